// SPDX-License-Identifier: LGPL-3.0-or-later
// A change that is made is what the architecture is, whoever is late to take it, hangs or leaves.
#include <future>

#include "hosts.hpp"

namespace mauve::testing::test_open_change {

/// Its hooks call what a test gives it.
struct HookedCore : TestCore {
  std::function<void()> adopting = [] {};
  std::function<void()> taking = [] {};
  std::function<void()> cleaning = [] {};
  time_ns_t declared{0};
  time_ns_t budget_ns() const MAUVE_RT override { return declared; }
  void cleanup_hook() override { cleaning(); }
  bool adopt(const CoreBase& /*old*/) override {
    adopting();
    return true;
  }
  void take(CoreBase& /*old*/) MAUVE_RT override { taking(); }
};

/// Waits for events of its shell's input.
struct EventShell : Shell {
  ReadPort<EventCount>& input = read_port<EventCount>("input").optional();
};
struct EventCore : Core<EventShell> {
  std::atomic<int> runs{0};
  void act() { ++runs; }
};
struct EventFsm : Fsm<EventShell, EventCore> {
  void define() override {
    State& run = execution("Run", "act", &EventCore::act);
    State& pause = wait_event("Pause", shell().input, s_to_ns(1000), us_to_ns(100));
    set_initial(pause);
    next(run, pause);
    next(pause, run);
  }
};

constexpr time_ns_t kLong = s_to_ns(30);
constexpr CommitTimeouts kShortly{.commit_ns = ms_to_ns(100), .phase_ns = 0};

Parts new_parts() {
  return {.shell = std::make_unique<TestShell>(),
          .core = std::make_unique<TestCore>(),
          .fsm = std::make_unique<TestFsm>()};
}

/// The component `late` is late to take a change that is made: on threads it is in a state until let_it_go_on(), in virtual time
/// it has a backlog. The component `b` takes part in the same change, and has taken it.
template <typename Way>
class OpenChange : public Hosted<Way> {
 protected:
  static constexpr bool is_virtual = Hosted<Way>::is_virtual;

  void SetUp() override {
    this->add("b");
    this->add("p");
    TaskSettings settings{.priority = 10, .overrun = OverrunPolicy::catch_up, .max_backlog = 1'000'000};
    settings.states = {DeclaredState{.name = "Run", .simulated_execution_ns = ms_to_ns(5)}};
    late = &this->add("late", 2, settings);
    this->core(*late).work = [held = held, this] {
      if (held->is_armed.exchange(false)) held->doors.pass();
      after_doors();
    };
    this->architecture.template add_resource<LatestValue<Number>>("r");
    this->architecture.template add_resource<LatestValue<Number>>("s");
  }
  void TearDown() override {
    let_it_go_on();
    if (requester.joinable()) requester.join();
    this->way.shutdown();
  }
  /// Makes the change of `late`, of b and of whatever else the transaction has. After deploy().
  void make_late(Transaction transaction) {
    auto fresh = std::make_unique<HookedCore>();
    const auto agree = std::make_shared<Doors>();
    if (!is_virtual) fresh->adopting = [agree] { agree->pass(); };
    transaction.replace_core("b", std::move(fresh));
    this->way.until([&] { return this->core(*late).runs > 5; }, "the one that will be late");
    const auto request = [this, &transaction] {
      first =
          this->host().commit(std::move(transaction), {.timeouts = {.commit_ns = s_to_ns(2), .phase_ns = 0}});
    };
    if (is_virtual) {
      request();
    } else {
      requester = std::thread([request] { EXPECT_NO_THROW(request()); });
      wait_until([&] { return agree->entered.load(); }, "the adopt of b");
      const int runs = this->core(*late).runs;
      wait_until([&] { return this->core(*late).runs > runs + 5; }, "the late one to vote");
      held->is_armed = true;
      wait_until([&] { return held->doors.entered.load(); }, "the late one to be in its state");
      agree->open = true;
      requester.join();
    }
    ASSERT_FALSE(has_taken()) << "it is late";
  }
  void make_late() { make_late(std::move(Transaction().set_property("late", "gain", 2.0))); }
  /// Some periods; the late one does not count.
  void pass_time() {
    if constexpr (is_virtual) this->run_for(ms_to_ns(6));
    if constexpr (!is_virtual) std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  void let_it_go_on() { held->doors.open = true; }
  bool has_taken() { return late->template shell_as<TestShell>().gain.value() == 2.0; }
  void await_taken() {
    let_it_go_on();
    this->way.until([&] { return is_settled(); }, "the late one");
    EXPECT_TRUE(has_taken());
  }
  bool is_settled() {
    this->host().describe();
    const CommitGate::Look table(this->architecture.commit_gate());
    return !late->change_mark().is_unsettled();
  }
  TransactionReport commit(Transaction& transaction,
                           const CommitTimeouts& timeouts = {.commit_ns = s_to_ns(10), .phase_ns = 0}) {
    return this->host().commit(std::move(transaction), {.timeouts = timeouts});
  }
  double value_of(const char* resource) {
    auto& found = static_cast<LatestValue<Number>&>(this->architecture.resource(resource));
    Number value{.value = -9};
    time_ns_t time_ns = 0;
    ReaderState reader;
    found.read.read(value, time_ns, reader);
    return value.value;
  }
  std::vector<std::string> listed() const {
    std::vector<std::string> names;
    for (const auto& component : this->architecture.components()) names.push_back(component->name());
    return names;
  }

  struct Held {
    std::atomic<bool> is_armed{false};
    Doors doors{};
  };
  const std::shared_ptr<Held> held{std::make_shared<Held>()};
  std::function<void()> after_doors = [] {};
  Component* late{nullptr};
  TransactionReport first;
  std::thread requester;
};
TYPED_TEST_SUITE(OpenChange, EveryHost, HostNames);

TYPED_TEST(OpenChange, AnInnocentChangesAgainAtOnce) {
  this->deploy();
  this->make_late();
  EXPECT_NO_THROW(this->commit(Transaction().set_property("b", "gain", 3.0)));
  EXPECT_NO_THROW(this->commit(Transaction().replace_core("b", "t/Counting")));
  EXPECT_EQ("t/Counting", this->architecture.component("b").core_implementation());
  EXPECT_FALSE(this->has_taken());
  const Error error =
      this->refusal([&] { this->commit(Transaction().set_property("late", "gain", 5.0), kShortly); });
  EXPECT_EQ(ErrorCode::timeout, error.code());
  EXPECT_EQ("late", error.detail().component) << error.what();
  this->await_taken();
  EXPECT_NO_THROW(this->commit(Transaction().set_property("late", "gain", 5.0)));
}

TYPED_TEST(OpenChange, APreparedStopOfAnInnocentIsMade) {
  this->deploy();
  const auto armed = this->host().prepare(std::move(Transaction().stop("b")));
  this->make_late();
  EXPECT_TRUE(armed->is_current()) << "a change of its core does not make a stop stale";
  EXPECT_NO_THROW(this->host().prepare(std::move(Transaction().stop("b")))) << "prepared anew";
  EXPECT_EQ(PreparedOutcome::committed, armed->commit(kLong));
  EXPECT_EQ(ComponentState::stopped, this->state("b"));
  EXPECT_FALSE(this->has_taken());
  armed->complete();
  this->await_taken();
}

TYPED_TEST(OpenChange, WhatItAddsIsListedStoppedAndRemoved) {
  this->deploy();
  Transaction change;
  change.set_property("late", "gain", 2.0).add_component("new", new_parts()).start("new");
  change.add_resource("data", std::make_unique<SharedData<Number>>());
  this->make_late(std::move(change));
  EXPECT_THAT(this->listed(), ::testing::Contains("new"));
  EXPECT_NE(nullptr, this->architecture.find_resource("data"));
  this->host().stop("new", kLong);
  EXPECT_EQ(ComponentState::stopped, this->state("new"));
  EXPECT_EQ(ErrorCode::duplicate_name,
            this->refusal([&] { this->commit(Transaction().add_component("new", new_parts())); }).code());
  EXPECT_NO_THROW(this->commit(Transaction().remove_component("new").remove_resource("data")));
  EXPECT_THAT(this->listed(), ::testing::Not(::testing::Contains("new")));
  EXPECT_FALSE(this->has_taken());
}

TYPED_TEST(OpenChange, WhatItRemovesIsNotListedAndNeverStarts) {
  this->deploy();
  const auto removed = this->architecture.hold_component("p");
  this->make_late(std::move(Transaction().set_property("late", "gain", 2.0).remove_component("p")));
  EXPECT_THAT(this->listed(), ::testing::Not(::testing::Contains("p")));
  EXPECT_EQ(ErrorCode::unknown_component, this->refusal([&] { this->host().start("p"); }).code());
  EXPECT_EQ(ErrorCode::unknown_component, this->refusal([&] { removed->task().start(); }).code());
  EXPECT_NE(ComponentState::running, removed->task().state());
  EXPECT_NO_THROW(this->commit(Transaction().add_component("p", new_parts()))) << "its name is free";
}

TYPED_TEST(OpenChange, AResourceThatALateOneIsToUseIsConnected) {
  this->architecture.connect("late", "input", "r", "read");
  this->deploy();
  Transaction change;
  change.set_property("late", "gain", 2.0).disconnect("late", "input").connect("late", "input", "s", "read");
  this->make_late(std::move(change));
  const Error error = this->refusal([&] { this->commit(Transaction().remove_resource("s")); });
  EXPECT_EQ("late.input", error.detail().found) << error.what();
  EXPECT_NO_THROW(this->commit(Transaction().remove_resource("r"))) << "no wire leads there any more";
  EXPECT_EQ(nullptr, this->architecture.find_resource("r"));
  this->pass_time();  // the late one reads it still
  this->await_taken();
  EXPECT_EQ("s", this->late->template shell_as<TestShell>().input.resource_name());
}

TYPED_TEST(OpenChange, ARemovedResourceIsNotConnectedAgain) {
  this->deploy();
  this->make_late(std::move(Transaction().set_property("late", "gain", 2.0).remove_resource("r")));
  EXPECT_EQ(ErrorCode::unknown_resource,
            this->refusal([&] { this->commit(Transaction().connect("p", "input", "r", "read")); }).code());
}

TYPED_TEST(OpenChange, AWritersEndHasOneOwner) {
  this->architecture.connect("p", "output", "r", "write");
  this->deploy();
  Transaction change;
  change.set_property("late", "gain", 2.0).disconnect("p", "output").connect("late", "output", "r", "write");
  this->make_late(std::move(change));
  EXPECT_EQ(ErrorCode::invalid_argument,
            this->refusal([&] { this->commit(Transaction().connect("b", "output", "r", "write")); }).code());
  this->await_taken();
}

TYPED_TEST(OpenChange, WhatALateOneWritesReplacesNoValueOfALaterOwner) {
  this->architecture.connect("late", "output", "r", "write");
  this->after_doors = [this] { this->core(*this->late).exposed_shell().output.write({-1.0}); };
  this->core(this->architecture.component("p")).work = [this] {
    this->core(this->architecture.component("p")).exposed_shell().output.write({1.0});
  };
  this->deploy();
  this->make_late(std::move(Transaction().set_property("late", "gain", 2.0).disconnect("late", "output")));
  const auto second = this->commit(Transaction().connect("p", "output", "r", "write"));
  EXPECT_LT(this->first.instant_ns, second.instant_ns) << "a change that builds on another lies later";
  this->way.until([&] { return this->value_of("r") == 1.0; }, "the new owner to write");
  this->await_taken();
  EXPECT_EQ(1.0, this->value_of("r"));
}

TYPED_TEST(OpenChange, EventsOfTheOldResourceReleaseNobody) {
  this->architecture.template add_resource<EventCounter>("old");
  this->architecture.template add_resource<EventCounter>("new");
  this->architecture.template add_component<EventShell, EventCore, EventFsm>("x");
  this->architecture.connect("x", "input", "old", "read");
  this->deploy();
  const auto raise = [this](const char* name) {
    static_cast<EventCounter&>(this->architecture.resource(name)).raise.raise(this->host().now_ns());
    this->pass_time();
  };
  Component& x = this->architecture.component("x");
  auto& runs = x.core_as<EventCore>().runs;
  raise("old");
  this->way.until([&] { return runs == 1; }, "an event");
  Transaction change;
  change.set_property("late", "gain", 2.0).disconnect("x", "input").connect("x", "input", "new", "read");
  this->make_late(std::move(change));
  const int before = runs;
  raise("old");
  raise("old");
  EXPECT_EQ(before, runs);
  raise("new");
  this->way.until([&] { return runs == before + 1; }, "an event of the new one");
  this->await_taken();
  raise("old");
  EXPECT_EQ(before + 1, runs);
  raise("new");
  this->way.until([&] { return runs == before + 2; }, "an event after the settlement");
}

TYPED_TEST(OpenChange, AProbationBeginsWithItsOwnComponent) {
  this->deploy();
  Transaction change;
  change.set_property("late", "gain", 2.0)
      .replace_core("p", std::make_unique<TestCore>(), ProbationOptions{.duration_ns = kLong});
  this->make_late(std::move(change));
  EXPECT_EQ(1U, this->host().probations().size());
  EXPECT_TRUE(this->host().revert_probation("p", "the operator", TestFixture::is_virtual ? 0 : kLong));
  EXPECT_EQ("t/Core", this->architecture.component("p").core_implementation());
  this->await_taken();
  this->host().settle_probations();
  ASSERT_EQ(1U, this->host().probations().size());
  EXPECT_EQ(ProbationVerdict::reverted, this->host().probations().front().verdict);
}

TYPED_TEST(OpenChange, ANewEpochLeavesOutWhoIsLate) {
  this->deploy();
  this->make_late();
  EXPECT_NO_THROW(this->commit(Transaction().resynchronise()));
  EXPECT_FALSE(this->has_taken());
  this->await_taken();
}

TYPED_TEST(OpenChange, AReaderThatComesAsAnotherOneGoesHasAPlaceOfItsOwn) {
  this->architecture.template add_resource<SharedData<Number>>("shared");
  this->architecture.connect("b", "input", "shared", "read");
  this->deploy();
  std::string on = "b";
  std::string off = "p";
  for (int round = 0; round < 20; ++round) {
    this->commit(Transaction().disconnect(on, "input").connect(off, "input", "shared", "read"));
    std::swap(on, off);
    EXPECT_TRUE(this->architecture.component(on).shell().find_port("input")->is_seated()) << round;
  }
}

// ---- on threads: who hangs

class OpenChangeBeside : public OpenChange<OnThreads> {};

TEST_F(OpenChangeBeside, AShutdownEndsWhatAChangeHasAddedAndWhatItHasRemoved) {
  architecture.connect("late", "output", "s", "write");
  deploy();
  auto core = std::make_unique<TestCore>();
  core->work = [&own = *core] { own.exposed_shell().output.write({7.0}); };
  Parts parts = new_parts();
  parts.core = std::move(core);
  Transaction change;
  change.set_property("late", "gain", 2.0).add_component("new", std::move(parts));
  change.connect("new", "output", "r", "write").start("new");
  make_late(std::move(change));
  const auto added = architecture.hold_component("new");
  way.until([&] { return value_of("r") == 7.0; }, "the new one to write");
  way.shutdown();
  EXPECT_EQ(ComponentState::stopped, added->task().state());
  EXPECT_FALSE(added->task().has_thread());
  EXPECT_EQ(0.0, value_of("r")) << "it commands no more";
}

TEST_F(OpenChangeBeside, ARevertThatALateOneIsStoppedBeforeIsCarriedOut) {
  deploy();
  auto trial = std::make_unique<TestCore>();
  trial->work = [held = held] {
    if (held->is_armed.exchange(false)) held->doors.pass();
  };
  commit(Transaction().replace_core("late", std::move(trial), ProbationOptions{.duration_ns = kLong}));
  Transaction change;
  change.add("revert_core", "late").set_property("late", "gain", 2.0);
  make_late(std::move(change));
  EXPECT_EQ(ErrorCode::timeout, refusal([&] { host().stop("late", 0); }).code());
  let_it_go_on();
  way.until([&] { return late->task().state() == ComponentState::stopped; }, "the pending stop");
  host().start("late");
  way.until([&] { return late->core_implementation() == "t/Core"; }, "the old core");
  EXPECT_EQ(ProbationVerdict::reverted, host().probations().front().verdict);
}

TEST_F(OpenChangeBeside, OneThatHungAndIsRemovedTakesNothing) {
  deploy();
  Transaction change;
  change.set_property("late", "gain", 2.0).connect("late", "output", "r", "write");
  make_late(std::move(change));
  const auto gone = architecture.hold_component("late");
  EXPECT_TRUE(host().stop("late", {.timeout_ns = ms_to_ns(20), .force = true}));
  EXPECT_EQ(0.0, value_of("r")) << "the safe value goes through the end that it has yet to take";
  commit(Transaction().remove_component("late"));
  EXPECT_NO_THROW(commit(Transaction().remove_resource("r")));
  EXPECT_NO_THROW(commit(Transaction().set_property("b", "gain", 3.0)));
  let_it_go_on();
  wait_until([&] { return architecture.threads_left_behind() == 0; }, "the thread's end");
  commit(Transaction().set_property("b", "gain", 4.0));
  EXPECT_FALSE(gone->shell_as<TestShell>().output.is_connected());
}

TEST_F(OpenChangeBeside, TwoAdoptsThatHangLeaveTheirRecordToBoth) {
  deploy();
  std::array<std::shared_ptr<Doors>, 2> doors{std::make_shared<Doors>(), std::make_shared<Doors>()};
  Transaction change;
  int i = 0;
  for (const char* name : {"b", "p"}) {
    auto core = std::make_unique<HookedCore>();
    core->adopting = [door = doors.at(static_cast<std::size_t>(i++))] { door->pass(); };
    change.replace_core(name, std::move(core));
  }
  EXPECT_EQ(ErrorCode::faulted, refusal([&] { commit(change, {.commit_ns = ms_to_ns(200)}); }).code());
  commit(Transaction().remove_component("b").remove_component("p"));
  for (auto door = doors.rbegin(); door != doors.rend(); ++door) {
    (*door)->open = true;
    const std::size_t left = static_cast<std::size_t>(doors.rend() - door) - 1;
    wait_until([&] { return architecture.threads_left_behind() == left; }, "a thread's end");
    commit(Transaction().set_property("late", "gain", 3.0 + static_cast<double>(left)));
  }
}

TEST_F(OpenChangeBeside, AnAdoptThatHangsKeepsTheResourceThatItWasToHave) {
  deploy();
  const auto doors = std::make_shared<Doors>();
  auto core = std::make_unique<HookedCore>();
  core->adopting = [doors] { doors->pass(); };
  Transaction change;
  change.add_resource("new", std::make_unique<LatestValue<Number>>())
      .replace_shell("b", std::make_unique<TestShell>())
      .replace_core("b", std::move(core))
      .connect("b", "output", "new", "write");
  EXPECT_EQ(ErrorCode::faulted, refusal([&] { commit(change, {.commit_ns = ms_to_ns(150)}); }).code());
  EXPECT_EQ(nullptr, architecture.find_resource("new"));
  commit(Transaction().remove_component("b"));
  doors->open = true;
  wait_until([&] { return architecture.threads_left_behind() == 0; }, "the thread's end");
  EXPECT_NO_THROW(commit(Transaction().set_property("late", "gain", 3.0)));
}

class OpenChangeTakes : public OpenChangeBeside, public ::testing::WithParamInterface<int> {};

/// 0: a new core; 1: and another end; 2: and a new shell.
TEST_P(OpenChangeTakes, ATakeThatHangsHasSafeOutputsThroughAllEndsOfItsOwn) {
  architecture.connect("b", "output", "r", "write");
  core(architecture.component("b")).work = [this] {
    core(architecture.component("b")).exposed_shell().output.write({7.0});
  };
  deploy();
  way.until([&] { return value_of("r") == 7.0; }, "a value");
  static_cast<LatestValue<Number>&>(architecture.resource("s")).write.write({5.0}, monotonic_now_ns());
  const auto doors = std::make_shared<Doors>();
  auto core = std::make_unique<HookedCore>();
  core->taking = [doors] { MAUVE_RT_TRUSTED(doors->pass()); };
  Transaction change;
  change.replace_core("b", std::move(core));
  const bool has_moved = GetParam() == 1;
  if (has_moved) change.disconnect("b", "output").connect("b", "output", "s", "write");
  if (GetParam() == 2) change.replace_shell("b", std::make_unique<TestShell>());
  EXPECT_NO_THROW(commit(change, {.commit_ns = ms_to_ns(200), .phase_ns = 0}));
  EXPECT_EQ(ComponentState::faulted, Hosted::state("b"));
  EXPECT_EQ(0.0, value_of(has_moved ? "s" : "r"));
  doors->open = true;
  wait_until([&] { return architecture.component("b").task().is_parked(); }, "the take's end");
  EXPECT_EQ(0.0, value_of(has_moved ? "s" : "r"));
}
INSTANTIATE_TEST_SUITE_P(All, OpenChangeTakes, ::testing::Values(0, 1, 2));

TEST_F(OpenChangeBeside, AnUrgentChangeComesBeforeAPreparationAndADryRun) {
  deploy();
  for (const bool is_dry : {true, false}) {
    const auto doors = std::make_shared<Doors>();
    const auto stop = host().prepare(std::move(Transaction().stop("b")));
    auto slow = std::async(std::launch::async, [&] {
      host().commit(std::move(Transaction().replace_core("b", std::make_unique<HangingCore>(doors))),
                    {.dry_run = is_dry});
    });
    wait_until([&] { return doors->entered.load(); }, "the hook");
    EXPECT_EQ(PreparedOutcome::committed, stop->commit(kLong)) << "while the hook lasts";
    EXPECT_EQ(ComponentState::stopped, Hosted::state("b"));
    doors->open = true;
    if (is_dry) {
      EXPECT_NO_THROW(slow.get());
    } else {
      EXPECT_EQ(ErrorCode::wrong_revision, refusal([&] { slow.get(); }).code());
    }
    stop->complete();
    host().start("b");
  }
}

TEST_F(OpenChangeBeside, AChangeWaitsForAPreparationNoLongerThanItsTimeout) {
  deploy();
  const auto doors = std::make_shared<Doors>();
  auto slow = std::async(std::launch::async, [&] {
    commit(Transaction().replace_core("b", std::make_unique<HangingCore>(doors)));
  });
  wait_until([&] { return doors->entered.load(); }, "the hook");
  const Error error = refusal([&] { commit(Transaction().set_property("b", "gain", 3.0), kShortly); });
  EXPECT_EQ(ErrorCode::timeout, error.code()) << error.what();
  doors->open = true;
  EXPECT_NO_THROW(slow.get());
}

TEST_F(OpenChangeBeside, ACleanupThatHangsHoldsNobody) {
  deploy();
  const auto doors = std::make_shared<Doors>();
  auto old = std::make_unique<HookedCore>();
  old->cleaning = [doors] { doors->pass(); };
  commit(Transaction().replace_core("b", std::move(old)));
  auto change = std::async(std::launch::async, [&] { commit(Transaction().replace_core("b", "t/Core")); });
  wait_until([&] { return doors->entered.load(); }, "the cleanup");
  EXPECT_NO_THROW(commit(Transaction().set_property("p", "gain", 3.0), kShortly));
  EXPECT_NO_THROW(commit(Transaction().set_property("b", "gain", 3.0), kShortly))
      << "of the same component, too";
  EXPECT_NO_THROW(commit(Transaction().remove_component("p").remove_resource("r")));
  const auto stop = host().prepare(std::move(Transaction().stop("b")));
  EXPECT_EQ(PreparedOutcome::committed, stop->commit(kLong));
  EXPECT_THAT(architecture.disposing().what, ::testing::HasSubstr("component b"));
  change.get();
  way.shutdown();
  EXPECT_FALSE(doors->open) << "and a shutdown";
  doors->open = true;
}

TEST_F(OpenChangeBeside, AStopByForceEndsAnAdoptThatHangs) {
  architecture.connect("b", "output", "r", "write");
  core(architecture.component("b")).work = [this] {
    core(architecture.component("b")).exposed_shell().output.write({7.0});
  };
  deploy();
  way.until([&] { return value_of("r") == 7.0; }, "a value");
  const auto doors = std::make_shared<Doors>();
  auto core = std::make_unique<HookedCore>();
  core->adopting = [doors] { doors->pass(); };
  auto change = std::async(std::launch::async, [&, fresh = std::move(core)]() mutable {
    return refusal([&] { commit(Transaction().replace_core("b", std::move(fresh)), {.commit_ns = kLong}); });
  });
  wait_until([&] { return doors->entered.load(); }, "the adopt");
  EXPECT_TRUE(host().stop("b", {.timeout_ns = ms_to_ns(20), .force = true}));
  EXPECT_EQ(ComponentState::faulted, Hosted::state("b"));
  EXPECT_EQ(0.0, value_of("r"));
  EXPECT_EQ(ErrorCode::wrong_revision, change.get().code()) << "the change is answered";
  EXPECT_FALSE(doors->open) << "while the adopt hangs";
  doors->open = true;
}

class OpenChangeBudgets : public OpenChangeBeside, public ::testing::WithParamInterface<bool> {};

TEST_P(OpenChangeBudgets, AHookThatHangsIsWatchedByItsBudget) {
  architecture.connect("b", "output", "r", "write");
  deploy();
  const auto doors = std::make_shared<Doors>();
  auto core = std::make_unique<HookedCore>();
  core->declared = us_to_ns(200);
  (GetParam() ? core->adopting : core->taking) = [doors] { MAUVE_RT_TRUSTED(doors->pass()); };
  auto change = std::async(std::launch::async, [&, fresh = std::move(core)]() mutable {
    host().commit(std::move(Transaction().replace_core("b", std::move(fresh))),
                  {.timeouts = {.commit_ns = kLong, .phase_ns = 0}});
  });
  wait_until([&] { return Hosted::state("b") == ComponentState::faulted; },
             "the watchdog, long before the timeout");
  EXPECT_EQ("adopt or take of its new part ran longer than its declared 200 us",
            architecture.component("b").task().fault().what);
  EXPECT_EQ(0.0, value_of("r"));
  if (GetParam()) {
    EXPECT_THROW(change.get(), Error);
  } else {
    EXPECT_NO_THROW(change.get()) << "it is made";
  }
  EXPECT_FALSE(doors->open);
  doors->open = true;
}
INSTANTIATE_TEST_SUITE_P(AdoptAndTake, OpenChangeBudgets, ::testing::Bool());

// ---- what is told of it, and the way out

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::SizeIs;

std::vector<std::string> names_of(const std::vector<LateComponent>& components) {
  std::vector<std::string> names;
  for (const LateComponent& component : components) names.push_back(component.name);
  return names;
}

TYPED_TEST(OpenChange, IsToldUntilTheLastComponentHasTakenIt) {
  this->deploy();
  EXPECT_THAT(this->host().open_changes(), IsEmpty());
  this->make_late(std::move(Transaction().set_property("late", "gain", 2.0).by("the operator")));
  const auto open = this->host().open_changes();
  ASSERT_THAT(open, SizeIs(1));
  EXPECT_EQ("the operator", open.front().author);
  EXPECT_THAT(open.front().steps, SizeIs(2));
  EXPECT_EQ(OpenChangePhase::made, open.front().phase);
  EXPECT_EQ(this->first.instant_ns, open.front().instant_ns);
  EXPECT_LE(open.front().begun_ns, this->host().now_ns());
  EXPECT_LT(0, open.front().begun_ns);
  EXPECT_THAT(names_of(open.front().late), ElementsAre("late"));
  EXPECT_FALSE(open.front().late.front().state.state.empty());
  EXPECT_FALSE(open.front().late.front().left_behind);
  this->await_taken();
  EXPECT_THAT(this->host().open_changes(), IsEmpty());
}

TYPED_TEST(OpenChange, TheComponentThatItWaitsForIsAbandonedAndRemoved) {
  this->deploy();
  this->make_late();
  const Abandoned done = this->host().abandon("late");
  EXPECT_EQ(TestFixture::is_virtual ? Abandoned::stopped : Abandoned::faulted, done);
  if (!TestFixture::is_virtual) {  // in virtual time the stop takes the change first
    EXPECT_EQ(ComponentState::faulted, this->state("late"));
    EXPECT_TRUE(this->host().open_changes().front().late.front().left_behind);
    EXPECT_EQ(ErrorCode::faulted, this->refusal([&] { this->host().abandon("late"); }).code());
  }
  EXPECT_NO_THROW(this->commit(Transaction().remove_component("late")));
  EXPECT_THAT(this->listed(), ::testing::Not(::testing::Contains("late")));
  this->late = nullptr;
}

TYPED_TEST(OpenChange, AComponentForWhichNothingWaitsIsNotAbandoned) {
  this->deploy();
  EXPECT_EQ(ErrorCode::not_running, this->refusal([&] { this->host().abandon("p"); }).code());
  EXPECT_EQ(ErrorCode::unknown_component, this->refusal([&] { this->host().abandon("nobody"); }).code());
  EXPECT_EQ(ComponentState::running, this->state("p"));
}

TEST_F(OpenChangeBeside, AComponentThatAChangeRemovesIsAbandonedByItsName) {
  deploy();
  const auto removed = architecture.hold_component("late");
  make_late(std::move(Transaction().set_property("p", "gain", 2.0).remove_component("late")));
  EXPECT_EQ(nullptr, architecture.find_component("late"));
  EXPECT_EQ(Abandoned::faulted, host().abandon("late"));
  EXPECT_EQ(ComponentState::faulted, removed->task().state());
}

TEST_F(OpenChangeBeside, OneThatIsNotDecidedIsCalledOff) {
  deploy();
  way.until([&] { return core(*late).runs > 5; }, "the one that will be late");
  held->is_armed = true;
  wait_until([&] { return held->doors.entered.load(); }, "the late one to be in its state");
  auto change = std::async(std::launch::async, [&] {
    return refusal([&] {
      commit(Transaction().set_property("late", "gain", 2.0).set_property("b", "gain", 2.0),
             {.commit_ns = kLong});
    });
  });
  const auto is_awaited = [&] {
    const auto open = host().open_changes();
    return open.size() == 1 && open.front().phase == OpenChangePhase::waiting &&
           names_of(open.front().late) == std::vector<std::string>{"late"};
  };
  wait_until(is_awaited, "the vote of b alone");
  EXPECT_EQ(Abandoned::called_off, host().abandon("late"));
  const Error error = change.get();
  EXPECT_EQ(ErrorCode::wrong_revision, error.code());
  EXPECT_EQ("late", error.detail().component) << error.what();
  EXPECT_THAT(host().open_changes(), IsEmpty());
  EXPECT_EQ(ComponentState::running, state("late")) << "it is not given up";
}

TEST_F(OpenChangeBeside, AnAdoptThatHangsIsGivenUpWithItsChange) {
  deploy();
  const auto doors = std::make_shared<Doors>();
  auto fresh = std::make_unique<HookedCore>();
  fresh->adopting = [doors] { doors->pass(); };
  auto change = std::async(std::launch::async, [&, ready = std::move(fresh)]() mutable {
    return refusal([&] { commit(Transaction().replace_core("b", std::move(ready)), {.commit_ns = kLong}); });
  });
  wait_until([&] { return doors->entered.load(); }, "the adopt");
  EXPECT_EQ(Abandoned::called_off, host().abandon("b"));
  EXPECT_EQ(ErrorCode::faulted, change.get().code());
  EXPECT_EQ(ComponentState::faulted, state("b"));
  EXPECT_FALSE(doors->open) << "while the adopt hangs";
  doors->open = true;
}

TEST_F(OpenChangeBeside, AHungPreparationAndAHeldChangeLockKeepNobodyFromTheList) {
  deploy();
  const auto doors = std::make_shared<Doors>();
  auto slow = std::async(std::launch::async, [&] {
    commit(Transaction().replace_core("b", std::make_unique<HangingCore>(doors)));
  });
  wait_until([&] { return doors->entered.load(); }, "the hook");
  Doors locked;
  auto holder = std::async(std::launch::async, [&] {
    const std::lock_guard change(architecture.change_lock());
    locked.pass();
  });
  wait_until([&] { return locked.entered.load(); }, "the change lock");
  const auto open = host().open_changes();
  ASSERT_THAT(open, SizeIs(1));
  EXPECT_EQ(OpenChangePhase::preparing, open.front().phase);
  EXPECT_THAT(open.front().late, IsEmpty());
  EXPECT_EQ(ErrorCode::not_running, refusal([&] { host().abandon("b"); }).code()) << "it ends with its hook";
  locked.open = true;
  doors->open = true;
  EXPECT_NO_THROW(slow.get());
}

TEST_F(OpenChangeBeside, APreparedOneIsToldWhileItIsCommittedAndUntilItIsSettled) {
  deploy();
  way.until([&] { return core(*late).runs > 5; }, "the one that will be late");
  const auto agree = std::make_shared<Doors>();
  auto fresh = std::make_unique<HookedCore>();
  fresh->adopting = [agree] { agree->pass(); };
  Transaction change;
  change.set_property("late", "gain", 2.0).replace_core("b", std::move(fresh)).by("rule r");
  const auto armed = host().prepare(std::move(change));
  EXPECT_THAT(host().open_changes(), IsEmpty()) << "it is prepared, and nothing more";
  const time_ns_t before = host().now_ns();
  auto outcome = std::async(std::launch::async, [&] { return armed->commit(kLong); });
  wait_until([&] { return agree->entered.load(); }, "the adopt of b");
  const int runs = core(*late).runs;
  wait_until([&] { return core(*late).runs > runs + 5; }, "the late one to vote");
  auto open = host().open_changes();
  ASSERT_THAT(open, SizeIs(1));
  EXPECT_EQ(OpenChangePhase::waiting, open.front().phase);
  EXPECT_LE(before, open.front().begun_ns) << "when it was committed";
  EXPECT_THAT(names_of(open.front().late), ElementsAre("b"));
  held->is_armed = true;
  wait_until([&] { return held->doors.entered.load(); }, "the late one to be in its state");
  agree->open = true;
  wait_until([&] { return host().open_changes().front().phase == OpenChangePhase::made; }, "the decision");
  wait_until([&] { return names_of(host().open_changes().front().late) == std::vector<std::string>{"late"}; },
             "b");
  EXPECT_EQ("rule r", host().open_changes().front().author);
  let_it_go_on();
  EXPECT_EQ(PreparedOutcome::committed, outcome.get());
  armed->complete();
  EXPECT_THAT(host().open_changes(), IsEmpty());
}

TEST_F(OpenChangeBeside, APreparedOneThatIsNotMadeSaysWhyAfterOthersWereSettled) {
  deploy();
  auto fresh = std::make_unique<HookedCore>();
  fresh->adopting = [] { throw std::runtime_error("the new core is not ready"); };
  const auto armed = host().prepare(std::move(Transaction().replace_core("b", std::move(fresh))));
  EXPECT_EQ(PreparedOutcome::refused, armed->commit(kLong));
  EXPECT_THAT(host().open_changes(), IsEmpty());
  EXPECT_NO_THROW(commit(Transaction().set_property("p", "gain", 3.0))) << "settles what can be settled";
  EXPECT_THAT(refusal([&] { armed->complete(); }).what(), ::testing::HasSubstr("the new core is not ready"));
}

TEST_F(OpenChangeBeside, WhoLooksDisturbsNoChange) {
  deploy();
  std::atomic<bool> is_over{false};
  auto looking = std::async(std::launch::async, [&] {
    std::size_t most = 0;
    while (!is_over) most = std::max(most, host().open_changes().size());
    return most;
  });
  for (int round = 0; round < 10; ++round) {
    commit(Transaction().replace_core("b", "t/Counting").set_property("p", "gain", 1.0 + round));
    commit(Transaction().add_component("new", new_parts()).start("new"));
    const auto armed = host().prepare(std::move(Transaction().replace_core("b", "t/Core").stop("new")));
    EXPECT_EQ(PreparedOutcome::committed, armed->commit(kLong));
    armed->complete();
    commit(Transaction().remove_component("new"));
  }
  is_over = true;
  EXPECT_GE(1U, looking.get());
  EXPECT_THAT(host().open_changes(), IsEmpty());
}

}  // namespace mauve::testing::test_open_change
