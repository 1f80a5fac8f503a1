// SPDX-License-Identifier: LGPL-3.0-or-later
// Rules 1, 2, 4, 5, 6: instants, overruns, the epoch, stop and start.
#include <random>

#include "fixtures.hpp"

namespace mauve::testing::test_grid {

TEST(Grid, FirstNotBefore) {
  const Grid grid{.reference_ns = 1000, .period_ns = 300};
  EXPECT_EQ(1000, grid.first_not_before(1000));
  EXPECT_EQ(1300, grid.first_not_before(1001));
  EXPECT_EQ(1300, grid.first_not_before(1300));
  EXPECT_EQ(700, grid.first_not_before(500));
}

TEST(Grid, PhaseErrorIsSignedAndNearest) {
  const Grid grid{.reference_ns = 1000, .period_ns = 300};
  EXPECT_EQ(0, grid.phase_error(1600));
  EXPECT_EQ(20, grid.phase_error(1620));
  EXPECT_EQ(-20, grid.phase_error(1580));
  EXPECT_EQ(-10, grid.phase_error(690));
}

class Rule2Instants : public Deployed {};

TEST_F(Rule2Instants, DoNotDriftWhateverExecutionTakes) {
  Component& component = add("c", 2);
  core(component).instants.reserve(20);
  core(component).work = [] {
    const time_ns_t until = monotonic_now_ns() + us_to_ns(300);
    while (monotonic_now_ns() < until) {
    }
  };
  deploy();
  wait_runs(component, 20);
  deployer.shutdown();
  const auto& instants = core(component).instants;
  ASSERT_EQ(20U, instants.size());
  EXPECT_EQ(deployer.epoch_ns(), instants.front());
  for (std::size_t i = 1; i < instants.size(); ++i) {
    EXPECT_EQ(0, (instants[i] - deployer.epoch_ns()) % ms_to_ns(2));
    EXPECT_GT(instants[i], instants[i - 1]);
  }
}

class Rule4Overrun : public Deployed {
 protected:
  /// Runs one activation for 2.5 periods of 20 ms, all others for no time.
  Component& overrun_once(OverrunPolicy policy, std::int64_t max_backlog = 10) {
    Component& component = add("c", 20, {.overrun = policy, .max_backlog = max_backlog});
    core(component).instants.reserve(8);
    core(component).work = [&component] {
      if (core(component).runs == 1) {
        const time_ns_t until = core(component).instants.front() + ms_to_ns(50);
        while (monotonic_now_ns() < until) {
        }
      }
    };
    deploy();
    return component;
  }
};

TEST_F(Rule4Overrun, SkipGoesOnAtTheNextInstantOfTheGrid) {
  Component& component = overrun_once(OverrunPolicy::skip);
  wait_runs(component, 2);
  const TraceDrain drain = deployer.drain_trace();
  const auto overruns = records_of(drain, TraceKind::overrun);
  ASSERT_GE(overruns.size(), 1U);
  // 2.5 periods: instants 1 and 2 have passed. The machine may have added to it, never taken away.
  EXPECT_GE(overruns[0].c, 2);
  const time_ns_t second = core(component).instants[1];
  EXPECT_EQ(deployer.epoch_ns() + (1 + overruns[0].c) * ms_to_ns(20), second);
  EXPECT_GE(second, overruns[0].b);
  EXPECT_LT(second - ms_to_ns(20), overruns[0].b);
}

TEST_F(Rule4Overrun, CatchUpReleasesEveryInstant) {
  Component& component = overrun_once(OverrunPolicy::catch_up, 10'000);  // whatever the machine adds to it
  wait_runs(component, 5);
  deployer.shutdown();
  for (std::size_t i = 0; i < 5; ++i) {
    EXPECT_EQ(deployer.epoch_ns() + static_cast<time_ns_t>(i) * ms_to_ns(20), core(component).instants[i]);
  }
}

TEST_F(Rule4Overrun, CatchUpOwingTooMuchIsAFault) {
  Component& component = overrun_once(OverrunPolicy::catch_up, 1);
  wait_until([&] { return component.task().state() == ComponentState::faulted; }, "the fault");
  EXPECT_THAT(component.task().fault().what, ::testing::HasSubstr("max_backlog"));
}

TEST_F(Rule4Overrun, FaultFaultsOnThreads) {
  Component& component = overrun_once(OverrunPolicy::fault);
  wait_until([&] { return component.task().state() == ComponentState::faulted; }, "the fault");
  EXPECT_EQ("Pause", component.task().fault().where);
}

class Rule5Deployment : public Deployed {};

TEST_F(Rule5Deployment, AllComponentsShareOneEpochPublishedAfterAllAreReady) {
  std::vector<Component*> components;
  for (int i = 0; i < 8; ++i) {
    components.push_back(
        &add("c" + std::to_string(i), 1, {.priority = 40 + i, .offset_ns = us_to_ns(100) * i}));
    core(*components.back()).instants.reserve(4);
  }
  const time_ns_t before = monotonic_now_ns();
  deploy();
  EXPECT_GE(deployer.epoch_ns(), before + ms_to_ns(20));
  for (Component* component : components) wait_runs(*component, 4);
  deployer.shutdown();
  const TraceDrain drain = deployer.drain_trace();
  for (int i = 0; i < 8; ++i) {
    EXPECT_EQ(deployer.epoch_ns() + us_to_ns(100) * i,
              core(*components[static_cast<std::size_t>(i)]).instants.front());
    const auto deployments = records_of(drain, TraceKind::deployment, i);
    ASSERT_EQ(1U, deployments.size());
    EXPECT_EQ(deployer.epoch_ns(), deployments[0].a);
    EXPECT_EQ(us_to_ns(100) * i, deployments[0].b);
    EXPECT_EQ(ms_to_ns(1), deployments[0].c);
    EXPECT_GE(records_of(drain, TraceKind::release, i).front().b, deployer.epoch_ns());
  }
}

TEST_F(Rule5Deployment, AThreadThatCannotBeMadeLeavesNoneBehind) {
  add("good");
  add("bad", 1, {.cpus = {1000}});
  architecture.configure();
  EXPECT_THROW(deployer.deploy(), Error);
  EXPECT_FALSE(architecture.component("good").task().has_thread());
  EXPECT_FALSE(deployer.is_deployed());
}

TEST_F(Rule5Deployment, ThreadsAreWhatWasAskedFor) {
  if (!may_use_fifo()) GTEST_SKIP() << "needs the right to SCHED_FIFO (rtprio limit)";
  Component& component = add("c", 1, {.priority = 42, .cpus = {0}});
  deploy();
  EXPECT_EQ("SCHED_FIFO", component.task().facts().policy);
  EXPECT_EQ(42, component.task().facts().priority);
  EXPECT_EQ(std::vector<int>{0}, component.task().facts().cpus);
}

class Rule6StopStart : public Deployed {};

TEST_F(Rule6StopStart, StopInterruptsALongWaitAtOnce) {
  Component& component = add("c", 3'600'000);
  deploy();
  wait_runs(component, 1);
  deployer.stop("c", s_to_ns(60));  // of an hour: a stop that waits it out is refused
  EXPECT_EQ(ComponentState::stopped, component.task().state());
}

TEST_F(Rule6StopStart, StopAtRandomPhasesNeverLosesItsWakeUpAndRestartsOnTheGrid) {
  Component& component = add("c", 1);
  core(component).work = [] {
    const time_ns_t until = monotonic_now_ns() + us_to_ns(200);  // so that some stops come in mid-execution
    while (monotonic_now_ns() < until) {
    }
  };
  deploy();
  std::mt19937 random(7);
  std::uniform_int_distribution<int> phase_us(0, 1500);
  for (int i = 0; i < 1000; ++i) {
    const time_ns_t until = monotonic_now_ns() + us_to_ns(phase_us(random));
    while (monotonic_now_ns() < until) {
    }
    deployer.stop("c", s_to_ns(10));
    const int runs = core(component).runs;
    ASSERT_EQ(ComponentState::stopped, component.task().state());
    ASSERT_TRUE(component.task().is_parked());
    deployer.start("c");
    ASSERT_GE(core(component).runs, runs);
  }
  wait_runs(component, core(component).runs + 2);
  EXPECT_EQ(0, component.task().grid().phase_error(component.task().get_time()));
  const TraceDrain drain = deployer.drain_trace();
  for (const TraceRecord& start : records_of(drain, TraceKind::start)) {
    ASSERT_EQ(0, (start.a - deployer.epoch_ns()) % ms_to_ns(1));
    ASSERT_GT(start.a, start.time_ns - s_to_ns(1));
  }
}

TEST_F(Rule6StopStart, Listing3ReadsAsInThePaper) {
  struct Alternative : TestCore {};
  Component& exploration = add("exploration", 5);
  Component& neighbour = add("neighbour", 5, {.priority = 60});
  core(neighbour).instants.reserve(100);
  deploy();
  wait_runs(exploration, 3);

  const time_ns_t clock = exploration.task().get_time();
  exploration.task().stop();
  exploration.cleanup_core();
  auto& replaced = exploration.replace_core<Alternative>();
  replaced.instants.reserve(2);
  exploration.configure_core();
  exploration.task().start(clock);

  wait_until([&] { return replaced.runs >= 2; }, "the new core to run");
  deployer.shutdown();
  EXPECT_EQ(0, (replaced.instants[0] - deployer.epoch_ns()) % ms_to_ns(5));
  EXPECT_GT(replaced.instants[0], clock);
}

TEST_F(Rule6StopStart, AStopThatTimesOutNamesTheStateAndStaysPending) {
  Component& component = add("c", 5);
  std::atomic<bool> go_on{false};
  core(component).work = [&] {
    while (!go_on) yield_thread();
  };
  deploy();
  wait_runs(component, 1);
  try {
    deployer.stop("c", ms_to_ns(20));
    FAIL() << "the stop should have timed out";
  } catch (const Error& error) {
    EXPECT_EQ(ErrorCode::timeout, error.code());
    EXPECT_THAT(error.what(), ::testing::HasSubstr("state Run"));
  }
  EXPECT_EQ(ComponentState::stopping, component.task().state());
  go_on = true;
  wait_until([&] { return component.task().state() == ComponentState::stopped; }, "the pending stop");
}

TEST_F(Rule6StopStart, WhatAComponentStillUsesIsNotCleanedUp) {
  Component& component = add("c", 5);
  std::atomic<bool> go_on{false};
  core(component).work = [&] {
    while (!go_on) yield_thread();
  };
  deploy();
  wait_runs(component, 1);
  deployer.shutdown();  // gives up waiting for the state
  EXPECT_FALSE(component.task().is_parked());
  EXPECT_THROW(architecture.cleanup(), Error);
  EXPECT_THROW(component.cleanup(), Error);
  EXPECT_TRUE(component.is_configured());
  go_on = true;
  wait_until([&] { return component.task().is_parked(); }, "the state to end");
  EXPECT_NO_THROW(architecture.cleanup());
}

TEST_F(Rule6StopStart, RefusalsSayWhy) {
  add("c", 1);
  deploy();
  EXPECT_THROW(deployer.start("c"), Error);
  deployer.stop("c");
  try {
    deployer.stop("c");
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(ErrorCode::not_running, error.code());
  }
  try {
    deployer.stop("d");
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(ErrorCode::unknown_component, error.code());
    EXPECT_THAT(error.what(), ::testing::HasSubstr("expected one of c"));
  }
}

}  // namespace mauve::testing::test_grid
