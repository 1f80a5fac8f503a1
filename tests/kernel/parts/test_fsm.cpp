// SPDX-License-Identifier: LGPL-3.0-or-later
// Rules 1 and 3: loops, periods.
#include "free_fsm.hpp"

namespace mauve::testing::test_fsm {

TEST(Rule3Period, GuidanceHasOneUnit) {
  constexpr time_ns_t kUnit = ms_to_ns(100);
  EXPECT_EQ(kUnit, period_of([](FreeFsm& fsm) {
              State& idle = fsm.run("Idle");
              State& planning = fsm.run("Planning");
              State& following = fsm.run("Following");
              State& w1 = fsm.wait("W1", kUnit);
              State& w2 = fsm.wait("W2", 5 * kUnit);
              State& w3 = fsm.wait("W3", 2 * kUnit);
              fsm.set_initial(idle);
              fsm.when_set(idle, planning);
              fsm.when_set(idle, following);
              fsm.next(idle, w1);
              fsm.next(w1, idle);
              fsm.next(planning, w2);
              fsm.next(w2, idle);
              fsm.next(following, w3);
              fsm.next(w3, idle);
            }));
}

TEST(Rule3Period, ALoopOfTwoWaitsHasTheirSum) {
  EXPECT_EQ(ms_to_ns(10), period_of([](FreeFsm& fsm) {
              State& run = fsm.run("Run");
              State& a = fsm.wait("A", ms_to_ns(3));
              State& b = fsm.wait("B", ms_to_ns(7));
              fsm.set_initial(run);
              fsm.next(run, a);
              fsm.next(a, b);
              fsm.next(b, run);
            }));
}

TEST(Rule3Period, CyclesShareTheirGreatestCommonDivisor) {
  EXPECT_EQ(ms_to_ns(2), period_of([](FreeFsm& fsm) {
              State& run = fsm.run("Run");
              State& a = fsm.wait("A", ms_to_ns(4));
              State& b = fsm.wait("B", ms_to_ns(6));
              fsm.set_initial(run);
              fsm.when_set(run, a);
              fsm.next(run, b);
              fsm.next(a, run);
              fsm.next(b, run);
            }));
}

TEST(Rule3Period, PathsThatNeverReturnDoNotCount) {
  EXPECT_EQ(ms_to_ns(10), period_of([](FreeFsm& fsm) {
              State& start = fsm.run("Start");
              State& shorter = fsm.wait("Shorter", ms_to_ns(3));
              State& longer = fsm.wait("Longer", ms_to_ns(5));
              State& run = fsm.run("Run");
              State& pause = fsm.wait("Pause", ms_to_ns(10));
              fsm.set_initial(start);
              fsm.when_set(start, shorter);
              fsm.next(start, longer);
              fsm.next(shorter, run);
              fsm.next(longer, run);
              fsm.next(run, pause);
              fsm.next(pause, run);
            }));
}

TEST(Rule1Loops, ALoopWithoutAWaitIsRefusedByName) {
  std::string text;
  EXPECT_EQ(ErrorCode::loop_without_wait, error_of(
                                              [](FreeFsm& fsm) {
                                                State& a = fsm.run("Alpha");
                                                State& b = fsm.run("Beta");
                                                State& w = fsm.wait("W", 1);
                                                fsm.set_initial(w);
                                                fsm.next(w, a);
                                                fsm.next(a, b);
                                                fsm.when_set(b, a);
                                                fsm.next(b, w);
                                              },
                                              &text));
  EXPECT_THAT(text, ::testing::HasSubstr("Alpha -> Beta -> Alpha"));
}

TEST(Rule1Loops, AStateThatLoopsOnItselfIsRefused) {
  EXPECT_EQ(ErrorCode::loop_without_wait, error_of([](FreeFsm& fsm) {
              State& a = fsm.run("A");
              fsm.set_initial(a);
              fsm.next(a, a);
            }));
}

TEST(FsmDefinition, ErrorsSayWhatIsMissing) {
  EXPECT_EQ(ErrorCode::bad_fsm, error_of([](FreeFsm& fsm) { fsm.run("A"); }));
  EXPECT_EQ(ErrorCode::bad_fsm, error_of([](FreeFsm& fsm) { fsm.set_initial(fsm.run("A")); }));
  EXPECT_EQ(ErrorCode::bad_fsm, error_of([](FreeFsm& fsm) { fsm.wait("W", 0); }));
  EXPECT_EQ(ErrorCode::duplicate_name, error_of([](FreeFsm& fsm) {
              fsm.run("A");
              fsm.run("A");
            }));
}

class PeriodOfComponent : public Deployed {
 protected:
  ErrorCode configure(std::int64_t period_ms, time_ns_t declared_ns) {
    Component& component = add("c", period_ms, {.period_ns = declared_ns});
    try {
      architecture.configure();
    } catch (const Error& error) {
      EXPECT_EQ("c", error.detail().component);
      return error.code();
    }
    found_ = component.task().context().period_ns;
    return ErrorCode::internal;
  }
  time_ns_t found_{0};
};

TEST_F(PeriodOfComponent, MayBeDeclaredAsADivisor) {
  configure(10, ms_to_ns(5));
  EXPECT_EQ(ms_to_ns(5), found_);
}

TEST_F(PeriodOfComponent, ADeclaredOneThatDoesNotDivideIsRefused) {
  EXPECT_EQ(ErrorCode::bad_period, configure(10, ms_to_ns(3)));
}

struct FastFsm : TestFsm {
  void define() override {
    State& run = execution("Run", "act", &TestCore::act);
    State& pause = wait("Pause", us_to_ns(50));
    set_initial(run);
    next(run, pause);
    next(pause, run);
  }
};

TEST(Rule3Period, UnderAHundredMicrosecondsMustBeDeclared) {
  Architecture architecture;
  architecture.add_component<TestShell, TestCore, FastFsm>("fast");
  EXPECT_THROW(architecture.configure(), Error);
  Architecture declared;
  declared.add_component<TestShell, TestCore, FastFsm>("fast", {.period_ns = us_to_ns(50)});
  EXPECT_NO_THROW(declared.configure());
}

}  // namespace mauve::testing::test_fsm
