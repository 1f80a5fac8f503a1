// SPDX-License-Identifier: LGPL-3.0-or-later
// Rule 11: the declared fallback core.
#include <sched.h>
#include <unistd.h>

#include <utility>

#include "free_fsm.hpp"

namespace mauve::testing::test_rule11_fallback {

using ::testing::ElementsAre;

std::unique_ptr<TestCore> make_core(const std::string& name) {
  auto made = std::make_unique<TestCore>();
  made->set_implementation(name);
  made->instants.reserve(10'000);
  return made;
}

double newest(SharedData<Number>& resource) {
  Number value{-1.0};
  time_ns_t time = 0;
  ReaderState seen;
  resource.read.read(value, time, seen);
  return value.value;
}

class Rule11Fallback : public Simulated {
 protected:
  /// A component of 10 ms whose core throws at its third activation, and its fallback.
  Component& add_guarded() {
    Component& component = add("c", 10, 0.0, {.offset_ns = ms_to_ns(1)});
    component.replace_core(make_core("t/Declared"));
    core(component).work = [&own = core(component)] {
      own.exposed_shell().output.write({4.0});
      if (own.runs == 3) throw std::runtime_error("division by zero");
    };
    auto spare = make_core("t/Fallback");
    spare->work = [&own = *spare] { own.exposed_shell().output.write({6.0}); };
    fallback = spare.get();
    component.set_fallback(std::move(spare));
    architecture.connect("c", "output", "out", "write");
    return component;
  }
  SharedData<Number>& out = architecture.add_resource<SharedData<Number>>("out");
  TestCore* fallback{nullptr};
};

TEST_F(Rule11Fallback, StartsInTheInitialStateAtTheNextInstantOfTheGrid) {
  Component& component = add_guarded();
  TestCore* const declared = &core(component);
  deploy();
  run_to(ms_to_ns(20));
  EXPECT_EQ("t/Declared", component.shown().core);
  EXPECT_EQ(4.0, newest(out));
  run_to(ms_to_ns(22));
  EXPECT_EQ(3, declared->runs);
  EXPECT_EQ(0.0, newest(out)) << "zeroed until the fallback writes";
  EXPECT_EQ("t/Fallback", component.shown().core);
  EXPECT_EQ(ComponentState::running, component.task().state());
  run_to(ms_to_ns(45));
  EXPECT_EQ(6.0, newest(out));
  EXPECT_EQ(3, declared->runs);
  EXPECT_EQ(fallback, &core(component));
  EXPECT_THAT(instants_ms(component), ElementsAre(31, 41));
}

TEST_F(Rule11Fallback, TheFaultIsStillTold) {
  Component& component = add_guarded();
  deploy();
  run_to(ms_to_ns(45));
  EXPECT_EQ("division by zero", component.task().fault().what);
  EXPECT_EQ("Run", component.task().fault().where);
  EXPECT_EQ(simulation.epoch_ns() + ms_to_ns(21), component.task().fault().when_ns);
  EXPECT_TRUE(component.task().has_fallen_back());
  EXPECT_EQ(1U, records_of(architecture.drain_trace(), TraceKind::fault).size());
}

TEST_F(Rule11Fallback, ItsOwnFaultIsFinal) {
  Component& component = add_guarded();
  fallback->work = [this] {
    if (fallback->runs == 2) throw std::runtime_error("nor this");
  };
  deploy();
  run_to(ms_to_ns(100));
  EXPECT_EQ(ComponentState::faulted, component.task().state());
  EXPECT_TRUE(component.task().is_parked());
  EXPECT_EQ("nor this", component.task().fault().what);
  EXPECT_THROW(host().start("c"), Error);
  EXPECT_EQ(2, fallback->runs);
}

TEST_F(Rule11Fallback, CleanupAndConfigureGiveTheDeclaredCoreAnotherChance) {
  Component& component = add_guarded();
  deploy();
  run_to(ms_to_ns(45));
  host().stop("c");
  component.cleanup();
  component.configure();
  EXPECT_EQ("t/Declared", component.shown().core);
  EXPECT_EQ("", component.task().fault().what);
  host().start("c");
  run_to(ms_to_ns(55));
  EXPECT_EQ(4.0, newest(out));
  EXPECT_FALSE(component.task().has_fallen_back());
}

struct CoreWithCleanup : TestCore {
  std::function<void()> at_cleanup = [] {};
  void cleanup_hook() override {
    std::exchange(at_cleanup, [] {})();
  }  // once
};

TEST_F(Rule11Fallback, NoStartComesIntoACleanup) {
  Component& component = add("c", 10);
  auto spare = std::make_unique<CoreWithCleanup>();
  ErrorCode refused{};
  spare->at_cleanup = [&] {
    try {
      host().start("c");
    } catch (const Error& error) {
      refused = error.code();
    }
  };
  component.set_fallback(std::move(spare));
  deploy();
  run_to(ms_to_ns(25));
  host().stop("c");
  const int runs = core(component).runs;
  component.cleanup();
  EXPECT_EQ(ErrorCode::not_configured, refused);
  EXPECT_EQ(ComponentState::unconfigured, component.task().state());
  component.configure();
  run_to(ms_to_ns(45));
  EXPECT_EQ(runs, core(component).runs);
  EXPECT_EQ(ComponentState::stopped, component.task().state());
}

TEST_F(Rule11Fallback, ACoreThatReplacesItIsGuardedByItAgain) {
  Component& component = add_guarded();
  deploy();
  run_to(ms_to_ns(45));
  ASSERT_TRUE(component.task().has_fallen_back());
  auto another = make_core("t/Another");
  another->work = [&own = *another] {
    if (own.runs == 2) throw std::runtime_error("again");
  };
  Transaction change;
  change.replace_core("c", std::move(another));
  host().commit(std::move(change));
  EXPECT_FALSE(component.task().has_fallen_back());
  EXPECT_EQ("t/Another", component.shown().core);
  fallback->instants.clear();
  run_to(ms_to_ns(85));
  EXPECT_TRUE(component.task().has_fallen_back());
  EXPECT_EQ(fallback, &core(component));
  EXPECT_THAT(instants_ms(component), ElementsAre(71, 81)) << "51 and 61 were the other's";
  EXPECT_EQ("again", component.task().fault().what);
}

TEST_F(Rule11Fallback, ItFitsANewFsmToo) {
  Component& component = add_guarded();
  deploy();
  run_to(ms_to_ns(5));
  Transaction change;
  change.replace_fsm("c", std::make_unique<FreeFsm>(varying({0}, ms_to_ns(3))));
  host().commit(std::move(change));
  run_to(ms_to_ns(26));
  EXPECT_TRUE(component.task().has_fallen_back());
  EXPECT_THAT(instants_ms(component), ElementsAre(19, 22, 25)) << "1, 13 and 16 were the declared core's";
}

TEST_F(Rule11Fallback, AnFsmReplacedUnderItKeepsIt) {
  Component& component = add_guarded();
  deploy();
  run_to(ms_to_ns(32));
  ASSERT_TRUE(component.task().has_fallen_back());
  Transaction change;
  change.replace_fsm("c", std::make_unique<FreeFsm>(varying({0}, ms_to_ns(3))));
  host().commit(std::move(change));
  fallback->instants.clear();
  run_to(ms_to_ns(47));
  EXPECT_THAT(instants_ms(component), ElementsAre(43, 46)) << "the first that is not before the pending 41";
  EXPECT_EQ("t/Fallback", component.shown().core);
}

/// Test components in all, but of another type.
struct OtherShell : TestShell {};
struct OtherCore : Core<OtherShell> {
  void act() {}
};
struct OtherFsm : Fsm<OtherShell, OtherCore> {
  void define() override {
    State& run = execution("Run", "act", &OtherCore::act);
    State& pause = wait("Pause", ms_to_ns(10));
    set_initial(run);
    next(run, pause);
    next(pause, run);
  }
};

TEST_F(Rule11Fallback, PartsThatItDoesNotSuitAreRefused) {
  Component& component = add_guarded();
  deploy();
  run_to(ms_to_ns(5));
  const std::string before = to_string(architecture.describe());
  Transaction change;
  change.replace_shell("c", std::make_unique<OtherShell>())
      .replace_fsm("c", std::make_unique<OtherFsm>())
      .replace_core("c", std::make_unique<OtherCore>());
  try {
    host().commit(std::move(change));
    FAIL() << "the component would have lost its fallback unnoticed";
  } catch (const Error& error) {
    EXPECT_EQ(ErrorCode::prepare_failed, error.code());
    EXPECT_THAT(error.what(), ::testing::HasSubstr("fallback"));
  }
  EXPECT_EQ(before, to_string(architecture.describe()));
  run_to(ms_to_ns(35));
  EXPECT_TRUE(component.task().has_fallen_back());
}

class Rule11FallbackThreads : public Deployed {};

TEST_F(Rule11FallbackThreads, IsPutInByTheComponentsOwnThread) {
  Component& component = add("c", 1);
  Component& other = add("other", 1);
  std::atomic<pid_t> threads[2] = {0, 0};
  core(component).work = [&] {
    threads[0] = gettid();
    throw std::runtime_error("at once");
  };
  auto spare = make_core("t/Fallback");
  TestCore& fallback = *spare;
  fallback.work = [&] { threads[1] = gettid(); };
  component.set_fallback(std::move(spare));
  deploy();
  wait_until([&] { return fallback.runs >= 5; }, "the fallback");
  EXPECT_EQ(threads[0].load(), threads[1].load());
  wait_runs(other, 5);
  deployer.shutdown();
  for (const time_ns_t instant : fallback.instants)
    EXPECT_EQ(0, (instant - deployer.epoch_ns()) % ms_to_ns(1));
}

TEST_F(Rule11FallbackThreads, ComesAfterTheWatchdogToo) {
  constexpr time_ns_t kBound = ms_to_ns(500);  // far over what a busy machine keeps a thread from running
  auto& out = architecture.add_resource<SharedData<Number>>("out");
  Component& component = add_free(architecture, "c",
                                  [](FreeFsm& fsm) {
                                    State& run = fsm.run("Run", kBound);
                                    State& pause = fsm.wait("Pause", ms_to_ns(5));
                                    fsm.set_initial(run);
                                    fsm.next(run, pause);
                                    fsm.next(pause, run);
                                  },
                                  {.cpus = {kComponentsCpu}});
  architecture.connect("c", "output", "out", "write");
  std::atomic<bool> go_on{false};
  core(component).work = [&, &own = core(component)] {
    own.exposed_shell().output.write({4.0});
    while (own.runs == 3 && !go_on) std::this_thread::yield();
  };
  auto spare = make_core("t/Fallback");
  TestCore& fallback = *spare;
  std::atomic<int> policy{-1};
  const ComponentsEndFirst guard(deployer);
  fallback.work = [&] {
    fallback.exposed_shell().output.write({6.0});
    policy = sched_getscheduler(0);
  };
  component.set_fallback(std::move(spare));
  deploy();
  wait_until([&] { return component.task().state() == ComponentState::faulted; }, "the watchdog");
  // FAULTED is told first, the outputs are written then.
  wait_until([&] { return newest(out) == 0.0; }, "the output, while the state is still running");
  EXPECT_EQ(0, fallback.runs) << "not before the component's own thread is free";
  go_on = true;
  wait_until([&] { return fallback.runs >= 3; }, "the fallback");
  EXPECT_EQ(6.0, newest(out)) << "its outputs are open again";
  EXPECT_THAT(component.task().fault().what, ::testing::HasSubstr("declared 500000 us"));
  if (component.task().facts().policy == "SCHED_FIFO") {
    EXPECT_EQ(SCHED_FIFO, policy) << "it has its priority back";
  }
}

TEST_F(Rule11FallbackThreads, CatchesACoreThatFaultsRightAfterItWasPutIn) {
  Component& component = add("c", 1);
  component.replace_core(make_core("t/Declared"));
  component.set_fallback(make_core("t/Fallback"));
  deploy();
  wait_runs(component, 1);
  const auto replace = [&](std::unique_ptr<TestCore> by) {
    Transaction change;
    change.replace_core("c", std::move(by));
    deployer.commit(std::move(change), {.timeouts = {.commit_ns = s_to_ns(10), .phase_ns = 0}});
  };
  for (int i = 0; i < 200; ++i) {
    auto broken = make_core("t/Broken");
    broken->work = [] { throw std::runtime_error("at its first activation"); };
    replace(std::move(broken));
    wait_until([&] { return component.task().has_fallen_back() || component.task().is_parked(); },
               "the fault");
    wait_until(
        [&] { return component.task().state() != ComponentState::faulted || component.task().is_parked(); },
        "the fallback");
    ASSERT_EQ(ComponentState::running, component.task().state()) << "round " << i;
    ASSERT_EQ("t/Fallback", component.shown().core) << "round " << i;
    replace(make_core("t/Good"));
    ASSERT_FALSE(component.task().has_fallen_back());
  }
}

TEST_F(Rule11FallbackThreads, ACommitInFlightIsRefusedByTheFault) {
  Component& component = add("c", 1);
  Component& other = add("other", 1);
  std::atomic<bool> go_on{false};
  core(component).work = [&] {
    while (!go_on) std::this_thread::yield();
    throw std::runtime_error("late");
  };
  component.set_fallback(make_core("t/Fallback"));
  deploy();
  wait_runs(component, 1);
  std::thread later([&] {
    wait_runs(other, core(other).runs + 50);  // it has voted by then, most likely
    go_on = true;
  });
  Transaction change;
  change.set_property("c", "gain", 5.0).set_property("other", "gain", 5.0);
  EXPECT_THROW(deployer.commit(std::move(change), {.timeouts = {.commit_ns = s_to_ns(20)}}), Error);
  later.join();
  EXPECT_EQ(PropertyValue(1.0), other.shown().properties[0].value);
  wait_until([&] { return component.task().state() == ComponentState::running; }, "the fallback");
  EXPECT_TRUE(component.task().has_fallen_back());
  wait_runs(component, 3);
}

}  // namespace mauve::testing::test_rule11_fallback
