// SPDX-License-Identifier: LGPL-3.0-or-later
// A core that goes in only where its outputs are near those of the core that it replaces, on both kinds of hosts.
#include <cmath>
#include <map>

#include "hosts.hpp"

namespace mauve::testing::test_bumpless {

using ::testing::HasSubstr;
using Verdict = ShadowVerdict;

/// What a test knows of a core that may be gone: its outputs by instant.
struct Log {
  std::vector<std::pair<time_ns_t, double>> written;
  std::atomic<int> count{0};
};

/// Counts what it has executed, and writes what the test says.
struct CountingCore : TestCore {
  MAUVE_STATE(rounds)

 public:
  std::shared_ptr<Log> log = std::make_shared<Log>();
  std::function<double(const CountingCore&)> law = [](const CountingCore&) { return 0.0; };
  std::int64_t rounds{0};

  double count() const { return static_cast<double>(rounds); }
  CountingCore() { log->written.reserve(200'000); }
  void act() override {
    ++rounds;
    const double value = law(*this);
    exposed_shell().output.write({value});
    log->written.emplace_back(clock_ns(), value);
    log->count.fetch_add(1);
    TestCore::act();
  }
};

using Law = std::function<double(const CountingCore&)>;

template <typename Way>
class Bumpless : public OnBothHosts<Way> {
 protected:
  Component& deploy_live(const Law& law) {
    this->architecture.template add_resource<SharedData<Number>>("out");
    Component& component = this->add("c");
    component.replace_core(make_core("t/Live", law, &live));
    this->architecture.connect("c", "output", "out", "write");
    this->deploy();
    this->host.until([&] { return live->count >= 3; }, "the live core");
    return component;
  }
  static std::unique_ptr<CountingCore> make_core(const std::string& name, const Law& law,
                                                 std::shared_ptr<Log>* log) {
    auto core = std::make_unique<CountingCore>();
    core->set_implementation(name);
    core->law = law;
    *log = core->log;
    return core;
  }
  static BumplessOptions within(double step, time_ns_t within_ns = s_to_ns(100)) {
    return {.outputs = {{.port = "output", .field = "value", .step = step}}, .within_ns = within_ns};
  }
  Transaction replacement(const Law& law, const BumplessOptions& options) {
    Transaction change;
    change.replace_core("c", make_core("t/Next", law, &next), ReplaceOptions{.bumpless = options});
    return change;
  }
  ShadowRecord record() {
    const auto all = (*this->host).shadows();
    return all.empty() ? ShadowRecord{} : all.back();
  }
  /// The outputs of both cores as they were written, in the order of their instants; none twice.
  std::map<time_ns_t, double> outputs_from(time_ns_t instant_ns) {
    std::map<time_ns_t, double> all;
    for (const auto& [at, value] : live->written) {
      if (at < instant_ns) all.emplace(at, value);
    }
    for (const auto& [at, value] : next->written) {
      const bool is_first = at < instant_ns || all.emplace(at, value).second;
      EXPECT_TRUE(is_first);
    }
    return all;
  }

  std::shared_ptr<Log> live;
  std::shared_ptr<Log> next;
};
TYPED_TEST_SUITE(Bumpless, EveryHost, HostNames);

TYPED_TEST(Bumpless, TheCoreGoesInWhereItsOutputsAreNear) {
  Component& component = this->deploy_live([](const CountingCore&) { return 1.0; });
  // It comes near for one release in 50, and is far before and after.
  const auto report = this->host.commit(this->replacement(
      [](const CountingCore& core) { return core.rounds % 50 == 49 ? 1.2 : 4.0; }, this->within(0.25)));
  EXPECT_EQ("t/Next", component.core_implementation());
  const time_ns_t instant_ns = report.instant_ns;
  ASSERT_NE(kNotMeasured, instant_ns);
  this->host.until([&] { return this->next->count >= 3 && !this->record().steps.empty(); }, "the new core");
  this->host.stop("c");
  const auto before = std::find_if(this->next->written.rbegin(), this->next->written.rend(),
                                   [&](const auto& each) { return each.first < instant_ns; });
  ASSERT_NE(this->next->written.rend(), before);
  EXPECT_EQ(1.2, before->second) << "in the release before T its output was near";
  EXPECT_EQ(this->live->written.back().first, before->first) << "which was the last one of the old core";
  ASSERT_EQ(1U, this->record().steps.size());
  const OutputStep step = this->record().steps.front();
  EXPECT_EQ("output.value", step.output);
  EXPECT_EQ(0.25, step.greatest);
  EXPECT_NEAR(0.2, step.difference, 1e-12);
  EXPECT_NEAR(0.2, step.least, 1e-12);
  EXPECT_NEAR(4.0 - 1.0, step.step, 1e-12) << "of the first output: the candidate is far again";
  if constexpr (!TestFixture::is_virtual) {
    ASSERT_EQ(1U, report.steps.front().outputs.size());
    EXPECT_NEAR(3.0, report.steps.front().outputs.front().step, 1e-12);
  }
  EXPECT_EQ(Verdict::promoted, this->record().verdict);
}

TYPED_TEST(Bumpless, NoOutputOfAChangeBetweenConvergingCoresIsBeyondItsStep) {
  Component& component =
      this->deploy_live([](const CountingCore& core) { return std::sin(1e-3 * core.count()); });
  const auto report = this->host.commit(this->replacement(
      [](const CountingCore& core) {
        return std::sin(1e-3 * core.count()) + std::exp(-0.01 * core.runs.load());
      },
      this->within(0.05)));
  this->host.until([&] { return this->next->count >= 200 && !this->record().steps.empty(); }, "the new core");
  this->host.stop("c");
  const auto outputs = this->outputs_from(report.instant_ns);
  for (auto at = std::next(outputs.begin()); at != outputs.end(); ++at)
    EXPECT_LE(std::abs(at->second - std::prev(at)->second), 0.05 + 2e-3);
  expect_released_at_each_instant(
      [&] {
        std::vector<time_ns_t> instants;
        for (const auto& [at, value] : outputs) instants.push_back(at);
        return instants;
      }(),
      component, ms_to_ns(1));
  EXPECT_LE(std::abs(this->record().steps.front().step), 0.05 + 2e-3);
}

TYPED_TEST(Bumpless, AnEqualCoreGoesInAtOnceWithTheStateOfTheOldOne) {
  Component& component = this->deploy_live([](const CountingCore& core) { return core.count(); });
  const auto report = this->host.commit(
      this->replacement([](const CountingCore& core) { return core.count(); }, this->within(0.5)));
  this->host.until([&] { return this->next->count >= 20; }, "the new core");
  this->host.stop("c");
  EXPECT_EQ("t/Next", component.core_implementation());
  const auto outputs = this->outputs_from(report.instant_ns);
  for (auto at = std::next(outputs.begin()); at != outputs.end(); ++at)
    EXPECT_EQ(1.0, at->second - std::prev(at)->second) << "the count goes on";
  EXPECT_EQ(1.0, this->record().steps.front().step);
}

TYPED_TEST(Bumpless, ACandidateBeginsEachReleaseWithTheStateOfTheLiveCore) {
  this->deploy_live([](const CountingCore& core) { return core.count(); });
  // Alone it would go away from the live core by one more each time.
  const auto report = this->host.commit(this->replacement(
      [](const CountingCore& core) {
        auto& own = const_cast<CountingCore&>(core);
        own.rounds += 1;
        return own.runs < 40 ? 1e9 : own.count();
      },
      this->within(1.5)));
  this->host.until([&] { return this->next->count >= 60; }, "the new core");
  EXPECT_NE(kNotMeasured, report.instant_ns);
  EXPECT_EQ(1.0, this->record().steps.front().difference);
  EXPECT_EQ(2.0, this->record().steps.front().step);
}

TYPED_TEST(Bumpless, ACandidateThatMissesReleasesHasTheStateAllTheSame) {
  this->deploy_live([](const CountingCore& core) { return core.count(); });
  // Its first releases last longer than all slots hold, or than its budget: it misses some.
  BumplessOptions options = this->within(0.5);
  options.budget_ns = us_to_ns(10);
  auto core = this->make_core(
      "t/Next",
      [](const CountingCore& next) {
        if (next.runs < 2 && !TestFixture::is_virtual) {
          const time_ns_t until_ns = monotonic_now_ns() + ms_to_ns(30);
          while (monotonic_now_ns() < until_ns) {
          }
        }
        return next.count();
      },
      &this->next);
  Transaction change;
  change.replace_core("c", std::move(core), ReplaceOptions{.bumpless = options});
  this->host.commit(std::move(change));
  this->host.until([&] { return this->next->count >= 20; }, "the new core");
  EXPECT_EQ(1.0, this->record().steps.front().step);
  if constexpr (!TestFixture::is_virtual) {
    EXPECT_GT(this->record().skipped_late + this->record().skipped_budget, 0);
  }
}

TYPED_TEST(Bumpless, TheCurvesHaveTheReleasesAroundTheSwap) {
  this->deploy_live([](const CountingCore& core) { return 1.0 + 1e-3 * core.count(); });
  const auto report = this->host.commit(this->replacement(
      [](const CountingCore& core) {
        return 1.0 + 1e-3 * core.count() + (core.runs.load() < 100 ? 3.0 : 0.1);
      },
      this->within(0.25)));
  this->host.until([&] { return this->record().curves.front().new_core.size() == OutputSteps::kCurve; },
                   "the curve");
  this->host.until([&] { return this->next->count >= 250; }, "more releases");
  this->host.stop("c");
  ASSERT_EQ(1U, this->record().curves.size());
  const OutputCurve curve = this->record().curves.front();
  EXPECT_EQ("output.value", curve.output);
  EXPECT_EQ(report.instant_ns, curve.instant_ns);
  const auto written = [](const Log& log) {
    return std::map<time_ns_t, double>(log.written.begin(), log.written.end());
  };
  const auto live = written(*this->live);
  const auto next = written(*this->next);
  ASSERT_EQ(OutputSteps::kCurve, curve.instants_ns.size()) << "the last ones of at least a hundred";
  for (std::size_t place = 0; place < curve.instants_ns.size(); ++place) {
    EXPECT_EQ(live.at(curve.instants_ns[place]), curve.live[place]);
    EXPECT_EQ(next.at(curve.instants_ns[place]), curve.candidate[place]);
  }
  EXPECT_EQ(live.rbegin()->first, curve.instants_ns.back()) << "up to the last release of the old core";
  ASSERT_EQ(OutputSteps::kCurve, curve.new_instants_ns.size());
  auto expected = next.lower_bound(report.instant_ns);
  for (std::size_t place = 0; place < curve.new_instants_ns.size(); ++place, ++expected) {
    EXPECT_EQ(expected->first, curve.new_instants_ns[place]);
    EXPECT_EQ(expected->second, curve.new_core[place]);
  }
}

TYPED_TEST(Bumpless, ACurveEndsWithTheNextChange) {
  this->deploy_live([](const CountingCore&) { return 1.0; });
  const auto swap = [&](const Law& law) { this->host.commit(this->replacement(law, this->within(1e9))); };
  swap([](const CountingCore&) { return 2.0; });
  this->host.until([&] { return !this->record().curves.front().new_core.empty(); }, "the first new core");
  const auto numbers_of = [&] { return this->record().curves.front().new_core; };
  Transaction plain;
  plain.replace_core("c", this->make_core("t/Plain", [](const CountingCore&) { return 3.0; }, &this->next));
  this->host.commit(std::move(plain));
  this->host.until([&] { return this->next->count >= 100; }, "the plain core");
  EXPECT_THAT(numbers_of(), ::testing::Each(2.0));
  swap([](const CountingCore&) { return 4.0; });
  this->host.until([&] { return !numbers_of().empty(); }, "the second new core");
  swap([](const CountingCore&) { return 5.0; });
  this->host.until([&] { return !numbers_of().empty(); }, "the third new core");
  this->host.stop("c");
  const std::size_t seen = numbers_of().size();
  this->host.start("c");
  const int before = this->next->count;
  this->host.until([&] { return this->next->count >= before + 100; }, "the core that was started again");
  EXPECT_THAT(numbers_of(), ::testing::Each(5.0));
  EXPECT_EQ(seen, numbers_of().size()) << "a stop ends the curve";
}

TYPED_TEST(Bumpless, ACoreThatDoesNotComeNearIsRefusedWithItsLeastDifference) {
  Component& component = this->deploy_live([](const CountingCore&) { return 1.0; });
  std::string text;
  EXPECT_EQ(ErrorCode::timeout,
            this->code_of(
                [&] {
                  this->host.commit(this->replacement(
                      [](const CountingCore& core) { return core.rounds % 7 == 0 ? 1.5 : 9.0; },
                      this->within(0.25, ms_to_ns(200))));
                },
                &text));
  EXPECT_THAT(text, HasSubstr("did not come near those of the core within 200 ms"));
  EXPECT_THAT(text, HasSubstr("output.value within 0.25"));
  EXPECT_THAT(text, HasSubstr("output.value at least 0.5 apart, at instant "));
  EXPECT_EQ("t/Live", component.core_implementation());
  const int before = this->live->count;
  this->host.until([&] { return this->live->count >= before + 5; }, "the live core");
  EXPECT_EQ(Verdict::ended, this->record().verdict);
  EXPECT_THAT(this->record().reason, HasSubstr("the change was refused"));
  const OutputCurve curve = this->record().curves.front();
  EXPECT_EQ(0, curve.instant_ns);
  EXPECT_THAT(curve.live, ::testing::Each(1.0));
  EXPECT_THAT(curve.candidate, ::testing::Contains(9.0));
  EXPECT_THAT(curve.new_core, ::testing::IsEmpty());
  // Nothing is left of it: the next change is made.
  this->host.commit(this->replacement([](const CountingCore&) { return 1.0; }, this->within(0.25)));
  EXPECT_EQ("t/Next", component.core_implementation());
}

TYPED_TEST(Bumpless, NanIsNotNear) {
  this->deploy_live([](const CountingCore&) { return 1.0; });
  std::string text;
  EXPECT_EQ(ErrorCode::timeout,
            this->code_of(
                [&] {
                  this->host.commit(this->replacement([](const CountingCore&) { return std::nan(""); },
                                                      this->within(1e300, ms_to_ns(50))));
                },
                &text));
  EXPECT_THAT(text, HasSubstr("output.value not written by both cores"));
}

TYPED_TEST(Bumpless, ACandidateThatFaultsRefusesTheChange) {
  Component& component = this->deploy_live([](const CountingCore&) { return 1.0; });
  std::string text;
  EXPECT_EQ(ErrorCode::adopt_refused, this->code_of(
                                          [&] {
                                            this->host.commit(this->replacement(
                                                [](const CountingCore& core) -> double {
                                                  if (core.runs == 5)
                                                    throw std::runtime_error("division by zero");
                                                  return 9.0;
                                                },
                                                this->within(0.25)));
                                          },
                                          &text));
  EXPECT_THAT(text, HasSubstr("division by zero in state Run"));
  EXPECT_EQ("t/Live", component.core_implementation());
  EXPECT_EQ(ComponentState::running, component.task().state());
}

TYPED_TEST(Bumpless, TheCandidateOfAShadowIsPromotedWithItsState) {
  Component& component = this->deploy_live([](const CountingCore&) { return 1.0; });
  Transaction begin;
  begin.shadow(
      "c",
      this->make_core(
          "t/Next", [](const CountingCore& core) { return core.rounds % 30 == 29 ? 1.0 : 9.0; }, &this->next),
      {.budget_ns = s_to_ns(1)});
  this->host.commit(std::move(begin));
  const auto promote = [&](double step, time_ns_t within_ns) {
    Transaction change;
    change.promote("c", {.bumpless = this->within(step, within_ns)});
    this->host.commit(std::move(change));
  };
  Transaction far;
  far.promote("c", {.bumpless = this->within(0.0, 1)});
  EXPECT_EQ(ErrorCode::timeout, this->code_of([&] { this->host.commit(std::move(far)); }));
  EXPECT_EQ(Verdict::running, this->record().verdict) << "it goes on in its shadow";
  promote(0.0, s_to_ns(100));
  EXPECT_EQ("t/Next", component.core_implementation());
  this->host.until([&] { return this->next->count >= 40; }, "the new core");
  this->host.stop("c");
  EXPECT_EQ(Verdict::promoted, this->record().verdict);
  EXPECT_EQ(0.0, this->record().steps.front().difference);
}

TYPED_TEST(Bumpless, AStoppedComponentIsChangedAtOnce) {
  Component& component = this->deploy_live([](const CountingCore&) { return 1.0; });
  this->host.stop("c");
  this->host.commit(this->replacement([](const CountingCore&) { return 9.0; }, this->within(0.0)));
  EXPECT_EQ("t/Next", component.core_implementation());
  this->host.start("c");
  this->host.until([&] { return this->next->count >= 3; }, "the new core");
}

TYPED_TEST(Bumpless, OtherComponentsOfTheTransactionChangeAtTheSameInstant) {
  Component& other = this->add("other");
  Component& component = this->deploy_live([](const CountingCore&) { return 1.0; });
  Transaction change = this->replacement(
      [](const CountingCore& core) { return core.rounds % 40 == 39 ? 1.0 : 9.0; }, this->within(0.0));
  std::shared_ptr<Log> others;
  change.replace_core("other", this->make_core("t/Other", [](const CountingCore&) { return 0.0; }, &others));
  const auto report = this->host.commit(std::move(change));
  this->host.until([&] { return others->count >= 3 && this->next->count >= 3; }, "the new cores");
  this->host.stop("c");
  this->host.stop("other");
  EXPECT_EQ("t/Other", other.core_implementation());
  EXPECT_EQ("t/Next", component.core_implementation());
  EXPECT_GE(others->written.front().first, report.instant_ns);
  EXPECT_LT(this->live->written.back().first, report.instant_ns);
}

TYPED_TEST(Bumpless, OnProbationTheOldCoreComesBack) {
  const auto is_in = std::make_shared<std::atomic<bool>>(false);
  Component& component = this->deploy_live([](const CountingCore&) { return 1.0; });
  Transaction change;
  change.replace_core("c",
                      this->make_core(
                          "t/Next",
                          [is_in](const CountingCore& core) -> double {
                            if (*is_in) throw std::runtime_error("late fault");
                            return core.runs % 20 == 19 ? 1.0 : 9.0;
                          },
                          &this->next),
                      ReplaceOptions{.probation = ProbationOptions{.duration_ns = s_to_ns(100)},
                                     .bumpless = this->within(0.0)});
  this->host.commit(std::move(change));
  EXPECT_EQ("t/Next", component.core_implementation());
  *is_in = true;
  this->host.until([&] { return component.core_implementation() == "t/Live"; }, "the old core");
  EXPECT_EQ(ComponentState::running, component.task().state());
}

TYPED_TEST(Bumpless, WhatCannotBeBoundedIsRefusedBeforeAnythingIsBuilt) {
  this->deploy_live([](const CountingCore&) { return 1.0; });
  const auto refused = [&](const BumplessOptions& options, const char* text) {
    std::string found;
    EXPECT_EQ(
        ErrorCode::invalid_argument,
        this->code_of(
            [&] { this->host.commit(this->replacement([](const CountingCore&) { return 1.0; }, options)); },
            &found));
    EXPECT_THAT(found, HasSubstr(text));
  };
  const auto with = [](const std::string& port, const std::string& field, double step) {
    return BumplessOptions{.outputs = {{.port = port, .field = field, .step = step}}};
  };
  refused({}, "needs the outputs that it bounds");
  refused(with("output", "value", -0.1), "no length");
  refused(with("output", "value", std::nan("")), "no length");
  refused(with("input", "value", 0.1), "only an output");
  refused(with("output", "speed", 0.1), "no number there");
  refused(this->within(0.1, 0), "cannot wait that long");
  Transaction idle = this->replacement([](const CountingCore&) { return 1.0; }, this->within(0.1));
  EXPECT_EQ(ErrorCode::invalid_argument,
            this->code_of([&] { (*this->host).commit(std::move(idle), {.idle = true}); }));
  Transaction prepared = this->replacement([](const CountingCore&) { return 1.0; }, this->within(0.1));
  EXPECT_EQ(ErrorCode::invalid_argument, this->code_of([&] { (*this->host).prepare(std::move(prepared)); }));
  Transaction beside = this->replacement([](const CountingCore&) { return 1.0; }, this->within(0.1));
  beside.set_property("c", "gain", 2.0);
  EXPECT_EQ(ErrorCode::invalid_argument, this->code_of([&] { this->host.commit(std::move(beside)); }));
  EXPECT_TRUE((*this->host).shadows().empty());
}

struct ZeroShell : TestShell {
  WritePort<Number>& zeroed = write_port<Number>("zeroed", {.on_commit = OutputPolicy::set_zero}).optional();
};

TYPED_TEST(Bumpless, APortThatWritesZeroAtEachChangeIsRefused) {
  this->architecture.template add_component<ZeroShell, TestCore, TestFsm>("z");
  this->deploy();
  Transaction change;
  change.replace_core("z", std::make_unique<TestCore>(),
                      ReplaceOptions{.bumpless = BumplessOptions{
                                         .outputs = {{.port = "zeroed", .field = "value", .step = 1.0}}}});
  std::string text;
  EXPECT_EQ(ErrorCode::invalid_argument, this->code_of([&] { this->host.commit(std::move(change)); }, &text));
  EXPECT_THAT(text, HasSubstr("on_commit: set_zero"));
}

TYPED_TEST(Bumpless, ADryRunBeginsNothing) {
  Component& component = this->deploy_live([](const CountingCore&) { return 1.0; });
  Transaction rehearsed = this->replacement([](const CountingCore&) { return 9.0; }, this->within(0.1));
  (*this->host).commit(std::move(rehearsed), {.dry_run = true});
  EXPECT_EQ("t/Live", component.core_implementation());
  EXPECT_TRUE((*this->host).shadows().empty());
}

TYPED_TEST(Bumpless, APromotedCoreGoesOnWithTheStateOfTheOldOne) {
  this->deploy_live([](const CountingCore& core) { return core.count(); });
  const Law count = [](const CountingCore& core) { return core.count(); };
  const auto swap = [&](bool is_fresh) {
    Transaction begin;
    begin.shadow("c", this->make_core("t/Next", count, &this->next),
                 {.budget_ns = s_to_ns(1), .is_fresh = is_fresh});
    this->host.commit(std::move(begin));
    this->host.until([&] { return this->record().compared >= 5; }, "the candidate");
    Transaction end;
    end.promote("c", {.is_fresh = is_fresh});
    return this->host.commit(std::move(end)).instant_ns;
  };
  const time_ns_t instant_ns = swap(false);
  const int in_shadow = this->next->count;
  this->host.until([&] { return this->next->count >= in_shadow + 5; }, "the new core");
  const auto first = std::find_if(this->next->written.begin(), this->next->written.end(),
                                  [&](const auto& each) { return each.first >= instant_ns; });
  EXPECT_EQ(this->live->written.back().second + 1.0, first->second) << "the count goes on";
  EXPECT_GT(this->next->written.front().second, 3.0) << "the candidate began with the state of the live core";
}

/// A controller of one joint: its terms are torques, so that another one with other gains can go on with them.
struct ArmCore : TestCore {
  MAUVE_STATE(integral_nm, error_before)

 public:
  double kp{20.0}, ki{60.0}, kd{1.0};
  double integral_nm{0.0}, error_before{0.0};

  void act() override {
    const double t = 1e-9 * static_cast<double>(clock_ns());
    const double error = 0.5 * std::sin(2.0 * t) - exposed_shell().input.read().value.value;
    integral_nm += ki * error * 1e-3;
    const double torque = kp * error + integral_nm + kd * (error - error_before) * 1e3;
    error_before = error;
    exposed_shell().output.write({torque});
    TestCore::act();
  }
};

/// The joint itself, with gravity.
struct JointCore : TestCore {
  double angle{0.0}, speed{0.0};

  void act() override {
    const double torque = exposed_shell().input.read().value.value;
    speed += 1e-3 * (torque - 5.0 * std::sin(angle) - 0.5 * speed) / 0.2;
    angle += 1e-3 * speed;
    exposed_shell().output.write({angle});
    TestCore::act();
  }
};

TYPED_TEST(Bumpless, NoTorqueOfAnArmStepsFartherThanAskedFor) {
  // In virtual time as many as a tester would want to see; on threads each of them takes some milliseconds.
  constexpr int kSwaps = TestFixture::is_virtual ? 1'000 : 60;
  constexpr double kGreatest = 0.4;
  this->architecture.template add_resource<SharedData<Number>>("torque");
  this->architecture.template add_resource<SharedData<Number>>("angle");
  this->add("c").replace_core(std::make_unique<ArmCore>());
  this->add("joint").replace_core(std::make_unique<JointCore>());
  this->architecture.connect("c", "output", "torque", "write");
  this->architecture.connect("joint", "input", "torque", "read");
  this->architecture.connect("joint", "output", "angle", "write");
  this->architecture.connect("c", "input", "angle", "read");
  this->deploy();
  double farthest = 0.0;
  for (int swap = 0; swap < kSwaps; ++swap) {
    auto core = std::make_unique<ArmCore>();
    const bool is_firm = swap % 2 == 0;
    core->kp = is_firm ? 45.0 : 20.0;
    core->ki = is_firm ? 200.0 : 60.0;
    core->kd = is_firm ? 1.5 : 1.0;
    Transaction change;
    change.replace_core("c", std::move(core), ReplaceOptions{.bumpless = this->within(kGreatest)});
    ASSERT_NO_THROW(this->host.commit(std::move(change))) << "swap " << swap;
    this->host.until([&] { return !std::isnan(this->record().steps.front().step); }, "the first torque");
    const OutputStep step = this->record().steps.front();
    ASSERT_LE(std::abs(step.difference), kGreatest) << "swap " << swap;
    farthest = std::max(farthest, std::abs(step.step));
    this->host.run_for(ms_to_ns(7));
  }
  // What a torque moves in one period besides: the arm follows a curve.
  if constexpr (TestFixture::is_virtual) {
    EXPECT_LE(farthest, kGreatest + 0.1);
  }
}

TEST(BumplessStop, AStopDoesNotWaitForNearOutputs) {
  Architecture architecture;
  Component& component = architecture.add_component<TestShell, TestCore, TestFsm>("c");
  OnThreads threads(architecture);
  architecture.configure();
  threads.host().deploy();
  wait_until([&] { return component.core_as<TestCore>().runs >= 3; }, "the component");
  std::optional<ErrorCode> code;
  std::thread requester([&] {
    Transaction change;
    change.replace_core("c", std::make_unique<CountingCore>(),
                        ReplaceOptions{.bumpless = BumplessOptions{.outputs = {{"output", "value", 0.0}},
                                                                   .within_ns = s_to_ns(1'000)}});
    try {
      threads.host().commit(std::move(change));
    } catch (const Error& error) {
      code = error.code();
    }
  });
  wait_until(
      [&] { return !threads.host().shadows().empty() && threads.host().shadows().back().compared >= 3; },
      "the candidate");
  threads.host().stop("c");
  EXPECT_EQ(ComponentState::stopped, component.task().state());
  requester.join();
  EXPECT_EQ(ErrorCode::wrong_revision, code);
  threads.host().start("c");
  const int before = component.core_as<TestCore>().runs;
  wait_until([&] { return component.core_as<TestCore>().runs >= before + 3; }, "the old core");
  threads.shutdown();
}

}  // namespace mauve::testing::test_bumpless
