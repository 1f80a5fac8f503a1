// SPDX-License-Identifier: LGPL-3.0-or-later
// Rule 11: a state that lasts longer than `hung_after` is told while it lasts, and does not time out.
#include <unistd.h>

#include "free_fsm.hpp"

namespace mauve::testing::test_rule11_hung {

constexpr time_ns_t kHungAfter = ms_to_ns(30);

class Rule11Hung : public Deployed {
 protected:
  Component& add_hanging() { return add("c", 1, {.hung_after_ns = kHungAfter}); }
  /// In an execution: a busy machine may have kept its thread in a wait, which a stop ends.
  static void wait_hung(Component& component) {
    wait_until(
        [&] {
          const StateAge age = component.task().state_age();
          return age.is_hung() && !age.is_wait;
        },
        "the component to be told as hung");
  }
  static void wait_well(Component& component) {
    wait_until([&] { return !component.task().state_age().is_hung(); }, "it to go on");
  }
  /// As long as `hung_after` and more, in another component's releases.
  static void let_time_pass(Component& neighbour) { wait_runs(neighbour, core(neighbour).runs + 60); }
};

TEST_F(Rule11Hung, AStateThatLoopsIsToldWhileItLastsAndNotAfter) {
  std::atomic<bool> go_on{false};
  const ComponentsEndFirst ended(deployer);
  Component& component = add_hanging();
  Component& neighbour = add("neighbour", 1, {.priority = 60});  // above it, on the same CPU
  core(component).work = [&] {
    while (!go_on) {
    }
  };
  deploy();
  wait_hung(component);
  const StateAge age = component.task().state_age();
  EXPECT_EQ("Run", age.state);
  EXPECT_FALSE(age.is_wait);
  EXPECT_EQ(kHungAfter, age.hung_after_ns);
  EXPECT_GT(age.age_ns, kHungAfter);
  EXPECT_EQ(0, age.bound_ns);
  EXPECT_EQ(ComponentState::running, component.task().state()) << "told, and no time-out";
  EXPECT_EQ(0, component.task().statistics().overruns) << "nothing but the age shows it";
  EXPECT_GT(component.task().state_age().age_ns, age.age_ns) << "it grows";
  let_time_pass(neighbour);
  EXPECT_FALSE(neighbour.task().state_age().is_hung());
  go_on = true;
  wait_well(component);
  wait_runs(component, 5);
  EXPECT_EQ(ComponentState::running, component.task().state());
}

TEST_F(Rule11Hung, AStateThatReadsAPipeGoesOnOnceItIsWritten) {
  int ends[2];
  ASSERT_EQ(0, pipe(ends));
  const ComponentsEndFirst ended(deployer);
  Component& component = add_hanging();
  char byte = 0;
  core(component).work = [&] {
    if (core(component).runs > 1) return;
    EXPECT_EQ(1, read(ends[0], &byte, 1));
  };
  deploy();
  wait_hung(component);
  EXPECT_EQ("Run", component.task().state_age().state);
  ASSERT_EQ(1, write(ends[1], "x", 1));
  wait_well(component);
  wait_runs(component, 5);
  deployer.shutdown();
  close(ends[0]);
  close(ends[1]);
}

TEST_F(Rule11Hung, AStopBesideItTimesOutAndStaysPending) {
  std::atomic<bool> go_on{false};
  const ComponentsEndFirst ended(deployer);
  Component& component = add_hanging();
  core(component).work = [&] {
    while (!go_on) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  };
  deploy();
  wait_hung(component);
  EXPECT_THROW(deployer.stop("c", ms_to_ns(5)), Error);
  EXPECT_EQ(ComponentState::stopping, component.task().state());
  EXPECT_TRUE(component.task().state_age().is_hung());
  go_on = true;
  wait_until([&] { return component.task().state() == ComponentState::stopped; }, "the stop");
  const StateAge age = component.task().state_age();
  EXPECT_EQ(0, age.age_ns) << "parked, it is in no state";
  EXPECT_EQ("Run", age.state) << "the last one";
}

TEST_F(Rule11Hung, AWaitForEventsIsNotHungHoweverLongItLasts) {
  architecture.add_resource<SharedData<Number>>("x");
  Component& component =
      add_free(architecture, "c",
               [](FreeFsm& fsm) {
                 State& run = fsm.run("Run", 0);
                 State& event = fsm.wait_event("Event", fsm.ports().input, s_to_ns(3600), ms_to_ns(1));
                 fsm.set_initial(run);
                 fsm.next(run, event);
                 fsm.next(event, run);
               },
               {.hung_after_ns = kHungAfter});
  architecture.connect("c", "input", "x", "read");
  Component& neighbour = add("neighbour", 1);
  deploy();
  wait_until([&] { return component.task().state_age().state == "Event"; }, "its wait");
  let_time_pass(neighbour);
  const StateAge age = component.task().state_age();
  EXPECT_EQ(0, age.age_ns);
  EXPECT_TRUE(age.is_wait);
}

TEST_F(Rule11Hung, AStateThatTimedOutButStillExecutesIsToldToo) {
  std::atomic<bool> go_on{false};
  const ComponentsEndFirst ended(deployer);
  Component& component =
      add_free(architecture, "c", varying({ms_to_ns(20)}, ms_to_ns(5)), {.hung_after_ns = kHungAfter});
  core(component).work = [&] {
    while (!go_on) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  };
  deploy();
  wait_until([&] { return component.task().state() == ComponentState::faulted; }, "the watchdog");
  wait_hung(component);
  EXPECT_EQ(ms_to_ns(20), component.task().state_age().bound_ns);
  go_on = true;
  wait_until([&] { return component.task().is_parked(); }, "the end of the state");
  EXPECT_EQ(0, component.task().state_age().age_ns);
}

TEST_F(Rule11Hung, TenPeriodsAndASecondAtLeastWhereNothingElseWasSaid) {
  Component& fast = add("fast", 1);
  Component& slow = add("slow", 200);
  Component& own = add("own", 200, {.hung_after_ns = ms_to_ns(5)});
  architecture.configure();
  EXPECT_EQ(s_to_ns(1), fast.task().state_age().hung_after_ns);
  EXPECT_EQ(s_to_ns(2), slow.task().state_age().hung_after_ns);
  EXPECT_EQ(ms_to_ns(5), own.task().state_age().hung_after_ns);
  EXPECT_EQ("", fast.task().state_age().state);
  EXPECT_EQ(0, fast.task().state_age().age_ns);
  EXPECT_THROW(add("wrong", 1, {.hung_after_ns = -1}), Error);
}

class Rule11HungSimulated : public Simulated {};

TEST_F(Rule11HungSimulated, AWaitIsAsOldAsItIsPastItsInstant) {
  add("busy", 100, 7.0, {.priority = 60});
  Component& late = add("late", 100, 0.0, {.priority = 50, .hung_after_ns = ms_to_ns(6)});
  deploy();
  const time_ns_t epoch = simulation.epoch_ns();
  StateAge before;
  StateAge waiting;
  simulation.at(epoch - 1, [&] { before = late.task().state_age(); });
  simulation.at(epoch + 1, [&] { waiting = late.task().state_age(); });
  run_to(ms_to_ns(50));
  EXPECT_EQ(0, before.age_ns) << "its first instant is to come";
  EXPECT_TRUE(waiting.is_wait);
  EXPECT_EQ(ms_to_ns(7), waiting.age_ns) << "the processor was busy until then";
  EXPECT_TRUE(waiting.is_hung());
  EXPECT_EQ(0, late.task().state_age().age_ns) << "it waits for an instant to come";
  EXPECT_EQ("Pause", late.task().state_age().state);
}

}  // namespace mauve::testing::test_rule11_hung
