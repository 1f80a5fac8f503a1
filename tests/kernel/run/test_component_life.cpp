// SPDX-License-Identifier: LGPL-3.0-or-later
// The edges of a component's life: each works as it is documented, or is refused with a typed error, and nothing hangs.
#include "free_fsm.hpp"
#include "hosts.hpp"

namespace mauve::testing::test_component_life {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

template <typename Host>
class ComponentLife : public OnBothHosts<Host> {
 protected:
  /// Starts are refused in every way there is, for want of a core.
  void expect_no_start(Component& component) {
    std::string text;
    EXPECT_EQ(ErrorCode::not_configured, this->code_of([&] { this->host.start(component.name()); }, &text));
    EXPECT_THAT(text, HasSubstr("core "));
    EXPECT_THAT(text, HasSubstr("configure_core"));
    EXPECT_EQ(ErrorCode::not_configured, this->code_of([&] {
      Transaction transaction;
      transaction.start(component.name());
      this->host.commit(std::move(transaction));
    }));
    EXPECT_EQ(ComponentState::stopped, component.task().state());
  }
};
TYPED_TEST_SUITE(ComponentLife, EveryHost, HostNames);

struct OtherShell : Shell {};
struct OtherCore : Core<OtherShell> {};
struct BadCore : TestCore {
  bool configure_hook() override { throw 42; }
};

// ---- a core that is not configured

TYPED_TEST(ComponentLife, AnUnconfiguredCoreDoesNotStart) {
  Component& component = this->add("c");
  this->deploy();
  this->wait_runs(component, 2);
  this->host.stop("c");

  component.cleanup_core();
  this->expect_no_start(component);
  component.replace_core(std::make_unique<TestCore>());
  this->expect_no_start(component);
  component.replace_core(std::make_unique<OtherCore>());
  EXPECT_EQ(ErrorCode::type_mismatch, this->code_of([&] { component.configure_core(); }));
  this->expect_no_start(component);
  component.replace_core(std::make_unique<BadCore>());
  EXPECT_EQ(ErrorCode::configure_failed, this->code_of([&] { component.configure_core(); }));
  this->expect_no_start(component);

  component.replace_core(std::make_unique<TestCore>());
  component.configure_core();
  this->host.start("c");
  this->wait_runs(component, 2);
}

TYPED_TEST(ComponentLife, ATransactionThatPutsACoreInMayStartIt) {
  Component& component = this->add("c");
  this->deploy();
  this->wait_runs(component, 1);
  this->host.stop("c");
  component.cleanup_core();
  Transaction transaction;
  transaction.start("c").replace_core("c", std::make_unique<TestCore>());
  this->host.commit(std::move(transaction));
  this->wait_runs(component, 2);
}

TYPED_TEST(ComponentLife, AnArchitectureWithAnUnconfiguredCoreIsNotDeployed) {
  Component& component = this->add("c");
  this->architecture.configure();
  component.cleanup_core();
  EXPECT_EQ(ErrorCode::not_configured, this->code_of([&] { (*this->host).deploy(); }));
  EXPECT_EQ(0, this->core(component).runs);
}

// ---- waits without an end of their own

TYPED_TEST(ComponentLife, AWaitForEverLastsUntilTheStop) {
  Component& component = add_free(this->architecture, "c", [](FreeFsm& fsm) {
    State& run = fsm.run("Run");
    fsm.set_initial(run);
    fsm.next(run, fsm.wait("Rest", kForever));
  });
  Component& clocked = this->add("clocked");
  this->deploy();
  this->wait_runs(component, 1);
  this->wait_runs(clocked, 20);
  EXPECT_EQ(1, this->core(component).runs);
  EXPECT_EQ(0U, component.task().statistics().overruns);
  EXPECT_EQ(0, component.task().grid().period_ns) << "no cycle, no period";
  this->host.stop("c");
  EXPECT_EQ(ComponentState::stopped, component.task().state());
  this->host.start("c");
  this->wait_runs(component, 2);
}

TYPED_TEST(ComponentLife, AWaitForEverIsAPlaceToPutANewCoreIn) {
  Component& component = add_free(this->architecture, "c", [](FreeFsm& fsm) {
    State& run = fsm.run("Run");
    fsm.set_initial(run);
    fsm.next(run, fsm.wait("Rest", kForever));
  });
  this->deploy();
  this->wait_runs(component, 1);
  Transaction transaction;
  transaction.replace_core("c", std::make_unique<TestCore>());
  const TransactionReport report = this->host.commit(std::move(transaction));
  EXPECT_TRUE(report.is_complete) << "no release follows that could be waited for";
  EXPECT_EQ(0, report.steps.front().missed_releases);
  EXPECT_EQ(ComponentState::running, component.task().state());
}

// ---- guards on waits

TYPED_TEST(ComponentLife, AWaitsGuardIsAskedWhenTheWaitHasEnded) {
  Component& component = add_free(this->architecture, "c", [](FreeFsm& fsm) {
    State& rest = fsm.wait("Rest", ms_to_ns(1));
    State& usual = fsm.run("Usual");
    State& special = fsm.run("Special");
    fsm.set_initial(usual);
    fsm.next(usual, rest);
    fsm.next(special, rest);
    fsm.next(rest, usual);
    fsm.when_set(rest, special);
  });
  std::vector<std::string> entered;
  TestCore& core = this->core(component);
  entered.reserve(1'000);
  core.work = [&] {
    if (entered.size() < 1'000) entered.push_back(component.task().current_state());
    core.condition = entered.size() == 2;  // for the wait that follows
  };
  this->deploy();
  this->wait_runs(component, 4);
  this->host.stop("c");
  entered.resize(4);
  EXPECT_THAT(entered, ElementsAre("Usual", "Usual", "Special", "Usual"));
}

TYPED_TEST(ComponentLife, AnEventWaitsGuardIsAskedWhenItHasEnded) {
  Component& component = add_free(this->architecture, "c", [](FreeFsm& fsm) {
    State& rest = fsm.wait_event("Rest", fsm.ports().input, ms_to_ns(1), us_to_ns(500));
    State& usual = fsm.run("Usual");
    State& special = fsm.run("Special");
    fsm.set_initial(usual);
    fsm.next(usual, rest);
    fsm.next(special, rest);
    fsm.next(rest, usual);
    fsm.when_set(rest, special);
  });
  this->architecture.template add_resource<SharedData<Number>>("number");
  this->architecture.connect("c", "input", "number", "read");
  std::atomic<bool> was_special{false};
  this->core(component).condition = true;
  this->core(component).work = [&] {
    if (component.task().current_state() == "Special") was_special = true;
  };
  this->deploy();
  this->host.until([&] { return was_special.load(); }, "the special state");
  this->host.stop("c");
}

struct ThrowingGuard : TestCore {
  bool check() { throw 42; }
};
struct ThrowingGuardFsm : Fsm<TestShell, ThrowingGuard> {
  void define() override {
    State& run = execution("Run", "act", &ThrowingGuard::act);
    State& rest = wait("Rest", ms_to_ns(1));
    set_initial(run);
    next(run, rest);
    next(rest, run);
    transition(rest, "check", &ThrowingGuard::check, run);
  }
};

TYPED_TEST(ComponentLife, AWaitsGuardThatThrowsIsAFaultOfThatWait) {
  Component& component =
      this->architecture.template add_component<TestShell, ThrowingGuard, ThrowingGuardFsm>("c");
  this->deploy();
  this->wait_state(component, ComponentState::faulted);
  EXPECT_EQ("Rest", component.task().fault().where);
}

// ---- commands from a state

TYPED_TEST(ComponentLife, AStateMayStopItsOwnComponent) {
  Component& component = this->add("c");
  TestCore& core = this->core(component);
  std::atomic<int> after{0};
  std::atomic<bool> is_deployed{false};
  core.work = [&] {
    if (!is_deployed.exchange(false)) return;
    this->host.stop("c", kForever);  // waits for nobody
    after = 1;
  };
  this->deploy();
  is_deployed = true;
  this->wait_state(component, ComponentState::stopped);
  EXPECT_EQ(1, after) << "the state ran to its end";
  const int runs = core.runs;
  this->host.start("c");
  this->wait_runs(component, runs + 2);
  this->host.shutdown();  // before what the state uses is gone
}

TYPED_TEST(ComponentLife, AStateMayNotStartItsOwnComponent) {
  Component& component = this->add("c");
  TestCore& core = this->core(component);
  std::atomic<int> code{-1};
  std::atomic<bool> is_deployed{false};
  core.work = [&] {
    if (!is_deployed.exchange(false)) return;
    try {
      this->host.start("c");
    } catch (const Error& error) {
      code = static_cast<int>(error.code());
    }
  };
  this->deploy();
  is_deployed = true;
  this->host.until([&] { return code >= 0; }, "the refusal");
  EXPECT_EQ(static_cast<int>(ErrorCode::already_running), code);
  this->host.shutdown();  // before what the state uses is gone
}

TYPED_TEST(ComponentLife, AStateMayStopAndStartAnotherComponent) {
  Component& component = this->add("c");
  Component& other = this->add("other");
  TestCore& core = this->core(component);
  std::atomic<int> asked{0};  // from here: 1 stop, 2 start
  core.work = [&] {
    const int wanted = asked.exchange(0);
    if (wanted == 1) this->host.stop("other");
    if (wanted == 2) this->host.start("other");
  };
  this->deploy();
  asked = 1;
  this->wait_state(other, ComponentState::stopped);
  asked = 2;
  const int seen = this->core(other).runs;
  this->wait_runs(other, seen + 2);
  EXPECT_EQ(ComponentState::running, component.task().state());
  this->host.shutdown();  // before what the state uses is gone
}

// ---- throw 42

struct ThrowsOnCleanup : TestCore {
  void cleanup_hook() override { throw 42; }
};
struct ThrowsOnAdopt : TestCore {
  bool adopt(const CoreBase&) override { throw 42; }
};

TYPED_TEST(ComponentLife, WhateverAHookThrowsIsATypedError) {
  Component& component = this->add("c");
  this->deploy();
  this->wait_runs(component, 1);
  const auto replace = [&](std::unique_ptr<CoreBase> core) {
    Transaction transaction;
    transaction.replace_core("c", std::move(core));
    this->host.commit(std::move(transaction));
  };
  EXPECT_EQ(ErrorCode::prepare_failed, this->code_of([&] { replace(std::make_unique<BadCore>()); }));
  EXPECT_EQ(ErrorCode::adopt_refused, this->code_of([&] { replace(std::make_unique<ThrowsOnAdopt>()); }));
  replace(std::make_unique<ThrowsOnCleanup>());
  replace(
      std::make_unique<TestCore>());  // the one that is out cannot be cleaned up: nobody's concern any more
  this->wait_runs(component, 2);
}

TEST(AnIntegerThrown, IsAConfigureFailure) {
  Architecture architecture;
  architecture.add_component("c", std::make_unique<TestShell>(), std::make_unique<BadCore>(),
                             std::make_unique<TestFsm>(), {});
  try {
    architecture.configure();
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(ErrorCode::configure_failed, error.code());
    EXPECT_EQ("c", error.detail().component);
  }
  EXPECT_FALSE(architecture.is_configured());
}

TEST(AnIntegerThrown, ByAPlugInsFactoryIsAPlugInError) {
  PluginRegistry registry;
  registry.add_core("p/Core", "p/Shell", []() -> std::unique_ptr<CoreBase> { throw 42; });
  registry.add_core("p/None", "p/Shell", []() -> std::unique_ptr<CoreBase> { return nullptr; });
  for (const char* name : {"p/Core", "p/None"}) {
    try {
      registry.make_core(name);
      FAIL();
    } catch (const Error& error) {
      EXPECT_EQ(ErrorCode::plugin, error.code());
      EXPECT_THAT(error.what(), HasSubstr(name));
    }
  }
}

// ---- locks

TYPED_TEST(ComponentLife, ALockTakenTwiceIsAFaultAndNoHang) {
  PiMutex mutex;
  Component& component = this->add("c");
  Component& neighbour = this->add("neighbour");
  this->core(component).work = [&] {
    const std::lock_guard once(mutex);
    const std::lock_guard twice(mutex);
  };
  this->core(neighbour).work = [&] { const std::lock_guard lock(mutex); };
  this->deploy();
  this->wait_state(component, ComponentState::faulted);
  EXPECT_THAT(component.task().fault().what, HasSubstr("taken twice"));
  EXPECT_EQ("Run", component.task().fault().where);
  const int seen = this->core(neighbour).runs;
  this->wait_runs(neighbour, seen + 2);
  this->host.shutdown();
}

TYPED_TEST(ComponentLife, ALockThatIsKeptIsAFaultAndFreeAgain) {
  PiMutex mutex;
  Component& component = this->add("c");
  Component& neighbour = this->add("neighbour");
  this->core(component).work = [&] { mutex.lock(); };
  this->core(neighbour).work = [&] { const std::lock_guard lock(mutex); };
  this->deploy();
  this->wait_state(component, ComponentState::faulted);
  const int seen = this->core(neighbour).runs;
  this->wait_runs(neighbour, seen + 2);
  this->host.shutdown();
}

TYPED_TEST(ComponentLife, ALockDestroyedOrLetGoUnheldIsAFault) {
  PiMutex mutex;
  Component& destroys = this->add("destroys");
  Component& unlocks = this->add("unlocks");
  this->core(destroys).work = [] {
    PiMutex gone;
    gone.lock();
  };
  this->core(unlocks).work = [&] { mutex.unlock(); };
  this->deploy();
  this->wait_state(destroys, ComponentState::faulted);
  this->wait_state(unlocks, ComponentState::faulted);
  this->host.shutdown();
  EXPECT_EQ(0, PiMutex::held_by_this_thread());
}

// ---- instants

TYPED_TEST(ComponentLife, AClockInTheFutureIsTheStart) {
  Component& component = this->add("c", 10);
  this->deploy();
  this->wait_runs(component, 1);
  this->host.stop("c");
  this->core(component).instants.clear();
  const int seen = this->core(component).runs;
  const time_ns_t start = this->host.now_ns() + ms_to_ns(55);
  this->host.start("c", start);
  this->wait_runs(component, seen + 2);
  this->host.stop("c");
  ASSERT_GE(this->core(component).instants.size(), 2U);
  EXPECT_EQ(start, this->core(component).instants[0]);
  EXPECT_EQ(0, (this->core(component).instants[1] - start) % ms_to_ns(10));
  EXPECT_EQ(start, component.task().get_time() -
                       (component.task().get_time() - start) / ms_to_ns(10) * ms_to_ns(10));
}

TYPED_TEST(ComponentLife, AnyClockWillDo) {
  Component& component = this->add("c", 10);
  this->deploy();
  this->wait_runs(component, 1);
  for (const time_ns_t clock : {INT64_MIN, time_ns_t{-1}, time_ns_t{0}, time_ns_t{7}}) {
    this->host.stop("c");
    const int seen = this->core(component).runs;
    this->core(component).instants.clear();
    const time_ns_t before = this->host.now_ns();
    this->host.start("c", clock);
    this->wait_runs(component, seen + 1);
    this->host.stop("c");
    const time_ns_t first = this->core(component).instants.front();
    EXPECT_GT(first, before + us_to_ns(200));
    EXPECT_EQ(0, (Grid{.reference_ns = clock, .period_ns = ms_to_ns(10)}.phase_error(first)));
    this->host.start("c");
  }
  this->host.stop("c");
  this->host.start("c", INT64_MAX);  // it waits for that
  this->host.stop("c");
  EXPECT_EQ(ComponentState::stopped, component.task().state());
}

TYPED_TEST(ComponentLife, AnOffsetBeyondThePeriodDelaysTheFirstRelease) {
  Component& component = this->add("c", 1, {.offset_ns = us_to_ns(25'300)});
  this->deploy();
  this->wait_runs(component, 1);
  component.task().stop();  // then nobody writes there any more
  EXPECT_EQ(this->architecture.deployment_epoch_ns() + us_to_ns(25'300),
            this->core(component).instants.front());
}

TEST(Settings, OutOfRangeAreRefusedWhereTheyAreGiven) {
  const auto code_of = [](const TaskSettings& settings) {
    Architecture architecture;
    try {
      architecture.add_component<TestShell, TestCore, TestFsm>("c", settings);
    } catch (const Error& error) {
      EXPECT_EQ("c", error.detail().component);
      return error.code();
    }
    return ErrorCode::internal;
  };
  EXPECT_EQ(ErrorCode::out_of_range, code_of({.offset_ns = -5}));
  EXPECT_EQ(ErrorCode::out_of_range, code_of({.offset_ns = INT64_MAX}));
  EXPECT_EQ(ErrorCode::out_of_range, code_of({.cpus = {-1}}));
  EXPECT_EQ(ErrorCode::out_of_range, code_of({.cpus = {5'000}}));
  EXPECT_EQ(ErrorCode::out_of_range, code_of({.priority = 0}));
  EXPECT_EQ(ErrorCode::out_of_range, code_of({.priority = 99}));
  EXPECT_EQ(ErrorCode::out_of_range, code_of({.stack_bytes = 65'535}));
  EXPECT_EQ(ErrorCode::out_of_range, code_of({.trace_records = 1}));
}

TEST(Settings, CpusThatTheMachineLacksAreToldAtDeployment) {
  Architecture architecture;
  architecture.add_component<TestShell, TestCore, TestFsm>("here");
  architecture.add_component<TestShell, TestCore, TestFsm>("c", {.cpus = {CPU_SETSIZE - 1}});
  architecture.configure();
  Deployer deployer(architecture);
  try {
    deployer.deploy();
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(ErrorCode::invalid_argument, error.code());
    EXPECT_EQ("c", error.detail().component);
    EXPECT_THAT(error.detail().remedy, HasSubstr("cpus"));
  }
  EXPECT_FALSE(deployer.is_deployed());
}

TEST(Timeouts, MayLastForEver) {
  Architecture architecture;
  Component& component = architecture.add_component<TestShell, TestCore, TestFsm>("c");
  std::atomic<bool> ends{false};
  std::atomic<bool> begun{false};
  component.core_as<TestCore>().work = [&] {
    begun = true;
    while (!ends) std::this_thread::sleep_for(std::chrono::microseconds(100));
  };
  architecture.configure();
  Deployer deployer(architecture);
  deployer.deploy();
  wait_until([&] { return begun.load(); }, "the state");
  std::atomic<bool> stopped{false};
  std::thread stopper([&] {
    deployer.stop("c", kForever);
    stopped = true;
  });
  wait_until([&] { return component.task().state() == ComponentState::stopping; }, "the stop");
  EXPECT_FALSE(stopped);
  ends = true;
  stopper.join();
  EXPECT_TRUE(stopped);
  deployer.start("c");
  deployer.set_property("c", "gain", 2.0, {.commit_ns = kForever, .phase_ns = kForever});
}

}  // namespace mauve::testing::test_component_life
