// SPDX-License-Identifier: LGPL-3.0-or-later
// Rule 11: bounds are compared at each state's end and watched while it lasts, by a thread that does not poll.
#include "free_fsm.hpp"
#include "simulated.hpp"

namespace mauve::testing::test_rule11_watchdog {

constexpr time_ns_t kBound = ms_to_ns(20);

struct BoundedFsm : TestFsm {
  void define() override {
    State& run = execution("Run", "act", &TestCore::act, kBound);
    State& pause = wait("Pause", ms_to_ns(5));
    set_initial(run);
    next(run, pause);
    next(pause, run);
  }
};

class Rule11Watchdog : public Deployed {
 protected:
  ~Rule11Watchdog() override {
    go_on = true;
    deployer.shutdown();
  }
  Component& add_bounded(const std::string& name) {
    return architecture.add_component<TestShell, TestCore, BoundedFsm>(name, {.cpus = {kComponentsCpu}});
  }
  /// From its third run on the component executes until the test says `go_on`.
  void hang(Component& component) {
    TestCore& hanging = core(component);
    hanging.work = [this, &hanging] {
      if (hanging.runs < 3) return;
      is_hanging = true;
      while (!go_on) std::this_thread::yield();
    };
  }
  static void wait_faulted(const Component& component) {
    wait_until([&] { return component.task().state() == ComponentState::faulted; }, "the fault");
  }
  static void wait_parked(const Component& component) {
    wait_until([&] { return component.task().is_parked(); }, "the park");
  }

  std::atomic<bool> is_hanging{false};
  std::atomic<bool> go_on{false};
};

double value_of(SharedData<Number>& resource) {
  Number value;
  time_ns_t time = 0;
  ReaderState seen;
  resource.read.read(value, time, seen);
  return value.value;
}

TEST_F(Rule11Watchdog, SleepsForEverWhereNobodyDeclaresABound) {
  Component& component = add("c", 1);
  deploy();
  wait_runs(component, 3);
  const std::uint64_t looks = deployer.watchdog()->looks();
  wait_runs(component, 200);
  EXPECT_EQ(looks, deployer.watchdog()->looks());
}

TEST_F(Rule11Watchdog, LooksAtMostOnceInAMillisecond) {
  Component& component = add_bounded("c");
  deploy();
  wait_runs(component, 3);
  const std::uint64_t looks = deployer.watchdog()->looks();
  const time_ns_t began = monotonic_now_ns();
  wait_runs(component, 50);
  const std::uint64_t looked = deployer.watchdog()->looks() - looks;
  EXPECT_GT(looked, 0U);
  EXPECT_LE(looked, static_cast<std::uint64_t>((monotonic_now_ns() - began) / ms_to_ns(1)) + 1);
}

TEST_F(Rule11Watchdog, AnExecutionOverItsBoundIsAlwaysFoundAtItsEnd) {
  Component& component = add_bounded("c");
  TestCore& late = core(component);
  late.work = [&late] {
    if (late.runs != 3) return;
    const time_ns_t until = monotonic_now_ns() + kBound + us_to_ns(1);
    while (monotonic_now_ns() < until) {
    }
  };
  deploy();
  wait_faulted(component);
  wait_parked(component);
  EXPECT_EQ("the state ran longer than its declared 20000 us", component.task().fault().what);
  EXPECT_EQ("Run", component.task().fault().where);
  EXPECT_EQ(3, late.runs);
}

// With RealtimeSanitizer also that its thread frees nothing of what the fault before was.
TEST_F(Rule11Watchdog, AFallbackIsWatchedTooAndItsFaultIsTheOneTold) {
  Component& component = add_bounded("c");
  core(component).work = [] { throw std::runtime_error("a text too long to be kept in place"); };
  auto spare = std::make_unique<TestCore>();
  spare->work = [this] {
    is_hanging = true;
    while (!go_on) std::this_thread::yield();
  };
  component.set_fallback(std::move(spare));
  deploy();
  wait_until([&] { return is_hanging.load(); }, "the fallback");
  wait_faulted(component);
  EXPECT_EQ("the state ran longer than its declared 20000 us", component.task().fault().what.substr(0, 47));
  go_on = true;
  wait_parked(component);
}

TEST_F(Rule11Watchdog, AnAddedComponentIsWatchedToo) {
  add("c", 1);
  deploy();
  auto fresh = std::make_unique<TestCore>();
  TestCore& late = *fresh;
  late.work = [this] {
    while (!go_on) std::this_thread::yield();
  };
  Transaction transaction;
  transaction
      .add_component("new", Parts{.shell = std::make_unique<TestShell>(),
                                  .core = std::move(fresh),
                                  .fsm = std::make_unique<BoundedFsm>()})
      .start("new");
  deployer.commit(std::move(transaction), {.timeouts = {.phase_ns = 0}});
  wait_faulted(architecture.component("new"));
  EXPECT_FALSE(architecture.component("new").task().is_parked());
}

/// One that hangs with the lock of the resource that its output leads to.
struct Locked : Resource {
  struct Write final : WriteService<Number> {
    explicit Write(Locked& owner) : WriteService<Number>("write"), owner(owner) {}
    bool write(const Number& /*value*/, time_ns_t /*time_ns*/) noexcept override {
      const std::lock_guard lock(owner.mutex);
      ++owner.writes;
      return true;
    }
    Locked& owner;
  };
  Locked() : Resource("locked", "") { offer(write); }

  PiMutex mutex;
  std::atomic<int> writes{0};
  Write write{*this};
};

TEST_F(Rule11Watchdog, WaitsForNoLockThatTheTimedOutOneHolds) {
  auto& locked = architecture.add_resource<Locked>("locked");
  auto& free = architecture.add_resource<SharedData<Number>>("free");
  Component& component = add_bounded("c");
  Component& second = add_bounded("second");
  architecture.connect("c", "output", "locked", "write");
  architecture.connect("second", "output", "free", "write");
  TestCore& hanging = core(component);
  hanging.work = [this, &hanging, &locked] {
    if (hanging.runs < 3) return;
    const std::lock_guard lock(locked.mutex);
    is_hanging = true;
    while (!go_on) std::this_thread::yield();
  };
  TestCore& other = core(second);
  other.work = [this, &other] {
    other.exposed_shell().output.write({4.0});
    while (is_hanging && !go_on) std::this_thread::yield();
  };
  deploy();
  wait_faulted(component);
  wait_faulted(second);
  wait_until([&] { return value_of(free) == 0.0; }, "the second one's output");
  EXPECT_THAT(component.task().fault().what, ::testing::HasSubstr("an output is not written yet"));
  EXPECT_EQ(0, locked.writes);
  go_on = true;
  wait_parked(component);
  EXPECT_THAT(component.task().fault().what, ::testing::Not(::testing::HasSubstr("not written")));
  EXPECT_GT(locked.writes, 0);
}

TEST_F(Rule11Watchdog, ATimedOutComponentIsReplacedWhileItsThreadRuns) {
  architecture.add_resource<LatestValue<Number>>("value");
  Component& component = add_bounded("c");
  architecture.connect("c", "output", "value", "write");
  hang(component);
  const std::shared_ptr<Component> old = [&] {
    deploy();
    return architecture.hold_component("c");
  }();
  wait_faulted(component);
  Transaction transaction;
  transaction.remove_component("c")
      .add_component("c", Parts{.shell = std::make_unique<TestShell>(),
                                .core = std::make_unique<TestCore>(),
                                .fsm = std::make_unique<TestFsm>()})
      .connect("c", "output", "value", "write")  // whose one place the old one held
      .start("c");
  deployer.commit(std::move(transaction), {.timeouts = {.phase_ns = 0}});
  EXPECT_FALSE(go_on) << "the old thread was not waited for";
  wait_runs(architecture.component("c"), 3);
  EXPECT_EQ(1U, architecture.threads_left_behind());
  old->shell_as<TestShell>().output.write({9.0});
  Number value;
  time_ns_t time = 0;
  ReaderState seen;
  auto& resource = dynamic_cast<LatestValue<Number>&>(architecture.resource("value"));
  resource.read.read(value, time, seen);
  EXPECT_NE(9.0, value.value) << "its late writes reach nobody";
  go_on = true;
  wait_until([&] { return architecture.threads_left_behind() == 0; }, "the old thread's end");
  deployer.set_property("c", "gain", 2.0, {.phase_ns = 0});  // reaps it
  EXPECT_EQ(1, old.use_count());
}

TEST_F(Rule11Watchdog, ARefusedRemovalLeavesTheTimedOutOneAsItWas) {
  Component& component = add_bounded("c");
  add("other", 1);
  hang(component);
  deploy();
  wait_faulted(component);
  auto refusing = std::make_unique<TestCore>();
  struct Refusing : TestCore {
    bool adopt(const CoreBase& /*old*/) override { return false; }
  };
  Transaction transaction;
  transaction.remove_component("c").replace_core("other", std::make_unique<Refusing>());
  EXPECT_THROW(deployer.commit(std::move(transaction)), Error);
  EXPECT_EQ(0U, architecture.threads_left_behind());
  go_on = true;
  wait_parked(component);
  EXPECT_EQ(ComponentState::faulted, component.task().state());
}

TEST_F(Rule11Watchdog, ATimedOutComponentThatStillExecutesCannotBeRepairedInPlace) {
  Component& component = add_bounded("c");
  hang(component);
  deploy();
  wait_faulted(component);
  Transaction transaction;
  transaction.replace_core("c", std::make_unique<TestCore>());
  try {
    deployer.commit(std::move(transaction));
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(ErrorCode::faulted, error.code());
    EXPECT_THAT(error.detail().remedy, ::testing::HasSubstr("remove the component and add it anew"));
  }
}

TEST_F(Rule11Watchdog, TimesOutWhateverExecutionIsUnderWayOnDemand) {
  Component& component = add_bounded("c");
  TestCore& waiting = core(component);
  waiting.work = [this] {
    is_hanging = true;
    while (!go_on) std::this_thread::yield();
  };
  deploy();
  wait_until([&] { return is_hanging.load(); }, "the execution");
  EXPECT_TRUE(component.task().time_out("asked for", monotonic_now_ns()) ||
              component.task().state() == ComponentState::faulted);
  EXPECT_FALSE(component.task().time_out("asked for", monotonic_now_ns())) << "it has timed out already";
  go_on = true;
  wait_parked(component);
  EXPECT_FALSE(component.task().time_out("asked for", monotonic_now_ns())) << "nothing is under way";
}

/// An architecture that goes while a thread still executes leaves that thread what it uses.
TEST(Rule11LeftBehind, AnArchitectureDoesNotWaitForAThreadThatDoesNotComeBack) {
  static std::atomic<bool> go_on{false};
  static std::atomic<bool> has_ended{false};
  static std::atomic<bool> is_hanging{false};
  {
    Architecture architecture;
    auto& component =
        architecture.add_component<TestShell, TestCore, BoundedFsm>("c", {.cpus = {kComponentsCpu}});
    component.core_as<TestCore>().work = [] {
      is_hanging = true;
      while (!go_on) std::this_thread::yield();
      has_ended = true;
    };
    architecture.configure();
    Deployer deployer(architecture);
    deployer.deploy();
    wait_until([] { return is_hanging.load(); }, "the execution");
  }
  EXPECT_FALSE(has_ended);
  go_on = true;
  wait_until([] { return has_ended.load(); }, "its end");
}

class Rule11SimulatedBound : public Simulated {};

struct CostlyFsm : TestFsm {
  void define() override {
    State& run = execution("Run", "act", &TestCore::act, ms_to_ns(1));
    run.simulated_execution_ns = us_to_ns(static_cast<std::int64_t>(shell().gain.value() * 1000));
    State& pause = wait("Pause", ms_to_ns(5));
    set_initial(run);
    next(run, pause);
    next(pause, run);
  }
};

TEST_F(Rule11SimulatedBound, IsComparedAtTheEndInVirtualTimeToo) {
  Component& on_time = architecture.add_component<TestShell, TestCore, CostlyFsm>("on_time");
  Component& late = architecture.add_component<TestShell, TestCore, CostlyFsm>("late");
  late.set_property("gain", 1.5);
  deploy();
  run_to(ms_to_ns(12));
  EXPECT_EQ(ComponentState::running, on_time.task().state()) << "equality is on time";
  EXPECT_EQ(ComponentState::faulted, late.task().state());
  EXPECT_EQ("the state ran longer than its declared 1000 us", late.task().fault().what);
  EXPECT_EQ(1, core(late).runs);
}

}  // namespace mauve::testing::test_rule11_watchdog
