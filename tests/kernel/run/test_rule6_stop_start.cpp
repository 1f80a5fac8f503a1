// SPDX-License-Identifier: LGPL-3.0-or-later
// Rule 6: stop and start at any moment, in virtual time and on threads.
#include <random>

#include "free_fsm.hpp"

namespace mauve::testing::test_rule6_stop_start {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using Rule6Simulated = Simulated;

constexpr time_ns_t kMargin = us_to_ns(200);

TEST_F(Rule6Simulated, StartsAtTheFirstInstantLaterThanTheMargin) {
  Component& component = add("c", 10, 0.0, {.offset_ns = ms_to_ns(3)});
  deploy();
  const time_ns_t epoch = simulation.epoch_ns();
  simulation.at(epoch + ms_to_ns(4), [this] { host().stop("c"); });
  simulation.at(epoch + ms_to_ns(23) - kMargin - 1, [this] { host().start("c"); });
  simulation.at(epoch + ms_to_ns(24), [this] { host().stop("c"); });
  simulation.at(epoch + ms_to_ns(43) - kMargin, [this] { host().start("c"); });
  run_to(ms_to_ns(65));
  EXPECT_THAT(instants_ms(component), ElementsAre(3, 23, 53, 63)) << "43 is not later than now + 200 us";
}

TEST_F(Rule6Simulated, StartOnAnotherClockTakesItsGrid) {
  Component& component = add("c", 10);
  deploy();
  const time_ns_t clock = simulation.epoch_ns() + ms_to_ns(2);
  simulation.at(simulation.epoch_ns() + ms_to_ns(5), [=, this] {
    host().stop("c");
    host().start("c", clock);
  });
  run_to(ms_to_ns(33));
  EXPECT_THAT(instants_ms(component), ElementsAre(0, 12, 22, 32));
}

TEST_F(Rule6Simulated, GivesUpThePositionAndTellsTheTimeOfTheInitialState) {
  Component& component = add_free(architecture, "c", varying({0, 0, 0}, ms_to_ns(10)));
  std::vector<std::string> entered;
  core(component).work = [&] { entered.push_back(component.task().current_state()); };
  deploy();
  const time_ns_t epoch = simulation.epoch_ns();
  simulation.at(epoch + ms_to_ns(15), [&] {
    EXPECT_EQ(epoch, host().get_time("c")) << "Run1 at 10 is not the initial state";
    host().stop("c");
    host().start("c");
  });
  run_to(ms_to_ns(30));
  EXPECT_THAT(entered, ElementsAre("Run0", "Run1", "Run0", "Run1"));
  EXPECT_EQ(epoch + ms_to_ns(20), host().get_time("c"));
}

TEST_F(Rule6Simulated, AtThousandsOfRandomInstantsActsWhereTheRuleSays) {
  Component& component = add("c", 7, 0.0, {.offset_ns = us_to_ns(1'700)});
  Component& neighbour = add("neighbour", 5);
  deploy();
  const Grid grid = component.task().grid();
  std::mt19937_64 random(17);
  std::vector<time_ns_t> expected;
  time_ns_t from = grid.reference_ns;  // of the run under way its first instant
  time_ns_t now = simulation.epoch_ns();
  const auto later = [&] { return now += static_cast<time_ns_t>(1 + random() % ms_to_ns(20)); };
  for (int i = 0; i < 2'000; ++i) {
    simulation.at(later(), [&] { host().stop("c"); });
    for (time_ns_t instant = from; instant < now; instant += grid.period_ns) expected.push_back(instant);
    simulation.at(later(), [&] { host().start("c"); });
    from = grid.first_not_before(now + kMargin + 1);
  }
  core(component).instants.reserve(2 * expected.size());
  simulation.run_until(now);
  EXPECT_EQ(expected, core(component).instants);
  EXPECT_EQ((now - simulation.epoch_ns()) / ms_to_ns(5) + 1, core(neighbour).runs);
}

class Rule6Threads : public Deployed {
 protected:
  static void spin(time_ns_t duration_ns) {
    const time_ns_t until = monotonic_now_ns() + duration_ns;
    while (monotonic_now_ns() < until) {
    }
  }
};

TEST_F(Rule6Threads, AStopNeverWaitsOutAPeriod) {
  // A period of 5 s, and 2,000 stops in its wait: one that waited it out, or lost its wake-up, would time out.
  Component& component = add("c", 5000);
  deploy();
  wait_runs(component, 1);
  std::mt19937 random(23);
  for (int i = 0; i < 2'000; ++i) {
    spin(us_to_ns(static_cast<std::int64_t>(random() % 200)));
    const int runs = core(component).runs;
    deployer.stop("c", s_to_ns(4));
    ASSERT_TRUE(component.task().is_parked());
    ASSERT_LE(core(component).runs, runs + 1)
        << "it acts while it is being stopped only if its instant has come";
    deployer.start("c");
  }
  const auto stops = records_of(deployer.drain_trace(), TraceKind::stop);
  ASSERT_FALSE(stops.empty());
  std::size_t before_the_instant = 0;
  for (const TraceRecord& stop : stops) before_the_instant += stop.time_ns < stop.a ? 1 : 0;
  EXPECT_GE(before_the_instant * 10, stops.size() * 9) << "parked before the instant it was waiting for";
}

TEST_F(Rule6Threads, AStopEndsThoughTheComponentIsStartedAgainAtOnce) {
  Component& component = add("c", 1);
  deploy();
  wait_runs(component, 1);
  std::atomic<bool> is_over{false};
  std::thread starter([&] {
    while (!is_over) {
      try {
        deployer.start("c");
      } catch (const Error&) {  // it runs
      }
    }
  });
  int stops = 0;
  while (stops < 1'000 && !HasFailure()) {
    try {
      deployer.stop("c", s_to_ns(20));
      ++stops;
    } catch (const Error& error) {
      EXPECT_EQ(ErrorCode::not_running, error.code()) << error.what();
    }
  }
  is_over = true;
  starter.join();
}

TEST_F(Rule6Threads, AStopInMidExecutionLeavesNoStateHalfRun) {
  TaskSettings settings{.cpus = {0}};
  settings.trace_records = std::size_t{1} << 16U;
  Component& component = add_free(
      architecture, "c",
      [](FreeFsm& fsm) {
        State& first = fsm.run("First");
        State& second = fsm.run("Second");
        State& third = fsm.run("Third");
        State& pause = fsm.wait("Pause", ms_to_ns(1));
        fsm.set_initial(first);
        fsm.next(first, second);
        fsm.next(second, third);
        fsm.next(third, pause);
        fsm.next(pause, first);
      },
      settings);
  std::atomic<int> entered{0};
  std::atomic<int> left{0};
  std::atomic<int> executions_to_hold{-1};
  std::atomic<bool> holds{false};
  const ComponentsEndFirst guard(deployer);
  core(component).work = [&] {
    ++entered;
    if (executions_to_hold-- == 0) {
      holds = true;
      while (component.task().state() != ComponentState::stopping)
        std::this_thread::sleep_for(std::chrono::microseconds(20));
    }
    spin(us_to_ns(200));
    ++left;
  };
  deploy();
  std::mt19937 random(29);
  int in_mid_execution = 0;
  int in_mid_chain = 0;
  for (int i = 0; i < 1'000; ++i) {
    if (i % 2 == 0) {  // at any instant; which one depends on what else the machine does
      const int seen = entered;
      wait_until([&] { return entered > seen; }, "an execution");
      spin(us_to_ns(static_cast<std::int64_t>(random() % 700)));
    } else {  // in an execution, which goes on until it is told to stop: whatever the machine does
      holds = false;
      executions_to_hold = static_cast<int>(random() % 5);
      wait_until([&] { return holds.load(); }, "the execution that is held");
      ASSERT_NE(entered, left);
      ++in_mid_execution;
    }
    deployer.stop("c", s_to_ns(10));
    ASSERT_EQ(ComponentState::stopped, component.task().state());
    ASSERT_EQ(entered, left) << "parked at a state's boundary";
    if (left % 3 != 0) {
      ++in_mid_chain;
      entered = left = 0;
    }
    deployer.start("c");
  }
  deployer.shutdown();
  EXPECT_EQ(500, in_mid_execution);
  EXPECT_GT(in_mid_chain, 250) << "the rest of the chain is given up";
  bool stopped = false;
  int open = 0;
  for (const TraceRecord& record : deployer.drain_trace().records) {
    const auto kind = static_cast<TraceKind>(record.kind);
    if (kind == TraceKind::state_begin) ++open;
    if (kind == TraceKind::state_end) --open;
    if (kind == TraceKind::stop) {
      ASSERT_EQ(0, open);
    }
    if (kind == TraceKind::state_begin || kind == TraceKind::release) {
      ASSERT_FALSE(stopped) << "between stop and start";
    }
    if (kind == TraceKind::stop) stopped = true;
    if (kind == TraceKind::start) {
      stopped = false;
      ASSERT_EQ(0, (record.a - deployer.epoch_ns()) % ms_to_ns(1));
    }
  }
}

TEST_F(Rule6Threads, AStopThatTimedOutIsTakenUpByTheNext) {
  Component& component = add("c", 5);
  std::atomic<bool> go_on{false};
  const ComponentsEndFirst guard(deployer);
  core(component).work = [&] {
    while (!go_on) std::this_thread::yield();
  };
  deploy();
  wait_runs(component, 1);
  for (int i = 0; i < 2; ++i) {
    try {
      deployer.stop("c", ms_to_ns(10));
      FAIL() << "should have timed out";
    } catch (const Error& error) {
      EXPECT_EQ(ErrorCode::timeout, error.code());
      EXPECT_THAT(error.what(), HasSubstr("state Run"));
      EXPECT_EQ("c", error.detail().component);
    }
    EXPECT_EQ(ComponentState::stopping, component.task().state());
    EXPECT_THROW(deployer.start("c"), Error) << "it has not stopped yet";
  }
  go_on = true;
  try {
    deployer.stop("c", s_to_ns(10));
  } catch (const Error& error) {
    EXPECT_EQ(ErrorCode::not_running, error.code()) << "the pending one was first";
  }
  wait_until([&] { return component.task().is_parked(); }, "the stop");
  EXPECT_EQ(1, core(component).runs);
  deployer.start("c");
  wait_runs(component, 2);
}

}  // namespace mauve::testing::test_rule6_stop_start
