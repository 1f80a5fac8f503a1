// SPDX-License-Identifier: LGPL-3.0-or-later
// A new common epoch for an architecture that runs.
#include "free_fsm.hpp"
#include "hosts.hpp"
#include "transaction_fixtures.hpp"

namespace mauve::testing::test_resynchronise {

template <typename Host>
class Resynchronise : public OnBothHosts<Host> {
 protected:
  TransactionReport resynchronise() {
    Transaction transaction;
    transaction.resynchronise();
    return this->host.commit(std::move(transaction));
  }
  const StepReport& line_of(const TransactionReport& report, const std::string& component) {
    for (const StepReport& line : report.steps) {
      if (line.component == component) return line;
    }
    ADD_FAILURE() << "no line of " << component;
    return report.steps.front();
  }
  time_ns_t epoch_ns() const { return this->architecture.deployment_epoch_ns(); }
};
TYPED_TEST_SUITE(Resynchronise, EveryHost, HostNames);

TYPED_TEST(Resynchronise, AllGoOnOnTheGridsOfTheNewEpoch) {
  Component& fast = this->add("fast", 3);
  Component& slow = this->add("slow", 20, {.offset_ns = us_to_ns(700)});
  Component& uneven = add_free(this->architecture, "uneven", [](FreeFsm& fsm) {
    State& first = fsm.run("First");
    State& second = fsm.run("Second");
    State& brief = fsm.wait("Brief", ms_to_ns(3));
    State& rest = fsm.wait("Rest", ms_to_ns(7));
    fsm.set_initial(first);
    fsm.next(first, brief);
    fsm.next(brief, second);
    fsm.next(second, rest);
    fsm.next(rest, first);
  });
  this->deploy();
  const time_ns_t before_ns = this->epoch_ns();
  this->wait_runs(uneven, 4);
  const TransactionReport report = this->resynchronise();
  const time_ns_t after_ns = this->epoch_ns();
  EXPECT_GT(after_ns, before_ns);
  EXPECT_TRUE(report.is_complete);
  EXPECT_EQ(4U, report.steps.size()) << "the step's line, then one for each component";
  for (Component* component : {&fast, &slow, &uneven}) {
    const StepReport& line = this->line_of(report, component->name());
    EXPECT_EQ(0, line.missed_releases);
    EXPECT_GE(line.shift_ns, 0);
    EXPECT_LT(line.shift_ns, component->task().grid().period_ns);
    EXPECT_EQ(after_ns + component->task().settings().offset_ns, component->task().grid().reference_ns);
    const int runs = this->core(*component).runs;
    this->wait_runs(*component, runs + 3);
  }
  this->host.shutdown();
  // Whatever the machine does, an instant lies on one of the two grids, and no two come closer than the waits between.
  for (Component* component : {&fast, &slow}) {
    const auto& instants = this->core(*component).instants;
    const Grid grid = component->task().grid();
    EXPECT_EQ(0, grid.phase_error(instants.back()));
    for (std::size_t i = 1; i < instants.size(); ++i)
      EXPECT_GE(instants[i] - instants[i - 1], grid.period_ns) << component->name() << " at " << i;
  }
  EXPECT_EQ(0, uneven.task().grid().phase_error(uneven.task().get_time()))
      << "its initial state is on the grid";
  EXPECT_GE(uneven.task().get_time(), after_ns - ms_to_ns(20));
}

TYPED_TEST(Resynchronise, BringsThoseTogetherThatWereStartedOnClocksOfTheirOwn) {
  Component& a = this->add("a", 10);
  Component& b = this->add("b", 10);
  this->deploy();
  this->wait_runs(a, 1);  // before its first entry it has no time
  this->wait_runs(b, 1);
  this->host.stop("b");
  // Far enough ahead for a machine that stalls: a clock that is past would be none.
  const int runs_before = this->core(b).runs;
  this->host.start("b", a.task().get_time() + ms_to_ns(500) + us_to_ns(3'300));
  this->wait_runs(b, runs_before + 2);
  EXPECT_EQ(us_to_ns(3'300), a.task().grid().phase_error(b.task().get_time()));
  this->resynchronise();
  const int runs = this->core(b).runs;
  this->wait_runs(b, runs + 2);
  EXPECT_EQ(0, a.task().grid().phase_error(b.task().get_time()));
  EXPECT_EQ(a.task().grid().reference_ns, b.task().grid().reference_ns);
}

TYPED_TEST(Resynchronise, StoppedOnesAndThoseAddedTakeItWhenTheyStart) {
  Component& first = this->add("first", 3);
  Component& stopped = this->add("stopped", 7);
  this->deploy();
  this->wait_runs(first, 2);
  this->host.stop("stopped");
  this->resynchronise();
  EXPECT_EQ(this->epoch_ns(), stopped.task().grid().reference_ns);
  EXPECT_EQ(ComponentState::stopped, stopped.task().state());
  Transaction transaction;
  transaction.template add_component<TestShell, TestCore, TestFsm>(
      "later", {.properties = {{"period_ms", std::int64_t{5}}}});
  transaction.start("later").start("stopped");
  this->host.commit(std::move(transaction));
  Component& later = this->architecture.component("later");
  this->wait_runs(later, 1);
  const int runs = this->core(stopped).runs;
  this->wait_runs(stopped, runs + 1);
  const Grid five{.reference_ns = this->epoch_ns(), .period_ns = ms_to_ns(5)};
  const Grid seven{.reference_ns = this->epoch_ns(), .period_ns = ms_to_ns(7)};
  EXPECT_EQ(0, five.phase_error(later.task().get_time()));
  EXPECT_EQ(0, seven.phase_error(stopped.task().get_time()));
}

/// The thread of the component takes both, and does not go on.
TYPED_TEST(Resynchronise, OneThatTheSameChangeStopsTakesItToo) {
  Component& first = this->add("first", 3);
  Component& stopped = this->add("stopped", 7);
  this->deploy();
  this->wait_runs(first, 2);
  this->wait_runs(stopped, 2);
  Transaction transaction;
  transaction.stop("stopped").resynchronise();
  this->host.commit(std::move(transaction));
  EXPECT_EQ(ComponentState::stopped, stopped.task().state());
  EXPECT_EQ(this->epoch_ns(), stopped.task().grid().reference_ns);
  EXPECT_EQ(this->epoch_ns(), first.task().grid().reference_ns);
}

TYPED_TEST(Resynchronise, BesideAnAddedComponentOneEpochServesAll) {
  Component& first = this->add("first", 3);
  this->deploy();
  this->wait_runs(first, 2);
  Transaction transaction;
  transaction.template add_component<TestShell, TestCore, TestFsm>("runs");
  transaction.template add_component<TestShell, TestCore, TestFsm>("rests");
  transaction.start("runs").resynchronise();
  this->host.commit(std::move(transaction));
  for (const auto& component : this->architecture.components())
    EXPECT_EQ(this->epoch_ns(), component->task().grid().reference_ns) << component->name();
}

TYPED_TEST(Resynchronise, TheTraceTellsOfTheNewEpoch) {
  Component& component = this->add("c", 5);
  this->deploy();
  this->wait_runs(component, 2);
  const time_ns_t before_ns = this->epoch_ns();
  this->resynchronise();
  this->wait_runs(component, 4);
  const auto told = records_of(this->architecture.drain_trace(), TraceKind::deployment);
  ASSERT_EQ(2U, told.size());
  EXPECT_EQ(before_ns, told[0].a);
  EXPECT_EQ(this->epoch_ns(), told[1].a);
  EXPECT_EQ(ms_to_ns(5), told[1].c);
}

TYPED_TEST(Resynchronise, LeavesAFaultedOneAloneAndASporadicOneInPlace) {
  Component& first = this->add("first", 3);
  Component& faulted = this->add("faulted", 3);
  Component& listens = add_free(this->architecture, "listens", [](FreeFsm& fsm) {
    State& run = fsm.run("Run");
    State& rest = fsm.wait_event("Rest", fsm.ports().input, ms_to_ns(1), us_to_ns(500));
    fsm.set_initial(run);
    fsm.next(run, rest);
    fsm.next(rest, run);
  });
  this->core(faulted).work = [] { throw 42; };
  this->deploy();
  this->wait_state(faulted, ComponentState::faulted);
  this->wait_runs(listens, 2);
  const TransactionReport report = this->resynchronise();
  EXPECT_EQ(0, this->line_of(report, "listens").shift_ns);
  EXPECT_EQ(ComponentState::faulted, faulted.task().state());
  EXPECT_EQ(this->epoch_ns(), faulted.task().grid().reference_ns) << "for when it was repaired";
  EXPECT_EQ(this->epoch_ns(), first.task().grid().reference_ns);
}

TYPED_TEST(Resynchronise, LiesAheadOfNowAlsoWhereNoComponentTakesIt) {
  this->deploy();
  this->host.run_for(ms_to_ns(30));
  const time_ns_t now_ns = (*this->host).now_ns();
  this->resynchronise();
  EXPECT_GE(this->epoch_ns(), now_ns + ms_to_ns(20));
}

struct RefusingCore : TestCore {
  bool adopt(const CoreBase& /*old*/) override { return false; }
};

TYPED_TEST(Resynchronise, ThatIsRefusedChangesNothing) {
  Component& component = this->add("c", 5);
  this->deploy();
  this->wait_runs(component, 2);
  const time_ns_t before_ns = this->epoch_ns();
  Transaction transaction;
  transaction.resynchronise().replace_core("c", std::make_unique<RefusingCore>());
  EXPECT_EQ(ErrorCode::adopt_refused, this->code_of([&] { this->host.commit(std::move(transaction)); }));
  EXPECT_EQ(before_ns, this->epoch_ns());
  EXPECT_EQ(before_ns, component.task().grid().reference_ns);
}

class ResynchroniseHung : public Deployed {};

/// A component of its name that takes its place, or itself once it was repaired, starts on the new epoch.
TEST_F(ResynchroniseHung, OneThatWasGivenUpTakesItToo) {
  const auto may_end = std::make_shared<std::atomic<bool>>(false);
  add("first");
  Component& hung = add("hung");
  core(hung).work = [may_end] {
    while (!*may_end) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  };
  deploy();
  wait_runs(hung, 1);
  EXPECT_TRUE(deployer.stop("hung", StopOptions{.timeout_ns = 0, .force = true}));
  deployer.commit(std::move(Transaction().resynchronise()));
  EXPECT_EQ(architecture.deployment_epoch_ns(), hung.task().grid().reference_ns);
  *may_end = true;
  wait_until([&] { return hung.task().is_parked(); }, "the end of the state");
}

/// The take ends after the second epoch was given, and gives the first.
TEST_F(ResynchroniseHung, OneWhoseTakeHangsKeepsTheLaterEpoch) {
  struct CoreThatHangsInTake : TestCore {
    explicit CoreThatHangsInTake(std::shared_ptr<Doors> shared) : doors(std::move(shared)) {}
    void take(CoreBase& /*old*/) noexcept override { doors->pass(); }
    std::shared_ptr<Doors> doors;
  };
  const auto doors = std::make_shared<Doors>();
  add("first");
  Component& hung = add("hung");
  deploy();
  wait_runs(hung, 1);
  Transaction both;
  both.replace_core("hung", std::make_unique<CoreThatHangsInTake>(doors)).resynchronise();
  deployer.commit(std::move(both), {.timeouts = {.commit_ns = ms_to_ns(10), .phase_ns = 0}});
  wait_until([&] { return hung.task().state() == ComponentState::faulted; }, "the end of all patience");
  const time_ns_t first_ns = architecture.deployment_epoch_ns();
  deployer.commit(std::move(Transaction().resynchronise()), {.timeouts = {.phase_ns = 0}});
  EXPECT_GT(architecture.deployment_epoch_ns(), first_ns);
  doors->open = true;
  wait_until([&] { return hung.task().is_parked(); }, "the end of the take");
  EXPECT_EQ(architecture.deployment_epoch_ns(), hung.task().grid().reference_ns);
}

/// Its state ends while the change waits for another component: it comes back when the change is decided.
TEST_F(ResynchroniseHung, OneThatFallsBackMeanwhileIsOnTheNewEpoch) {
  struct SlowToAgree : TestCore {
    explicit SlowToAgree(std::shared_ptr<Doors> shared) : doors(std::move(shared)) {}
    bool adopt(const CoreBase& /*old*/) override {
      doors->pass();
      return true;
    }
    std::shared_ptr<Doors> doors;
  };
  const auto hangs = std::make_shared<Doors>();
  const auto agrees = std::make_shared<Doors>();
  add("other");
  Component& hung = add("hung", 1, {.states = {{.name = "Run", .max_execution_ns = ms_to_ns(200)}}});
  core(hung).work = [hangs, &own = core(hung)] {
    if (own.runs == 2) hangs->pass();
  };
  hung.set_fallback(std::make_unique<TestCore>());
  deploy();
  wait_until([&] { return hung.task().state() == ComponentState::faulted; }, "the watchdog");
  Transaction both;
  both.replace_core("other", std::make_unique<SlowToAgree>(agrees)).resynchronise();
  std::thread requester(
      [&] { deployer.commit(std::move(both), {.timeouts = {.commit_ns = s_to_ns(20), .phase_ns = 0}}); });
  wait_until([&] { return agrees->entered.load(); }, "the adopt");
  hangs->open = true;
  std::this_thread::sleep_for(std::chrono::milliseconds(30));
  agrees->open = true;
  requester.join();
  wait_until([&] { return hung.task().state() == ComponentState::running; }, "the fallback");
  EXPECT_TRUE(hung.task().has_fallen_back());
  EXPECT_EQ(architecture.deployment_epoch_ns(), hung.task().grid().reference_ns);
  wait_runs(hung, 2);
  EXPECT_EQ(0, hung.task().grid().phase_error(hung.task().get_time()));
}

/// Holds the thread of the component where a repair has made it STOPPED, before it is parked again.
struct HoldsAtRepair final : TaskListener {
  void on_late_wakeup(time_ns_t /*now_ns*/, time_ns_t /*late_ns*/) noexcept override {}
  void on_late_response(time_ns_t /*now_ns*/, time_ns_t /*response_ns*/) noexcept override {}
  void on_overrun(time_ns_t /*now_ns*/, std::uint64_t /*overruns*/) noexcept override {}
  void on_over_declared(time_ns_t /*now_ns*/) noexcept override {}
  void on_state(time_ns_t /*now_ns*/, ComponentState state) noexcept override {
    if (state == ComponentState::stopped && !doors.entered) doors.pass();
  }
  Doors doors;
};

TEST_F(ResynchroniseHung, OneThatIsBeingRepairedStartsOnTheNewEpoch) {
  HoldsAtRepair repair;
  add("first");
  Component& repaired = add("repaired");
  core(repaired).work = [] { throw 42; };
  deploy();
  wait_until(
      [&] { return repaired.task().is_parked() && repaired.task().state() == ComponentState::faulted; },
      "the fault");
  ASSERT_TRUE(repaired.task().listening().listen(repair, kForever, kForever));
  std::thread requester([&] {
    Transaction transaction;
    transaction.replace_core("repaired", std::make_unique<TestCore>());
    deployer.commit(std::move(transaction), {.timeouts = {.commit_ns = s_to_ns(20), .phase_ns = 0}});
  });
  wait_until([&] { return repair.doors.entered.load(); }, "the repair");
  deployer.commit(std::move(Transaction().resynchronise()), {.timeouts = {.phase_ns = 0}});
  repair.doors.open = true;
  requester.join();
  repaired.task().listening().unlisten();
  deployer.start("repaired");
  EXPECT_EQ(architecture.deployment_epoch_ns(), repaired.task().grid().reference_ns);
  wait_runs(repaired, 2);
  EXPECT_EQ(0, repaired.task().grid().phase_error(repaired.task().get_time()));
}

TEST(ResynchroniseUndeployed, IsRefused) {
  Architecture architecture;
  architecture.add_component<TestShell, TestCore, TestFsm>("c");
  architecture.configure();
  Deployer deployer(architecture);
  Transaction transaction;
  transaction.resynchronise();
  try {
    deployer.commit(std::move(transaction));
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(ErrorCode::not_configured, error.code());
    EXPECT_EQ("resynchronise", error.detail().step_name);
  }
}

TEST(ResynchroniseInVirtualTime, MovesEachInstantToTheFirstOfTheNewGrid) {
  Architecture architecture;
  Component& component = architecture.add_component<TestShell, TestCore, TestFsm>("c");
  component.set_property("period_ms", std::int64_t{10});
  component.core_as<TestCore>().instants.reserve(100);
  architecture.configure();
  Simulation simulation;
  SimulatedHost& host = simulation.add(architecture);
  simulation.deploy();
  const time_ns_t epoch = simulation.epoch_ns();
  simulation.at(epoch + ms_to_ns(13), [&] {
    Transaction transaction;
    transaction.resynchronise();
    const TransactionReport report = host.commit(std::move(transaction));
    EXPECT_EQ(ms_to_ns(3), report.steps.back().shift_ns)
        << "20 pending, 33 new: 23 is the first not before 20";
  });
  simulation.run_until(epoch + ms_to_ns(45));
  EXPECT_EQ(epoch + ms_to_ns(33), architecture.deployment_epoch_ns());
  std::vector<time_ns_t> expected;
  for (const std::int64_t ms : {0, 10, 23, 33, 43}) expected.push_back(epoch + ms_to_ns(ms));
  EXPECT_EQ(expected, component.core_as<TestCore>().instants);
}

}  // namespace mauve::testing::test_resynchronise
