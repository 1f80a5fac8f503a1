// SPDX-License-Identifier: LGPL-3.0-or-later
// A core on probation: each violation puts the old core back, whatever else ends a probation, on both kinds of hosts.
#include <cmath>
#include <limits>
#include <random>
#include <tuple>
#include <vector>

#include "probation_fixtures.hpp"

namespace mauve::testing::test_probation {

using ::testing::HasSubstr;

TYPED_TEST_SUITE(Probations, EveryHost, HostNames);

TYPED_TEST(Probations, ACoreWithoutViolationPasses) {
  Component& component = this->add_trial();
  this->deploy();
  this->wait_seen(*this->old_seen, 2);
  const auto seen = this->put_in([](TrialCore&, int) {}, {.duration_ns = ms_to_ns(20), .min_releases = 3});
  EXPECT_EQ(Verdict::running, this->record().verdict);
  EXPECT_EQ("t/Old", this->record().from_core);
  EXPECT_EQ("t/New", this->record().to_core);
  EXPECT_FALSE(this->old_seen->is_cleaned) << "it stays configured";
  this->wait_seen(*seen, 4);
  this->settle();
  const auto end_ns = this->record().begin_ns + ms_to_ns(20);
  this->host.until([&] { return this->host.now_ns() >= end_ns; }, "the end");
  this->settle();
  const ProbationRecord record = this->record();
  EXPECT_EQ(Verdict::passed, record.verdict);
  EXPECT_EQ("", record.reason);
  EXPECT_GE(record.releases, 3);
  EXPECT_GE(record.end_ns, end_ns);
  this->wait_cleaned(*this->old_seen);
  EXPECT_EQ("t/New", component.core_implementation());
  this->wait_seen(*seen, seen->runs + 3);
  EXPECT_EQ(1U, (*this->host).probations().size());
}

TYPED_TEST(Probations, WithTooFewReleasesNothingIsKnown) {
  Component& component = this->add_trial();
  this->deploy();
  this->put_in([](TrialCore&, int) {}, {.duration_ns = ms_to_ns(5), .min_releases = 1'000'000});
  this->host.until(
      [&] {
        this->settle();
        return this->record().verdict != Verdict::running;
      },
      "the end");
  EXPECT_EQ(Verdict::inconclusive, this->record().verdict);
  EXPECT_EQ(Cause::too_few, this->record().cause);
  EXPECT_THAT(this->record().reason, HasSubstr("expected at least 1000000"));
  EXPECT_EQ("t/New", component.core_implementation());
}

TYPED_TEST(Probations, AFaultPutsTheOldCoreBack) {
  Component& component = this->add_trial();
  this->deploy();
  this->wait_seen(*this->old_seen, 2);
  const int runs_before = this->old->runs;
  const auto seen = this->put_in([](TrialCore& core, int run) {
    core.exposed_shell().output.write({2.0});
    if (run == 3) throw std::runtime_error("division by zero");
  });
  this->wait_verdict(Verdict::reverted);
  this->expect_old_core_runs_on(component);
  EXPECT_EQ(3, seen->runs);
  EXPECT_GT(this->old->runs, runs_before) << "it has its state of before";
  EXPECT_EQ(Cause::fault, this->record().cause);
  EXPECT_EQ("fault: division by zero in state Run", this->record().reason);
  EXPECT_EQ(2, this->record().releases);
  EXPECT_EQ("division by zero", component.task().fault().what);
  EXPECT_FALSE(seen->is_cleaned) << "not by the component's own thread";
  this->settle();
  this->wait_cleaned(*seen);
  EXPECT_EQ(Verdict::reverted, this->record().verdict);
}

TYPED_TEST(Probations, OutputsAreHeldOverAFaultAsOverAChange) {
  if constexpr (TestFixture::is_virtual) {
    this->add_trial();
    this->deploy();
    this->wait_seen(*this->old_seen, 2);
    const auto seen = this->put_in([](TrialCore& core, int) {
      core.exposed_shell().output.write({2.0});
      throw std::runtime_error("at once");
    });
    this->wait_seen(*seen, 1);
    EXPECT_EQ(Verdict::reverted, this->record().verdict);
    EXPECT_EQ(2.0, this->newest()) << "no zero in between";
  }
}

TYPED_TEST(Probations, AnOverrunPutsTheOldCoreBackWithinTheWait) {
  Component& component = this->add_trial();
  this->deploy();
  this->wait_seen(*this->old_seen, 2);
  const auto seen = this->put_in(
      [&](TrialCore&, int run) {
        if (run == 3) this->overrun(component);
      },
      {.on_fault = false, .on_overrun = true});
  this->wait_verdict(Verdict::reverted);
  this->expect_old_core_runs_on(component);
  EXPECT_LE(seen->runs, 3) << "a slow machine may overrun sooner";
  EXPECT_EQ(Cause::overrun, this->record().cause);
  EXPECT_THAT(this->record().reason, HasSubstr("overrun at instant"));
}

TYPED_TEST(Probations, AnExecutionOverItsBoundPutsTheOldCoreBack) {
  constexpr time_ns_t kBound = ms_to_ns(200);
  Component& component = this->add_trial("c", {.states = {{.name = "Run", .max_execution_ns = kBound}}});
  this->deploy();
  const auto seen = this->put_in(
      [&](TrialCore&, int run) {
        if (run == 2) this->overrun(component, 2 * kBound);
      },
      {.on_fault = false, .on_over_declared = true});
  this->wait_verdict(Verdict::reverted);
  this->expect_old_core_runs_on(component);
  EXPECT_EQ(2, seen->runs);
  EXPECT_EQ(Cause::over_declared, this->record().cause);
  EXPECT_THAT(this->record().reason, HasSubstr("state Run ran longer than its 200000 us"));
  this->host.until([&] { return this->newest() == 1.0; }, "its outputs to be open again");
}

TYPED_TEST(Probations, AnExecutionOverItsEnforcedWorstCasePutsTheOldCoreBack) {
  constexpr time_ns_t kBudget = ms_to_ns(20);
  Component& component =
      this->add_trial("c", {.enforce_wcet = true, .states = {{.name = "Run", .wcet_ns = kBudget}}});
  this->deploy();
  const auto seen = this->put_in(
      [&](TrialCore&, int run) {
        if (run != 2) return;
        component.task().clock().spend(2 * kBudget);  // of virtual time
        const time_ns_t until_ns = thread_cpu_now_ns() + (TestFixture::is_virtual ? 0 : 2 * kBudget);
        while (thread_cpu_now_ns() < until_ns) {
        }
      },
      {.on_fault = false, .on_over_declared = true});
  this->wait_verdict(Verdict::reverted);
  this->expect_old_core_runs_on(component);
  EXPECT_EQ(2, seen->runs);
  EXPECT_EQ(Cause::over_declared, this->record().cause);
  EXPECT_THAT(this->record().reason, HasSubstr("execution over declared: state Run used "));
  EXPECT_THAT(this->record().reason, HasSubstr(" of CPU time, and its wcet_ns is 20 ms"));
}

TYPED_TEST(Probations, AValueThatBreaksALimitIsNotWritten) {
  Component& component = this->add_trial();
  this->deploy();
  this->wait_seen(*this->old_seen, 2);
  std::atomic<double> bad{kNan};
  const auto seen = this->put_in(
      [&](TrialCore& core, int run) { core.exposed_shell().output.write({run < 3 ? 5.0 : bad.load()}); },
      {.outputs = {{.port = "output", .not_nan = true}}});
  this->wait_verdict(Verdict::reverted);
  EXPECT_FALSE(std::isnan(this->newest()));
  EXPECT_EQ(3, seen->runs);
  EXPECT_EQ("output c.output.value is nan", this->record().reason);
  this->expect_old_core_runs_on(component);
  bad = 11.0;
  const auto second = this->put_in(
      [&](TrialCore& core, int run) { core.exposed_shell().output.write({run < 3 ? 5.0 : bad.load()}); },
      {.outputs = {{.port = "output", .field = "value", .minimum = -1.0, .maximum = 10.0}}});
  this->wait_verdict(Verdict::reverted);
  EXPECT_NE(11.0, this->newest());
  EXPECT_EQ(3, second->runs);
  EXPECT_EQ("output c.output.value is 11, above 10", this->record().reason);
  this->expect_old_core_runs_on(component);
}

TYPED_TEST(Probations, NothingIsWatchedThatWasNotAskedFor) {
  Component& component = this->add_trial();
  this->deploy();
  const auto seen = this->put_in(
      [&](TrialCore& core, int run) {
        core.exposed_shell().output.write({kNan});
        if (run == 2) this->overrun(component);
      },
      {.outputs = {}});
  this->wait_seen(*seen, 6);
  EXPECT_EQ(Verdict::running, this->record().verdict);
  EXPECT_TRUE(std::isnan(this->newest()));
}

TYPED_TEST(Probations, AFaultThatIsNotWatchedIsFinal) {
  Component& component = this->add_trial();
  this->deploy();
  this->put_in([](TrialCore&, int) { throw std::runtime_error("unwatched"); }, {.on_fault = false});
  this->wait_state(component, ComponentState::faulted);
  EXPECT_EQ(Verdict::running, this->record().verdict);
  EXPECT_EQ("t/New", component.core_implementation());
}

TYPED_TEST(Probations, ARequestPutsTheOldCoreBack) {
  Component& component = this->add_trial();
  this->deploy();
  EXPECT_FALSE((*this->host).revert_probation("c", "there is none"));
  const auto seen = this->put_in([](TrialCore&, int) {});
  this->wait_seen(*seen, 2);
  EXPECT_TRUE((*this->host).revert_probation("c", "rule too_warm", s_to_ns(30)));
  const int runs = seen->runs;
  EXPECT_EQ(Verdict::reverted, this->record().verdict);
  EXPECT_EQ("rule too_warm", this->record().reason);
  this->expect_old_core_runs_on(component);
  EXPECT_EQ(runs, seen->runs);
}

TYPED_TEST(Probations, ARequestPutsTheOldCoreBackIntoAStoppedComponent) {
  Component& component = this->add_trial();
  this->deploy();
  const auto seen = this->put_in([](TrialCore&, int) {});
  this->wait_seen(*seen, 2);
  this->host.stop("c");
  EXPECT_EQ(Verdict::running, this->record().verdict) << "a stop does not end it";
  EXPECT_TRUE((*this->host).revert_probation("c", "while it is stopped"));
  EXPECT_EQ("t/Old", component.core_implementation());
  EXPECT_EQ(ComponentState::stopped, component.task().state());
  this->host.start("c");
  this->expect_old_core_runs_on(component);
}

TYPED_TEST(Probations, ARequestFromTheComponentsOwnStateIsCarriedOutInItsWait) {
  Component& component = this->add_trial();
  this->deploy();
  std::atomic<bool> answered{false};
  const auto seen = this->put_in([&](TrialCore&, int run) {
    if (run == 3) answered = component.revert_probation("by itself");
  });
  this->wait_verdict(Verdict::reverted);
  EXPECT_TRUE(answered);
  EXPECT_EQ(3, seen->runs);
  this->expect_old_core_runs_on(component);
}

TYPED_TEST(Probations, AStoppedComponentsProbationEndsByTheClock) {
  Component& component = this->add_trial();
  this->deploy();
  const auto seen = this->put_in([](TrialCore&, int) {}, {.duration_ns = ms_to_ns(30), .min_releases = 1});
  this->wait_seen(*seen, 2);
  this->host.stop("c");
  this->host.until(
      [&] {
        this->settle();
        return this->record().verdict != Verdict::running;
      },
      "the end");
  EXPECT_EQ(Verdict::passed, this->record().verdict);
  this->host.start("c");
  this->wait_seen(*seen, seen->runs + 2);
  EXPECT_EQ("t/New", component.core_implementation());
}

TYPED_TEST(Probations, AnotherCoreEndsItInconclusive) {
  Component& component = this->add_trial();
  this->deploy();
  const auto first = this->put_in([](TrialCore&, int) {});
  this->wait_seen(*first, 2);
  const auto second = this->put_in([](TrialCore&, int) {});
  const auto all = (*this->host).probations();
  ASSERT_EQ(2U, all.size());
  EXPECT_EQ(Verdict::inconclusive, all[0].verdict);
  EXPECT_EQ(Cause::replaced, all[0].cause);
  EXPECT_EQ(Verdict::running, all[1].verdict);
  this->wait_cleaned(*this->old_seen);
  EXPECT_FALSE(first->is_cleaned) << "it is the old core now";
  EXPECT_TRUE((*this->host).revert_probation("c", "", s_to_ns(30)));
  this->wait_seen(*first, first->runs + 2);
  EXPECT_EQ("t/New", component.core_implementation());
  this->settle();
  this->wait_cleaned(*second);
}

TYPED_TEST(Probations, AnotherFsmEndsItInconclusive) {
  this->add_trial();
  this->deploy();
  const auto seen = this->put_in([](TrialCore&, int) {});
  Transaction change;
  change.replace_fsm("c", std::make_unique<TestFsm>());
  this->host.commit(std::move(change), 0);
  EXPECT_EQ(Verdict::inconclusive, this->record().verdict);
  this->wait_cleaned(*this->old_seen);
  this->wait_seen(*seen, seen->runs + 3);
}

TYPED_TEST(Probations, ARefusedChangeDoesNotEndIt) {
  Component& component = this->add_trial();
  this->deploy();
  const auto seen = this->put_in([](TrialCore&, int) {});
  Transaction change;
  change.replace_core("c", std::make_unique<RefusingCore>());
  EXPECT_EQ(ErrorCode::adopt_refused, this->code_of([&] { this->host.commit(std::move(change)); }));
  EXPECT_EQ(Verdict::running, this->record().verdict);
  EXPECT_TRUE((*this->host).revert_probation("c", "", s_to_ns(30)));
  this->expect_old_core_runs_on(component);
}

TYPED_TEST(Probations, PropertiesAndConnectionsDoNotEndIt) {
  Component& component = this->add_trial();
  auto& other = this->architecture.template add_resource<SharedData<Number>>("other");
  this->deploy();
  const auto seen = this->put_in([](TrialCore&, int) {});
  component.set_property("gain", 5.0, {.commit_ns = s_to_ns(30), .phase_ns = 0});
  Transaction change;
  change.disconnect("c", "output").connect("c", "output", "other", "write");
  this->host.commit(std::move(change), 0);
  EXPECT_EQ(Verdict::running, this->record().verdict);
  EXPECT_TRUE((*this->host).revert_probation("c", "", s_to_ns(30)));
  this->expect_old_core_runs_on(component);
  EXPECT_EQ(PropertyValue(5.0), component.shown().properties[0].value) << "it stays";
  this->out = &other;
  EXPECT_EQ(1.0, this->newest()) << "the old core writes to the new connection";
}

TYPED_TEST(Probations, AShutdownEndsItInconclusive) {
  Component& component = this->add_trial();
  this->deploy();
  const auto seen = this->put_in([](TrialCore&, int) {});
  this->host.shutdown();
  EXPECT_EQ(Verdict::inconclusive, this->record().verdict);
  EXPECT_EQ(Cause::ended, this->record().cause);
  this->architecture.cleanup();
  this->wait_cleaned(*this->old_seen);
  this->wait_cleaned(*seen);
  EXPECT_EQ(Verdict::inconclusive, component.probations().back().verdict);
}

TYPED_TEST(Probations, ToConfigureAnewEndsItInconclusive) {
  Component& component = this->add_trial();
  this->deploy();
  const auto seen = this->put_in([](TrialCore&, int) {});
  this->host.stop("c");
  component.configure_anew();
  EXPECT_EQ(Verdict::inconclusive, this->record().verdict);
  this->wait_cleaned(*this->old_seen);
  this->host.start("c");
  this->wait_seen(*seen, seen->runs + 2);
}

TYPED_TEST(Probations, ARemovedComponentsCoresAreBothRetired) {
  this->add_trial();
  this->deploy();
  const auto seen = this->put_in([](TrialCore&, int) {});
  Transaction change;
  change.remove_component("c");
  this->host.commit(std::move(change), 0);
  EXPECT_TRUE((*this->host).probations().empty());
  this->wait_cleaned(*this->old_seen);
  this->wait_cleaned(*seen);
}

TYPED_TEST(Probations, AStopThatIsPendingAtAFaultIsCarriedOut) {
  Component& component = this->add_trial();
  this->deploy();
  this->put_in([&](TrialCore&, int run) {
    if (run != 2) return;
    component.task().stop();  // from its own state: pending
    throw std::runtime_error("while it stops");
  });
  this->wait_verdict(Verdict::reverted);
  this->wait_state(component, ComponentState::stopped);
  this->host.start("c");
  this->expect_old_core_runs_on(component);
}

TYPED_TEST(Probations, APreparedChangeIsStaleAfterARevert) {
  Component& component = this->add_trial();
  this->deploy();
  const auto seen = this->put_in([](TrialCore&, int) {});
  Transaction steps;
  steps.set_property("c", "gain", 3.0);
  const auto prepared = (*this->host).prepare(std::move(steps));
  Transaction core_steps;
  core_steps.replace_core("c", std::make_unique<TrialCore>());
  const auto other = (*this->host).prepare(std::move(core_steps));
  EXPECT_TRUE(prepared->is_current());
  EXPECT_TRUE((*this->host).revert_probation("c", "", s_to_ns(30)));
  EXPECT_EQ(PreparedOutcome::refused, other->commit(s_to_ns(30))) << "made for the core that is out";
  this->settle();
  EXPECT_FALSE(prepared->is_current());
  EXPECT_EQ(PreparedOutcome::stale, prepared->commit(s_to_ns(30)));
  this->expect_old_core_runs_on(component);
}

TYPED_TEST(Probations, APreparedOneIsWatchedFromItsCommitOn) {
  Component& component = this->add_trial();
  this->deploy();
  this->wait_seen(*this->old_seen, 2);
  auto core = std::make_unique<TrialCore>();
  core->work = [&own = *core] {
    if (own.runs == 2) throw std::runtime_error("bad");
  };
  const auto seen = core->seen;
  Transaction steps;
  steps.replace_core("c", std::move(core), ProbationOptions{.duration_ns = kLong});
  const auto prepared = (*this->host).prepare(std::move(steps));
  EXPECT_EQ(PreparedOutcome::committed, prepared->commit(s_to_ns(30)));
  this->host.until([&] { return seen->runs == 2 && component.core_implementation() == "t/Old"; },
                   "the way back");
  EXPECT_EQ(Verdict::reverted, this->record().verdict) << "it is known before its change is completed";
  prepared->complete();
  EXPECT_EQ(Verdict::reverted, this->record().verdict);
  this->settle();
  this->wait_cleaned(*seen);
  this->expect_old_core_runs_on(component);
}

TYPED_TEST(Probations, AFallbackStaysReadyForLater) {
  Component& component = this->add_trial();
  auto spare = std::make_unique<TrialCore>();
  spare->set_implementation("t/Fallback");
  const auto spare_seen = spare->seen;
  component.set_fallback(std::move(spare));
  std::atomic<bool> is_broken{false};
  this->old->work = [&] {
    if (is_broken) throw std::runtime_error("the old one, too");
  };
  this->deploy();
  this->put_in([](TrialCore&, int) { throw std::runtime_error("the new one"); });
  this->wait_verdict(Verdict::reverted);
  this->expect_old_core_runs_on(component);
  EXPECT_FALSE(component.task().has_fallen_back());
  EXPECT_EQ(0, spare_seen->runs);
  this->settle();
  is_broken = true;
  this->wait_seen(*spare_seen, 2);
  EXPECT_TRUE(component.task().has_fallen_back());
  // The fallback is the old core of the next one.
  std::atomic<bool> was_fallback{false};
  const auto seen = this->put_in([&](TrialCore&, int run) {
    was_fallback = was_fallback || component.task().has_fallen_back();
    if (run == 2) throw std::runtime_error("and again");
  });
  this->wait_verdict(Verdict::reverted);
  EXPECT_FALSE(was_fallback);
  this->wait_seen(*spare_seen, spare_seen->runs + 2);
  EXPECT_TRUE(component.task().has_fallen_back());
  EXPECT_EQ("t/Fallback", component.core_implementation());
}

TYPED_TEST(Probations, AFallbackThatTakesOverEndsIt) {
  Component& component = this->add_trial();
  auto spare = std::make_unique<TrialCore>();
  spare->set_implementation("t/Fallback");
  component.set_fallback(std::move(spare));
  this->deploy();
  this->put_in([](TrialCore&, int) { throw std::runtime_error("unwatched"); }, {.on_fault = false});
  this->wait_verdict(Verdict::inconclusive);
  EXPECT_EQ(Cause::fell_back, this->record().cause);
  EXPECT_EQ("t/Fallback", component.core_implementation());
}

TYPED_TEST(Probations, WhatCannotBeOnProbationIsRefused) {
  Component& component = this->add_trial();
  const auto code = [&](ProbationOptions options, std::string* text = nullptr) {
    return this->code_of([&] { this->put_in([](TrialCore&, int) {}, std::move(options)); }, text);
  };
  this->architecture.configure();
  if constexpr (!TestFixture::is_virtual) {
    EXPECT_EQ(ErrorCode::not_configured, code({})) << "nothing is deployed";
  }
  this->deploy();
  std::string text;
  EXPECT_EQ(ErrorCode::invalid_argument, code({.duration_ns = -1}));
  EXPECT_EQ(ErrorCode::unknown_port, code({.outputs = {{.port = "cmd", .not_nan = true}}}));
  EXPECT_EQ(ErrorCode::invalid_argument, code({.outputs = {{.port = "input", .not_nan = true}}}, &text));
  EXPECT_THAT(text, HasSubstr("write port"));
  EXPECT_EQ(ErrorCode::invalid_argument,
            code({.outputs = {{.port = "output", .field = "x", .not_nan = true}}}));
  EXPECT_EQ(ErrorCode::invalid_argument, code({.outputs = {{.port = "output"}}}, &text));
  EXPECT_THAT(text, HasSubstr("sets no bound"));
  constexpr double kInfinite = std::numeric_limits<double>::infinity();
  for (const auto& [minimum, maximum, words] : std::vector<std::tuple<double, double, const char*>>{
           {kNan, 1.0, "expected a finite minimum, or none, found minimum nan"},
           {0.0, kNan, "found maximum nan"},
           {kInfinite, kInfinite, "found minimum inf"},
           {-kInfinite, 1.0, "found minimum -inf"},
           {0.0, kInfinite, "found maximum inf"},
           {2.0, 1.0, "expected minimum <= maximum, found minimum 2, maximum 1"}}) {
    EXPECT_EQ(ErrorCode::invalid_argument,
              code({.outputs = {{.port = "output", .minimum = minimum, .maximum = maximum}}}, &text));
    EXPECT_THAT(text, HasSubstr(words));
    EXPECT_THAT(text, HasSubstr("component 'c': output output: "));
    EXPECT_THAT(text, HasSubstr("correct the minimum and the maximum"));
  }
  for (const time_ns_t duration : {INT64_MIN, time_ns_t{-1}, kLongest + 1, INT64_MAX}) {
    EXPECT_EQ(ErrorCode::invalid_argument, code({.duration_ns = duration}, &text));
    EXPECT_THAT(text, HasSubstr("duration_ns"));
    EXPECT_THAT(text, HasSubstr("found " + std::to_string(duration)));
  }
  for (const std::int64_t releases : {INT64_MIN, std::int64_t{-5}, std::int64_t{0}}) {
    EXPECT_EQ(ErrorCode::invalid_argument, code({.min_releases = releases}, &text));
    EXPECT_THAT(text, HasSubstr("expected at least 1, found " + std::to_string(releases)));
  }
  Transaction both;
  both.replace_core("c", std::make_unique<TrialCore>(), ProbationOptions{.duration_ns = kLong})
      .replace_shell("c", std::make_unique<TestShell>());
  EXPECT_EQ(ErrorCode::invalid_argument, this->code_of([&] { this->host.commit(std::move(both)); }));
  EXPECT_TRUE((*this->host).probations().empty());
  this->expect_old_core_runs_on(component);
}

TYPED_TEST(Probations, TheTraceShowsTheWayBack) {
  Component& component = this->add_trial();
  this->deploy();
  this->put_in([](TrialCore& core, int run) { core.exposed_shell().output.write({run < 3 ? 1.0 : kNan}); },
               {.outputs = {{.port = "output", .not_nan = true}}});
  this->wait_verdict(Verdict::reverted);
  this->expect_old_core_runs_on(component);
  const TraceDrain drain = this->architecture.drain_trace();
  int ways_back = 0;
  for (const TraceRecord& record : records_of(drain, TraceKind::reconfiguration, component.task().number())) {
    if (TraceNames::word(record.name) == "revert_core t/Old") ++ways_back;
  }
  EXPECT_EQ(1, ways_back);
}

/// Writes at each event.
struct EventFsm : Fsm<TestShell, TestCore> {
  void define() override {
    State& run = execution("Run", "act", &TestCore::act);
    State& pause = wait_event("Pause", shell().input, s_to_ns(1'000), us_to_ns(100));
    set_initial(run);
    next(run, pause);
    next(pause, run);
  }
};

TYPED_TEST(Probations, AComponentThatWaitsForEventsIsReverted) {
  auto& events = this->architecture.template add_resource<SharedData<Number>>("events");
  Component& component = this->architecture.template add_component<TestShell, TrialCore, EventFsm>("c");
  auto& first = component.template core_as<TrialCore>();
  first.set_implementation("t/Old");
  const auto old_seen = first.seen;
  this->architecture.connect("c", "input", "events", "read");
  this->deploy();
  const auto raise = [&](Seen& seen, int runs) {
    this->host.until(
        [&] {
          if (seen.runs >= runs) return true;
          events.write.write({1.0}, this->host.now_ns());
          return false;
        },
        "the event's release");
  };
  raise(*old_seen, 2);
  const auto faulty = this->put_in([](TrialCore&, int run) {
    if (run == 2) throw std::runtime_error("bad");
  });
  raise(*faulty, 2);
  this->wait_verdict(Verdict::reverted);
  raise(*old_seen, old_seen->runs + 2);
  EXPECT_EQ(2, faulty->runs);
  const auto second = this->put_in([](TrialCore&, int) {});
  EXPECT_TRUE((*this->host).revert_probation("c", "within the long wait", s_to_ns(30)));
  raise(*old_seen, old_seen->runs + 2);
  EXPECT_EQ(0, second->runs);
}

/// Each round's core is bad in a random way at a random release, and does not run once more; its neighbours do not notice.
TYPED_TEST(Probations, EachRandomlyBadCoreIsRevertedByTheNextRelease) {
  constexpr int kRounds = TestFixture::is_virtual ? 1'000 : 50;
  Component& component = this->add_trial();
  Component& neighbour = this->add("neighbour", 1, {.offset_ns = kPeriod / 2});
  this->core(neighbour).instants.reserve(200'000);
  this->deploy();
  std::mt19937 random(20261126);
  const auto below = [&random](int limit) {
    return static_cast<int>(random() % static_cast<unsigned>(limit));
  };
  int reverted = 0;
  for (int round = 0; round < kRounds; ++round) {
    const int kind = below(5);
    const int bad_run = 1 + below(5);
    const auto seen = this->put_in(
        [&, kind, bad_run](TrialCore& core, int run) {
          if (run != bad_run) return;
          if (kind == 0) throw std::runtime_error("bad");
          if (kind == 1) throw 7;  // NOLINT: no std::exception
          if (kind == 2) this->overrun(component);
          if (kind == 3) core.exposed_shell().output.write({kNan});
          if (kind == 4) core.exposed_shell().output.write({1e9});
        },
        {.on_overrun = TestFixture::is_virtual || kind == 2,  // a busy machine overruns by itself
         .outputs = {{.port = "output", .minimum = -10.0, .maximum = 10.0}}});
    const int old_runs = this->old_seen->runs;
    this->wait_verdict(Verdict::reverted);
    this->wait_seen(*this->old_seen, old_runs + 2);
    const time_ns_t bad_ns = seen->last_ns;
    const auto& instants = this->old->instants;
    if constexpr (TestFixture::is_virtual) {
      ASSERT_EQ(bad_run, seen->runs) << "round " << round << ", kind " << kind;
      const time_ns_t next_ns = bad_ns + (kind == 2 ? 2 : 1) * kPeriod;
      ASSERT_NE(instants.end(), std::find(instants.begin(), instants.end(), next_ns)) << "round " << round;
    } else if (kind != 2) {
      ASSERT_EQ(bad_run, seen->runs) << "round " << round << ", kind " << kind;
    }
    ASSERT_EQ(ComponentState::running, component.task().state());
    ASSERT_LE(std::abs(this->newest()), 10.0);
    ++reverted;
    this->settle();
    this->wait_cleaned(*seen);
  }
  EXPECT_EQ(kRounds, reverted);
  this->host.shutdown();
  this->expect_untouched(neighbour);
}

class ProbationThreads : public Probations<OnThreads> {};

TEST_F(ProbationThreads, TheWayBackAllocatesNothing) {
  Component& component = add_trial();
  deploy();
  wait_seen(*old_seen, 2);
  host.stop("c");
  const auto seen =
      put_in([&](TrialCore& core, int run) { core.exposed_shell().output.write({run < 3 ? 1.0 : kNan}); },
             {.outputs = {{.port = "output", .not_nan = true}}});
  host.start("c");  // counts from here on
  wait_verdict(Verdict::reverted);
  wait_seen(*old_seen, old_seen->runs + 3);
  EXPECT_EQ(3, seen->runs);
  EXPECT_EQ(0U, component.task().counters().allocations());
}

TEST_F(ProbationThreads, ACoreThatWasStoppedByForceIsOutWhenItsStateEnds) {
  Component& component = add_trial();
  deploy();
  std::atomic<bool> is_open{false};
  const auto seen = put_in([&](TrialCore&, int) {
    while (!is_open) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  });
  wait_seen(*seen, 1);
  EXPECT_TRUE((*host).stop("c", {.timeout_ns = ms_to_ns(10), .force = true}));
  EXPECT_EQ(Verdict::running, record().verdict) << "its thread still executes the new core";
  is_open = true;
  wait_verdict(Verdict::reverted);
  host.until([&] { return component.task().is_parked(); }, "the park");
  EXPECT_EQ(ComponentState::faulted, component.task().state()) << "as the stop has reported";
  EXPECT_THAT(record().reason, HasSubstr("stopped by force"));
  EXPECT_EQ("t/Old", component.core_implementation());
  component.configure_anew();
  host.start("c");
  wait_seen(*old_seen, old_seen->runs + 2);
}

/// Whatever is asked for at once: in the end one core is in, and each other one is cleaned up.
TEST_F(ProbationThreads, ManyChangesAtOnceLeaveOneCore) {
  Component& component = add_trial();
  Component& neighbour = add("neighbour");
  deploy();
  std::mutex mutex;
  std::vector<std::shared_ptr<Seen>> all{old_seen};
  std::atomic<bool> is_over{false};
  const auto tolerate = [](const std::function<void()>& action) {
    try {
      action();
    } catch (const Error&) {  // another one was first
    }
  };
  const auto worker = [&](unsigned seed, const std::function<void(std::mt19937&)>& act) {
    return std::thread([&, seed, act] {
      std::mt19937 random(seed);
      while (!is_over) {
        tolerate([&] { act(random); });
        std::this_thread::sleep_for(std::chrono::microseconds(200 + random() % 2'000));
      }
    });
  };
  std::vector<std::thread> threads;
  for (unsigned seed : {1U, 2U}) {
    threads.push_back(worker(seed, [&](std::mt19937& random) {
      auto core = std::make_unique<TrialCore>();
      const int kind = static_cast<int>(random() % 6);
      const int bad_run = 1 + static_cast<int>(random() % 4);
      core->work = [&component, &own = *core, kind, bad_run] {
        if (own.runs != bad_run) return;
        if (kind == 0) throw std::runtime_error("bad");
        if (kind == 1) own.exposed_shell().output.write({kNan});
        if (kind == 2) overrun(component);
      };
      {
        const std::lock_guard lock(mutex);
        all.push_back(core->seen);
      }
      auto seen = core->seen;
      ProbationOptions options{.duration_ns = ms_to_ns(1 + static_cast<std::int64_t>(random() % 8)),
                               .on_overrun = true,
                               .outputs = {{.port = "output", .not_nan = true}}};
      Transaction change;
      change.set_property("neighbour", "gain", 2.0).replace_core("c", std::move(core), std::move(options));
      host.commit(std::move(change), 0);
    }));
  }
  threads.push_back(worker(3, [&](std::mt19937& random) {
    if (random() % 4 == 0) host.stop("c");
    (*host).start("c");
  }));
  threads.push_back(
      worker(4, [&](std::mt19937& /*random*/) { (*host).revert_probation("c", "asked for", s_to_ns(30)); }));
  threads.push_back(worker(5, [&](std::mt19937& random) {
    (*host).settle_probations();
    for (const ProbationRecord& record : (*host).probations()) EXPECT_EQ("c", record.component);
    component.set_property("gain", static_cast<double>(random() % 10),
                           {.commit_ns = s_to_ns(30), .phase_ns = 0});
  }));
  std::this_thread::sleep_for(std::chrono::milliseconds(1'500));
  is_over = true;
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(ComponentState::running, neighbour.task().state());
  host.shutdown();
  settle();
  int configured = 0;
  for (const auto& seen : all) configured += seen->is_configured && !seen->is_cleaned ? 1 : 0;
  EXPECT_EQ(1, configured) << "of " << all.size();
  EXPECT_GT(all.size(), 20U);
  (*host).deploy();
  tolerate([&] { (*host).start("c"); });
  const auto& last = component.core_as<TrialCore>().seen;
  EXPECT_FALSE(last->is_cleaned);
}

/// A core on probation whose third execution hangs until the doors open.
class ProbationHangs : public ProbationThreads {
 protected:
  static constexpr TaskSettings kSettings{.hung_after_ns = ms_to_ns(100)};

  /// The component as it is by then: not the one that is in the list at last.
  std::shared_ptr<Component> put_in_one_that_hangs(ProbationOptions options = {.duration_ns = ms_to_ns(20)}) {
    deploy();
    wait_seen(*old_seen, 2);
    seen = put_in(
        [doors = doors](TrialCore&, int run) {
          if (run == 3) doors->pass();
        },
        std::move(options));
    wait_until([&] { return doors->entered.load(); }, "the long state");
    return architecture.hold_component("c");
  }
  std::shared_ptr<Component> await_successor(const std::shared_ptr<Component>& hung) {
    wait_until(
        [&] {
          settle();
          EXPECT_NE(Verdict::passed, record().verdict);
          EXPECT_NE(Verdict::inconclusive, record().verdict);
          return architecture.hold_component("c") != hung;
        },
        "another component");
    return architecture.hold_component("c");
  }

  const std::shared_ptr<Doors> doors{std::make_shared<Doors>()};
  std::shared_ptr<Seen> seen;
};

TEST_F(ProbationHangs, TheOldCoreGoesOnByAnotherThread) {
  add_trial("c", kSettings).set_property("gain", 3.0);
  const auto hung = put_in_one_that_hangs();
  const auto component = await_successor(hung);
  wait_state(*component, ComponentState::running);
  EXPECT_EQ(Verdict::reverted, record().verdict);
  EXPECT_THAT(record().reason,
              HasSubstr("hung: state Run of the core on probation did not end; the old core goes on"));
  expect_old_core_runs_on(*component);
  EXPECT_THAT(record().reason, HasSubstr(" ms after the state began")) << "how long it lasted";
  EXPECT_EQ(3.0, component->shell_as<TestShell>().gain.value());
  EXPECT_EQ(1.0, newest()) << "what the old core writes";
  EXPECT_EQ(ComponentState::faulted, hung->task().state());
  EXPECT_FALSE(doors->open) << "it hangs still";
  doors->open = true;
  wait_until([&] { return hung->task().has_ended(); }, "the end of the thread that hung");
  expect_old_core_runs_on(*component);
  EXPECT_EQ(Verdict::reverted, record().verdict);
  (*host).stop("c");
  EXPECT_EQ(0, (old->instants.back() - (*host).epoch_ns()) % kPeriod) << "on the grid of the deployment";
}

/// What the shells of comebacks do when they are configured.
struct ShellOfComebacks : TestShell {
  explicit ShellOfComebacks(std::function<bool()> at_configure) : configures(std::move(at_configure)) {}
  bool configure_hook() override { return configures(); }
  std::function<bool()> configures;
};

/// The change that was to bring the core back has it by then, and gives it to the next one.
TEST_F(ProbationHangs, AComebackThatGoesStaleIsMadeAgain) {
  Component& trial = add_trial("c", kSettings);
  auto spare = std::make_unique<TestCore>();
  spare->set_factory([] { return std::make_unique<TestCore>(); });
  trial.set_fallback(std::move(spare));
  const auto configures = std::make_shared<Doors>();
  trial.shell().set_factory([configures] {
    return std::make_unique<ShellOfComebacks>([configures] {
      configures->pass();
      return true;
    });
  });
  const auto hung = put_in_one_that_hangs({.duration_ns = s_to_ns(20)});
  Transaction addition;
  addition.add_component<TestShell, TestCore, TestFsm>("later");
  const auto first = (*host).prepare(std::move(addition));
  wait_until(
      [&] {
        settle();
        return configures->entered.load();
      },
      "the comeback");
  EXPECT_EQ(PreparedOutcome::committed, first->commit(kLong));
  configures->open = true;
  const auto component = await_successor(hung);
  wait_state(*component, ComponentState::running);
  expect_old_core_runs_on(*component);
  EXPECT_EQ(Verdict::reverted, record().verdict);
  EXPECT_THAT(record().reason, HasSubstr("the old core goes on by another thread"));
  doors->open = true;
  wait_until([&] { return hung->task().has_ended(); }, "the end of the thread that hung");
}

TEST_F(ProbationHangs, TheOldCoreThatCouldNotComeBackIsInAfterACleanup) {
  Component& trial = add_trial("c", kSettings);
  trial.shell().set_factory([] { return std::make_unique<ShellOfComebacks>([] { return false; }); });
  const auto hung = put_in_one_that_hangs({.duration_ns = s_to_ns(20)});
  wait_until(
      [&] {
        settle();
        return record().reason.find("does not go on") != std::string::npos;
      },
      "the comeback");
  EXPECT_EQ(Verdict::reverted, record().verdict);
  doors->open = true;
  wait_until([&] { return hung->task().is_parked(); }, "the end of the state");
  EXPECT_EQ(ComponentState::faulted, hung->task().state());
  const int runs = seen->runs;
  hung->configure_anew();
  (*host).start("c");
  wait_seen(*old_seen, old_seen->runs + 3);
  EXPECT_EQ("t/Old", hung->core_implementation());
  EXPECT_EQ(runs, seen->runs) << "it was reverted";
  EXPECT_EQ(Verdict::reverted, record().verdict);
  wait_cleaned(*seen);
}

TEST_F(ProbationHangs, AnOutputWithMaxSlewGoesOnFromItsLastValue) {
  TaskSettings settings = kSettings;
  settings.max_slew = {{"output.value", 100.0}};  // 0.1 a release
  auto& sink = architecture.add_resource<RingBuffer<Number>>("sink", 1'000'000);
  add_trial("c", settings, "sink");
  const auto component = await_successor(put_in_one_that_hangs());
  wait_seen(*old_seen, old_seen->runs + 30);
  std::vector<double> all;
  Number value;
  time_ns_t time_ns = 0;
  ReaderState reader;
  while (sink.read.read(value, time_ns, reader) == DataStatus::new_data) all.push_back(value.value);
  const auto safe = std::find(all.rbegin(), all.rend(), 0.0).base();
  ASSERT_NE(all.end(), safe) << "from the safe value on";
  EXPECT_NEAR(0.1, *safe, 1e-9);
  EXPECT_EQ(1.0, all.back());
  doors->open = true;
}

TEST_F(ProbationHangs, ItIsOnProbationAgainAndStopped) {
  add_trial("c", kSettings);
  const auto component = await_successor(put_in_one_that_hangs());
  wait_state(*component, ComponentState::running);
  const auto again = put_in([](TrialCore&, int) {});
  wait_seen(*again, 3);
  EXPECT_TRUE((*host).revert_probation("c", "enough", kLong));
  expect_old_core_runs_on(*component);
  (*host).stop("c");
  EXPECT_EQ(ComponentState::stopped, component->task().state());
  doors->open = true;
}

TEST_F(ProbationHangs, AStopThatIsPendingIsCarriedOut) {
  Component& first = add_trial("c", kSettings);
  const auto hung = put_in_one_that_hangs();
  EXPECT_THROW(first.task().stop(0), Error);
  const auto component = await_successor(hung);
  EXPECT_EQ(ComponentState::stopped, component->task().state());
  (*host).start("c");
  expect_old_core_runs_on(*component);
  doors->open = true;
}

/// Of a change that waits in the component's slot: the architecture describes that one.
class ProbationHangsInAChange : public ProbationHangs, public ::testing::WithParamInterface<bool> {
 protected:
  ~ProbationHangsInAChange() override {
    doors->open = agrees->open = true;
    requester.join();
  }

  /// The core on probation hangs after its component has agreed; then the change is made.
  void make(bool replaces_core) {
    deploy();
    wait_seen(*old_seen, 2);
    seen = put_in(
        [this](TrialCore&, int) {
          if (is_to_hang) doors->pass();
        },
        {.duration_ns = s_to_ns(10)});
    wait_seen(*seen, 2);
    struct AdoptingCore : TestCore {
      explicit AdoptingCore(std::shared_ptr<Doors> at) : doors(std::move(at)) {}
      bool adopt(const CoreBase& /*old*/) override {
        doors->pass();
        return true;
      }
      std::shared_ptr<Doors> doors;
    };
    Transaction both;
    both.replace_core("other", std::make_unique<AdoptingCore>(agrees));
    both.set_property("c", "gain", 2.0);
    if (replaces_core) {
      auto next = std::make_unique<TrialCore>();
      next->set_implementation("t/Next");
      both.replace_core("c", std::move(next));
    }
    requester = std::thread([this, change = std::move(both)]() mutable {
      (*host).commit(std::move(change), {.timeouts = {.commit_ns = s_to_ns(2), .phase_ns = 0}});
    });
    wait_until([&] { return agrees->entered.load(); }, "the adopt of the other component");
    wait_seen(*seen, seen->runs + 5);  // it has agreed by then
    is_to_hang = true;
    wait_until([&] { return doors->entered.load(); }, "the long state");
    const std::uint64_t revision = architecture.revision();
    agrees->open = true;
    wait_until([&] { return architecture.revision() != revision; }, "the change");
  }

  const std::shared_ptr<Doors> agrees{std::make_shared<Doors>()};
  std::atomic<bool> is_to_hang{false};
  std::thread requester;
};
INSTANTIATE_TEST_SUITE_P(All, ProbationHangsInAChange, ::testing::Bool(), [](const auto& tested) {
  return std::string(tested.param ? "OfTheCore" : "OfAProperty");
});

TEST_P(ProbationHangsInAChange, TheDecidedChangeIsNotPassedOver) {
  add_trial("c", kSettings);
  add("other", 1);
  make(GetParam());
  const auto component = architecture.hold_component("c");
  const auto is_left_out = [&] {
    settle();
    const auto records = (*host).probations();
    const std::string reason = records.empty() ? "" : records.back().reason;
    return reason.find("does not go on") != std::string::npos ||
           reason.find("another change replaced") != std::string::npos;
  };
  wait_until(is_left_out, "the hang to be found");
  EXPECT_EQ(component, architecture.hold_component("c")) << "the old core does not come back";
  EXPECT_EQ(component, architecture.find_awaited("c")) << "it is late";
  EXPECT_EQ(ComponentState::faulted, component->task().state());
  EXPECT_EQ(GetParam() ? Verdict::inconclusive : Verdict::reverted, record().verdict);
  doors->open = true;
  wait_until([&] { return component->task().is_parked(); }, "the end of the state");
  settle();
  EXPECT_EQ(ComponentState::faulted, component->task().state());
  EXPECT_EQ(GetParam() ? "t/Next" : "t/Old", component->core_implementation());
  EXPECT_EQ(2.0, component->shell_as<TestShell>().gain.value());
  EXPECT_EQ(GetParam() ? Verdict::inconclusive : Verdict::reverted, record().verdict);
  wait_cleaned(*seen);
}

TEST_F(ProbationHangs, TheOldCoreGoesInAtTheEndOfTheStateWhereNoOtherShellCanBeMade) {
  Component& component = add_trial("c", kSettings);
  component.shell().set_factory({});
  put_in_one_that_hangs();
  const auto is_given_up = [&] {
    settle();
    EXPECT_NE(Verdict::passed, record().verdict);
    return component.task().state() == ComponentState::faulted;
  };
  wait_until(is_given_up, "the hang to be found");
  EXPECT_EQ(Verdict::reverted, record().verdict);
  EXPECT_THAT(record().reason, HasSubstr("hung: state Run of the core on probation did not end"));
  EXPECT_EQ(0.0, newest()) << "its output is safe";
  doors->open = true;
  host.until([&] { return component.core_implementation() == "t/Old"; }, "the old core");
  settle();
  EXPECT_EQ(Verdict::reverted, record().verdict);
  wait_state(component, ComponentState::running);
  expect_old_core_runs_on(component);
  wait_cleaned(*seen);
}

TEST_F(ProbationHangs, AStateThatEndsAsItIsGivenUpLeavesOneOldCore) {
  add_trial("c", {.hung_after_ns = ms_to_ns(10)});
  const auto inside = std::make_shared<std::atomic<int>>(0);
  old->work = [inside] {
    EXPECT_EQ(1, ++*inside) << "two threads execute the old core";
    --*inside;
  };
  deploy();
  for (int round = 0; round < 20; ++round) {
    const auto hanging = std::make_shared<Doors>();
    put_in(
        [hanging](TrialCore&, int run) {
          if (run == 2) hanging->pass();
        },
        {.duration_ns = s_to_ns(10)});
    wait_until([&] { return hanging->entered.load(); }, "the long state");
    std::this_thread::sleep_for(std::chrono::milliseconds(9));
    std::thread opens([&] {
      std::this_thread::sleep_for(std::chrono::microseconds(round * 300));
      hanging->open = true;
    });
    wait_until(
        [&] {
          settle();
          if (round % 4 == 0) hanging->open = true;
          const auto records = (*host).probations();
          const bool is_over = !records.empty() && records.back().verdict != Verdict::running;
          const bool is_on_trial = architecture.hold_component("c")->core_implementation() == "t/New";
          return is_over || (is_on_trial && hanging->open && records.back().releases > 5);
        },
        "the end of the state, or the old core");
    opens.join();
    const auto component = architecture.hold_component("c");
    if (component->core_implementation() == "t/New") (*host).revert_probation("c", "next round", kLong);
    const int runs = old_seen->runs;
    wait_until(
        [&] {
          settle();
          return old_seen->runs > runs + 2;
        },
        "the old core");
    EXPECT_EQ(old, &architecture.hold_component("c")->core());
  }
}

TEST_F(ProbationThreads, AStateThatOutlastsTheDurationIsWaitedFor) {
  add_trial();
  deploy();
  wait_seen(*old_seen, 2);
  const auto doors = std::make_shared<Doors>();
  put_in(
      [doors](TrialCore&, int run) {
        if (run != 3) return;
        doors->pass();
        throw std::runtime_error("bad");
      },
      {.duration_ns = ms_to_ns(20)});
  wait_until([&] { return doors->entered.load(); }, "the long state");
  std::this_thread::sleep_for(std::chrono::milliseconds(40));
  settle();
  EXPECT_EQ(Verdict::running, record().verdict) << "nothing is known before it ends";
  doors->open = true;
  host.until([&] { return record().verdict == Verdict::reverted; }, "the verdict");
}

}  // namespace mauve::testing::test_probation
