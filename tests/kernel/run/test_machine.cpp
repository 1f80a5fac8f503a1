// SPDX-License-Identifier: LGPL-3.0-or-later
// The machine alone, stepped by hand: no thread, no task, a clock that stands where the test puts it.
#include "free_fsm.hpp"

namespace mauve::testing::test_machine {

using ::testing::ElementsAre;

constexpr time_ns_t kPeriod = ms_to_ns(10);

class HandClock final : public Clock {
 public:
  time_ns_t now_ns() const noexcept override { return now; }
  bool sleep_until(time_ns_t, const std::atomic<std::uint32_t>&, std::uint32_t) const noexcept override {
    ADD_FAILURE() << "a machine does not sleep";
    return true;
  }
  void spend(time_ns_t simulated_ns) const noexcept override { now += simulated_ns; }

  mutable time_ns_t now{0};
};

class MachineByHand : public ::testing::Test {
 protected:
  void make(Define how, const TaskSettings& wanted = {}) {
    settings = wanted;
    fsm = std::make_unique<FreeFsm>(std::move(how));
    fsm->bind_shell(shell);
    fsm->configure();
    binding = fsm->bind_core(core);
    core.instants.reserve(100);
    machine.set_parts(*fsm, &binding, fsm->period_ns());
    machine.set_clock(clock);
    machine.join(0);
  }
  /// One execution of that length, one wait; `work` is called in each execution.
  void make_periodic(time_ns_t takes_ns, const TaskSettings& wanted = {}) {
    make(
        [takes_ns](FreeFsm& made) {
          State& run = made.run("Run", takes_ns);
          State& pause = made.wait("Pause", kPeriod);
          made.set_initial(run);
          made.next(run, pause);
          made.next(pause, run);
        },
        wanted);
  }
  /// Ends the wait under way, and goes on to the next one.
  Machine::Entered step() {
    clock.now = std::max(clock.now, machine.due_ns());
    machine.release(clock.now);
    machine.leave_wait();
    for (;;) {
      const Machine::Entered entered = machine.enter_next();
      if (entered != Machine::Entered::execution) return entered;
    }
  }

  HandClock clock;
  TestShell shell;
  TestCore core;
  TaskSettings settings;
  std::unique_ptr<FreeFsm> fsm;
  CoreBinding binding;
  Machine machine{settings};
};

TEST_F(MachineByHand, OnlyWaitsAdvanceItsClock) {
  make_periodic(ms_to_ns(3));
  machine.start(s_to_ns(1));
  for (int k = 0; k < 3; ++k) {
    EXPECT_EQ(s_to_ns(1) + k * kPeriod, machine.due_ns());
    EXPECT_EQ(Machine::Entered::wait, step());
    EXPECT_EQ(s_to_ns(1) + k * kPeriod, machine.context().instant_ns.load());
  }
  EXPECT_EQ(3U, machine.statistics().releases);
  EXPECT_EQ(0U, machine.statistics().overruns);
  EXPECT_EQ(3, core.runs);
}

TEST_F(MachineByHand, WaitsForNothingUntilStartedAndOnceParked) {
  make_periodic(0);
  EXPECT_FALSE(machine.is_started());
  EXPECT_EQ(kForever, machine.due_ns());
  machine.start(kPeriod);
  EXPECT_TRUE(machine.is_started());
  step();
  machine.park();
  EXPECT_FALSE(machine.is_started());
  EXPECT_EQ(kForever, machine.due_ns());
}

TEST_F(MachineByHand, SkipsToTheNextInstantOfItsGrid) {
  make_periodic(ms_to_ns(25));
  machine.start(0);
  step();
  EXPECT_EQ(3 * kPeriod, machine.due_ns());
  EXPECT_EQ(1U, machine.statistics().overruns);
  EXPECT_EQ(2U, machine.statistics().skipped);
}

TEST_F(MachineByHand, CatchesUpUntilItOwesTooMuch) {
  make_periodic(ms_to_ns(25), {.overrun = OverrunPolicy::catch_up, .max_backlog = 3});
  machine.start(0);
  step();
  EXPECT_EQ(kPeriod, machine.due_ns()) << "due already, 1 more owed";
  EXPECT_THROW(step(), std::runtime_error);
  EXPECT_EQ(2U, machine.statistics().overruns);
  EXPECT_EQ(0U, machine.statistics().skipped);
}

TEST_F(MachineByHand, ThrowsWhereAnOverrunIsAFault) {
  make_periodic(ms_to_ns(11), {.overrun = OverrunPolicy::fault});
  machine.start(0);
  EXPECT_THROW(step(), std::runtime_error);
}

TEST_F(MachineByHand, TellsALongStateWhileItLasts) {
  make_periodic(ms_to_ns(4));
  core.work = [this] {
    const auto fact = machine.present().look();
    ASSERT_TRUE(fact);
    EXPECT_FALSE(fact->is_wait);
    EXPECT_EQ(kPeriod, fact->since_ns);
    EXPECT_EQ(ms_to_ns(4), fact->bound_ns);
    EXPECT_EQ(kPeriod + ms_to_ns(4), machine.earliest_excess_ns());
  };
  machine.start(kPeriod);
  EXPECT_EQ(kPeriod + ms_to_ns(4), machine.earliest_excess_ns()) << "foreseen";
  step();
  EXPECT_EQ(1, core.runs);
  ASSERT_TRUE(machine.present().look());
  EXPECT_TRUE(machine.present().look()->is_wait);
}

TEST_F(MachineByHand, ThrowsAtTheEndOfAStateOverItsBound) {
  make_periodic(ms_to_ns(4));
  core.work = [this] { clock.now += ms_to_ns(1); };  // beside the 4 that it takes anyway
  machine.start(0);
  try {
    step();
    FAIL() << "it was over its bound";
  } catch (const OverBound& failure) {
    EXPECT_EQ(ms_to_ns(4), failure.bound_ns);
  }
}

TEST_F(MachineByHand, ABudgetIsForeseenAndComparedAtTheEnd) {
  make_periodic(ms_to_ns(4));
  binding.budgets_ns = {ms_to_ns(3), 0};
  machine.set_parts(*fsm, &binding, fsm->period_ns());
  machine.start(kPeriod);
  EXPECT_EQ(kPeriod + ms_to_ns(3), machine.earliest_excess_ns()) << "sooner than the bound";
  try {
    step();
    FAIL() << "it was over its budget";
  } catch (const OverBound& failure) {
    EXPECT_EQ(ms_to_ns(3), failure.bound_ns);
    EXPECT_EQ(ms_to_ns(4), failure.cpu_ns);
  }
}

TEST_F(MachineByHand, SaysWhenItsStateTimedOut) {
  make_periodic(ms_to_ns(4));
  core.work = [this] {
    const auto execution = machine.execution().look();
    ASSERT_TRUE(execution);
    EXPECT_TRUE(machine.execution().time_out(*execution));
  };
  machine.start(0);
  EXPECT_EQ(Machine::Entered::timed_out, step());
}

TEST_F(MachineByHand, SkipsTheInstantsThatPassedInAChange) {
  make_periodic(0);
  machine.start(0);
  step();
  ASSERT_EQ(kPeriod, machine.due_ns());
  EXPECT_EQ(0, machine.skip_lost(ms_to_ns(5), ms_to_ns(15))) << "late by less than a period";
  EXPECT_EQ(0, machine.skip_lost(ms_to_ns(20), ms_to_ns(31))) << "it had an overrun before the change";
  EXPECT_EQ(0, machine.skip_lost(ms_to_ns(11), ms_to_ns(19))) << "late by less than a period";
  EXPECT_EQ(3, machine.skip_lost(ms_to_ns(11), ms_to_ns(31))) << "the wait was over, and nothing else late";
  EXPECT_EQ(4 * kPeriod, machine.due_ns());
}

TEST_F(MachineByHand, MovesToTheGridOfANewEpoch) {
  make_periodic(0);
  machine.start(0);
  step();
  EXPECT_EQ(ms_to_ns(4), machine.resynchronise(s_to_ns(1) + ms_to_ns(4)));
  EXPECT_EQ(kPeriod + ms_to_ns(4), machine.due_ns());
}

TEST_F(MachineByHand, TracesWhatItDoesInOrder) {
  TraceRing ring(1);
  ring.set_clock(&clock);
  make_periodic(ms_to_ns(2));
  machine.set_ring(&ring);
  machine.start(0);
  step();
  std::vector<TraceRecord> records;
  ring.drain(records);
  std::vector<TraceKind> kinds;
  for (const TraceRecord& record : records) kinds.push_back(static_cast<TraceKind>(record.kind));
  EXPECT_THAT(kinds,
              ElementsAre(TraceKind::release, TraceKind::state_begin, TraceKind::state_end, TraceKind::wait));
}

}  // namespace mauve::testing::test_machine
