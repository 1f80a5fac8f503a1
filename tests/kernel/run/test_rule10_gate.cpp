// SPDX-License-Identifier: LGPL-3.0-or-later
// Rule 10: nobody is held past its instant for a change, and whoever wants it not to happen waits for nobody.
#include <future>
#include <random>

#include "transaction_fixtures.hpp"

namespace mauve::testing {
namespace {

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
  time_ns_t reckoned_budget_ns() const noexcept override { return reckoned; }
  std::function<void()> adopting = [] {};
  std::function<void()> taking = [] {};
  bool agrees{true};
  time_ns_t declared{0};
  time_ns_t reckoned{us_to_ns(200)};
};

std::function<void()> pause_ms(int milliseconds) {
  return [milliseconds] { std::this_thread::sleep_for(std::chrono::milliseconds(milliseconds)); };
}

class Rule10Gate : public Deployed {
 protected:
  ~Rule10Gate() override {
    latch.open();
    deployer.shutdown();
    if (requester.joinable()) requester.join();
  }

  /// Two components; `slow` stays in its state from its next activation on, until the latch is opened.
  void deploy_two(const TaskSettings& fast_settings = {.priority = 60}) {
    fast = &add("fast", 2, fast_settings);
    slow = &add("slow", 3, {.priority = 40});
    core(*slow).work = [this] {
      if (busy) latch.wait();
      if (broken) throw std::runtime_error("broken sensor");
    };
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
  std::thread requester;
  std::optional<Error> error;
  std::atomic<bool> ended{false};
};

TEST(Rule10Allowance, OneThatHasLostMoreThanAllowedStillWaitsForItsPendingInstant) {
  Commit commit(1, {});
  commit.set_max_missed(3);
  commit.expect(1);
  Participant& place = commit.participants().front();
  commit.note_came(place);
  EXPECT_EQ(3, commit.may_miss(place));
  place.lost = 1;
  EXPECT_EQ(2, commit.may_miss(place));
  place.lost = 5;
  EXPECT_EQ(0, commit.may_miss(place)) << "a negative rest would put its leaving into the past for good";
}

TEST_F(Rule10Gate, WhoWaitsInVainIsNeverHeldOverItsInstant) {
  deploy_two({.priority = 60, .trace_records = std::size_t{1} << 15U});
  keep_slow_busy();
  error = error_of(set_both(), {.timeouts = {.commit_ns = ms_to_ns(300)}});
  ASSERT_TRUE(error);
  EXPECT_EQ(ErrorCode::timeout, error->code());
  EXPECT_EQ("slow", error->detail().component) << error->what();
  EXPECT_EQ("state Run", error->detail().element);
  expect_going_on(*fast);
  // An overrun is found on entering a wait; one that is found anywhere else comes from the gate.
  TraceRecord before{};
  for (const TraceRecord& record : deployer.drain_trace().records) {
    if (record.component != fast->task().number()) continue;
    if (record.kind == static_cast<std::uint16_t>(TraceKind::overrun)) {
      EXPECT_EQ(static_cast<std::uint16_t>(TraceKind::wait), before.kind);
    }
    before = record;
  }
}

TEST_F(Rule10Gate, ManyOfDifferentPeriodsMeet) {
#ifdef __SANITIZE_THREAD__
  constexpr int kMany = 6;  // ten times as slow, twelve leave each other no common wait on a busy machine
#else
  constexpr int kMany = 12;
#endif
  for (int i = 1; i <= kMany; ++i) add("c" + std::to_string(i), i, {.priority = 20 + i});
  deploy();
  for (int round = 0; round < 20; ++round) {
    Transaction change;
    for (int i = 1; i <= kMany; ++i) change.set_property("c" + std::to_string(i), "gain", 1.0 + round % 7);
    const auto refused = error_of(std::move(change), kPatient);
    ASSERT_FALSE(refused) << refused->what();
  }
}

TEST_F(Rule10Gate, AReckonedBudgetLongerThanAnyWaitIsNoObstacle) {
  Component& c = add("c", 1);
  deploy();
  auto fresh = std::make_unique<ToldCore>();
  fresh->reckoned = ms_to_ns(20);
  const auto refused = error_of(replace("c", std::move(fresh)), kPatient);
  EXPECT_FALSE(refused) << refused->what();
  EXPECT_NE(nullptr, dynamic_cast<ToldCore*>(&c.core()));
}

TEST_F(Rule10Gate, ADeclaredBudgetLongerThanAnyWaitIsRefusedAndSaysSo) {
  add("c", 2);
  deploy();
  auto fresh = std::make_unique<ToldCore>();
  fresh->declared = ms_to_ns(20);
  error = error_of(replace("c", std::move(fresh)), {.timeouts = {.commit_ns = ms_to_ns(100)}});
  ASSERT_TRUE(error);
  EXPECT_EQ(ErrorCode::timeout, error->code());
  EXPECT_EQ("c", error->detail().component);
  EXPECT_THAT(error->what(), HasSubstr("fits in no wait"));
  EXPECT_THAT(error->detail().remedy, HasSubstr("max_missed"));
}

TEST_F(Rule10Gate, TwoThatAreNeverInTheirWaitsTogetherNeedAReleaseToBeMissed) {
  // Each executes for three quarters of the period, one while the other waits: a stall below 100 ms brings no overrun
  // and no common wait. A longer one loses a release by itself, so the change needs to miss none.
  Component& even = add("even", 400);
  Component& odd = add("odd", 400, {.offset_ns = ms_to_ns(200)});
  for (Component* each : {&even, &odd}) core(*each).work = pause_ms(300);
  const auto overruns = [&] { return even.task().statistics().overruns + odd.task().statistics().overruns; };
  deploy();
  wait_runs(odd, 1);  // before its first release it waits
  const auto both = [] {
    Transaction change;
    change.set_property("even", "gain", 2.0).set_property("odd", "gain", 2.0);
    return change;
  };
  error = error_of(both(), {.timeouts = {.commit_ns = ms_to_ns(1000)}});
  if (error) {
    EXPECT_EQ(ErrorCode::timeout, error->code());
    EXPECT_THAT(error->what(), HasSubstr("never in their waits together"));
    EXPECT_THAT(error->detail().remedy, HasSubstr("max_missed"));
  } else {
    EXPECT_GT(overruns(), 0U) << "they met in their waits without a lost release";
  }
  TransactionOptions options = kPatient;
  options.max_missed = 3;
  options.timeouts.phase_ns = s_to_ns(50);
  Transaction change = both();
  const TransactionReport report = deployer.commit(std::move(change), options);
  const auto missed = [&](int step) { return report.steps[static_cast<std::size_t>(step)].missed_releases; };
  EXPECT_GE(missed(0) + missed(1) + static_cast<std::int64_t>(overruns()), 1);
  EXPECT_LE(std::max(missed(0), missed(1)), 3);
}

TEST_F(Rule10Gate, MoreReleasesThanCanBeMeantAreRefused) {
  add("c");
  deploy();
  Transaction change;
  change.set_property("c", "gain", 2.0);
  error = error_of(std::move(change), {.max_missed = -1});
  ASSERT_TRUE(error);
  EXPECT_EQ(ErrorCode::out_of_range, error->code());
}

class Rule10Missed : public Rule10Gate, public ::testing::WithParamInterface<OverrunPolicy> {};
INSTANTIATE_TEST_SUITE_P(Policies, Rule10Missed,
                         ::testing::Values(OverrunPolicy::skip, OverrunPolicy::catch_up,
                                           OverrunPolicy::fault));

TEST_P(Rule10Missed, AllowedReleasesAreSkippedAndReportedAndAreNoOverrun) {
  Component& c = add("c", 200, {.overrun = GetParam()});
  deploy();
  wait_runs(c, 1);
  auto fresh = std::make_unique<ToldCore>();
  fresh->declared = s_to_ns(2);
  fresh->adopting = pause_ms(300);
  TransactionOptions options = kPatient;
  options.max_missed = 20;
  options.timeouts.phase_ns = s_to_ns(50);
  Transaction change = replace("c", std::move(fresh));
  const TransactionReport report = deployer.commit(std::move(change), options);
  EXPECT_GE(report.steps[0].missed_releases, 1);
  EXPECT_LE(report.steps[0].missed_releases, 20);
  EXPECT_EQ(0, report.steps[0].phase_nominal_ns);
  EXPECT_EQ(ComponentState::running, c.task().state()) << c.task().fault().what;
  EXPECT_EQ(0U, c.task().statistics().overruns);
  const auto armed = records_of(deployer.drain_trace(), TraceKind::armed);
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
  EXPECT_EQ(ComponentState::running, c.task().state()) << c.task().fault().what;
  EXPECT_EQ(0U, c.task().statistics().overruns);
}

TEST_F(Rule10Gate, AStopCallsACommitOffAndWaitsForNobody) {
  deploy_two();
  keep_slow_busy();
  request(set_both(), kPatient);
  wait_until([&] { return fast->task().state() == ComponentState::held; }, "fast at the gate");
  deployer.stop("fast", s_to_ns(50));
  EXPECT_EQ(ComponentState::stopped, fast->task().state());
  wait_ended();  // while slow is busy still
  ASSERT_TRUE(error);
  EXPECT_EQ(ErrorCode::wrong_revision, error->code()) << error->what();
  EXPECT_EQ("fast", error->detail().component);
  EXPECT_THAT(error->what(), HasSubstr("was started or stopped, or it faulted, meanwhile"));
  EXPECT_EQ(1.0, slow->shell_as<TestShell>().gain.value()) << "nothing was changed";
  latch.open();
  expect_going_on(*slow);
  deployer.start("fast");
  expect_going_on(*fast);
}

TEST_F(Rule10Gate, AStopOfTheOneInALongStateCallsTheCommitOffToo) {
  deploy_two();
  keep_slow_busy();
  request(set_both(), kPatient);
  wait_until([&] { return fast->task().state() == ComponentState::held; }, "fast at the gate");
  EXPECT_THROW(deployer.stop("slow", 0), Error) << "it stays pending";
  wait_ended();
  ASSERT_TRUE(error);
  EXPECT_EQ(ErrorCode::wrong_revision, error->code()) << error->what();
  EXPECT_EQ("slow", error->detail().component);
  expect_going_on(*fast);
  latch.open();
  wait_until([&] { return slow->task().state() == ComponentState::stopped; }, "the pending stop");
}

TEST_F(Rule10Gate, AFaultCallsTheCommitOff) {
  deploy_two();
  keep_slow_busy();
  request(set_both(), kPatient);
  wait_until([&] { return fast->task().state() == ComponentState::held; }, "fast at the gate");
  broken = true;
  latch.open();
  wait_ended();
  ASSERT_TRUE(error);
  EXPECT_EQ(ErrorCode::wrong_revision, error->code()) << error->what();
  EXPECT_EQ("FAULTED", error->detail().found);
  expect_going_on(*fast);
}

TEST_F(Rule10Gate, TheConductorCallsOffWhatIsUnderWay) {
  deploy_two();
  keep_slow_busy();
  Conductor conductor;
  conductor.withdraw();  // nothing is: nothing happens
  Commit commit(2, {});
  commit.participants()[0].task = &fast->task();
  commit.participants()[1].task = &slow->task();
  std::thread committing([&] {
    try {
      carry_out(commit, s_to_ns(50), &conductor);
    } catch (const Error& failure) {
      error = failure;
    }
  });
  wait_until([&] { return fast->task().state() == ComponentState::held; }, "fast at the gate");
  conductor.withdraw();
  committing.join();
  ASSERT_TRUE(error);
  EXPECT_EQ(ErrorCode::wrong_revision, error->code());
  EXPECT_THAT(error->what(), HasSubstr("shut down"));
  expect_going_on(*fast);
}

TEST_F(Rule10Gate, WhileAnAdoptLastsTheOthersGoOn) {
  deploy_two();
  auto fresh = std::make_unique<ToldCore>();
  fresh->adopting = [this] { latch.wait(); };
  Transaction change = replace("fast", std::move(fresh));
  change.set_property("slow", "gain", 2.0);
  const std::pair runs(core(*fast).runs.load(), core(*slow).runs.load());
  request(std::move(change), kPatient);
  wait_until([&] { return latch.reached(); }, "the adopt");
  wait_until([&] { return core(*fast).runs > runs.first + 20 || core(*slow).runs > runs.second + 20; },
             "the one that does not run the adopt");
  EXPECT_FALSE(ended);
  latch.open();
  wait_ended();
  ASSERT_TRUE(error);
  EXPECT_EQ(ErrorCode::adopt_refused, error->code()) << error->what();
  EXPECT_EQ("fast", error->detail().component);
  EXPECT_EQ(nullptr, dynamic_cast<ToldCore*>(&fast->core())) << "nothing was changed";
  EXPECT_EQ(1.0, slow->shell_as<TestShell>().gain.value());
  expect_going_on(*fast);
  expect_going_on(*slow);
}

TEST_F(Rule10Gate, ACommitThatOverranIsPutDownToWhoWasOverItsBudget) {
  deploy_two();
  auto over = std::make_unique<ToldCore>();
  over->adopting = pause_ms(60);
  auto within = std::make_unique<ToldCore>();
  within->adopting = pause_ms(90);
  within->reckoned = ms_to_ns(120);
  Transaction change = replace("fast", std::move(over));
  change.replace_core("slow", std::move(within));
  error = error_of(std::move(change), kPatient);
  ASSERT_TRUE(error);
  EXPECT_EQ(ErrorCode::adopt_refused, error->code()) << error->what();
  EXPECT_EQ("fast", error->detail().component) << error->what();
  EXPECT_THAT(error->what(), HasSubstr("reckoned at 200 us"));
  expect_going_on(*fast);
  expect_going_on(*slow);
}

TEST_F(Rule10Gate, AnAdoptThatDoesNotEndGivesUpItsComponentOnly) {
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
  EXPECT_THAT(c.task().fault().what, HasSubstr("adopt of c's new part does not end, on the thread of c"));
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

TEST_F(Rule10Gate, ATakeThatDoesNotEndGivesUpAllThatWaitForIt) {
  deploy_two();
  auto fresh = std::make_unique<ToldCore>();
  fresh->taking = [this] { latch.wait(); };
  Transaction change = replace("fast", std::move(fresh));
  change.set_property("slow", "gain", 2.0);
  error = error_of(std::move(change), {.timeouts = {.commit_ns = s_to_ns(2)}, .max_missed = 2000});
  ASSERT_TRUE(error);
  EXPECT_EQ(ErrorCode::faulted, error->code()) << error->what();
  EXPECT_EQ(ComponentState::faulted, fast->task().state());
  EXPECT_EQ(ComponentState::faulted, slow->task().state());
  latch.open();
  wait_until([&] { return fast->task().is_parked() && slow->task().is_parked(); }, "both threads");
}

TEST_F(Rule10Gate, AnAdoptThatDoesNotEndHoldsNobodyWhoAsksItOfAStoppedComponent) {
  Component& c = add("c", 2);
  Component& other = add("other", 2);
  deploy();
  deployer.stop("c", s_to_ns(50));
  auto fresh = std::make_unique<ToldCore>();
  fresh->adopting = [this] { latch.wait(); };
  error = error_of(replace("c", std::move(fresh)), {.timeouts = {.commit_ns = ms_to_ns(200)}});
  ASSERT_TRUE(error);
  EXPECT_EQ(ErrorCode::faulted, error->code()) << error->what();
  EXPECT_THAT(error->what(), HasSubstr("adopt of c's new part does not end, on the thread of c"));
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
TEST_F(Rule10Gate, WhatIsAskedRightAfterAStopIsDone) {
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

TEST_F(Rule10Gate, AStoppedComponentWhoseAdoptDoesNotEndCanBeRemoved) {
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

TEST_F(Rule10Gate, ATakeThatDoesNotEndGivesUpAllTheStoppedOnesOfItsChange) {
  deploy_two();
  deployer.stop("fast", s_to_ns(50));
  deployer.stop("slow", s_to_ns(50));
  auto fresh = std::make_unique<ToldCore>();
  fresh->taking = [this] { latch.wait(); };
  Transaction change = replace("fast", std::move(fresh));
  change.set_property("slow", "gain", 2.0);
  error = error_of(std::move(change), {.timeouts = {.commit_ns = ms_to_ns(200)}});
  ASSERT_TRUE(error);
  EXPECT_EQ(ErrorCode::faulted, error->code()) << error->what();
  EXPECT_EQ(ComponentState::faulted, fast->task().state());
  EXPECT_EQ(ComponentState::faulted, slow->task().state());
  latch.open();
  wait_until([&] { return fast->task().is_parked(); }, "its thread");
}

TEST_F(Rule10Gate, AChangeOfAStoppedComponentIsMadeAndItStartsWithIt) {
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

TEST_F(Rule10Gate, AnAdoptOverItsDeclaredBudgetIsRefused) {
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
  EXPECT_EQ(0U, c.task().statistics().overruns) << "what adopt took is no overrun";
}

TEST_F(Rule10Gate, AnAdoptMayLastAsLongAsReleasesMayBeMissedFromTheFirstMeetingOn) {
  deploy_two();
  auto fresh = std::make_unique<ToldCore>();
  fresh->adopting = pause_ms(40);
  Transaction change = replace("fast", std::move(fresh));
  change.set_property("slow", "gain", 2.0);
  TransactionOptions options = kPatient;
  options.max_missed = 10'000;
  const auto refused = error_of(std::move(change), options);
  EXPECT_FALSE(refused) << refused->what();
}

TEST_F(Rule10Gate, ATakeOverItsDeclaredBudgetIsInAndFaultsItsComponent) {
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

TEST_F(Rule10Gate, AnEventIsNotHeldUpByAGateThatOthersAreMissingAt) {
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
  request(set_both(), kPatient);
  for (int event = 0; event < 3; ++event) {
    wait_until([&] { return fast->task().state() == ComponentState::held; }, "fast at the gate");
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
TEST_F(Rule10Gate, StopsStartsAndCommitsAtRandomPhasesAllEnd) {
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
    // Adopt is late where who makes the change loses its processor.
    EXPECT_TRUE(refused->code() == ErrorCode::wrong_revision || refused->code() == ErrorCode::timeout ||
                refused->code() == ErrorCode::adopt_refused)
        << refused->what();
    std::this_thread::sleep_for(std::chrono::microseconds(100));
  }
  for (std::thread& client : clients) client.join();
  for (Component* component : {fast, slow}) {
    if (component->task().state() == ComponentState::stopped) component->task().start();
    expect_going_on(*component);
  }
  TransactionOptions options = kPatient;
  options.max_missed = 1000;  // on a busy machine they need not be in their waits together for long
  const auto refused = error_of(set_both(), options);
  EXPECT_FALSE(refused) << refused->what();
}

}  // namespace
}  // namespace mauve::testing
