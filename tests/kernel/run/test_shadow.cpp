// SPDX-License-Identifier: LGPL-3.0-or-later
// A candidate in a component's shadow: the same inputs at the same instants, no effects, the differences of its outputs, on both
// kinds of hosts.
#include <cmath>
#include <limits>
#include <map>

#include "hosts.hpp"

namespace mauve::testing::test_shadow {

struct Text {
  std::string data;
};

}  // namespace mauve::testing::test_shadow

MAUVE_TYPE(mauve::testing::test_shadow::Text, "std_msgs/msg/String", data)

namespace mauve::testing::test_shadow {

using ::testing::HasSubstr;
using Verdict = ShadowVerdict;

constexpr time_ns_t kPeriod = ms_to_ns(1);
constexpr time_ns_t kBudget = ms_to_ns(500);  // more than a busy machine takes
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

/// What a core read in one release.
struct Run {
  time_ns_t instant_ns{0};
  double value{0.0};
  DataStatus status{DataStatus::none};
  time_ns_t time_ns{0};
  bool operator==(const Run&) const = default;
};

/// What a test knows of a core that may be gone.
struct Log {
  std::vector<Run> runs;
  std::atomic<int> count{0};
  std::atomic<int> configured{0};
  std::atomic<bool> is_cleaned{false};
};

/// Reads its input, and writes what the test says.
struct FollowingCore : TestCore {
  std::shared_ptr<Log> log = std::make_shared<Log>();
  std::function<void(FollowingCore&, double)> follow = [](FollowingCore& core, double value) {
    core.exposed_shell().output.write({value});
  };
  double before{0.0};

  FollowingCore() { log->runs.reserve(100'000); }
  void act() override {
    const Sample<Number> read = exposed_shell().input.read();
    log->runs.push_back({clock_ns(), read.value.value, read.status, read.time_ns});
    follow(*this, read.value.value);
    before = read.value.value;
    log->count.fetch_add(1);
    TestCore::act();
  }
  bool configure_hook() override { return log->configured.fetch_add(1) >= 0; }
  void cleanup_hook() override { log->is_cleaned = true; }
};

using Follow = std::function<void(FollowingCore&, double)>;

template <typename Way>
class Shadows : public OnBothHosts<Way> {
 protected:
  /// A component that writes a signal without a pattern, and one that follows it: it writes what it has read.
  Component& add_live(const TaskSettings& settings = {}, const Follow& follow = {}) {
    this->architecture.template add_resource<SharedData<Number>>("in");
    out = &this->architecture.template add_resource<SharedData<Number>>("out");
    Component& source = this->add("source");
    TestCore& writer = this->core(source);
    writer.work = [&writer] {
      const double step = writer.runs.load();
      writer.exposed_shell().output.write({std::sin(0.7 * step) + std::sin(2.3 * step)});
    };
    this->architecture.connect("source", "output", "in", "write");
    Component& component = this->add("c", 1, settings);
    component.replace_core(make_core("t/Live", follow, &live));
    this->architecture.connect("c", "input", "in", "read");
    this->architecture.connect("c", "output", "out", "write");
    return component;
  }
  static std::unique_ptr<FollowingCore> make_core(const std::string& name, const Follow& follow,
                                                  std::shared_ptr<Log>* log) {
    auto core = std::make_unique<FollowingCore>();
    core->set_implementation(name);
    if (follow) core->follow = follow;
    *log = core->log;
    return core;
  }
  /// The candidate follows as told; what it has seen is in `candidate`.
  FollowingCore* shadow(const Follow& follow = {}, time_ns_t budget_ns = kBudget) {
    auto core = make_core("t/Candidate", follow, &candidate);
    FollowingCore* const made = core.get();
    Transaction change;
    change.shadow("c", std::move(core), {.budget_ns = budget_ns}, std::make_unique<TestShell>());
    this->host.commit(std::move(change), 0);
    return made;
  }
  void commit(Transaction change) { this->host.commit(std::move(change), 0); }
  ShadowRecord record() {
    const auto all = (*this->host).shadows();
    return all.empty() ? ShadowRecord{} : all.back();
  }
  OutputDifference output(const std::string& port = "output") {
    for (const OutputDifference& each : record().outputs) {
      if (each.port == port) return each;
    }
    ADD_FAILURE() << "no output " << port;
    return {};
  }
  NumberDifference number() {
    const OutputDifference found = output();
    return found.numbers.empty() ? NumberDifference{} : found.numbers.front();
  }
  void wait_compared(std::int64_t releases) {
    this->host.until([&] { return record().compared >= releases; }, "the candidate to execute");
  }
  /// Until the candidate has caught up with the component, which is stopped.
  void stop_and_settle() {
    this->host.stop("c");
    this->host.until(
        [&] {
          const ShadowRecord now = record();
          return now.compared + now.skipped_late + now.skipped_budget + now.idle == now.releases;
        },
        "the candidate to catch up");
  }
  void wait_verdict(Verdict verdict) {
    this->host.until([&] { return record().verdict == verdict; }, to_string(verdict));
  }
  SharedData<Number>* out{nullptr};
  std::shared_ptr<Log> live;
  std::shared_ptr<Log> candidate;
};
TYPED_TEST_SUITE(Shadows, EveryHost, HostNames);

TYPED_TEST(Shadows, TheCandidateReadsWhatTheLiveCoreReadsAtTheSameInstants) {
  this->add_live();
  this->deploy();
  this->host.until([&] { return this->live->count >= 3; }, "the live core");
  this->shadow();
  this->wait_compared(30);
  this->stop_and_settle();
  std::map<time_ns_t, Run> by_instant;
  for (const Run& run : this->live->runs) by_instant.emplace(run.instant_ns, run);
  ASSERT_GE(this->candidate->runs.size(), 30U);
  for (const Run& run : this->candidate->runs) {
    ASSERT_TRUE(by_instant.contains(run.instant_ns));
    EXPECT_EQ(by_instant.at(run.instant_ns), run);
  }
  const ShadowRecord record = this->record();
  EXPECT_EQ(static_cast<std::int64_t>(this->candidate->runs.size()), record.compared);
  EXPECT_EQ("c", record.component);
  EXPECT_EQ("t/Candidate", record.core);
  EXPECT_EQ("t/Live", record.live_core);
  EXPECT_EQ(Verdict::running, record.verdict);
  EXPECT_EQ(0, record.over_budget);
  EXPECT_EQ(0, record.idle);
  if constexpr (TestFixture::is_virtual) {
    EXPECT_EQ(record.releases, record.compared);
    const auto& runs = this->live->runs;
    EXPECT_EQ(runs.back(), this->candidate->runs.back());
  }
}

TYPED_TEST(Shadows, AnEqualCandidateHasNoDifference) {
  this->add_live();
  this->deploy();
  this->shadow();
  this->wait_compared(40);
  this->stop_and_settle();
  const NumberDifference number = this->number();
  EXPECT_EQ("value", number.path.substr(0, 5));
  EXPECT_EQ(this->record().compared, number.count);
  EXPECT_EQ(number.count, this->output().both);
  EXPECT_EQ(0.0, number.maximum);
  EXPECT_EQ(0.0, number.rms);
  EXPECT_EQ(0, number.nan);
  EXPECT_EQ(0, this->output().live_only);
  EXPECT_EQ(0, this->output().shadow_only);
  EXPECT_EQ(0, this->output("held").both) << "no core writes it";
  if constexpr (TestFixture::is_virtual) {
    EXPECT_EQ(0, this->output().lag);
  }
}

TYPED_TEST(Shadows, NothingOfTheCandidateReachesAResource) {
  Component& component = this->add_live();
  this->deploy();
  this->shadow([](FollowingCore& core, double) {
    core.exposed_shell().output.write({99.0});
    core.exposed_shell().held.write({99.0});
  });
  this->host.until([&] { return this->record().compared >= 10; }, "the candidate");
  Number value{};
  time_ns_t time = 0;
  ReaderState seen;
  this->out->read.read(value, time, seen);
  EXPECT_NE(99.0, value.value);
  EXPECT_EQ("t/Live", component.core_implementation());
  this->stop_and_settle();
  for (const Run& run : this->live->runs) EXPECT_NE(99.0, run.value);
  EXPECT_EQ(this->record().compared, this->output("held").shadow_only);
}

TYPED_TEST(Shadows, TheDifferencesAreThoseOfTheNumbers) {
  this->add_live();
  this->deploy();
  this->shadow([](FollowingCore& core, double value) { core.exposed_shell().output.write({1.1 * value}); });
  this->wait_compared(40);
  this->stop_and_settle();
  double maximum = 0.0;
  double squares = 0.0;
  for (const Run& run : this->candidate->runs) {
    maximum = std::max(maximum, std::abs(0.1 * run.value));
    squares += 0.01 * run.value * run.value;
  }
  const NumberDifference number = this->number();
  EXPECT_NEAR(maximum, number.maximum, 1e-9);
  EXPECT_NEAR(std::sqrt(squares / static_cast<double>(this->candidate->runs.size())), number.rms, 1e-9);
  EXPECT_GT(number.maximum, 0.0);
}

TYPED_TEST(Shadows, NanIsCounted) {
  this->add_live();
  this->deploy();
  this->shadow([](FollowingCore& core, double value) {
    core.exposed_shell().output.write({core.runs % 4 == 3 ? kNan : value});
  });
  this->wait_compared(20);
  this->stop_and_settle();
  const NumberDifference number = this->number();
  EXPECT_EQ(this->record().compared / 4, number.nan);
  EXPECT_EQ(0, number.live_nan);
  EXPECT_EQ(this->record().compared, number.count + number.nan);
  EXPECT_EQ(0.0, number.maximum);
}

TYPED_TEST(Shadows, ACandidateThatLagsIsFound) {
  this->add_live();
  this->deploy();
  this->shadow([](FollowingCore& core, double) { core.exposed_shell().output.write({core.before}); });
  this->host.until([&] { return this->output().lag == 1; }, "the lag");
  EXPECT_GT(this->number().maximum, 0.0);
}

TYPED_TEST(Shadows, ACandidateOverItsBudgetCostsNobodyElse) {
  constexpr time_ns_t kTakes = us_to_ns(200);
  Component& component = this->add_live({.states = {{.name = "Run", .simulated_execution_ns = kTakes}}});
  Component& neighbour = this->add("n");
  this->deploy();
  this->shadow(
      [](FollowingCore&, double) {
        if constexpr (!TestFixture::is_virtual) {
          const time_ns_t until = monotonic_now_ns() + 5 * kPeriod;
          while (monotonic_now_ns() < until) {
          }
        }
      },
      us_to_ns(80));
  this->wait_compared(10);
  this->stop_and_settle();
  const ShadowRecord record = this->record();
  EXPECT_GT(record.over_budget, 0);
  EXPECT_GT(record.skipped_late + record.skipped_budget, 0);
  EXPECT_EQ(record.releases, record.compared + record.skipped_late + record.skipped_budget + record.idle);
  EXPECT_GE(record.largest_execution_ns, us_to_ns(80));
  EXPECT_EQ(record.compared, this->output().live_only) << "the candidate writes nothing";
  std::vector<time_ns_t> instants;
  for (const Run& run : this->live->runs) instants.push_back(run.instant_ns);
  expect_released_at_each_instant(instants, component, kPeriod);
  if constexpr (TestFixture::is_virtual) {
    EXPECT_EQ(kTakes, record.largest_execution_ns);
    EXPECT_EQ(record.compared, record.over_budget);
    EXPECT_EQ(0, record.skipped_late);
    EXPECT_LE(std::abs(2 * record.compared - record.skipped_budget), 2)
        << "2.5 budgets: two releases are skipped";
    EXPECT_EQ(0U, component.task().statistics().overruns.load());
    EXPECT_EQ(0U, neighbour.task().statistics().overruns.load());
  }
  this->host.stop("n");
  expect_released_at_each_instant(this->core(neighbour).instants, neighbour, kPeriod);
}

TYPED_TEST(Shadows, AFaultOfTheCandidateEndsTheShadow) {
  Component& component = this->add_live();
  this->deploy();
  this->shadow([](FollowingCore& core, double) {
    if (core.runs == 3) throw std::runtime_error("division by zero");
  });
  this->wait_verdict(Verdict::faulted);
  EXPECT_EQ("division by zero in state Run", this->record().reason);
  EXPECT_EQ(3, this->record().compared);
  EXPECT_GE(this->record().end_ns, this->record().begin_ns);
  const int before = this->live->count;
  this->host.until([&] { return this->live->count >= before + 5; }, "the live core");
  EXPECT_EQ(ComponentState::running, component.task().state());
  (*this->host).settle_probations();
  this->host.until([&] { return this->candidate->is_cleaned.load(); }, "the clean-up");
  this->shadow();
  this->wait_compared(3);
}

TYPED_TEST(Shadows, PromoteTakesTheWarmCandidate) {
  Component& component = this->add_live();
  this->deploy();
  FollowingCore* const core = this->shadow();
  this->wait_compared(10);
  {
    Transaction change;
    change.promote("c");
    this->commit(std::move(change));
  }
  EXPECT_EQ(core, &component.core());
  EXPECT_EQ("t/Candidate", component.core_implementation());
  const int before = this->candidate->count;
  EXPECT_GE(before, 10) << "with its state";
  const int live_before = this->live->count;
  this->host.until([&] { return this->candidate->count >= before + 5; }, "the promoted core");
  EXPECT_EQ(live_before, this->live->count);
  EXPECT_EQ(1, this->candidate->configured);
  EXPECT_FALSE(this->candidate->is_cleaned);
  wait_until([&] { return this->live->is_cleaned.load(); }, "the clean-up");
  EXPECT_EQ(Verdict::promoted, this->record().verdict);
  this->host.stop("c");
  const auto& runs = this->candidate->runs;
  for (std::size_t at = 1; at < runs.size(); ++at) EXPECT_GT(runs[at].instant_ns, runs[at - 1].instant_ns);
  Number value{};
  time_ns_t time = 0;
  ReaderState seen;
  this->host.start("c");
  this->host.until(
      [&] {
        this->out->read.read(value, time, seen);
        return value.value != 0.0;
      },
      "its output");
}

TYPED_TEST(Shadows, TheCandidateOfARefusedPromoteGoesOn) {
  this->add_live();
  this->deploy();
  this->shadow();
  this->wait_compared(5);
  Transaction change;
  change.promote("c").set_property("c", "unknown", 1.0);
  EXPECT_EQ(ErrorCode::unknown_property, this->code_of([&] { this->commit(std::move(change)); }));
  const std::int64_t before = this->record().compared;
  this->wait_compared(before + 5);
  EXPECT_EQ(Verdict::running, this->record().verdict);
  EXPECT_FALSE(this->candidate->is_cleaned);
  Transaction rehearsed;
  rehearsed.promote("c");
  (*this->host).commit(std::move(rehearsed), {.dry_run = true});
  this->wait_compared(before + 10);
}

TYPED_TEST(Shadows, APromoteStandsAlone) {
  this->add_live();
  this->deploy();
  this->shadow();
  this->wait_compared(3);
  const auto refused = [&](const std::function<void(Transaction&)>& fill) {
    Transaction change;
    change.promote("c");
    fill(change);
    return this->code_of([&] { this->commit(std::move(change)); });
  };
  EXPECT_EQ(ErrorCode::invalid_argument, refused([](Transaction& change) { change.promote("c"); }));
  EXPECT_EQ(ErrorCode::invalid_argument, refused([&](Transaction& change) {
              std::shared_ptr<Log> log;
              change.replace_core("c", this->make_core("t/Next", {}, &log));
            }));
  EXPECT_EQ(ErrorCode::invalid_argument, this->code_of([&] {
    Transaction change;
    change.promote("c");
    (*this->host).prepare(std::move(change));
  }));
  this->wait_compared(this->record().compared + 5);
  EXPECT_EQ(Verdict::running, this->record().verdict);
}

TYPED_TEST(Shadows, ARemovedComponentEndsItsShadow) {
  this->add_live();
  this->deploy();
  this->shadow();
  this->wait_compared(3);
  Transaction change;
  change.remove_component("c");
  this->commit(std::move(change));
  EXPECT_TRUE((*this->host).shadows().empty());
  this->host.until([&] { return this->candidate->is_cleaned.load(); }, "the clean-up");
}

TYPED_TEST(Shadows, OtherChangesEndTheShadow) {
  this->add_live();
  this->deploy();
  const auto expect_ended = [&](const std::string& reason) {
    EXPECT_EQ(Verdict::ended, this->record().verdict);
    EXPECT_THAT(this->record().reason, HasSubstr(reason));
    this->host.until([&] { return this->candidate->is_cleaned.load(); }, "the clean-up");
  };
  this->shadow();
  this->wait_compared(3);
  Transaction end;
  end.end_shadow("c");
  this->commit(std::move(end));
  expect_ended("end_shadow");
  this->shadow();
  this->wait_compared(3);
  Transaction wiring;
  wiring.disconnect("c", "output");
  this->commit(std::move(wiring));
  expect_ended("changed");
  this->shadow();
  this->wait_compared(3);
  Transaction parts;
  parts.replace_core("c", this->make_core("t/Next", {}, &this->live));
  this->commit(std::move(parts));
  expect_ended("changed");
  this->shadow();
  this->wait_compared(3);
  this->host.shutdown();
  expect_ended("shut down");
}

TYPED_TEST(Shadows, APropertyIsSetInTheCandidateToo) {
  const Follow scaled = [](FollowingCore& core, double value) {
    core.exposed_shell().output.write({core.exposed_shell().gain.value() * value});
  };
  Component& component = this->add_live({}, scaled);
  component.set_property("gain", 2.0);
  this->deploy();
  std::atomic<double> gain{0.0};
  this->shadow([&](FollowingCore& core, double value) {
    gain = core.exposed_shell().gain.value();
    core.exposed_shell().output.write({gain * value});
  });
  this->wait_compared(5);
  EXPECT_EQ(2.0, gain);
  EXPECT_EQ(0.0, this->number().maximum);
  component.set_property("gain", 3.0);
  this->host.until([&] { return gain == 3.0; }, "the property");
  EXPECT_EQ(Verdict::running, this->record().verdict);
  this->host.shutdown();
}

TYPED_TEST(Shadows, AStopPausesTheShadow) {
  this->add_live();
  this->deploy();
  this->shadow();
  this->wait_compared(5);
  this->stop_and_settle();
  const std::int64_t before = this->record().compared;
  EXPECT_EQ(Verdict::running, this->record().verdict);
  this->host.start("c");
  this->wait_compared(before + 5);
  this->stop_and_settle();
  EXPECT_EQ(0.0, this->number().maximum);
  EXPECT_EQ(0, this->record().idle);
}

TYPED_TEST(Shadows, WhatCannotBeShadowedIsRefused) {
  this->add_live();
  const auto asked = [&](const std::function<void(Transaction&)>& fill) {
    Transaction change;
    fill(change);
    this->commit(std::move(change));
  };
  const auto shadowed = [&](time_ns_t budget_ns, std::unique_ptr<Shell> shell) {
    asked([&](Transaction& change) {
      std::shared_ptr<Log> log;
      change.shadow("c", this->make_core("t/New", {}, &log), {.budget_ns = budget_ns}, std::move(shell));
    });
  };
  struct OtherShell : TestShell {};
  this->architecture.configure();
  (*this->host).deploy();
  EXPECT_EQ(ErrorCode::invalid_argument, this->code_of([&] { shadowed(0, std::make_unique<TestShell>()); }));
  EXPECT_EQ(ErrorCode::type_mismatch,
            this->code_of([&] { shadowed(kBudget, std::make_unique<OtherShell>()); }));
  this->architecture.component("c").shell().set_factory({});
  EXPECT_EQ(ErrorCode::prepare_failed, this->code_of([&] { shadowed(kBudget, nullptr); }));
  EXPECT_EQ(ErrorCode::not_running,
            this->code_of([&] { asked([](Transaction& change) { change.promote("c"); }); }));
  asked([](Transaction& change) { change.end_shadow("c"); });
  EXPECT_TRUE((*this->host).shadows().empty());
  this->shadow();
  EXPECT_EQ(ErrorCode::already_running,
            this->code_of([&] { shadowed(kBudget, std::make_unique<TestShell>()); }));
  EXPECT_EQ(Verdict::running, this->record().verdict);
}

struct TextShell : TestShell {
  ReadPort<Text>& text = read_port<Text>("text").optional();
};
struct TextFsm : Fsm<TextShell, CoreBase> {
  void define() override {
    State& pause = wait("Pause", kPeriod);
    set_initial(pause);
    next(pause, pause);
  }
};
struct IdleCore : Core<TextShell> {};

struct EventFsm : Fsm<TestShell, TestCore> {
  void define() override {
    State& run = execution("Run", "act", &TestCore::act);
    State& pause = wait_event("Pause", shell().input, s_to_ns(1), kPeriod);
    set_initial(run);
    next(run, pause);
    next(pause, run);
  }
};

class Bell final : public Resource {
 public:
  Bell() : Resource("test/Bell", "") { offer(ring_); }

 private:
  class Ring final : public CallService<void()> {
   public:
    Ring() : CallService("ring", "test/Ring") {}
    void call() override {}
  };
  Ring ring_;
};
struct BellShell : TestShell {
  CallPort<void()>& ring = call_port<void()>("ring", "test/Ring");
};

TYPED_TEST(Shadows, CallPortsAreRefused) {
  this->architecture.template add_resource<Bell>("bell");
  this->architecture.template add_component<BellShell, TestCore, TestFsm>("caller");
  this->architecture.connect("caller", "ring", "bell", "ring");
  this->deploy();
  std::string text;
  const ErrorCode code = this->code_of(
      [&] {
        Transaction change;
        change.shadow("caller", std::make_unique<TestCore>(), {.budget_ns = kBudget},
                      std::make_unique<BellShell>());
        this->commit(std::move(change));
      },
      &text);
  EXPECT_EQ(ErrorCode::type_mismatch, code);
  EXPECT_THAT(text, HasSubstr("a component with a call port has no shadow"));
}

TYPED_TEST(Shadows, TextsAndEventWaitsAreRefused) {
  this->architecture.template add_resource<SharedData<Number>>("in");
  this->architecture.template add_component<TextShell, IdleCore, TextFsm>("text");
  this->architecture.template add_component<TestShell, TestCore, EventFsm>("event");
  this->architecture.connect("event", "input", "in", "read");
  this->deploy();
  std::string text;
  const auto shadowed = [&](const char* name, std::unique_ptr<CoreBase> core, std::unique_ptr<Shell> shell) {
    Transaction change;
    change.shadow(name, std::move(core), {.budget_ns = kBudget}, std::move(shell));
    this->commit(std::move(change));
  };
  EXPECT_EQ(
      ErrorCode::type_mismatch,
      this->code_of([&] { shadowed("text", std::make_unique<IdleCore>(), std::make_unique<TextShell>()); },
                    &text));
  EXPECT_THAT(text, HasSubstr("port text"));
  EXPECT_EQ(
      ErrorCode::prepare_failed,
      this->code_of([&] { shadowed("event", std::make_unique<TestCore>(), std::make_unique<TestShell>()); },
                    &text));
  EXPECT_THAT(text, HasSubstr("waits for events"));
  EXPECT_TRUE((*this->host).shadows().empty());
}

/// Writes which of its two states ran.
struct PlaceCore : TestCore {
  void first() { exposed_shell().output.write({1.0}); }
  void second() { exposed_shell().output.write({2.0}); }
};
struct PlaceFsm : Fsm<TestShell, PlaceCore> {
  void define() override {
    State& one = execution("One", "first", &PlaceCore::first);
    State& between = wait("Between", kPeriod);
    State& two = execution("Two", "second", &PlaceCore::second);
    State& pause = wait("Pause", 2 * kPeriod);
    set_initial(one);
    next(one, between);
    next(between, two);
    next(two, pause);
    next(pause, one);
  }
};

TYPED_TEST(Shadows, TheCandidateBeginsInTheLiveCoresPlace) {
  Component& component = this->architecture.template add_component<TestShell, PlaceCore, PlaceFsm>("c");
  this->deploy();
  for (int round = 0; round < 6; ++round) {
    const auto releases = component.task().statistics().releases.load();
    this->host.until([&] { return component.task().statistics().releases.load() > releases; }, "a release");
    Transaction change;
    change.shadow("c", std::make_unique<PlaceCore>(), {.budget_ns = kBudget}, std::make_unique<TestShell>());
    this->commit(std::move(change));
    this->wait_compared(6);
    EXPECT_EQ(0.0, this->number().maximum);
    EXPECT_EQ(0, this->output().live_only);
    Transaction end;
    end.end_shadow("c");
    this->commit(std::move(end));
  }
}

class ShadowThreads : public Shadows<OnThreads> {};

TEST_F(ShadowThreads, TheLiveThreadAllocatesNothing) {
  Component& component = add_live();
  deploy();
  host.stop("c");
  shadow();
  host.start("c");  // counts from here on
  wait_compared(30);
  EXPECT_EQ(0U, component.task().counters().allocations());
  Transaction change;
  change.promote("c");
  commit(std::move(change));
  const int before = candidate->count;
  host.until([&] { return candidate->count >= before + 3; }, "the promoted core");
  EXPECT_EQ(0U, component.task().counters().allocations());
}

TEST_F(ShadowThreads, NobodyIsKeptWaitingByACandidateThatHangs) {
  std::atomic<bool> is_over{false};
  add("other");
  Component& component = add_live();
  deploy();
  const auto compared = [&] {
    for (const ShadowRecord& each : (*host).shadows()) {
      if (each.component == "other") return each.compared;
    }
    return std::int64_t{0};
  };
  commit(std::move(Transaction().shadow("other", std::make_unique<TestCore>(), {.budget_ns = s_to_ns(1)},
                                        std::make_unique<TestShell>())));
  shadow([&](FollowingCore&, double) {
    while (!is_over) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  });
  host.until([&] { return record().skipped_late >= 20; }, "releases without the candidate");
  EXPECT_EQ(0, record().compared);
  EXPECT_EQ(ComponentState::running, component.task().state());
  Transaction change;
  change.promote("c");
  EXPECT_EQ(ErrorCode::timeout, code_of([&] { commit(std::move(change)); }));
  EXPECT_EQ(ComponentState::running, component.task().state());
  const std::int64_t before = compared();
  host.until([&] { return compared() > before + 3; }, "the candidate of another component");
  const auto is_told = [&] {
    (*host).settle_probations();
    return record().verdict == Verdict::hung;
  };
  host.until(is_told, "the verdict");
  EXPECT_EQ("hung: state Run of the candidate did not end", record().reason);
  is_over = true;
  host.until([&] { return candidate->is_cleaned.load(); }, "the clean-up");
}

}  // namespace mauve::testing::test_shadow
