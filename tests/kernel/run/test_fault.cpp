// SPDX-License-Identifier: LGPL-3.0-or-later
// Rule 11: faults park one component and leave the others alone. Rule 8: no lock past a state's end.
#include "fixtures.hpp"

namespace mauve::testing::test_fault {

class Rule11Faults : public Deployed {
 protected:
  static void wait_fault(Component& component) {
    wait_until(
        [&] { return component.task().state() == ComponentState::faulted && component.task().is_parked(); },
        "the fault");
  }
};

TEST_F(Rule11Faults, AnExceptionParksItsComponentAndWritesItsOutputs) {
  auto& out = architecture.add_resource<SharedData<Number>>("out");
  auto& kept = architecture.add_resource<SharedData<Number>>("kept");
  Component& component = add("c", 1);
  Component& other = add("other", 1);
  architecture.connect("c", "output", "out", "write");
  architecture.connect("c", "held", "kept", "write");
  TestCore& failing = core(component);
  failing.work = [&failing] {
    failing.exposed_shell().output.write({4.0});
    failing.exposed_shell().held.write({5.0});
    if (failing.runs == 3) throw std::runtime_error("division by zero");
  };
  deploy();
  wait_fault(component);
  EXPECT_EQ("division by zero", component.task().fault().what);
  EXPECT_EQ("Run", component.task().fault().where);
  EXPECT_GT(component.task().fault().when_ns, deployer.epoch_ns());

  Number value;
  time_ns_t time = 0;
  ReaderState seen;
  out.read.read(value, time, seen);
  EXPECT_EQ(0.0, value.value) << "on_stop: the type's zero";
  seen = {};
  kept.read.read(value, time, seen);
  EXPECT_EQ(5.0, value.value) << "on_stop: hold";

  const int runs = core(other).runs;
  wait_runs(other, runs + 5);
  EXPECT_EQ(3, failing.runs);
}

TEST_F(Rule11Faults, AFaultedComponentStartsOnlyAfterCleanupAndConfigure) {
  Component& component = add("c", 1);
  std::atomic<bool> fail{true};
  core(component).work = [&] {
    if (fail) throw std::runtime_error("no");
  };
  deploy();
  wait_fault(component);
  try {
    deployer.start("c");
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(ErrorCode::faulted, error.code());
  }
  fail = false;
  component.cleanup();
  component.configure();
  deployer.start("c");
  wait_runs(component, 3);
  EXPECT_EQ(ComponentState::running, component.task().state());
  deployer.shutdown();  // before `fail` goes
}

TEST_F(Rule11Faults, ALockHeldAtAStatesEndIsAFault) {
  static auto* const mutex = new PiMutex;  // never destroyed: its holder is gone
  Component& component = add("c", 1);
  core(component).work = [] { mutex->lock(); };
  deploy();
  wait_fault(component);
  EXPECT_THAT(component.task().fault().what, ::testing::HasSubstr("lock"));
}

TEST_F(Rule11Faults, ACommitThatMeetsAFaultIsAnswered) {
  Component& component = add("c", 1);
  std::atomic<bool> fail{false};
  core(component).work = [&] {
    if (core(component).runs < 2) return;
    while (!fail) {
    }
    throw std::runtime_error("late");
  };
  deploy();
  wait_runs(component, 2);  // in mid-execution now, until told to fail
  std::thread later([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    fail = true;
  });
  EXPECT_THROW(component.swap_core(std::make_unique<TestCore>(), {.commit_ns = s_to_ns(10)}), Error);
  later.join();
  EXPECT_EQ(ComponentState::faulted, component.task().state());
}

struct BoundedFsm : TestFsm {
  void define() override {
    State& run = execution("Run", "act", &TestCore::act, ms_to_ns(20));
    State& pause = wait("Pause", ms_to_ns(5));
    set_initial(run);
    next(run, pause);
    next(pause, run);
  }
};

TEST_F(Rule11Faults, AStateOverItsDeclaredTimeIsCaughtByTheWatchdog) {
  auto& out = architecture.add_resource<SharedData<Number>>("out");
  Component& component =
      architecture.add_component<TestShell, TestCore, BoundedFsm>("c", {.cpus = {kComponentsCpu}});
  architecture.connect("c", "output", "out", "write");
  TestCore& runaway = core(component);
  std::atomic<bool> go_on{false};
  runaway.work = [&] {
    runaway.exposed_shell().output.write({4.0});
    if (runaway.runs < 3) return;
    while (!go_on) std::this_thread::yield();
    runaway.exposed_shell().output.write({4.0});
  };
  deploy();
  wait_until([&] { return component.task().state() == ComponentState::faulted; }, "the watchdog");
  EXPECT_FALSE(component.task().is_parked());
  EXPECT_THAT(component.task().fault().what, ::testing::HasSubstr("declared 20000 us"));
  go_on = true;
  wait_fault(component);
  Number value{9.0};
  time_ns_t time = 0;
  ReaderState seen;
  out.read.read(value, time, seen);
  EXPECT_EQ(0.0, value.value) << "what it wrote after it timed out does not count";
}

}  // namespace mauve::testing::test_fault
