// SPDX-License-Identifier: LGPL-3.0-or-later
// After a bumpless change the outputs go over linearly from the old core to the new one, on both kinds of hosts.
#include <cmath>
#include <map>
#include <numbers>

#include "hosts.hpp"

namespace mauve::testing::test_blend {

struct Mixed {
  double number{};
  float small{};
  std::int64_t whole{};
  bool on{};
  std::array<double, 2> list{};
  Quaternion turn{};
};

}  // namespace mauve::testing::test_blend

MAUVE_TYPE(mauve::testing::test_blend::Mixed, "test_msgs/msg/Blended", number, small, whole, on, list, turn)

namespace mauve::testing::test_blend {

using ::testing::HasSubstr;
using Verdict = ShadowVerdict;

/// Keeps all that is written to it.
template <typename T>
class Recorder : public Resource {
 public:
  Recorder() : Resource("recorder", "") {
    all_.reserve(100'000);
    offer(write_);
  }
  std::vector<std::pair<time_ns_t, T>> all() {
    const std::lock_guard lock(mutex_);
    return all_;
  }
  /// Those of releases at the instant or later.
  std::vector<std::pair<time_ns_t, T>> from(time_ns_t instant_ns) {
    auto found = all();
    std::erase_if(found, [&](const auto& each) { return each.first < instant_ns; });
    return found;
  }

 private:
  struct Write final : WriteService<T> {
    explicit Write(Recorder& its_owner) : WriteService<T>("write"), owner(its_owner) {}
    bool write(const T& value, time_ns_t time_ns) noexcept override {
      const std::lock_guard lock(owner.mutex_);
      if (owner.all_.size() < owner.all_.capacity()) owner.all_.emplace_back(time_ns, value);
      return true;
    }
    Recorder& owner;
  };

  PiMutex mutex_;
  std::vector<std::pair<time_ns_t, T>> all_;
  Write write_{*this};
};

/// Does what the test says with its shell.
struct FreeCore : TestCore {
  std::function<void(FreeCore&)> law;
  std::shared_ptr<std::atomic<bool>> is_cleaned = std::make_shared<std::atomic<bool>>(false);

  explicit FreeCore(std::function<void(FreeCore&)> its_law) : law(std::move(its_law)) {}
  void act() override {
    law(*this);
    TestCore::act();
  }
  time_ns_t now_ns() const { return clock_ns(); }
  void cleanup_hook() override { *is_cleaned = true; }
};

using Law = std::function<void(FreeCore&)>;

Law constant(double value) {
  return [value](FreeCore& core) { core.exposed_shell().output.write({value}); };
}

/// A computer that stalls for longer than a period ends a blend on threads.
template <typename Way>
constexpr std::int64_t kPeriodMs = std::is_same_v<Way, InVirtualTime> ? 1 : 5;
constexpr time_ns_t kBlend = ms_to_ns(60);

template <typename Way>
class Blending : public OnBothHosts<Way> {
 protected:
  Component& deploy_old(const Law& law, const TaskSettings& settings = {}) {
    out = &this->architecture.template add_resource<Recorder<Number>>("out");
    held = &this->architecture.template add_resource<Recorder<Number>>("held");
    Component& component = this->add("c", kPeriodMs<Way>, settings);
    auto core = std::make_unique<FreeCore>(law);
    is_old_cleaned = core->is_cleaned;
    component.replace_core(std::move(core));
    this->architecture.connect("c", "output", "out", "write");
    this->architecture.connect("c", "held", "held", "write");
    this->deploy();
    this->host.until([&] { return out->all().size() >= 3; }, "the old core");
    return component;
  }
  static BumplessOptions options(time_ns_t blend_ns = kBlend) {
    return {.outputs = {{.port = "output", .field = "value", .step = 100.0}},
            .within_ns = s_to_ns(100),
            .blend_ns = blend_ns};
  }
  /// Returns T.
  time_ns_t replace(const Law& law, const BumplessOptions& with = options()) {
    Transaction change;
    change.replace_core("c", std::make_unique<FreeCore>(law), ReplaceOptions{.bumpless = with});
    return this->host.commit(std::move(change)).instant_ns;
  }
  ShadowRecord record() {
    const auto all = (*this->host).shadows();
    return all.empty() ? ShadowRecord{} : all.back();
  }
  /// Whether the component was late by itself.
  bool is_late() { return !this->is_virtual && record().reason.ends_with("an overrun of the component"); }
  void wait_end() {
    this->host.until([&] { return record().verdict != Verdict::running; }, "the end of the blend");
  }
  void wait_old_cleaned() {
    const auto is_cleaned = [&] {
      (*this->host).settle_probations();  // as an executor does from time to time
      return is_old_cleaned->load();
    };
    this->host.until(is_cleaned, "the clean-up of the old core");
  }
  void wait_written(time_ns_t instant_ns) {
    this->host.until([&] { return out->all().back().first >= instant_ns; }, "outputs");
  }
  static double weight(time_ns_t at_ns, time_ns_t instant_ns, time_ns_t blend_ns = kBlend) {
    return std::clamp(static_cast<double>(at_ns - instant_ns) / static_cast<double>(blend_ns), 0.0, 1.0);
  }

  int late_runs{0};
  Recorder<Number>* out{nullptr};
  Recorder<Number>* held{nullptr};
  std::shared_ptr<std::atomic<bool>> is_old_cleaned;
};
TYPED_TEST_SUITE(Blending, EveryHost, HostNames);

/// A computer that stalls for longer than a period has ended the blend: the case begins once more.
#define AGAIN_IF_LATE()                                                                        \
  if (this->is_late()) {                                                                       \
    if (++this->late_runs == 5) GTEST_SKIP() << "a busy computer has ended the blend 5 times"; \
    this->begin_again();                                                                       \
    return this->TestBody();                                                                   \
  }

TYPED_TEST(Blending, OutputsGoOverLinearly) {
  Component& component = this->deploy_old(constant(0.0));
  const time_ns_t instant_ns = this->replace(constant(10.0));
  this->wait_written(instant_ns + kBlend + ms_to_ns(20));
  AGAIN_IF_LATE()
  this->wait_old_cleaned();
  this->host.stop("c");
  auto all = this->out->all();
  all.pop_back();  // the zero of the stop
  double last = 0.0;
  std::size_t between = 0;
  for (const auto& [at_ns, value] : all) {
    EXPECT_NEAR(10.0 * this->weight(at_ns, instant_ns), value.value, 1e-12) << at_ns - instant_ns;
    EXPECT_GE(value.value, last);
    last = value.value;
    between += value.value > 0.0 && value.value < 10.0 ? 1 : 0;
  }
  EXPECT_EQ(10.0, last);
  EXPECT_GT(between, this->is_virtual ? 50U : 0U);
  std::vector<time_ns_t> instants;
  for (const auto& [at_ns, value] : all) instants.push_back(at_ns);
  expect_released_at_each_instant(instants, component, ms_to_ns(kPeriodMs<TypeParam>));
  EXPECT_EQ(Verdict::promoted, this->record().verdict);
  EXPECT_EQ("the candidate is the component's core now", this->record().reason);
  const auto first = this->out->from(instant_ns).front();
  EXPECT_NEAR(first.second.value, this->record().steps.front().step, 1e-12)
      << "the step is that of the blend";
}

struct MixedShell : Shell {
  WritePort<Mixed>& mixed = write_port<Mixed>("mixed");
};
struct MixedCore : Core<MixedShell> {
  Mixed value{};
  explicit MixedCore(const Mixed& its_value = {}) : value(its_value) {}
  void act() { shell().mixed.write(value); }
};
struct MixedFsm : Fsm<MixedShell, MixedCore> {
  void define() override {
    State& run = execution("Run", "act", &MixedCore::act);
    State& pause = wait("Pause", ms_to_ns(5));
    set_initial(run);
    next(run, pause);
    next(pause, run);
  }
};

TYPED_TEST(Blending, QuaternionsTurnAndAllElseSwitches) {
  auto& mixed = this->architecture.template add_resource<Recorder<Mixed>>("mixed");
  this->architecture.template add_component<MixedShell, MixedCore, MixedFsm>("c");
  this->architecture.connect("c", "mixed", "mixed", "write");
  this->deploy();
  this->host.until([&] { return mixed.all().size() >= 3; }, "the old core");
  const double angle = std::numbers::pi / 2.0;
  // The other quaternion of a rotation by that angle: the shorter arc counts.
  const Quaternion turn{.z = -std::sin(angle / 2.0), .w = -std::cos(angle / 2.0)};
  const Mixed fresh{
      .number = 4.0, .small = 2.0F, .whole = 7, .on = true, .list = {1.0, std::nan("")}, .turn = turn};
  Transaction change;
  change.replace_core("c", std::make_unique<MixedCore>(fresh),
                      ReplaceOptions{.bumpless = BumplessOptions{.outputs = {{"mixed", "number", 100.0}},
                                                                 .within_ns = s_to_ns(100),
                                                                 .blend_ns = kBlend}});
  const time_ns_t instant_ns = this->host.commit(std::move(change)).instant_ns;
  this->host.until([&] { return mixed.all().back().first >= instant_ns + kBlend; }, "the end of the blend");
  AGAIN_IF_LATE()
  this->host.stop("c");
  const auto all = mixed.from(instant_ns);
  for (const auto& [at_ns, value] : all) {
    if (&value == &all.back().second) break;  // of the stop
    const double weight = this->weight(at_ns, instant_ns);
    EXPECT_NEAR(4.0 * weight, value.number, 1e-12);
    EXPECT_NEAR(2.0 * weight, value.small, 1e-6);
    EXPECT_EQ(7, value.whole);
    EXPECT_TRUE(value.on);
    EXPECT_NEAR(weight, value.list[0], 1e-12);
    EXPECT_TRUE(std::isnan(value.list[1])) << "no number is between";
    if (weight == 1.0) continue;
    EXPECT_NEAR(std::sin(weight * angle / 2.0), value.turn.z, 1e-12);
    EXPECT_NEAR(std::cos(weight * angle / 2.0), value.turn.w, 1e-12);
    EXPECT_EQ(0.0, value.turn.x);
  }
}

TYPED_TEST(Blending, AStopEndsTheBlend) {
  Component& component = this->deploy_old(constant(1.0));
  const time_ns_t instant_ns = this->replace(constant(10.0), this->options(s_to_ns(50)));
  this->wait_written(instant_ns + ms_to_ns(20));
  AGAIN_IF_LATE()
  this->host.stop("c");
  EXPECT_EQ(ComponentState::stopped, component.task().state());
  EXPECT_EQ(0.0, this->out->all().back().second.value) << "as on_stop says";
  EXPECT_EQ(Verdict::promoted, this->record().verdict);
  EXPECT_THAT(this->record().reason, HasSubstr("ended early: a stop of the component"));
  const time_ns_t stopped_ns = this->out->all().back().first;
  this->host.start("c");
  this->host.until([&] { return this->out->from(stopped_ns + 1).size() >= 3; }, "the new core");
  EXPECT_EQ(10.0, this->out->from(stopped_ns + 1).front().second.value);
  this->wait_old_cleaned();
}

TYPED_TEST(Blending, AnotherChangeEndsTheBlend) {
  this->deploy_old(constant(1.0));
  const time_ns_t first_ns = this->replace(constant(10.0), this->options(s_to_ns(50)));
  this->wait_written(first_ns + ms_to_ns(20));
  AGAIN_IF_LATE()
  Transaction change;
  change.replace_core("c", std::make_unique<FreeCore>(constant(20.0)));
  const time_ns_t second_ns = this->host.commit(std::move(change)).instant_ns;
  this->wait_written(second_ns + ms_to_ns(20));
  for (const auto& [at_ns, value] : this->out->from(second_ns)) EXPECT_EQ(20.0, value.value);
  EXPECT_THAT(this->record().reason, HasSubstr("ended early: the component's parts or wiring were changed"));
  this->wait_old_cleaned();
}

TYPED_TEST(Blending, AStepEndsTheBlend) {
  this->deploy_old(constant(1.0));
  const time_ns_t first_ns = this->replace(constant(10.0), this->options(s_to_ns(50)));
  this->wait_written(first_ns + ms_to_ns(20));
  Transaction end;
  end.end_shadow("c");
  const time_ns_t second_ns = this->host.commit(std::move(end)).instant_ns;
  this->wait_written(second_ns + ms_to_ns(20));
  for (const auto& [at_ns, value] : this->out->from(second_ns)) EXPECT_EQ(10.0, value.value);
}

TYPED_TEST(Blending, AFaultOfTheOldCoreEndsTheBlend) {
  const auto is_to_fail = std::make_shared<std::atomic<bool>>(false);
  Component& component = this->deploy_old([is_to_fail](FreeCore& core) {
    if (*is_to_fail) throw std::runtime_error("old and tired");
    core.exposed_shell().output.write({1.0});
  });
  const time_ns_t instant_ns = this->replace(constant(10.0), this->options(s_to_ns(50)));
  this->wait_written(instant_ns + ms_to_ns(20));
  AGAIN_IF_LATE()
  EXPECT_LT(this->out->all().back().second.value, 2.0);
  *is_to_fail = true;
  this->wait_end();
  const time_ns_t end_ns = this->out->all().back().first;
  this->wait_written(end_ns + ms_to_ns(20));
  for (const auto& [at_ns, value] : this->out->from(end_ns + 1)) EXPECT_EQ(10.0, value.value);
  EXPECT_EQ(ComponentState::running, component.task().state());
  EXPECT_THAT(this->record().reason, HasSubstr("fault of the old core: old and tired in state Run"));
}

TYPED_TEST(Blending, AFaultOfTheNewCorePutsTheOldOneBack) {
  const auto is_to_fail = std::make_shared<std::atomic<bool>>(false);
  const auto old_runs = std::make_shared<std::atomic<int>>(0);
  Component& component = this->deploy_old([old_runs](FreeCore& core) {
    core.exposed_shell().output.write({1.0 + 1e-9 * ++*old_runs});  // its own state goes on
  });
  const CoreBase* const old = &component.core();
  const time_ns_t instant_ns = this->replace(
      [is_to_fail](FreeCore& core) {
        core.exposed_shell().output.write({10.0});
        if (*is_to_fail) throw std::runtime_error("too young");
      },
      this->options(s_to_ns(50)));
  this->wait_written(instant_ns + ms_to_ns(20));
  AGAIN_IF_LATE()
  const std::uint64_t revision = this->architecture.revision();
  *is_to_fail = true;
  this->host.until([&] { return &component.core() == old; }, "the old core");
  this->wait_written((*this->host).now_ns() + ms_to_ns(20));
  double last = 0.0;
  for (const auto& [at_ns, value] : this->out->all()) {
    EXPECT_LT(value.value, 2.0) << "what the new core wrote in the release of the fault is dropped";
    EXPECT_NE(0.0, value.value) << "no safe outputs";
    last = value.value;
  }
  EXPECT_LT(last, 1.001) << "the old core alone";
  EXPECT_EQ(ComponentState::running, component.task().state());
  EXPECT_FALSE(this->is_old_cleaned->load());
  (*this->host).settle_probations();
  EXPECT_GT(this->architecture.revision(), revision);
  const auto probations = (*this->host).probations();
  ASSERT_EQ(1U, probations.size());
  EXPECT_EQ(ProbationVerdict::reverted, probations.back().verdict);
  EXPECT_EQ("fault: too young in state Run", probations.back().reason);
  EXPECT_EQ(Verdict::ended, this->record().verdict);
  EXPECT_EQ("the old core is the component's core again", this->record().reason);
  // And it is a core as any other one: the next blend begins with it.
  const time_ns_t second_ns = this->replace(constant(5.0));
  this->wait_written(second_ns + kBlend + ms_to_ns(20));
  EXPECT_EQ(5.0, this->out->all().back().second.value);
}

TYPED_TEST(Blending, ARequestPutsTheOldCoreBack) {
  Component& component = this->deploy_old(constant(1.0));
  const CoreBase* const old = &component.core();
  const time_ns_t instant_ns = this->replace(constant(10.0), this->options(s_to_ns(50)));
  this->wait_written(instant_ns + ms_to_ns(20));
  AGAIN_IF_LATE()
  EXPECT_TRUE((*this->host).revert_probation("c", "an operator", s_to_ns(10)));
  this->host.until([&] { return &component.core() == old; }, "the old core");
  const time_ns_t back_ns = (*this->host).now_ns();
  this->wait_written(back_ns + ms_to_ns(20));
  for (const auto& [at_ns, value] : this->out->from(back_ns + 1)) EXPECT_EQ(1.0, value.value);
  EXPECT_EQ("an operator", (*this->host).probations().back().reason);
}

TYPED_TEST(Blending, TheProbationEndsWithTheBlend) {
  const auto is_to_fail = std::make_shared<std::atomic<bool>>(false);
  Component& component = this->deploy_old(constant(1.0));
  const time_ns_t instant_ns = this->replace([is_to_fail](FreeCore& core) {
    core.exposed_shell().output.write({10.0});
    if (*is_to_fail) throw std::runtime_error("grown up");
  });
  this->wait_written(instant_ns + kBlend + ms_to_ns(20));
  this->wait_end();
  EXPECT_NE(ProbationVerdict::running, (*this->host).probations().back().verdict);
  if constexpr (TestFixture::is_virtual) {
    EXPECT_EQ(ProbationVerdict::passed, (*this->host).probations().back().verdict);
  }
  *is_to_fail = true;
  this->wait_state(component, ComponentState::faulted);
  EXPECT_EQ(0.0, this->out->all().back().second.value);
}

TYPED_TEST(Blending, APropertyIsSetInBothCores) {
  const auto gain = [](FreeCore& core) {
    core.exposed_shell().output.write({core.exposed_shell().gain.value()});
  };
  this->deploy_old(gain);
  const time_ns_t instant_ns = this->replace(gain, this->options(s_to_ns(50)));
  this->wait_written(instant_ns + ms_to_ns(20));
  AGAIN_IF_LATE()
  Transaction change;
  change.set_property("c", "gain", 8.0);
  this->host.commit(std::move(change));
  this->host.until([&] { return this->is_late() || this->out->all().back().second.value == 8.0; },
                   "the same output of both");
  AGAIN_IF_LATE()
  EXPECT_EQ(Verdict::running, this->record().verdict);
}

TYPED_TEST(Blending, AnOverrunEndsTheBlend) {
  // Each core alone fits in the period, both together do not.
  TaskSettings settings;
  settings.states = {DeclaredState{.name = "Run", .simulated_execution_ns = us_to_ns(600)}};
  const auto is_slow = std::make_shared<std::atomic<bool>>(false);
  Component& component = this->deploy_old(
      [is_slow](FreeCore& core) {
        core.exposed_shell().output.write({1.0});
        const time_ns_t until_ns = monotonic_now_ns() + ms_to_ns(12);
        while (*is_slow && !TestFixture::is_virtual && monotonic_now_ns() < until_ns) {
        }
      },
      settings);
  BumplessOptions options = this->options(s_to_ns(50));
  options.budget_ns = s_to_ns(1);
  const time_ns_t instant_ns = this->replace(constant(10.0), options);
  *is_slow = true;
  this->wait_end();
  const time_ns_t end_ns = this->out->all().back().first;
  this->wait_written(end_ns + ms_to_ns(20));
  for (const auto& [at_ns, value] : this->out->from(end_ns)) EXPECT_EQ(10.0, value.value);
  EXPECT_THAT(this->record().reason, HasSubstr("ended early: an overrun of the component"));
  EXPECT_GE(component.task().statistics().overruns.load(), 1U);
  if constexpr (TestFixture::is_virtual) {
    EXPECT_EQ(1U, component.task().statistics().overruns.load());
    EXPECT_EQ(10.0, this->out->from(instant_ns).front().second.value) << "in the very release";
  }
}

TYPED_TEST(Blending, TheOldCoreExecutesOnTheInputsOfTheSameRelease) {
  this->architecture.template add_resource<SharedData<Number>>("in");
  Component& source = this->add("source");
  source.replace_core(std::make_unique<FreeCore>([](FreeCore& core) {
    core.exposed_shell().output.write({std::sin(1e-7 * static_cast<double>(core.now_ns()))});
  }));
  const auto follow = [](double more, std::map<time_ns_t, double>* read) {
    return [more, read](FreeCore& core) {
      const double input = core.exposed_shell().input.read().value.value;
      if (read != nullptr) read->insert_or_assign(core.now_ns(), input);
      core.exposed_shell().output.write({input + more});
    };
  };
  this->architecture.connect("source", "output", "in", "write");
  std::map<time_ns_t, double> read;
  this->out = &this->architecture.template add_resource<Recorder<Number>>("out");
  Component& component = this->add("c", kPeriodMs<TypeParam>);
  component.replace_core(std::make_unique<FreeCore>(follow(0.0, nullptr)));
  this->architecture.connect("c", "input", "in", "read");
  this->architecture.connect("c", "output", "out", "write");
  this->deploy();
  this->host.until([&] { return this->out->all().size() >= 3; }, "the old core");
  const time_ns_t instant_ns = this->replace(follow(10.0, &read));
  this->wait_written(instant_ns + kBlend + ms_to_ns(20));
  AGAIN_IF_LATE()
  this->host.stop("c");
  auto outputs = this->out->from(instant_ns);
  outputs.pop_back();
  for (const auto& [at_ns, value] : outputs)
    EXPECT_NEAR(read.at(at_ns) + 10.0 * this->weight(at_ns, instant_ns), value.value, 1e-12);
}

TYPED_TEST(Blending, AnOutputThatOneCoreWritesIsTheNewCores) {
  this->deploy_old([](FreeCore& core) {
    core.exposed_shell().output.write({1.0});
    core.exposed_shell().held.write({1.0});
  });
  const time_ns_t first_ns = this->replace(constant(1.0));
  this->wait_written(first_ns + kBlend + ms_to_ns(20));
  this->wait_end();
  EXPECT_TRUE(this->held->from(first_ns).empty()) << "which the new core does not write";
  (*this->host).settle_probations();
  const time_ns_t second_ns = this->replace([](FreeCore& core) {
    core.exposed_shell().output.write({1.0});
    core.exposed_shell().held.write({5.0});
  });
  this->wait_written(second_ns + ms_to_ns(20));
  AGAIN_IF_LATE()
  const auto written = this->held->from(second_ns);
  ASSERT_FALSE(written.empty());
  EXPECT_EQ(5.0, written.front().second.value) << "which the old core does not write";
}

TYPED_TEST(Blending, MaxSlewLimitsTheBlend) {
  this->deploy_old(constant(0.0), {.max_slew = {{"output.value", 50.0}}});
  const time_ns_t instant_ns = this->replace(constant(10.0));  // 167 per second
  this->wait_written(instant_ns + ms_to_ns(300));
  AGAIN_IF_LATE()
  double last = 0.0;
  time_ns_t last_ns = this->out->all().front().first;
  for (const auto& [at_ns, value] : this->out->all()) {
    EXPECT_LE(value.value - last, 50.0 * 1e-9 * static_cast<double>(at_ns - last_ns) + 1e-9);
    last = value.value;
    last_ns = at_ns;
  }
  EXPECT_EQ(10.0, last);
}

TYPED_TEST(Blending, APromotedCandidateBlends) {
  this->deploy_old(constant(0.0));
  Transaction begin;
  begin.shadow("c", std::make_unique<FreeCore>(constant(10.0)), {.budget_ns = s_to_ns(1)});
  this->host.commit(std::move(begin));
  Transaction promote;
  promote.promote("c", {.bumpless = this->options()});
  const time_ns_t instant_ns = this->host.commit(std::move(promote)).instant_ns;
  this->wait_written(instant_ns + kBlend + ms_to_ns(20));
  AGAIN_IF_LATE()
  for (const auto& [at_ns, value] : this->out->all())
    EXPECT_NEAR(10.0 * this->weight(at_ns, instant_ns), value.value, 1e-12);
}

TYPED_TEST(Blending, WhatCannotGoOverIsRefused) {
  this->deploy_old(constant(0.0));
  const auto refused = [&](const ReplaceOptions& with, const char* text) {
    std::string found;
    EXPECT_EQ(ErrorCode::invalid_argument, this->code_of(
                                               [&] {
                                                 Transaction change;
                                                 change.replace_core(
                                                     "c", std::make_unique<FreeCore>(constant(10.0)), with);
                                                 this->host.commit(std::move(change));
                                               },
                                               &found));
    EXPECT_THAT(found, HasSubstr(text));
  };
  refused({.bumpless = this->options(-1)}, "blend_s");
  refused({.bumpless = this->options(s_to_ns(60) + 1)}, "0 to 60 s");
  refused({.bumpless = BumplessOptions{.blend_ns = kBlend}}, "needs the outputs that it bounds");
  refused({.probation = ProbationOptions{.duration_ns = s_to_ns(1)}, .bumpless = this->options()},
          "one of blend_s and probation_s");
}

TYPED_TEST(Blending, AFallbackCoreDoesNotGoOver) {
  const auto is_to_fail = std::make_shared<std::atomic<bool>>(false);
  this->out = &this->architecture.template add_resource<Recorder<Number>>("out");
  Component& component = this->add("c", kPeriodMs<TypeParam>);
  component.replace_core(std::make_unique<FreeCore>([is_to_fail](FreeCore& core) {
    if (*is_to_fail) throw std::runtime_error("a fault");
    core.exposed_shell().output.write({1.0});
  }));
  component.set_fallback(std::make_unique<FreeCore>(constant(2.0)));
  this->architecture.connect("c", "output", "out", "write");
  this->deploy();
  *is_to_fail = true;
  this->host.until([&] { return !this->out->all().empty() && this->out->all().back().second.value == 2.0; },
                   "the fallback");
  std::string text;
  EXPECT_EQ(ErrorCode::invalid_argument, this->code_of([&] { this->replace(constant(3.0)); }, &text));
  EXPECT_THAT(text, HasSubstr("leave out blend_s"));
  this->replace(constant(3.0), this->options(0));
  this->wait_written((*this->host).now_ns());
  EXPECT_EQ(3.0, this->out->all().back().second.value);
}

class BlendThreads : public Blending<OnThreads> {};

struct BoundedFsm : TestFsm {
  void define() override {
    State& run = execution("Run", "act", &TestCore::act, ms_to_ns(50));
    State& pause = wait("Pause", ms_to_ns(5));
    set_initial(run);
    next(run, pause);
    next(pause, run);
  }
};

TEST_F(BlendThreads, TheWatchdogFindsANewCoreThatHangs) {
  const auto hangs = std::make_shared<std::atomic<bool>>(false);
  out = &architecture.add_resource<Recorder<Number>>("out");
  Component& component = architecture.add_component<TestShell, TestCore, BoundedFsm>("c");
  component.replace_core(std::make_unique<FreeCore>(constant(1.0)));
  const CoreBase* const old = &component.core();
  architecture.connect("c", "output", "out", "write");
  deploy();
  host.until([&] { return out->all().size() >= 3; }, "the old core");
  const time_ns_t instant_ns = replace(
      [hangs](FreeCore& core) {
        core.exposed_shell().output.write({10.0});
        while (*hangs) std::this_thread::yield();
      },
      options(s_to_ns(50)));
  wait_written(instant_ns + ms_to_ns(20));
  AGAIN_IF_LATE()
  *hangs = true;
  wait_state(component, ComponentState::faulted);
  EXPECT_NE(old, &component.core()) << "the state has not ended";
  host.until([&] { return out->all().back().second.value == 0.0; }, "safe outputs while it lasts");
  *hangs = false;
  wait_state(component, ComponentState::running);
  EXPECT_EQ(old, &component.core());
  const time_ns_t back_ns = (*host).now_ns();
  wait_written(back_ns + ms_to_ns(20));
  for (const auto& [at_ns, value] : out->from(back_ns)) EXPECT_EQ(1.0, value.value);
  EXPECT_EQ(ProbationVerdict::reverted, (*host).probations().back().verdict);
  EXPECT_THAT((*host).probations().back().reason, HasSubstr("Run ran longer than its 50000 us"));
}

/// The state of the new core has ended: no bound is watched, and the component is late.
TEST_F(BlendThreads, AnOldCoreThatHangsEndsTheBlendWhenItReturns) {
  const auto hangs = std::make_shared<std::atomic<bool>>(false);
  const auto is_hanging = std::make_shared<std::atomic<bool>>(false);
  Component& component = deploy_old(
      [hangs, is_hanging](FreeCore& core) {
        core.exposed_shell().output.write({1.0});
        *is_hanging = hangs->load();
        while (*hangs) std::this_thread::yield();
      },
      {.hung_after_ns = ms_to_ns(30)});
  const time_ns_t instant_ns = replace(constant(10.0), options(s_to_ns(50)));
  wait_written(instant_ns + ms_to_ns(20));
  AGAIN_IF_LATE()
  *hangs = true;
  host.until([&] { return is_hanging->load(); }, "the old core to hang");
  host.until([&] { return component.task().state_age().is_hung(); }, "the component to be told as hung");
  (*host).settle_probations();
  EXPECT_EQ(ComponentState::running, component.task().state());
  *hangs = false;
  wait_end();
  EXPECT_THAT(record().reason, HasSubstr("ended early: an overrun of the component"));
  wait_written((*host).now_ns());
  EXPECT_EQ(10.0, out->all().back().second.value);
  wait_old_cleaned();
}

TEST_F(BlendThreads, TheComponentsThreadAllocatesNothing) {
  Component& component = deploy_old(constant(0.0));
  const time_ns_t instant_ns = replace(constant(10.0));
  wait_written(instant_ns + kBlend + ms_to_ns(20));
  wait_end();
  EXPECT_EQ(0U, component.task().counters().allocations());
}

}  // namespace mauve::testing::test_blend
