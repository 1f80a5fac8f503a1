// SPDX-License-Identifier: LGPL-3.0-or-later
// Rule 10: a change takes effect at one logical instant, no component waits for another, and a stop waits for no change.
#include <future>
#include <map>
#include <mutex>
#include <random>
#include <set>

#include "transaction_fixtures.hpp"

namespace mauve::testing::test_rule10_commit {

using ::testing::HasSubstr;

/// Lets whoever waits at it go on when it is opened, and at the test's end.
class Latch {
 public:
  void wait() {
    reached_ = true;
    while (!open_) std::this_thread::sleep_for(std::chrono::microseconds(200));
  }
  void open() { open_ = true; }
  bool reached() const { return reached_; }

 private:
  std::atomic<bool> open_{false};
  std::atomic<bool> reached_{false};
};

/// A core whose adopt and take do as they are told.
struct ToldCore : TestCore {
  bool adopt(const CoreBase& /*old*/) override {
    adopting();
    return agrees;
  }
  void take(CoreBase& /*old*/) noexcept override { taking(); }
  time_ns_t budget_ns() const noexcept override { return declared; }
  std::function<void()> adopting = [] {};
  std::function<void()> taking = [] {};
  bool agrees{true};
  time_ns_t declared{0};
};

std::function<void()> pause_ms(int milliseconds) {
  return [milliseconds] { std::this_thread::sleep_for(std::chrono::milliseconds(milliseconds)); };
}

class Rule10Commit : public Deployed {
 protected:
  ~Rule10Commit() override {
    latch.open();
    fast_may_agree.open();
    take_may_end.open();
    deployer.shutdown();
    if (requester.joinable()) requester.join();
  }

  /// Two components; `slow` stays in its state from its next activation on, until the latch is opened.
  void deploy_two(const TaskSettings& fast_settings = {.priority = 60}) {
    fast = &add("fast", 2, fast_settings);
    slow = &add("slow", 3, {.priority = 40});
    core(*slow).work = [this] {
      if (busy) {
        latch.wait();
        at_the_end_of_slow();
      }
      if (broken) throw std::runtime_error("broken sensor");
    };
    prepare();
    deploy();
    wait_runs(*fast, 3);
    wait_runs(*slow, 3);
  }
  void keep_slow_busy() {
    busy = true;
    wait_until([&] { return latch.reached(); }, "slow to be in its long state");
  }
  static Transaction set_both() {
    Transaction both;
    both.set_property("fast", "gain", 2.0).set_property("slow", "gain", 2.0);
    return both;
  }
  /// Changes both; `fast_has_agreed` tells that fast's adopt has ended.
  Transaction change_both() {
    auto fresh = std::make_unique<ToldCore>();
    fresh->adopting = [this] { fast_has_agreed = true; };
    Transaction both = replace("fast", std::move(fresh));
    both.set_property("slow", "gain", 2.0);
    return both;
  }
  /// A change of both is made at an instant up to which slow, in its long state, is late.
  void make_it_late() {
    Transaction both = replace("fast", core_that_waits());
    both.set_property("slow", "gain", 2.0);
    make_it_late(std::move(both));
  }
  std::unique_ptr<ToldCore> core_that_waits() {
    auto fresh = std::make_unique<ToldCore>();
    fresh->adopting = [this] { fast_may_agree.wait(); };
    fresh->taking = [this] { fast_has_taken = true; };
    return fresh;
  }
  void make_it_late(Transaction both) {
    request(std::move(both), {.timeouts = {.commit_ns = s_to_ns(2), .phase_ns = 0}});
    wait_until([&] { return fast_may_agree.reached(); }, "the adopt of fast");
    wait_runs(*slow, core(*slow).runs + 5);  // it has voted by then
    keep_slow_busy();
    fast_may_agree.open();
    wait_until([&] { return fast_has_taken.load(); }, "fast's new core");
  }
  Transaction with_a_take_that_waits(time_ns_t declared = 0) {
    auto fresh = std::make_unique<ToldCore>();
    fresh->declared = declared;
    fresh->taking = [this] { take_may_end.wait(); };
    Transaction both = replace("fast", core_that_waits());
    both.replace_core("slow", std::move(fresh));
    return both;
  }
  void reach_the_take() {
    latch.open();
    wait_until([&] { return take_may_end.reached(); }, "the take");
  }
  void expect_given_up_in_its_take() {
    wait_until([&] { return slow->task().is_left_behind(); }, "the watchdog");
    EXPECT_EQ(ComponentState::faulted, slow->task().state());
    wait_ended();
    EXPECT_FALSE(error) << error->what();
    take_may_end.open();
    wait_until([&] { return slow->task().is_parked(); }, "its thread");
    EXPECT_EQ(ComponentState::faulted, slow->task().state());
  }
  double gain_of_slow() const { return slow->shell_as<TestShell>().gain.value(); }
  /// On a thread of its own; `error` is what it ended with.
  void request(Transaction transaction, const TransactionOptions& options = {}) {
    requester = std::thread([this, options, change = std::move(transaction)]() mutable {
      error = error_of(std::move(change), options);
      ended = true;
    });
  }
  void wait_ended() {
    wait_until([&] { return ended.load(); }, "the commit's answer");
    requester.join();
  }
  std::optional<Error> error_of(Transaction transaction, const TransactionOptions& options = {}) {
    try {
      deployer.commit(std::move(transaction), options);
      return std::nullopt;
    } catch (const Error& failure) {
      return failure;
    }
  }
  static void expect_going_on(Component& component) { wait_runs(component, core(component).runs + 3); }
  static Transaction replace(const std::string& component, std::unique_ptr<ToldCore> fresh) {
    Transaction change;
    change.replace_core(component, std::move(fresh));
    return change;
  }
  static constexpr TransactionOptions kPatient{.timeouts = {.commit_ns = s_to_ns(50)}};

  Component* fast{nullptr};
  Component* slow{nullptr};
  Latch latch;
  std::atomic<bool> busy{false};
  std::atomic<bool> broken{false};
  std::atomic<bool> fast_has_agreed{false};
  std::atomic<bool> fast_has_taken{false};
  Latch fast_may_agree;
  Latch take_may_end;
  std::function<void()> prepare = [] {};
  std::function<void()> at_the_end_of_slow = [] {};
  std::thread requester;
  std::optional<Error> error;
  std::atomic<bool> ended{false};
};

TEST_F(Rule10Commit, OneThatReachesNoWaitStopsTheChangeAndDelaysNoOther) {
  deploy_two({.priority = 60, .trace_records = std::size_t{1} << 15U});
  keep_slow_busy();
  error = error_of(set_both(), {.timeouts = {.commit_ns = ms_to_ns(300)}});
  ASSERT_TRUE(error);
  EXPECT_EQ(ErrorCode::timeout, error->code());
  EXPECT_EQ("slow", error->detail().component) << error->what();
  EXPECT_EQ("state Run", error->detail().element);
  expect_going_on(*fast);
  // An overrun is found on entering a wait; one that is found anywhere else comes from the change.
  TraceRecord before{};
  for (const TraceRecord& record : deployer.drain_trace().records) {
    if (record.component != fast->task().number()) continue;
    if (record.kind == static_cast<std::uint16_t>(TraceKind::overrun)) {
      EXPECT_EQ(static_cast<std::uint16_t>(TraceKind::wait), before.kind);
    }
    before = record;
  }
}

TEST_F(Rule10Commit, ManyOfDifferentPeriodsChangeTogether) {
  constexpr int kMany = 12;
  for (int i = 1; i <= kMany; ++i) add("c" + std::to_string(i), i, {.priority = 20 + i});
  deploy();
  for (int round = 0; round < 20; ++round) {
    Transaction change;
    for (int i = 1; i <= kMany; ++i) change.set_property("c" + std::to_string(i), "gain", 1.0 + round % 7);
    const auto refused = error_of(std::move(change), kPatient);
    ASSERT_FALSE(refused) << refused->what();
  }
}

TEST_F(Rule10Commit, ADeclaredBudgetLongerThanAnyWaitIsRefusedAndSaysSo) {
  add("c", 2);
  deploy();
  auto fresh = std::make_unique<ToldCore>();
  fresh->declared = ms_to_ns(20);
  error = error_of(replace("c", std::move(fresh)), {.timeouts = {.commit_ns = ms_to_ns(100)}});
  ASSERT_TRUE(error);
  EXPECT_EQ(ErrorCode::timeout, error->code());
  EXPECT_EQ("c", error->detail().component);
  EXPECT_THAT(error->what(), HasSubstr("fits in no wait"));
  EXPECT_THAT(error->detail().remedy, HasSubstr("shorter budget"));
}

TEST_F(Rule10Commit, TwoThatAreNeverInTheirWaitsTogetherChangeWithoutALostRelease) {
  // Each executes for three quarters of the period, one while the other waits.
  Component& even = add("even", 400);
  Component& odd = add("odd", 400, {.offset_ns = ms_to_ns(200)});
  for (Component* each : {&even, &odd}) core(*each).work = pause_ms(300);
  deploy();
  wait_runs(odd, 1);  // before its first release it waits
  Transaction both;
  both.set_property("even", "gain", 2.0).set_property("odd", "gain", 2.0);
  const TransactionReport report = deployer.commit(std::move(both), kPatient);
  EXPECT_EQ(0, report.steps[0].missed_releases);
  EXPECT_EQ(0, report.steps[1].missed_releases);
  EXPECT_EQ(2.0, even.shell_as<TestShell>().gain.value());
  EXPECT_EQ(2.0, odd.shell_as<TestShell>().gain.value());
}

TEST_F(Rule10Commit, AdoptAndTakeRunOnTheThreadOfTheirOwnComponent) {
  deploy_two();
  std::mutex mutex;
  std::map<std::string, std::set<std::thread::id>> threads;
  const auto note = [&](const std::string& name) {
    const std::lock_guard lock(mutex);
    threads[name].insert(std::this_thread::get_id());
  };
  for (int round = 0; round < 20; ++round) {
    Transaction both;
    for (const std::string name : {"fast", "slow"}) {
      auto fresh = std::make_unique<ToldCore>();
      fresh->adopting = fresh->taking = fresh->work = [&note, name] { note(name); };
      both.replace_core(name, std::move(fresh));
    }
    const auto refused = error_of(std::move(both), kPatient);
    ASSERT_FALSE(refused) << refused->what();
  }
  expect_going_on(*fast);
  expect_going_on(*slow);
  deployer.shutdown();
  EXPECT_EQ(1U, threads["fast"].size());
  EXPECT_EQ(1U, threads["slow"].size());
  EXPECT_NE(threads["fast"], threads["slow"]);
}

/// The first component has no overrun at an instant of the change, and runs. Where the computer stalls it has others.
void expect_no_overrun_by_change(const Component& component, const TraceDrain& trace) {
  const auto parked = records_of(trace, TraceKind::parked);
  const auto armed = records_of(trace, TraceKind::armed);
  ASSERT_FALSE(parked.empty());
  ASSERT_FALSE(armed.empty());
  const auto overruns = records_of(trace, TraceKind::overrun);
  for (const TraceRecord& overrun : overruns) {
    const time_ns_t missed = overrun.a;
    EXPECT_TRUE(missed < parked.back().time_ns || missed > armed.back().time_ns) << missed;
  }
  if (!overruns.empty()) return;
  EXPECT_EQ(0U, component.task().statistics().overruns);
  EXPECT_EQ(ComponentState::running, component.task().state()) << component.task().fault().what;
}

class Rule10Missed : public Rule10Commit, public ::testing::WithParamInterface<OverrunPolicy> {};
INSTANTIATE_TEST_SUITE_P(Policies, Rule10Missed,
                         ::testing::Values(OverrunPolicy::skip, OverrunPolicy::catch_up,
                                           OverrunPolicy::fault));

TEST_P(Rule10Missed, ReleasesThatAnAdoptLastsBeyondAreSkippedAndReportedAndAreNoOverrun) {
  Component& c = add("c", 200, {.overrun = GetParam()});
  deploy();
  wait_runs(c, 1);
  auto fresh = std::make_unique<ToldCore>();
  fresh->adopting = pause_ms(500);
  TransactionOptions options = kPatient;
  options.timeouts.phase_ns = s_to_ns(50);
  Transaction change = replace("c", std::move(fresh));
  const TransactionReport report = deployer.commit(std::move(change), options);
  EXPECT_GE(report.steps[0].missed_releases, 1);
  EXPECT_EQ(0, report.steps[0].phase_nominal_ns);
  const TraceDrain trace = deployer.drain_trace();
  expect_no_overrun_by_change(c, trace);
  const auto armed = records_of(trace, TraceKind::armed);
  ASSERT_EQ(1U, armed.size());
  EXPECT_EQ(report.steps[0].missed_releases, armed[0].c) << "the trace tells them from lost ones";
}

TEST_P(Rule10Missed, NeitherDoesANewFsmBeginWithAnOverrun) {
  Component& c = add("c", 200, {.overrun = GetParam()});
  deploy();
  wait_runs(c, 1);
  auto fresh = std::make_unique<ToldCore>();
  fresh->adopting = pause_ms(600);
  ToldCore& told = *fresh;
  Transaction change = replace("c", std::move(fresh));
  change.replace_fsm("c", std::make_unique<TestFsm>());
  TransactionOptions options = kPatient;
  options.timeouts.phase_ns = s_to_ns(50);
  const TransactionReport report = deployer.commit(std::move(change), options);
  EXPECT_GE(report.steps[0].missed_releases, 2);
  wait_until([&] { return told.runs > 1 || c.task().state() == ComponentState::faulted; }, "two runs");
  expect_no_overrun_by_change(c, deployer.drain_trace());
}

TEST_F(Rule10Commit, AStopCallsACommitOffAndWaitsForNobody) {
  deploy_two();
  keep_slow_busy();
  request(change_both(), kPatient);
  wait_until([&] { return fast_has_agreed.load(); }, "fast to agree");
  deployer.stop("fast", s_to_ns(50));
  EXPECT_EQ(ComponentState::stopped, fast->task().state());
  wait_ended();  // while slow is busy still
  ASSERT_TRUE(error);
  EXPECT_EQ(ErrorCode::wrong_revision, error->code()) << error->what();
  EXPECT_EQ("fast", error->detail().component);
  EXPECT_THAT(error->what(), HasSubstr("was started or stopped, or it faulted, before the change was made"));
  EXPECT_EQ(1.0, slow->shell_as<TestShell>().gain.value()) << "nothing was changed";
  latch.open();
  expect_going_on(*slow);
  deployer.start("fast");
  expect_going_on(*fast);
}

TEST_F(Rule10Commit, AStopOfTheOneInALongStateCallsTheCommitOffToo) {
  deploy_two();
  keep_slow_busy();
  request(change_both(), kPatient);
  wait_until([&] { return fast_has_agreed.load(); }, "fast to agree");
  EXPECT_THROW(deployer.stop("slow", 0), Error) << "it stays pending";
  wait_ended();
  ASSERT_TRUE(error);
  EXPECT_EQ(ErrorCode::wrong_revision, error->code()) << error->what();
  EXPECT_EQ("slow", error->detail().component);
  expect_going_on(*fast);
  latch.open();
  wait_until([&] { return slow->task().state() == ComponentState::stopped; }, "the pending stop");
}

TEST_F(Rule10Commit, AFaultCallsTheCommitOff) {
  deploy_two();
  keep_slow_busy();
  request(change_both(), kPatient);
  wait_until([&] { return fast_has_agreed.load(); }, "fast to agree");
  broken = true;
  latch.open();
  wait_ended();
  ASSERT_TRUE(error);
  EXPECT_EQ(ErrorCode::wrong_revision, error->code()) << error->what();
  EXPECT_EQ("FAULTED", error->detail().found);
  expect_going_on(*fast);
}

TEST_F(Rule10Commit, AGateThatIsClosedCallsOffWhatIsUnderWayAndWhatComesThen) {
  deploy_two();
  keep_slow_busy();
  CommitGate& gate = architecture.commit_gate();
  request(change_both(), kPatient);
  wait_until([&] { return fast_has_agreed.load(); }, "fast to agree");
  gate.close();
  wait_ended();
  ASSERT_TRUE(error);
  EXPECT_EQ(ErrorCode::wrong_revision, error->code());
  EXPECT_THAT(error->what(), HasSubstr("shut down"));
  expect_going_on(*fast);
  error = error_of(set_both(), kPatient);
  ASSERT_TRUE(error);
  EXPECT_THAT(error->what(), HasSubstr("shut down"));
  gate.open();
  latch.open();
  const auto refused = error_of(set_both(), kPatient);
  EXPECT_FALSE(refused) << refused->what();
}

TEST_F(Rule10Commit, WhileAnAdoptLastsTheOthersGoOn) {
  deploy_two();
  auto fresh = std::make_unique<ToldCore>();
  fresh->adopting = [this] { latch.wait(); };
  Transaction change = replace("fast", std::move(fresh));
  change.set_property("slow", "gain", 2.0);
  const int runs = core(*slow).runs;
  request(std::move(change), kPatient);
  wait_until([&] { return latch.reached(); }, "the adopt");
  wait_until([&] { return core(*slow).runs > runs + 20; }, "the one that does not run the adopt");
  EXPECT_FALSE(ended);
  EXPECT_EQ(1.0, gain_of_slow());
  latch.open();
  wait_ended();
  ASSERT_FALSE(error) << error->what();
  EXPECT_NE(nullptr, dynamic_cast<ToldCore*>(&fast->core()));
  EXPECT_EQ(2.0, gain_of_slow());
  expect_going_on(*fast);
  expect_going_on(*slow);
}

TEST_F(Rule10Commit, WhoIsOverItsBudgetIsNamedAndNobodyElse) {
  Component& fast_one = add("fast", 500);
  Component& slow_one = add("slow", 500);
  deploy();
  wait_runs(fast_one, 1);
  wait_runs(slow_one, 1);
  auto over = std::make_unique<ToldCore>();
  over->adopting = pause_ms(60);
  over->declared = ms_to_ns(5);
  auto within = std::make_unique<ToldCore>();
  within->adopting = pause_ms(90);
  Transaction change = replace("fast", std::move(over));
  change.replace_core("slow", std::move(within));
  error = error_of(std::move(change), kPatient);
  ASSERT_TRUE(error);
  EXPECT_EQ(ErrorCode::adopt_refused, error->code()) << error->what();
  EXPECT_EQ("fast", error->detail().component) << error->what();
  EXPECT_THAT(error->what(), HasSubstr("declared budget is 5000 us"));
  expect_going_on(fast_one);
  expect_going_on(slow_one);
}

TEST_F(Rule10Commit, ALateOneTakesTheChangeAtTheEndOfItsState) {
  deploy_two();
  make_it_late();
  wait_ended();  // it waits for slow as long as the timeout allows
  ASSERT_FALSE(error) << error->what();
  EXPECT_EQ(1.0, gain_of_slow());
  const auto refused = error_of(set_both(), {.timeouts = {.commit_ns = ms_to_ns(50)}});
  ASSERT_TRUE(refused);
  EXPECT_EQ("slow", refused->detail().component) << refused->what();
  Transaction other;
  other.set_property("fast", "gain", 7.0);
  const auto also = error_of(std::move(other), {.timeouts = {.commit_ns = s_to_ns(2)}});
  EXPECT_FALSE(also) << "fast has taken the change, and waits for nobody: " << also->what();
  latch.open();
  const auto is_shown = [&] {
    deployer.describe();  // completes it
    return slow->shown().properties[0].value == PropertyValue(2.0);
  };
  wait_until(is_shown, "the change to be completed");
  EXPECT_EQ(2.0, gain_of_slow());
  const auto next = error_of(set_both(), kPatient);
  EXPECT_FALSE(next) << next->what();
}

TEST_F(Rule10Commit, ALateOneThatIsStoppedTakesTheChangeFirst) {
  deploy_two();
  make_it_late();
  EXPECT_THROW(deployer.stop("slow", 0), Error) << "it stays pending";
  latch.open();
  wait_until([&] { return slow->task().state() == ComponentState::stopped; }, "the pending stop");
  EXPECT_EQ(2.0, gain_of_slow());
  wait_ended();
  EXPECT_FALSE(error) << error->what();
}

TEST_F(Rule10Commit, ALateOneThatFaultsHasTheNewParts) {
  deploy_two();
  make_it_late();
  broken = true;
  latch.open();
  wait_until([&] { return slow->task().state() == ComponentState::faulted; }, "the fault");
  wait_ended();
  EXPECT_FALSE(error) << error->what();
  EXPECT_EQ(2.0, gain_of_slow());
}

/// It takes the change before it writes its safe outputs.
TEST_F(Rule10Commit, ALateOneThatHangsInATakeOnItsWayIntoAStopIsGivenUp) {
  deploy_two();
  make_it_late(with_a_take_that_waits());
  EXPECT_THROW(deployer.stop("slow", 0), Error) << "it stays pending";
  reach_the_take();
  EXPECT_TRUE(deployer.stop("slow", {.timeout_ns = 0, .force = true})) << "its core declares no budget";
  expect_given_up_in_its_take();
}

TEST_F(Rule10Commit, ALateOneThatHangsInATakeAfterAFaultIsGivenUp) {
  deploy_two();
  make_it_late(with_a_take_that_waits(us_to_ns(100)));
  broken = true;
  reach_the_take();
  expect_given_up_in_its_take();
}

TEST_F(Rule10Commit, ALateOneThatHangsCanBeRemovedByForce) {
  deploy_two();
  make_it_late();
  wait_ended();
  Transaction removal;
  removal.remove_component("slow");
  EXPECT_TRUE(deployer.stop("slow", {.timeout_ns = ms_to_ns(50), .force = true}));
  const auto refused = error_of(std::move(removal), {.timeouts = {.commit_ns = s_to_ns(5)}});
  EXPECT_FALSE(refused) << refused->what();
  EXPECT_EQ(nullptr, architecture.find_component("slow"));
  expect_going_on(*fast);
}

/// It waits for the adopt of an earlier change, which another component has refused, in a component that is stopped.
TEST_F(Rule10Commit, AShutdownCallsOffAChangeThatWaitsForAnEarlierOne) {
  deploy_two();
  deployer.stop("slow");
  auto hanging = std::make_unique<ToldCore>();
  hanging->adopting = [this] { latch.wait(); };
  auto refusing = std::make_unique<ToldCore>();
  refusing->adopting = [this] { wait_until([&] { return latch.reached(); }, "the adopt of slow"); };
  refusing->agrees = false;
  Transaction both = replace("slow", std::move(hanging));
  both.replace_core("fast", std::move(refusing));
  const auto refused = error_of(std::move(both), {.timeouts = {.commit_ns = s_to_ns(2)}});
  ASSERT_TRUE(refused);
  EXPECT_EQ(ErrorCode::adopt_refused, refused->code()) << refused->what();
  request(replace("slow", std::make_unique<ToldCore>()), {.timeouts = {.commit_ns = s_to_ns(600)}});
  std::this_thread::sleep_for(std::chrono::milliseconds(50));
  EXPECT_FALSE(ended);
  deployer.shutdown();
  wait_ended();  // the minute of that is over long before the timeout
  ASSERT_TRUE(error);
  EXPECT_EQ(ErrorCode::not_configured, error->code()) << error->what();
  EXPECT_THAT(error->what(), HasSubstr("was shut down before the change was made"));
}

TEST_F(Rule10Commit, WhatALateOnesChangeAddsIsNotAddedTwice) {
  deploy_two();
  Transaction first = replace("fast", core_that_waits());
  first.set_property("slow", "gain", 2.0)
      .add_component("new",
                     {.shell = std::make_unique<TestShell>(),
                      .core = std::make_unique<TestCore>(),
                      .fsm = std::make_unique<TestFsm>()},
                     {})
      .add_resource("data", std::make_unique<SharedData<Number>>());
  make_it_late(std::move(first));
  wait_ended();
  EXPECT_NE(nullptr, architecture.find_component("new")) << "the change is made";
  Transaction component;
  component.add_component("new",
                          {.shell = std::make_unique<TestShell>(),
                           .core = std::make_unique<TestCore>(),
                           .fsm = std::make_unique<TestFsm>()},
                          {});
  Transaction resource;
  resource.add_resource("data", std::make_unique<SharedData<Number>>());
  for (Transaction* second : {&component, &resource}) {
    const auto refused = error_of(std::move(*second), kPatient);
    ASSERT_TRUE(refused);
    EXPECT_EQ(ErrorCode::duplicate_name, refused->code()) << refused->what();
  }
}

template <typename Kind>
class Rule10Floor : public Rule10Commit {};
using Kinds = ::testing::Types<SharedData<Number>, LatestValue<Number>, RingBuffer<Number>>;
TYPED_TEST_SUITE(Rule10Floor, Kinds);

/// The writer's end moves from slow, which is late, to fast.
TYPED_TEST(Rule10Floor, WhatALateOneWritesToAnEndThatHasMovedIsDropped) {
  auto owned = [] {
    if constexpr (std::is_default_constructible_v<TypeParam>) return std::make_unique<TypeParam>();
    if constexpr (!std::is_default_constructible_v<TypeParam>) return std::make_unique<TypeParam>(1000U);
  }();
  TypeParam& moved = *owned;
  this->architecture.add_resource("moved", std::move(owned));
  // Shared: the component runs on after the test's body.
  const auto has_written = std::make_shared<std::atomic<bool>>(false);
  this->prepare = [&] { this->architecture.connect("slow", "output", "moved", "write"); };
  this->at_the_end_of_slow = [this, has_written] {
    this->core(*this->slow).exposed_shell().output.write({.value = -1});
    *has_written = true;
  };
  this->deploy_two();
  auto fresh = this->core_that_waits();
  ToldCore& told = *fresh;
  fresh->work = [&told] { told.exposed_shell().output.write({.value = 1}); };
  Transaction both = this->replace("fast", std::move(fresh));
  both.disconnect("slow", "output").connect("fast", "output", "moved", "write");
  this->make_it_late(std::move(both));
  wait_until([&] { return told.runs > 3; }, "the new owner to write");
  ReaderState reader;
  time_ns_t time_ns = 0;
  const auto newest = [&] {
    Number value;
    while (moved.read.read(value, time_ns, reader) == DataStatus::new_data) {
      if (value.value < 0) return value.value;
    }
    return value.value;
  };
  newest();
  this->latch.open();
  wait_until([&] { return has_written->load(); }, "the late one to write");
  EXPECT_GE(newest(), 0);
  this->wait_ended();
  EXPECT_FALSE(this->error) << this->error->what();
}

/// Its period is long, so that it takes the change after the new owner has written.
TEST_F(Rule10Commit, TheLastOutputOfARemovedComponentDoesNotReplaceWhatTheNewOwnerWrites) {
  auto& moved = architecture.add_resource<LatestValue<Number>>("moved");
  for (int round = 0; round < 20; ++round) {
    const std::string before = "c" + std::to_string(round);
    const std::string after = "c" + std::to_string(round + 1);
    if (round == 0) {
      add(before, 20);
      architecture.connect(before, "output", "moved", "write");
      core(architecture.component(before)).work = [this] {
        core(architecture.component("c0")).exposed_shell().output.write({.value = 1});
      };
      deploy();
      wait_runs(architecture.component(before), 1);
    }
    auto fresh = std::make_unique<ToldCore>();
    ToldCore& told = *fresh;
    fresh->work = [&told] { told.exposed_shell().output.write({.value = 1}); };
    Transaction change;
    change.remove_component(before)
        .add_component(after, Parts{.shell = std::make_unique<TestShell>(),
                                    .core = std::move(fresh),
                                    .fsm = std::make_unique<TestFsm>()})
        .connect(after, "output", "moved", "write")
        .start(after);
    deployer.commit(std::move(change), kPatient);
    ReaderState reader;
    time_ns_t time_ns = 0;
    wait_until([&] { return told.runs > 2; }, "the new owner to write");
    Number value{.value = -1};
    moved.read.read(value, time_ns, reader);
    EXPECT_EQ(1, value.value) << "in round " << round;
  }
}

TEST_F(Rule10Commit, AnAdoptThatDoesNotEndGivesUpItsComponentOnly) {
  Component& c = add("c", 2);
  Component& other = add("other", 2);
  deploy();
  auto fresh = std::make_unique<ToldCore>();
  fresh->adopting = [this] { latch.wait(); };
  error = error_of(replace("c", std::move(fresh)), {.timeouts = {.commit_ns = s_to_ns(1)}});
  ASSERT_TRUE(error);
  EXPECT_EQ(ErrorCode::faulted, error->code()) << error->what();
  EXPECT_EQ("c", error->detail().component);
  EXPECT_EQ(ComponentState::faulted, c.task().state());
  EXPECT_THAT(c.task().fault().what, HasSubstr("adopt of its new part does not end"));
  EXPECT_THROW(deployer.stop("c"), Error) << "it is FAULTED, and nobody waits for it";
  Transaction next;
  next.set_property("other", "gain", 2.0);
  const auto refused = error_of(std::move(next), kPatient);
  EXPECT_FALSE(refused) << refused->what();
  deployer.stop("other", s_to_ns(50));
  EXPECT_EQ(ComponentState::stopped, other.task().state());
  latch.open();
  wait_until([&] { return c.task().is_parked(); }, "the thread to come back");
  EXPECT_EQ(ComponentState::faulted, c.task().state());
}

TEST_F(Rule10Commit, ATakeThatDoesNotEndCostsItsOwnComponentOnly) {
  deploy_two();
  auto fresh = std::make_unique<ToldCore>();
  fresh->taking = [this] { latch.wait(); };
  Transaction change = replace("fast", std::move(fresh));
  change.set_property("slow", "gain", 2.0);
  const auto refused = error_of(std::move(change), {.timeouts = {.commit_ns = ms_to_ns(200), .phase_ns = 0}});
  EXPECT_FALSE(refused) << "the change is made: " << refused->what();
  EXPECT_EQ(ComponentState::faulted, fast->task().state());
  EXPECT_THAT(fast->task().fault().what, HasSubstr("take of its new part does not end"));
  EXPECT_EQ(ComponentState::running, slow->task().state());
  expect_going_on(*slow);
  EXPECT_EQ(2.0, gain_of_slow());
  latch.open();
  wait_until([&] { return fast->task().is_parked(); }, "its thread");
  EXPECT_NE(nullptr, dynamic_cast<ToldCore*>(&fast->core()));
}

TEST_F(Rule10Commit, AnAdoptThatDoesNotEndHoldsNobodyWhoAsksItOfAStoppedComponent) {
  Component& c = add("c", 2);
  Component& other = add("other", 2);
  deploy();
  deployer.stop("c", s_to_ns(50));
  auto fresh = std::make_unique<ToldCore>();
  fresh->adopting = [this] { latch.wait(); };
  error = error_of(replace("c", std::move(fresh)), {.timeouts = {.commit_ns = ms_to_ns(200)}});
  ASSERT_TRUE(error);
  EXPECT_EQ(ErrorCode::faulted, error->code()) << error->what();
  EXPECT_THAT(error->what(), HasSubstr("adopt of its new part does not end"));
  EXPECT_EQ(ComponentState::faulted, c.task().state());
  EXPECT_TRUE(c.task().is_left_behind());
  EXPECT_THROW(deployer.start("c"), Error);
  Transaction next;
  next.set_property("other", "gain", 2.0);
  const auto refused = error_of(std::move(next), kPatient);
  EXPECT_FALSE(refused) << refused->what();
  expect_going_on(other);
  latch.open();
  wait_until([&] { return c.task().is_parked(); }, "the thread to come back");
  EXPECT_EQ(ComponentState::faulted, c.task().state());
  EXPECT_EQ(nullptr, dynamic_cast<ToldCore*>(&c.core())) << "nothing was changed";
  EXPECT_FALSE(c.task().is_left_behind());
}

/// Whoever waits for the stop comes before the thread that stopped is quite through with it: it has the same CPU, and
/// without the rights to be more urgent the scheduler decides.
TEST_F(Rule10Commit, WhatIsAskedRightAfterAStopIsDone) {
  Component& c = add("c", 1, {.priority = 20});
  deploy();
  std::thread asking([&] {
    cpu_set_t one;
    CPU_ZERO(&one);
    CPU_SET(kComponentsCpu, &one);
    pthread_setaffinity_np(pthread_self(), sizeof(one), &one);
    const sched_param urgent{.sched_priority = 90};
    pthread_setschedparam(pthread_self(), SCHED_FIFO, &urgent);
    for (int round = 0; round < 20; ++round) {
      deployer.stop("c", s_to_ns(50));
      const auto refused = error_of(replace("c", std::make_unique<ToldCore>()), kPatient);
      EXPECT_FALSE(refused) << refused->what();
      deployer.start("c");
    }
  });
  asking.join();
  expect_going_on(c);
}

TEST_F(Rule10Commit, AStoppedComponentWhoseAdoptDoesNotEndCanBeRemoved) {
  add("c", 2);
  deploy();
  deployer.stop("c", s_to_ns(50));
  auto fresh = std::make_unique<ToldCore>();
  const auto shared = std::make_shared<Latch>();  // the thread that is left behind may outlive this test
  fresh->adopting = [shared] { shared->wait(); };
  ASSERT_TRUE(error_of(replace("c", std::move(fresh)), {.timeouts = {.commit_ns = ms_to_ns(200)}}));
  Transaction removal;
  removal.remove_component("c");
  const auto refused = error_of(std::move(removal), kPatient);
  EXPECT_FALSE(refused) << refused->what();
  EXPECT_EQ(nullptr, architecture.find_component("c"));
  shared->open();
}

TEST_F(Rule10Commit, ATakeOfAStoppedOneThatDoesNotEndCostsItAlone) {
  deploy_two();
  deployer.stop("fast", s_to_ns(50));
  deployer.stop("slow", s_to_ns(50));
  auto fresh = std::make_unique<ToldCore>();
  fresh->taking = [this] { latch.wait(); };
  Transaction change = replace("fast", std::move(fresh));
  change.set_property("slow", "gain", 2.0);
  const auto refused = error_of(std::move(change), {.timeouts = {.commit_ns = ms_to_ns(200), .phase_ns = 0}});
  EXPECT_FALSE(refused) << "the change is made: " << refused->what();
  EXPECT_EQ(ComponentState::faulted, fast->task().state());
  EXPECT_EQ(ComponentState::stopped, slow->task().state());
  EXPECT_EQ(2.0, gain_of_slow());
  latch.open();
  wait_until([&] { return fast->task().is_parked(); }, "its thread");
}

TEST_F(Rule10Commit, AChangeOfAStoppedComponentIsMadeAndItStartsWithIt) {
  Component& c = add("c", 2);
  deploy();
  for (int i = 0; i < 50; ++i) {
    deployer.stop("c", s_to_ns(50));
    const auto refused = error_of(replace("c", std::make_unique<ToldCore>()), kPatient);
    ASSERT_FALSE(refused) << refused->what();
    EXPECT_EQ(ComponentState::stopped, c.task().state());
    EXPECT_TRUE(c.task().is_parked());
    EXPECT_NE(nullptr, dynamic_cast<ToldCore*>(&c.core()));
    deployer.start("c");
    wait_runs(c, core(c).runs + 1);
  }
}

TEST_F(Rule10Commit, AnAdoptOverItsDeclaredBudgetIsRefused) {
  Component& c = add("c", 20, {.overrun = OverrunPolicy::fault});
  deploy();
  wait_runs(c, 1);
  auto fresh = std::make_unique<ToldCore>();
  fresh->declared = ms_to_ns(1);
  fresh->adopting = pause_ms(70);
  error = error_of(replace("c", std::move(fresh)), kPatient);
  ASSERT_TRUE(error);
  EXPECT_EQ(ErrorCode::adopt_refused, error->code());
  EXPECT_THAT(error->what(), HasSubstr("declared budget is 1000 us"));
  EXPECT_EQ(nullptr, dynamic_cast<ToldCore*>(&c.core()));
  expect_no_overrun_by_change(c, deployer.drain_trace());
}

TEST_F(Rule10Commit, ATakeOverItsDeclaredBudgetIsInAndFaultsItsComponent) {
  Component& c = add("c", 20);
  Component& other = add("other", 2);
  deploy();
  auto fresh = std::make_unique<ToldCore>();
  fresh->declared = ms_to_ns(5);
  fresh->taking = pause_ms(20);
  TransactionOptions options = kPatient;
  options.timeouts.phase_ns = 0;
  const auto refused = error_of(replace("c", std::move(fresh)), options);
  ASSERT_FALSE(refused) << refused->what();
  EXPECT_NE(nullptr, dynamic_cast<ToldCore*>(&c.core()));
  wait_until([&] { return c.task().state() == ComponentState::faulted; }, "the fault");
  EXPECT_THAT(c.task().fault().what, HasSubstr("longer than the new core declares"));
  expect_going_on(other);
}

/// Runs at each write to its input, and long after without one.
struct EventFsm : Fsm<TestShell, TestCore> {
  void define() override {
    State& run = execution("Run", "act", &TestCore::act);
    State& pause = wait_event("Pause", shell().input, s_to_ns(1000), us_to_ns(100));
    set_initial(run);
    next(run, pause);
    next(pause, run);
  }
};

TEST_F(Rule10Commit, AnEventIsNotHeldUpByAChangeThatIsOpen) {
  slow = &add("slow", 3, {.priority = 40});
  core(*slow).work = [this] {
    if (busy) latch.wait();
  };
  fast = &architecture.add_component<TestShell, TestCore, EventFsm>("fast", {.cpus = {kComponentsCpu}});
  auto& events = architecture.add_resource<SharedData<Number>>("events");
  architecture.connect("fast", "input", "events", "read");
  deploy();
  keep_slow_busy();
  wait_runs(*fast, 1);
  request(change_both(), kPatient);
  wait_until([&] { return fast_has_agreed.load(); }, "fast to agree");
  for (int event = 0; event < 3; ++event) {
    const int before = core(*fast).runs;
    events.write.write({1.0}, monotonic_now_ns());
    wait_runs(*fast, before + 1);
  }
  EXPECT_FALSE(ended);
  latch.open();
  wait_ended();
  EXPECT_FALSE(error) << error->what();
}

/// Stops, starts, commits over both, and a state that now and then lasts: whatever the order, each answers and all go on.
TEST_F(Rule10Commit, StopsStartsAndCommitsAtRandomPhasesAllEnd) {
  fast = &add("fast", 1, {.priority = 60});
  slow = &add("slow", 2, {.priority = 40});
  core(*slow).work = [this] {
    if (core(*slow).runs % 50 == 0) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  };
  deploy();
  constexpr int kRounds = 400;
  std::vector<std::thread> clients;
  std::atomic<int> left{2};
  for (const char* name : {"fast", "slow"}) {
    clients.emplace_back([this, &left, name] {
      std::minstd_rand random(static_cast<unsigned char>(name[0]));
      for (int i = 0; i < kRounds; ++i) {
        std::this_thread::sleep_for(std::chrono::microseconds(random() % 3000));
        try {
          deployer.stop(name, s_to_ns(20));
          deployer.start(name);
        } catch (const Error& failure) {  // a commit that needs it running may be under way
          EXPECT_TRUE(failure.code() == ErrorCode::not_running ||
                      failure.code() == ErrorCode::already_running)
              << failure.what();
        }
      }
      --left;
    });
  }
  // As long as they go on: refused at once while one is stopped, 400 commits could be over before it is started again.
  while (left > 0) {
    const auto refused = error_of(set_both(), {.timeouts = {.commit_ns = s_to_ns(20), .phase_ns = 0}});
    if (!refused) continue;
    EXPECT_TRUE(refused->code() == ErrorCode::wrong_revision || refused->code() == ErrorCode::timeout)
        << refused->what();
    std::this_thread::sleep_for(std::chrono::microseconds(100));
  }
  for (std::thread& client : clients) client.join();
  for (Component* component : {fast, slow}) {
    if (component->task().state() == ComponentState::stopped) component->task().start();
    expect_going_on(*component);
  }
  const auto refused = error_of(set_both(), kPatient);
  EXPECT_FALSE(refused) << refused->what();
}

}  // namespace mauve::testing::test_rule10_commit
