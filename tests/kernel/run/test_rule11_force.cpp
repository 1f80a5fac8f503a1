// SPDX-License-Identifier: LGPL-3.0-or-later
// Rule 11: a component whose state does not end, without a declared bound, is stopped and removed by force.
#include <random>

#include "free_fsm.hpp"

namespace mauve::testing::test_rule11_force {

using ::testing::HasSubstr;

constexpr time_ns_t kShort = ms_to_ns(20);
constexpr time_ns_t kEnough = s_to_ns(20);  // for a component that is well, on a busy machine
constexpr TransactionOptions kForce{.timeouts = {.commit_ns = ms_to_ns(50), .phase_ns = 0}, .force = true};

class Rule11Force : public Deployed {
 protected:
  ~Rule11Force() override {
    go_on = true;
    deployer.shutdown();
  }
  /// From its third run on the component executes until the test says `go_on`.
  void hang(Component& component) {
    TestCore& hanging = core(component);
    hanging.work = [this, &hanging] {
      hanging.exposed_shell().output.write({4.0});
      if (hanging.runs < 3) return;
      is_hanging = true;
      while (!go_on) std::this_thread::sleep_for(std::chrono::microseconds(100));
    };
  }
  void deploy_and_hang(Component& component) {
    hang(component);
    deploy();
    wait_until([this] { return is_hanging.load(); }, "the state that does not end");
  }
  ErrorCode refused(Transaction& transaction, const TransactionOptions& options,
                    std::string* remedy = nullptr) {
    try {
      deployer.commit(std::move(transaction), options);
    } catch (const Error& error) {
      if (remedy != nullptr) *remedy = error.detail().remedy;
      return error.code();
    }
    ADD_FAILURE() << "it was not refused";
    return ErrorCode::internal;
  }
  static Parts fresh_parts() {
    return {.shell = std::make_unique<TestShell>(),
            .core = std::make_unique<TestCore>(),
            .fsm = std::make_unique<TestFsm>()};
  }
  ComponentState state(const std::string& name) const { return architecture.component(name).task().state(); }
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

TEST_F(Rule11Force, AStopByForceGivesUpAStateThatDoesNotEnd) {
  auto& output = architecture.add_resource<SharedData<Number>>("output");
  Component& component = add("c");
  Component& neighbour = add("neighbour");
  architecture.connect("c", "output", "output", "write");
  deploy_and_hang(component);
  EXPECT_EQ(4.0, value_of(output));
  EXPECT_THROW(deployer.stop("c", kShort), Error);
  EXPECT_EQ(ComponentState::stopping, state("c")) << "without force it stays pending";
  EXPECT_TRUE(deployer.stop("c", {.timeout_ns = kShort, .force = true}));
  EXPECT_EQ(ComponentState::faulted, state("c"));
  EXPECT_EQ(0.0, value_of(output)) << "written by the return";
  EXPECT_FALSE(component.task().is_parked()) << "its thread is left behind";
  EXPECT_TRUE(component.task().is_left_behind());
  EXPECT_EQ("stopped by force while state Run was executing", component.task().fault().what);
  EXPECT_EQ("Run", component.task().fault().where);
  EXPECT_THROW(deployer.stop("c", {.timeout_ns = kShort, .force = true}), Error) << "it is FAULTED already";
  EXPECT_THROW(deployer.start("c"), Error);
  wait_runs(neighbour, core(neighbour).runs + 10);
  const int runs = core(component).runs;
  go_on = true;
  wait_parked(component);
  EXPECT_EQ(ComponentState::faulted, state("c"));
  EXPECT_EQ("stopped by force while state Run was executing", component.task().fault().what);
  EXPECT_EQ(runs, core(component).runs) << "it went no further than the end of the state";
  EXPECT_FALSE(component.task().is_left_behind());
}

TEST_F(Rule11Force, AfterItsStateHasEndedItIsRepairedInPlace) {
  Component& component = add("c");
  deploy_and_hang(component);
  EXPECT_TRUE(deployer.stop("c", {.timeout_ns = kShort, .force = true}));
  go_on = true;
  wait_parked(component);
  Transaction transaction;
  transaction.configure("c").start("c");
  deployer.commit(std::move(transaction), {.timeouts = {.commit_ns = kEnough, .phase_ns = 0}});
  wait_runs(component, core(component).runs + 3);
  EXPECT_FALSE(deployer.stop("c", {.timeout_ns = kEnough, .force = true}));
  EXPECT_EQ(ComponentState::stopped, state("c"));
}

TEST_F(Rule11Force, AGuardThatDoesNotEndIsGivenUpToo) {
  struct Guarded : TestCore {
    bool is_set_or_hangs() const {
      if (runs < 3) return false;
      *is_hanging = true;
      while (!*go_on) std::this_thread::sleep_for(std::chrono::microseconds(100));
      return false;
    }
    std::atomic<bool>* is_hanging{nullptr};
    std::atomic<bool>* go_on{nullptr};
  };
  struct GuardedFsm : Fsm<TestShell, Guarded> {
    void define() override {
      State& run = execution("Run", "act", &TestCore::act);
      State& pause = wait("Pause", ms_to_ns(1));
      set_initial(run);
      next(run, pause);
      transition(pause, "is_set_or_hangs", &Guarded::is_set_or_hangs, pause);
      next(pause, run);
    }
  };
  auto& component =
      architecture.add_component<TestShell, Guarded, GuardedFsm>("c", {.cpus = {kComponentsCpu}});
  component.core_as<Guarded>().is_hanging = &is_hanging;
  component.core_as<Guarded>().go_on = &go_on;
  deploy();
  wait_until([this] { return is_hanging.load(); }, "the guard that does not end");
  EXPECT_TRUE(deployer.stop("c", {.timeout_ns = kShort, .force = true}));
  EXPECT_EQ("stopped by force while state Pause was executing", component.task().fault().what);
  go_on = true;
  wait_parked(component);
  EXPECT_EQ(ComponentState::faulted, state("c"));
}

TEST_F(Rule11Force, AFallbackDoesNotReplaceWhatWasStoppedByForce) {
  Component& component = add("c");
  component.set_fallback(std::make_unique<TestCore>());
  deploy_and_hang(component);
  EXPECT_TRUE(deployer.stop("c", {.timeout_ns = kShort, .force = true}));
  go_on = true;
  wait_parked(component);
  EXPECT_EQ(ComponentState::faulted, state("c"));
}

TEST_F(Rule11Force, ARemovalByForceGoesOnWithoutTheThread) {
  architecture.add_resource<LatestValue<Number>>("value");
  Component& component = add("c");
  architecture.connect("c", "output", "value", "write");
  deploy_and_hang(component);
  const auto exchange = [] {
    Transaction transaction;
    transaction.remove_component("c")
        .add_component("c", fresh_parts())
        .connect("c", "output", "value", "write")
        .start("c");
    return transaction;
  };
  Transaction without = exchange();
  TransactionOptions options = kForce;
  options.force = false;
  EXPECT_EQ(ErrorCode::timeout, refused(without, options));
  EXPECT_EQ(ComponentState::running, state("c")) << "without force nothing changes";
  EXPECT_EQ(0U, architecture.threads_left_behind());
  deployer.commit(exchange(), kForce);
  EXPECT_FALSE(go_on) << "the old thread was not waited for";
  EXPECT_EQ(1U, architecture.threads_left_behind());
  wait_runs(architecture.component("c"), 3);
  go_on = true;
  wait_until([&] { return architecture.threads_left_behind() == 0; }, "the old thread's end");
  EXPECT_EQ(ComponentState::running, state("c"));
}

TEST_F(Rule11Force, AStopStepByForceLetsTheOtherStepsTakeEffect) {
  Component& component = add("c");
  Component& other = add("other");
  deploy_and_hang(component);
  Transaction transaction;
  transaction.stop("c").set_property("other", "gain", 3.0);
  deployer.commit(std::move(transaction), kForce);
  EXPECT_EQ(ComponentState::faulted, state("c"));
  EXPECT_EQ("stopped by force while state Run was executing", component.task().fault().what);
  EXPECT_EQ(3.0, core(other).exposed_shell().gain.value());
}

TEST_F(Rule11Force, NewPartsForAThreadThatIsLeftBehindAreRefused) {
  Component& component = add("c");
  Component& other = add("other");
  deploy_and_hang(component);
  Transaction transaction;
  transaction.replace_core("c", std::make_unique<TestCore>()).set_property("other", "gain", 3.0);
  std::string remedy;
  EXPECT_EQ(ErrorCode::faulted, refused(transaction, kForce, &remedy));
  EXPECT_THAT(remedy, HasSubstr("remove the component and add it anew, in one transaction"));
  EXPECT_EQ(ComponentState::faulted, state("c"));
  EXPECT_EQ(1.0, core(other).exposed_shell().gain.value()) << "nothing else was changed";
}

TEST_F(Rule11Force, NothingElseIsDoneWithAThreadThatIsLeftBehind) {
  Component& component = add("c");
  deploy_and_hang(component);
  Transaction transaction;
  transaction.set_property("c", "gain", 3.0).stop("c");
  EXPECT_EQ(ErrorCode::faulted, refused(transaction, kForce));
  EXPECT_EQ(1.0, core(component).exposed_shell().gain.value());
}

TEST_F(Rule11Force, NobodyIsGivenUpForAPropertyNorWhoIsWell) {
  Component& component = add("c");
  add("well");
  deploy_and_hang(component);
  Transaction transaction;
  transaction.set_property("c", "gain", 3.0).remove_component("well");
  EXPECT_EQ(ErrorCode::timeout, refused(transaction, kForce));
  EXPECT_EQ(ComponentState::running, state("c"));
  EXPECT_EQ(ComponentState::running, state("well"));
  go_on = true;
  wait_runs(component, core(component).runs + 3);
  Transaction again;
  again.set_property("c", "gain", 3.0).remove_component("well");
  TransactionOptions patient = kForce;
  patient.timeouts.commit_ns = kEnough;
  deployer.commit(std::move(again), patient);
  EXPECT_EQ(3.0, core(component).exposed_shell().gain.value());
  EXPECT_EQ(0U, architecture.threads_left_behind());
}

TEST_F(Rule11Force, APreparedTransactionIsNotForced) {
  add("c");
  deploy();
  Transaction transaction;
  transaction.stop("c");
  try {
    deployer.prepare(std::move(transaction), kForce);
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(ErrorCode::invalid_argument, error.code());
  }
}

TEST_F(Rule11Force, AWaitIsNotGivenUpThoughItsThreadDoesNotGetToRun) {
  if (!may_use_fifo()) GTEST_SKIP() << "without SCHED_FIFO no thread keeps another one from running";
  constexpr time_ns_t kBrief = ms_to_ns(2);  // nobody else on this CPU gets to run, of other tests neither
  Component& waiting = add("waiting", 1, {.priority = 20});
  Component& urgent = add("urgent", 1, {.priority = 60});  // on the same CPU
  core(urgent).work = [this, &urgent] {
    if (core(urgent).runs < 3) return;
    is_hanging = true;
    while (!go_on) {
    }
  };
  deploy();
  wait_until([this] { return is_hanging.load(); }, "the one that keeps the CPU");
  ASSERT_TRUE(waiting.task().state_age().is_wait);
  EXPECT_THROW(deployer.stop("waiting", {.timeout_ns = kBrief, .force = true}), Error);
  EXPECT_EQ(ComponentState::stopping, state("waiting")) << "it is not what hangs";
  EXPECT_TRUE(deployer.stop("urgent", {.timeout_ns = kBrief, .force = true}));
  wait_until([&] { return state("waiting") == ComponentState::stopped; },
             "the stop, for which there is a CPU now");
}

/// States with and without a bound that end by themselves, and a force that comes at any moment of them.
TEST_F(Rule11Force, AStateEndsOrIsGivenUpAndNeverBoth) {
  constexpr int kRounds = 2'000;
  auto& output = architecture.add_resource<SharedData<Number>>("output");
  Component& component = add_free(architecture, "c",
                                  [](FreeFsm& fsm) {
                                    State& first = fsm.run("First");
                                    State& bounded = fsm.run("Bounded", s_to_ns(60));
                                    State& pause = fsm.wait("Pause", us_to_ns(300));
                                    fsm.set_initial(first);
                                    fsm.next(first, bounded);
                                    fsm.next(bounded, pause);
                                    fsm.next(pause, first);
                                  },
                                  {.cpus = {kComponentsCpu}});
  architecture.connect("c", "output", "output", "write");
  TestCore& worker = core(component);
  std::mt19937 random(11);
  std::atomic<time_ns_t> length_ns{0};
  const ComponentsEndFirst ended(deployer);
  worker.work = [&] {
    worker.exposed_shell().output.write({4.0});
    const time_ns_t until = monotonic_now_ns() + length_ns;
    while (monotonic_now_ns() < until) {
    }
  };
  deploy();
  int forced = 0;
  int ordinary = 0;
  for (int round = 0; round < kRounds; ++round) {
    length_ns = us_to_ns(static_cast<std::int64_t>(random() % 400));
    wait_runs(component, worker.runs + 1);
    std::this_thread::sleep_for(std::chrono::microseconds(random() % 200));
    bool was_forced = false;
    try {
      was_forced = deployer.stop(
          "c", {.timeout_ns = us_to_ns(static_cast<std::int64_t>(random() % 300)), .force = true});
    } catch (const Error& error) {
      ASSERT_EQ(ErrorCode::timeout, error.code())
          << "in its wait, or at the end of the state: it is not harmed";
    }
    wait_parked(component);
    wait_until([&] { return state("c") != ComponentState::stopping; }, "the end of the stop");
    ASSERT_EQ(was_forced ? ComponentState::faulted : ComponentState::stopped, state("c"));
    ASSERT_EQ(0.0, value_of(output));
    ASSERT_FALSE(component.task().is_left_behind());
    ++(was_forced ? forced : ordinary);
    if (!was_forced) {
      deployer.start("c");
      continue;
    }
    ASSERT_THAT(component.task().fault().what, HasSubstr("stopped by force while state "));
    Transaction repair;
    repair.configure("c").start("c");
    deployer.commit(std::move(repair), {.timeouts = {.commit_ns = kEnough, .phase_ns = 0}});
  }
  EXPECT_GT(forced, 0);
  EXPECT_GT(ordinary, 0);
  std::printf("%d of %d rounds by force\n", forced, kRounds);
}

}  // namespace mauve::testing::test_rule11_force
