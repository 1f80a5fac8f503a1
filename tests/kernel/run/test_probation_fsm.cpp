// SPDX-License-Identifier: LGPL-3.0-or-later
// A new fsm and core on probation: both go out as one, and the component keeps its place.
#include <cmath>
#include <random>

#include "probation_fixtures.hpp"

namespace mauve::testing::test_probation_fsm {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

/// The new fsm is compiled for this class, and does not run the old core.
struct NewCore : TrialCore {
  void check() { checks.fetch_add(1); }
  bool fail() { throw std::runtime_error("in a guard"); }
  std::atomic<int> checks{0};
};

/// Check -> Run -> Pause(period_ms) -> Check
struct NewFsm : Fsm<TestShell, NewCore> {
  std::shared_ptr<std::atomic<bool>> is_gone = std::make_shared<std::atomic<bool>>(false);
  ~NewFsm() override { *is_gone = true; }
  void define() override {
    State& check = execution("Check", "check", &NewCore::check);
    State& run = execution("Run", "act", &NewCore::act);
    State& pause = wait("Pause", ms_to_ns(shell().period_ms.value()));
    set_initial(check);
    next(check, run);
    next(run, pause);
    next(pause, check);
  }
};

/// Sense -> Short(first_ns) -> Act -> Long(second_ns) -> Sense, for any core.
struct TwoWaitsFsm : Fsm<TestShell, TestCore> {
  TwoWaitsFsm(std::string first_name, time_ns_t first_ns, std::string second_name, time_ns_t second_ns)
      : first_name_(std::move(first_name)),
        first_ns_(first_ns),
        second_name_(std::move(second_name)),
        second_ns_(second_ns) {}
  void define() override {
    State& sense = execution("Sense", "act", &TestCore::act);
    State& first = wait(first_name_, first_ns_);
    State& act = execution("Act", "act", &TestCore::act);
    State& second = wait(second_name_, second_ns_);
    set_initial(sense);
    next(sense, first);
    next(first, act);
    next(act, second);
    next(second, sense);
  }

 private:
  std::string first_name_;
  time_ns_t first_ns_;
  std::string second_name_;
  time_ns_t second_ns_;
};

std::unique_ptr<TwoWaitsFsm> two_waits() {
  return std::make_unique<TwoWaitsFsm>("Short", kPeriod, "Long", 2 * kPeriod);
}

template <typename Way>
class FsmProbations : public Probations<Way> {
 protected:
  ~FsmProbations() override { this->host.shutdown(); }  // before the note of executions goes

  using Work = std::function<void(TrialCore&, int)>;

  /// Puts in an fsm and a core on probation.
  std::shared_ptr<Seen> put_in_both(std::unique_ptr<FsmBase> fsm, const Work& work,
                                    ProbationOptions options = {}) {
    auto core = std::make_unique<NewCore>();
    core->set_implementation("t/New");
    core->work = [this, &own = *core, work] {
      note(own);
      work(own, own.runs.load());
    };
    auto seen = core->seen;
    if (options.duration_ns == 0) options.duration_ns = kLong;
    Transaction change;
    change.replace_fsm("c", std::move(fsm)).replace_core("c", std::move(core), std::move(options));
    this->host.commit(std::move(change), 0);
    return seen;
  }
  std::shared_ptr<Seen> put_in_both(const Work& work, ProbationOptions options = {}) {
    return put_in_both(std::make_unique<NewFsm>(), work, std::move(options));
  }
  /// The executions of old and new cores, in the order in which they happened; by the component's thread.
  void note(const TrialCore& core) {
    if (executed_ns.size() < executed_ns.capacity()) executed_ns.push_back(core.seen->last_ns);
  }
  Component& add_noted(const TaskSettings& settings = {}) {
    Component& component = this->add_trial("c", settings);
    executed_ns.reserve(100'000);
    this->old->work = [this] {
      note(*this->old);
      this->old->exposed_shell().output.write({1.0});
    };
    return component;
  }
  static std::vector<std::string> state_names(const Component& component) {
    std::vector<std::string> names;
    for (const DescribedState& state : component.described_states()) names.push_back(state.name);
    return names;
  }
  static std::vector<std::string> timed_states(const Component& component) {
    std::vector<std::string> names;
    const auto times = component.state_times();  // keeps them to the end of the loop
    for (const StateTime& time : *times) names.push_back(time.state);
    return names;
  }
  void expect_old_parts_run_on(Component& component) {
    this->expect_old_core_runs_on(component);
    this->settle();
    EXPECT_THAT(state_names(component), ElementsAre("Run", "Pause"));
    EXPECT_THAT(timed_states(component), ElementsAre("Run"));
  }
  /// Each instant was executed once; only in virtual time no instant is skipped.
  void expect_no_release_lost(int but = 0) {
    this->host.shutdown();
    int lost = 0;
    for (std::size_t i = 1; i < executed_ns.size(); ++i) {
      const time_ns_t step_ns = executed_ns[i] - executed_ns[i - 1];
      ASSERT_EQ(0, step_ns % kPeriod);
      ASSERT_GT(step_ns, 0);
      lost += static_cast<int>(step_ns / kPeriod) - 1;
    }
    if constexpr (Probations<Way>::is_virtual) {
      EXPECT_EQ(but, lost);
    }
  }

  std::vector<time_ns_t> executed_ns;
};
TYPED_TEST_SUITE(FsmProbations, EveryHost, HostNames);

TYPED_TEST(FsmProbations, AnFsmAndACoreWithoutViolationPass) {
  Component& component = this->add_noted();
  this->deploy();
  this->wait_seen(*this->old_seen, 2);
  auto fsm = std::make_unique<NewFsm>();
  const auto is_gone = fsm->is_gone;
  const auto seen = this->put_in_both(std::move(fsm), [](TrialCore&, int) {},
                                      {.duration_ns = ms_to_ns(20), .min_releases = 3});
  EXPECT_THAT(this->state_names(component), ElementsAre("Check", "Run", "Pause"));
  this->wait_seen(*seen, 4);
  EXPECT_FALSE(this->old_seen->is_cleaned);
  this->host.until(
      [&] {
        this->settle();
        return this->record().verdict != Verdict::running;
      },
      "the end");
  EXPECT_EQ(Verdict::passed, this->record().verdict);
  this->wait_cleaned(*this->old_seen);
  EXPECT_FALSE(*is_gone);
  EXPECT_THAT(this->state_names(component), ElementsAre("Check", "Run", "Pause"));
  this->wait_seen(*seen, seen->runs + 3);
  this->expect_no_release_lost();
}

TYPED_TEST(FsmProbations, AFaultPutsBothBack) {
  Component& component = this->add_noted();
  this->deploy();
  this->wait_seen(*this->old_seen, 2);
  const int runs_before = this->old->runs;
  auto fsm = std::make_unique<NewFsm>();
  const auto is_gone = fsm->is_gone;
  const auto seen = this->put_in_both(std::move(fsm), [](TrialCore&, int run) {
    if (run == 3) throw std::runtime_error("division by zero");
  });
  this->wait_verdict(Verdict::reverted);
  this->expect_old_core_runs_on(component);
  EXPECT_FALSE(*is_gone) << "not by the component's own thread";
  this->expect_old_parts_run_on(component);
  wait_until([&] { return is_gone->load(); }, "the last holder of the fsm");
  this->wait_cleaned(*seen);
  EXPECT_EQ(3, seen->runs);
  EXPECT_GT(this->old->runs, runs_before) << "it has its state of before";
  EXPECT_EQ("fault: division by zero in state Run", this->record().reason);
  this->expect_no_release_lost();
}

/// Its guard fails when the wait has ended.
struct BadGuardFsm : Fsm<TestShell, NewCore> {
  void define() override {
    State& run = execution("Run", "act", &NewCore::act);
    State& pause = wait("Pause", kPeriod);
    set_initial(run);
    next(run, pause);
    transition(pause, "is_bad", &NewCore::fail, run);
    next(pause, run);
  }
};

TYPED_TEST(FsmProbations, AFaultInAGuardOfAWaitPutsBothBack) {
  Component& component = this->add_noted();
  this->deploy();
  this->wait_seen(*this->old_seen, 2);
  const auto seen = this->put_in_both(std::make_unique<BadGuardFsm>(), [](TrialCore&, int) {});
  this->wait_verdict(Verdict::reverted);
  this->expect_old_parts_run_on(component);
  EXPECT_EQ("fault: in a guard in state Pause", this->record().reason);
}

TYPED_TEST(FsmProbations, AnOverrunPutsBothBackWithinTheWait) {
  Component& component = this->add_noted();
  this->deploy();
  this->wait_seen(*this->old_seen, 2);
  const auto seen = this->put_in_both(
      [&](TrialCore&, int run) {
        if (run == 3) this->overrun(component);
      },
      {.on_fault = false, .on_overrun = true});
  this->wait_verdict(Verdict::reverted);
  this->expect_old_parts_run_on(component);
  EXPECT_LE(seen->runs, 3) << "a slow machine may overrun sooner";
  EXPECT_EQ(Cause::overrun, this->record().cause);
  this->expect_no_release_lost(1);  // the one that the overrun has skipped
}

TYPED_TEST(FsmProbations, AnOutputBeyondItsLimitPutsBothBack) {
  Component& component = this->add_noted();
  Component& neighbour = this->add("neighbour", 1, {.offset_ns = kPeriod / 2});
  this->core(neighbour).instants.reserve(100'000);
  this->deploy();
  this->wait_seen(*this->old_seen, 2);
  const auto seen = this->put_in_both(
      [](TrialCore& core, int run) { core.exposed_shell().output.write({run < 3 ? 5.0 : kNan}); },
      {.outputs = {{.port = "output", .not_nan = true}}});
  this->wait_verdict(Verdict::reverted);
  EXPECT_FALSE(std::isnan(this->newest()));
  this->expect_old_parts_run_on(component);
  EXPECT_EQ(3, seen->runs);
  EXPECT_EQ(Cause::output, this->record().cause);
  this->expect_no_release_lost();
  this->expect_untouched(neighbour);
}

TYPED_TEST(FsmProbations, ARequestPutsBothBack) {
  Component& component = this->add_noted();
  this->deploy();
  const auto seen = this->put_in_both([](TrialCore&, int) {});
  this->wait_seen(*seen, 2);
  EXPECT_TRUE((*this->host).revert_probation("c", "rule too_warm", s_to_ns(30)));
  const int runs = seen->runs;
  this->expect_old_parts_run_on(component);
  EXPECT_EQ(runs, seen->runs);
  EXPECT_EQ("rule too_warm", this->record().reason);
  this->expect_no_release_lost();
}

TYPED_TEST(FsmProbations, ARequestPutsBothBackIntoAStoppedComponent) {
  Component& component = this->add_noted();
  this->deploy();
  const auto seen = this->put_in_both([](TrialCore&, int) {});
  this->wait_seen(*seen, 2);
  this->host.stop("c");
  EXPECT_TRUE((*this->host).revert_probation("c", "while it is stopped"));
  EXPECT_EQ(ComponentState::stopped, component.task().state());
  this->host.start("c");
  this->expect_old_parts_run_on(component);
}

TYPED_TEST(FsmProbations, BeforeTheFirstReleaseTheOldFsmStartsAtTheSameInstant) {
  Component& component = this->add_noted();
  this->deploy();
  const auto seen = this->put_in_both([](TrialCore&, int) {});
  EXPECT_TRUE((*this->host).revert_probation("c", "at once", s_to_ns(30)));
  if constexpr (TestFixture::is_virtual) {
    EXPECT_EQ(0, seen->runs);
    EXPECT_EQ(0, this->old_seen->runs);
  }
  this->expect_old_parts_run_on(component);
  const time_ns_t epoch_ns = (*this->host).epoch_ns();
  this->expect_no_release_lost();
  ASSERT_FALSE(this->executed_ns.empty());
  if constexpr (TestFixture::is_virtual) {
    EXPECT_EQ(epoch_ns, this->executed_ns.front());
  }
}

/// In either wait, in virtual time at each of many instants: the executions go on as if nothing had happened.
TYPED_TEST(FsmProbations, ThePlaceIsKeptBothWays) {
  Component& component = this->add_noted();
  this->deploy();
  Transaction change;
  change.replace_fsm("c", two_waits());
  this->host.commit(std::move(change), 0);
  this->wait_seen(*this->old_seen, this->old_seen->runs + 3);
  std::mt19937 random(7);
  const std::size_t from = TestFixture::is_virtual ? this->executed_ns.size() : 0;
  for (int round = 0; round < 40; ++round) {
    const auto seen = this->put_in_both(two_waits(), [](TrialCore&, int) {});
    if constexpr (TestFixture::is_virtual) {
      this->host.run_for(us_to_ns(100) * static_cast<time_ns_t>(random() % 70));
    } else {
      this->wait_seen(*seen, 1 + static_cast<int>(random() % 2));
    }
    EXPECT_TRUE((*this->host).revert_probation("c", "", s_to_ns(30)));
    this->wait_seen(*this->old_seen, this->old_seen->runs + 1 + static_cast<int>(random() % 2));
    this->settle();
  }
  EXPECT_THAT(this->state_names(component), ElementsAre("Sense", "Short", "Act", "Long"));
  this->host.shutdown();
  if constexpr (TestFixture::is_virtual) {
    const auto& all = this->executed_ns;
    ASSERT_GT(all.size(), from + 80);
    for (std::size_t i = from + 1; i < all.size(); ++i) {
      const time_ns_t expected_ns = all[i - 1] - all[i - 2] == kPeriod ? 2 * kPeriod : kPeriod;
      ASSERT_EQ(expected_ns, all[i] - all[i - 1]) << "execution " << i;
    }
  }
}

/// The new core fails in either execution state: the old fsm goes on in its initial state, at an instant of its grid.
TYPED_TEST(FsmProbations, AfterAFaultTheOldFsmStartsInItsInitialState) {
  Component& component = this->add_noted();
  this->deploy();
  Transaction change;
  change.replace_fsm("c", two_waits());
  this->host.commit(std::move(change), 0);
  this->wait_seen(*this->old_seen, this->old_seen->runs + 3);
  for (int bad_run = 1; bad_run <= 6; ++bad_run) {
    const auto seen = this->put_in_both(two_waits(), [bad_run](TrialCore&, int run) {
      if (run == bad_run) throw std::runtime_error("bad");
    });
    this->wait_verdict(Verdict::reverted);
    const int runs = this->old_seen->runs;
    this->wait_seen(*this->old_seen, runs + 3);
    EXPECT_EQ(bad_run, seen->runs);
    this->settle();
    if constexpr (TestFixture::is_virtual) {
      const auto& all = this->executed_ns;
      const auto bad = std::find(all.begin(), all.end(), seen->last_ns.load());
      ASSERT_LT(bad + 2, all.end());
      const time_ns_t place_ns = (*(bad + 1) - (*this->host).epoch_ns()) % (3 * kPeriod);
      EXPECT_EQ(0, place_ns) << "bad run " << bad_run;
      EXPECT_LE(*(bad + 1) - *bad, 3 * kPeriod);
      EXPECT_EQ(kPeriod, *(bad + 2) - *(bad + 1));
    }
  }
  EXPECT_EQ(ComponentState::running, component.task().state());
}

TYPED_TEST(FsmProbations, AnotherFsmAndCoreEndItInconclusive) {
  Component& component = this->add_noted();
  this->deploy();
  auto fsm = std::make_unique<NewFsm>();
  const auto is_gone = fsm->is_gone;
  const auto first = this->put_in_both(std::move(fsm), [](TrialCore&, int) {});
  this->wait_seen(*first, 2);
  const auto second = this->put_in_both([](TrialCore&, int run) {
    if (run == 2) throw std::runtime_error("bad");
  });
  const auto all = (*this->host).probations();
  ASSERT_EQ(2U, all.size());
  EXPECT_EQ(Cause::replaced, all[0].cause);
  this->wait_cleaned(*this->old_seen);
  this->wait_seen(*second, 2);
  this->wait_verdict(Verdict::reverted);
  this->wait_seen(*first, first->runs + 2);
  this->settle();
  EXPECT_FALSE(*is_gone) << "it is the old fsm now";
  this->wait_cleaned(*second);
  EXPECT_THAT(this->state_names(component), ElementsAre("Check", "Run", "Pause"));
}

TYPED_TEST(FsmProbations, ACoreAloneEndsItAndLeavesTheNewFsm) {
  Component& component = this->add_noted();
  this->deploy();
  const auto first = this->put_in_both([](TrialCore&, int) {});
  this->wait_seen(*first, 2);
  auto core = std::make_unique<NewCore>();
  core->work = [] { throw std::runtime_error("bad"); };
  const auto second = core->seen;
  Transaction change;
  change.replace_core("c", std::move(core), ProbationOptions{.duration_ns = kLong});
  this->host.commit(std::move(change), 0);
  this->wait_cleaned(*this->old_seen);
  this->wait_verdict(Verdict::reverted);
  this->wait_seen(*first, first->runs + 2);
  EXPECT_EQ(1, second->runs);
  EXPECT_THAT(this->state_names(component), ElementsAre("Check", "Run", "Pause"));
}

TYPED_TEST(FsmProbations, AChangeForTheNewFsmIsRefusedAfterARevert) {
  Component& component = this->add_noted();
  this->deploy();
  const auto seen = this->put_in_both([](TrialCore&, int) {});
  Transaction core_steps;
  core_steps.replace_core("c", std::make_unique<NewCore>());
  const auto prepared = (*this->host).prepare(std::move(core_steps));
  EXPECT_TRUE((*this->host).revert_probation("c", "", s_to_ns(30)));
  EXPECT_EQ(PreparedOutcome::refused, prepared->commit(s_to_ns(30)));
  this->settle();
  EXPECT_EQ(PreparedOutcome::stale, prepared->commit(s_to_ns(30)));
  this->expect_old_parts_run_on(component);
}

TYPED_TEST(FsmProbations, AFallbackIsMadeReadyForTheOldFsmAgain) {
  Component& component = this->add_noted();
  auto spare = std::make_unique<NewCore>();
  spare->set_implementation("t/Fallback");
  const auto spare_seen = spare->seen;
  component.set_fallback(std::move(spare));
  std::atomic<bool> is_broken{false};
  this->old->work = [&] {
    if (is_broken) throw std::runtime_error("the old one, too");
  };
  this->deploy();
  this->put_in_both([](TrialCore&, int) { throw std::runtime_error("the new one"); });
  this->wait_verdict(Verdict::reverted);
  EXPECT_EQ(0, spare_seen->runs);
  this->expect_old_parts_run_on(component);
  is_broken = true;
  this->wait_seen(*spare_seen, 2);
  EXPECT_TRUE(component.task().has_fallen_back());
  EXPECT_THAT(this->state_names(component), ElementsAre("Run", "Pause"));
}

TYPED_TEST(FsmProbations, AFactoryGoesBackWithItsFsm) {
  Component& component = this->add_noted();
  this->deploy();
  const auto seen = this->put_in_both([](TrialCore&, int) {});
  EXPECT_EQ(nullptr, component.fsm().another()) << "an instance was given";
  EXPECT_TRUE((*this->host).revert_probation("c", "", s_to_ns(30)));
  EXPECT_NE(nullptr, component.fsm().another());
  Transaction change;
  change.replace_shell("c", std::make_unique<TestShell>());
  this->host.commit(std::move(change), 0);
  this->expect_old_parts_run_on(component);
}

TYPED_TEST(FsmProbations, ARemovedComponentsPartsAreAllRetired) {
  this->add_noted();
  this->deploy();
  auto fsm = std::make_unique<NewFsm>();
  const auto is_gone = fsm->is_gone;
  const auto seen = this->put_in_both(std::move(fsm), [](TrialCore&, int) {});
  EXPECT_TRUE((*this->host).revert_probation("c", "", s_to_ns(30)));
  Transaction change;
  change.remove_component("c");
  this->host.commit(std::move(change), 0);
  wait_until([&] { return is_gone->load(); }, "the last holder of the fsm");
  this->wait_cleaned(*this->old_seen);
  this->wait_cleaned(*seen);
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

/// Never enters its initial state again.
struct WarmUpFsm : Fsm<TestShell, TestCore> {
  void define() override {
    State& warm_up = execution("WarmUp", "act", &TestCore::act);
    State& run = execution("Run", "act", &TestCore::act);
    State& pause = wait("Pause", kPeriod);
    set_initial(warm_up);
    next(warm_up, run);
    next(run, pause);
    next(pause, run);
  }
};

TYPED_TEST(FsmProbations, FsmsThatDoNotKeepThePlaceAreRefused) {
  Component& component = this->add_noted();
  this->deploy();
  this->wait_seen(*this->old_seen, 1);
  const auto refusal = [&](std::unique_ptr<FsmBase> fsm) {
    std::string text;
    EXPECT_EQ(ErrorCode::prepare_failed,
              this->code_of([&] { this->put_in_both(std::move(fsm), [](TrialCore&, int) {}); }, &text));
    return text;
  };
  EXPECT_THAT(refusal(std::make_unique<EventFsm>()), HasSubstr("the event wait Pause"));
  EXPECT_THAT(refusal(two_waits()), HasSubstr("the same period"));
  EXPECT_THAT(refusal(std::make_unique<TwoWaitsFsm>("Pause", kPeriod, "Rest", 2 * kPeriod)),
              HasSubstr("the same period"));
  EXPECT_THAT(refusal(std::make_unique<WarmUpFsm>()), HasSubstr("no fixed place"));
  this->expect_old_parts_run_on(component);
  const auto replace_fsm = [&](std::unique_ptr<FsmBase> fsm) {
    Transaction change;
    change.replace_fsm("c", std::move(fsm));
    this->host.commit(std::move(change), 0);
  };
  replace_fsm(two_waits());
  EXPECT_THAT(refusal(std::make_unique<TwoWaitsFsm>("Short", kPeriod, "Rest", 2 * kPeriod)),
              HasSubstr("no wait of that name"));
  EXPECT_THAT(refusal(std::make_unique<TwoWaitsFsm>("Short", 2 * kPeriod, "Long", kPeriod)),
              HasSubstr("wait Short"));
  replace_fsm(std::make_unique<EventFsm>());
  EXPECT_THAT(refusal(std::make_unique<TestFsm>()), HasSubstr("the old fsm"));
  EXPECT_TRUE((*this->host).probations().empty());
}

TYPED_TEST(FsmProbations, OtherChangesOfTheSameTransactionAreRefused) {
  Component& component = this->add_noted();
  this->deploy();
  const auto code = [&](const std::function<void(Transaction&)>& more) {
    Transaction change;
    change.replace_fsm("c", std::make_unique<NewFsm>())
        .replace_core("c", std::make_unique<NewCore>(), ProbationOptions{.duration_ns = kLong});
    more(change);
    return this->code_of([&] { this->host.commit(std::move(change)); });
  };
  EXPECT_EQ(ErrorCode::structural_property,
            code([](Transaction& change) { change.set_property("c", "period_ms", std::int64_t{2}); }));
  EXPECT_EQ(ErrorCode::invalid_argument,
            code([](Transaction& change) { change.replace_shell("c", std::make_unique<TestShell>()); }));
  this->expect_old_parts_run_on(component);
}

/// Each round's fsm and core are bad in a random way at a random release, and do not run once more.
TYPED_TEST(FsmProbations, EachRandomlyBadFsmAndCoreAreRevertedByTheNextRelease) {
  constexpr int kRounds = TestFixture::is_virtual ? 100 : 30;
  Component& component = this->add_noted();
  Component& neighbour = this->add("neighbour", 1, {.offset_ns = kPeriod / 2});
  this->core(neighbour).instants.reserve(100'000);
  this->deploy();
  std::mt19937 random(20261127);
  int reverted = 0;
  int overruns = 0;
  for (int round = 0; round < kRounds; ++round) {
    const int kind = static_cast<int>(random() % 5);
    const int bad_run = 1 + static_cast<int>(random() % 5);
    const auto seen = this->put_in_both(
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
    overruns += kind == 2 ? 1 : 0;
    this->wait_verdict(Verdict::reverted);
    this->wait_seen(*this->old_seen, this->old_seen->runs + 2);
    if (TestFixture::is_virtual || kind != 2) {
      ASSERT_EQ(bad_run, seen->runs) << "round " << round << ", kind " << kind;
    }
    ASSERT_EQ(ComponentState::running, component.task().state());
    ASSERT_LE(std::abs(this->newest()), 10.0);
    this->settle();
    this->wait_cleaned(*seen);
    ASSERT_THAT(this->state_names(component), ElementsAre("Run", "Pause"));
    ++reverted;
  }
  EXPECT_EQ(kRounds, reverted);
  this->expect_no_release_lost(overruns);
  this->expect_untouched(neighbour);
}

class FsmProbationThreads : public FsmProbations<OnThreads> {};

TEST_F(FsmProbationThreads, TheWayBackAllocatesNothing) {
  Component& component = add_noted();
  deploy();
  wait_seen(*old_seen, 2);
  host.stop("c");
  const auto seen = put_in_both(
      [&](TrialCore& core, int run) { core.exposed_shell().output.write({run < 3 ? 1.0 : kNan}); },
      {.outputs = {{.port = "output", .not_nan = true}}});
  host.start("c");  // counts from here on
  wait_verdict(Verdict::reverted);
  wait_seen(*old_seen, old_seen->runs + 3);
  EXPECT_EQ(3, seen->runs);
  EXPECT_EQ(0U, component.task().counters().allocations());
}

/// Changes, requests and readers of the fsm at once: in the end one fsm and one core are in.
TEST_F(FsmProbationThreads, ManyChangesAndReadersAtOnceLeaveOneFsm) {
  Component& component = add_noted();
  deploy();
  std::atomic<bool> is_over{false};
  const auto worker = [&](unsigned seed, const std::function<void(std::mt19937&)>& act) {
    return std::thread([&, seed, act] {
      std::mt19937 random(seed);
      while (!is_over) {
        try {
          act(random);
        } catch (const Error&) {  // another one was first
        }
        std::this_thread::sleep_for(std::chrono::microseconds(200 + random() % 2'000));
      }
    });
  };
  std::atomic<int> changes{0};
  std::vector<std::thread> threads;
  for (unsigned seed : {1U, 2U}) {
    threads.push_back(worker(seed, [&](std::mt19937& random) {
      const int kind = static_cast<int>(random() % 5);
      const int bad_run = 1 + static_cast<int>(random() % 4);
      const auto work = [&component, kind, bad_run](TrialCore& core, int run) {
        if (run != bad_run) return;
        if (kind == 0) throw std::runtime_error("bad");
        if (kind == 1) core.exposed_shell().output.write({kNan});
        if (kind == 2) overrun(component);
      };
      put_in_both(work, {.duration_ns = ms_to_ns(1 + static_cast<std::int64_t>(random() % 8)),
                         .on_overrun = true,
                         .outputs = {{.port = "output", .not_nan = true}}});
      ++changes;
    }));
  }
  threads.push_back(worker(3, [&](std::mt19937& random) {
    if (component.task().state() == ComponentState::faulted) {  // bad after the end of its probation
      Transaction repair;
      repair.configure("c");
      host.commit(std::move(repair), 0);
    }
    if (random() % 4 == 0) host.stop("c");
    (*host).start("c");
  }));
  threads.push_back(
      worker(4, [&](std::mt19937& /*random*/) { (*host).revert_probation("c", "asked for", s_to_ns(30)); }));
  threads.push_back(worker(5, [&](std::mt19937& random) {
    (*host).settle_probations();
    component.set_property("gain", static_cast<double>(random() % 10),
                           {.commit_ns = s_to_ns(30), .phase_ns = 0});
  }));
  threads.push_back(worker(6, [&](std::mt19937& /*random*/) {
    EXPECT_FALSE(component.described_states().empty());
    EXPECT_FALSE(timed_states(component).empty());
    EXPECT_FALSE(component.shown().shell.empty() && component.shown().core.empty());
  }));
  host.until([&] { return changes > 300; }, "the changes");
  is_over = true;
  for (std::thread& thread : threads) thread.join();
  host.shutdown();
  settle();
  const bool is_new = dynamic_cast<const NewFsm*>(&component.fsm()) != nullptr;
  EXPECT_EQ(is_new, dynamic_cast<const NewCore*>(&component.core()) != nullptr) << "they go as one";
  EXPECT_EQ(is_new ? "Check" : "Run", state_names(component).front());
}

}  // namespace mauve::testing::test_probation_fsm
