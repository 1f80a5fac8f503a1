// SPDX-License-Identifier: LGPL-3.0-or-later
// Rule 7: a new fsm goes on in the wait of the same name; else it starts at the pending instant where that lies on its own
// grid, else at the first of its grid after it; the report says what that cost.
#include <algorithm>
#include <random>

#include "simulated.hpp"

namespace mauve::testing::test_rule7_restart {

/// A chain of waits, with an activation before each.
struct ChainFsm : Fsm<TestShell, TestCore> {
  explicit ChainFsm(std::vector<time_ns_t> waits) : waits_(std::move(waits)) {}

  void define() override {
    State* first = nullptr;
    State* before = nullptr;
    for (std::size_t i = 0; i < waits_.size(); ++i) {
      State& run = execution("Run" + std::to_string(i), "act", &TestCore::act);
      State& pause = wait("Wait" + std::to_string(i), waits_[i]);
      next(run, pause);
      if (before != nullptr) next(*before, run);
      if (first == nullptr) first = &run;
      before = &pause;
    }
    next(*before, *first);
    set_initial(*first);
  }

 private:
  std::vector<time_ns_t> waits_;
};

/// Once through a wait that no cycle passes, then a loop.
struct LeadInFsm : Fsm<TestShell, TestCore> {
  void define() override {
    State& begin = execution("Begin", "act", &TestCore::act);
    State& lead = wait("Lead", ms_to_ns(13));
    State& run = execution("Run", "act", &TestCore::act);
    State& pause = wait("Pause", ms_to_ns(10));
    set_initial(begin);
    next(begin, lead);
    next(lead, run);
    next(run, pause);
    next(pause, run);
  }
};

struct EventFsm : Fsm<TestShell, TestCore> {
  explicit EventFsm(std::string name = "Event") : name_(std::move(name)) {}

  void define() override {
    State& run = execution("Run", "act", &TestCore::act);
    State& pause = wait_event(name_, shell().input, s_to_ns(10), us_to_ns(1));
    set_initial(run);
    next(run, pause);
    next(pause, run);
  }

 private:
  std::string name_;
};

std::unique_ptr<ChainFsm> chain_ms(const std::vector<std::int64_t>& waits_ms) {
  std::vector<time_ns_t> waits;
  for (const std::int64_t wait_ms : waits_ms) waits.push_back(ms_to_ns(wait_ms));
  return std::make_unique<ChainFsm>(std::move(waits));
}

class Rule7Restart : public Simulated {
 protected:
  void SetUp() override {
    add("c", 1);
    deploy();
  }
  /// Replaces the fsm at an instant; the next release comes in the same call.
  StepReport replace(time_ns_t at_ns, std::unique_ptr<FsmBase> fsm) {
    run_to(at_ns);
    host().drain_trace();
    Transaction transaction;
    transaction.replace_fsm("c", std::move(fsm));
    auto report = host().commit(std::move(transaction));
    return report.steps.front();
  }
  Component& component() { return architecture.component("c"); }
  time_ns_t due_ns() { return component().task().due_ns() - simulation.epoch_ns(); }
};

TEST_F(Rule7Restart, ThePendingInstantIsTakenWhenItIsOnTheNewGrid) {
  const StepReport equal = replace(us_to_ns(9'990), chain_ms({1}));  // no margin is needed in flight
  EXPECT_EQ(ms_to_ns(10), due_ns());
  EXPECT_EQ(0, equal.missed_releases);
  EXPECT_EQ("", equal.remark);
  const StepReport longer = replace(us_to_ns(19'500), chain_ms({10}));
  EXPECT_EQ(ms_to_ns(20), due_ns());
  EXPECT_EQ(0, longer.missed_releases);
  const StepReport shorter = replace(us_to_ns(25'000), chain_ms({2}));
  EXPECT_EQ(ms_to_ns(30), due_ns()) << "not before the instant that was pending";
  EXPECT_EQ(0, shorter.missed_releases);
  EXPECT_EQ(0, shorter.phase_nominal_ns);
}

TEST_F(Rule7Restart, ElseTheFirstOfTheNewGridAndTheReportSaysWhatThatCost) {
  const StepReport report = replace(us_to_ns(2'500), chain_ms({10}));
  EXPECT_EQ(ms_to_ns(10), due_ns());
  EXPECT_EQ(7, report.missed_releases) << "3, 4, 5, 6, 7, 8 and 9 ms";
  EXPECT_THAT(report.remark, ::testing::HasSubstr("10000 us"));
  const StepReport between = replace(ms_to_ns(15), chain_ms({7}));
  EXPECT_EQ(ms_to_ns(21), due_ns());
  EXPECT_EQ(1, between.missed_releases) << "20 ms";
  EXPECT_EQ(0, between.phase_nominal_ns);
}

TEST_F(Rule7Restart, AStartOnAClockOfItsOwnIsAsFromAParkAndNeverCountsBelowZero) {
  replace(us_to_ns(500), chain_ms({100}));
  run_to(ms_to_ns(150));
  Transaction transaction;
  transaction.stop("c").replace_fsm("c", chain_ms({10}));
  transaction.start("c", simulation.epoch_ns() + ms_to_ns(3));
  const auto report = host().commit(std::move(transaction));
  EXPECT_EQ(ms_to_ns(153), due_ns());
  EXPECT_EQ(0, report.steps.front().missed_releases) << "153 ms comes before 200 ms, which was pending";
  EXPECT_EQ(0, report.steps.front().phase_nominal_ns) << "the grid is the one that was asked for";
}

TEST_F(Rule7Restart, AStopAndAStartInOneTransactionKeepThePendingInstant) {
  run_to(us_to_ns(4'900));
  Transaction transaction;
  transaction.stop("c").start("c");
  const auto report = host().commit(std::move(transaction));
  EXPECT_EQ(ms_to_ns(5), due_ns());
  EXPECT_EQ(0, report.steps.front().missed_releases);
}

TEST_F(Rule7Restart, WithoutAGridItStartsAtThePendingInstantAndFromAnEventNow) {
  EXPECT_EQ(0, replace(us_to_ns(2'500), std::make_unique<EventFsm>()).missed_releases);
  EXPECT_EQ(ms_to_ns(3), due_ns());
  run_to(us_to_ns(3'500));
  EXPECT_EQ(ms_to_ns(3) + s_to_ns(10), due_ns()) << "it waits for an event";
  EXPECT_EQ(0, replace(us_to_ns(4'500), std::make_unique<EventFsm>("Other")).missed_releases);
  EXPECT_EQ(us_to_ns(4'500), due_ns());
  run_to(us_to_ns(4'600));
  EXPECT_EQ(0, replace(us_to_ns(4'700), chain_ms({2})).missed_releases);
  EXPECT_EQ(ms_to_ns(6), due_ns());
}

TEST_F(Rule7Restart, ThePhaseIsThatOfTheStateWhateverWaitItLeaves) {
  replace(us_to_ns(500), chain_ms({4, 6, 5}));
  for (const time_ns_t at_ms : {16, 20, 26, 31}) {  // pending: after 4 ms, 6 ms, 5 ms, 4 ms
    run_to(ms_to_ns(at_ms));
    Transaction transaction;
    transaction.replace_core("c", std::make_unique<TestCore>());
    const auto report = host().commit(std::move(transaction));
    EXPECT_EQ(0, report.steps.front().phase_nominal_ns) << "at " << at_ms << " ms";
    EXPECT_EQ(0, report.steps.front().missed_releases);
  }
  replace(ms_to_ns(31), std::make_unique<LeadInFsm>());
  EXPECT_EQ(ms_to_ns(40), due_ns());
  host().drain_trace();
  run_to(ms_to_ns(80));
  const auto releases = records_of(host().drain_trace(), TraceKind::release);
  ASSERT_EQ(4U, releases.size());
  const Grid& grid = component().task().grid();
  for (const TraceRecord& release : releases) EXPECT_EQ(0, grid.phase_error(release.a - release.c));
  EXPECT_EQ(0, releases[0].c);
  EXPECT_EQ(ms_to_ns(3), releases[1].c) << "after 13 ms, on a grid of 10";
}

TEST_F(Rule7Restart, AnFsmThatHasTheWaitGoesOnInItsPlace) {
  replace(us_to_ns(500), chain_ms({4, 6, 5}));
  std::vector<std::string> entered;
  auto& core = component().core_as<TestCore>();
  core.work = [&] { entered.push_back(component().task().current_state()); };
  const StepReport first =
      replace(ms_to_ns(17), chain_ms({4, 6, 5}));  // 15, and pending: 19, the end of Wait0
  EXPECT_EQ(ms_to_ns(19), due_ns());
  EXPECT_EQ(0, first.missed_releases);
  EXPECT_EQ(0, first.phase_nominal_ns);
  EXPECT_TRUE(records_of(host().drain_trace(), TraceKind::start).empty());
  replace(ms_to_ns(20),
          chain_ms({1, 9, 20}));  // pending: 25, which is 10 after 15, and 15 + 15 on a grid of 30
  EXPECT_EQ(ms_to_ns(30), due_ns()) << "15 is not on the grid of 30: it restarts at the first after 25";
  run_to(ms_to_ns(61));
  EXPECT_EQ((std::vector<std::string>{"Run0", "Run1", "Run0", "Run1", "Run2", "Run0", "Run1"}), entered);
}

TEST_F(Rule7Restart, AnEventWaitOfTheSameNameGoesOnToo) {
  replace(us_to_ns(2'500), std::make_unique<EventFsm>());
  run_to(us_to_ns(3'500));
  const int runs = component().core_as<TestCore>().runs;
  replace(us_to_ns(4'500), std::make_unique<EventFsm>());
  EXPECT_EQ(ms_to_ns(3) + s_to_ns(10), due_ns()) << "it still waits";
  run_to(us_to_ns(9'500));
  EXPECT_EQ(runs, component().core_as<TestCore>().runs);
}

TEST_F(Rule7Restart, NoReleaseOfAnFsmWithSeveralWaitsIsLostInAnySwap) {
  replace(us_to_ns(500), chain_ms({4, 6, 5}));
  auto& core = component().core_as<TestCore>();
  core.instants.clear();
  core.instants.reserve(1000);
  std::minstd_rand random(7);
  time_ns_t at = ms_to_ns(16);
  for (int swap = 0; swap < 300; ++swap) {
    at += static_cast<time_ns_t>(random() % static_cast<unsigned>(ms_to_ns(7)));
    EXPECT_EQ(0, replace(at, chain_ms({4, 6, 5})).missed_releases);
  }
  ASSERT_GT(core.instants.size(), 100U);
  for (std::size_t i = 1; i < core.instants.size(); ++i) {
    const time_ns_t place = (core.instants[i] - simulation.epoch_ns()) % ms_to_ns(15);
    EXPECT_EQ(place == 0             ? ms_to_ns(5)
              : place == ms_to_ns(4) ? ms_to_ns(4)
                                     : ms_to_ns(6),
              core.instants[i] - core.instants[i - 1]);
  }
}

using Rule7RestartOnThreads = Deployed;

TEST_F(Rule7RestartOnThreads, AnFsmWithSeveralWaitsKeepsItsPlace) {
  add("c", 1, {.trace_records = std::size_t{1} << 15U});
  deploy();
  const auto commit = [this](std::unique_ptr<FsmBase> fsm) {
    Transaction transaction;
    transaction.replace_fsm("c", std::move(fsm));
    return deployer.commit(std::move(transaction), {.timeouts = {.phase_ns = s_to_ns(10)}}).steps.front();
  };
  commit(chain_ms({4, 6, 5}));
  deployer.drain_trace();
  for (int change = 0; change < 30; ++change) {
    std::this_thread::sleep_for(std::chrono::microseconds(700 * (change % 17)));
    const StepReport report = commit(chain_ms({4, 6, 5}));
    EXPECT_EQ(0, report.phase_nominal_ns);
  }
  const TraceDrain drain = deployer.drain_trace();
  EXPECT_TRUE(records_of(drain, TraceKind::start).empty()) << "none began anew";
  const auto releases = records_of(drain, TraceKind::release);
  const auto lost = records_of(drain, TraceKind::overrun).size();
  const auto armed = records_of(drain, TraceKind::armed);
  const bool has_stalled = lost != 0 || std::any_of(armed.begin(), armed.end(),
                                                    [](const TraceRecord& record) { return record.c != 0; });
  for (std::size_t i = 1; i < releases.size() && !has_stalled; ++i) {
    const time_ns_t wait = releases[i].a - releases[i - 1].a;
    EXPECT_TRUE(wait == ms_to_ns(4) || wait == ms_to_ns(6) || wait == ms_to_ns(5)) << wait;
  }
}

TEST_F(Rule7RestartOnThreads, NoReleaseIsMissedOnAnEqualGrid) {
  add("c", 1, {.trace_records = std::size_t{1} << 15U});
  deploy();
  for (int change = 0; change < 30; ++change) {
    deployer.drain_trace();
    Transaction transaction;
    transaction.replace_fsm("c", std::make_unique<TestFsm>());
    const auto report = deployer.commit(std::move(transaction), {.timeouts = {.phase_ns = s_to_ns(10)}});
    const TraceDrain drain = deployer.drain_trace();
    const auto parked = records_of(drain, TraceKind::parked);
    const auto armed = records_of(drain, TraceKind::armed);
    ASSERT_EQ(1U, parked.size());
    ASSERT_EQ(1U, armed.size());
    EXPECT_EQ(0, report.steps.front().phase_nominal_ns);
    // The machine stalled the commit past the instant. armed's instant is later by a stall that lost some.
    if (armed.back().time_ns > parked.back().a) continue;
    EXPECT_EQ(parked.back().a, armed.back().a);
    EXPECT_EQ(0, report.steps.front().missed_releases);
  }
}

}  // namespace mauve::testing::test_rule7_restart
