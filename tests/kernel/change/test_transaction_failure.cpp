// SPDX-License-Identifier: LGPL-3.0-or-later
// Rule 10: a failure at any step, of any kind, leaves the architecture as it was.
#include "transaction_fixtures.hpp"

namespace mauve::testing::test_transaction_failure {

using Entry = std::function<void(Transaction&)>;
struct BadStep {
  const char* what;
  ErrorCode code;
  Entry enter;
};

class Rule10Failure : public Transacted {
 protected:
  void SetUp() override {
    for (const char* name : {"a", "b", "c", "e", "f", "idle", "resting"}) add(name);
    add("g", 2, {.priority = 40});  // below the others: when it spins, they go on
    add("untouched", 1, {.priority = 60});
    for (const char* name : {"x", "y"}) architecture.add_resource<SharedData<Number>>(name);
    architecture.add_resource<LatestValue<Number>>("one");
    architecture.connect("a", "output", "x", "write");
    architecture.connect("b", "input", "x", "read");
    architecture.connect("c", "input", "x", "read");
    architecture.connect("e", "output", "y", "write");
    architecture.connect("f", "output", "one", "write");
    architecture.connect("g", "input", "x", "read");
    architecture.component("g").core_as<TestCore>().work = [this] {
      if (broken.exchange(false)) throw std::runtime_error("broken sensor");
      while (spin) spinning = true;
    };
    deploy();
    for (const char* name : {"a", "g", "untouched"}) {
      wait_until([&] { return runs(name) > 0; }, name);
    }
    deployer.stop("idle");
    deployer.stop("resting");
    witness = std::make_unique<ReleaseWitness>(architecture.component("untouched").task(), ms_to_ns(1));
  }

  void TearDown() override {
    spin = false;
    deployer.shutdown();  // before what the core of g refers to goes
  }

  /// Every kind of step, each of which builds on the ones before it.
  static std::vector<Entry> good_steps() {
    return {[](Transaction& t) { t.replace_core("a", "t/Counting"); },
            [](Transaction& t) { t.replace_fsm("b", "t/Syncopated"); },
            [](Transaction& t) { t.replace_shell("c", "t/WideShell"); },
            [](Transaction& t) { t.set_property("a", "gain", 2.5); },
            [](Transaction& t) { t.add_resource("z", "shared_data", kNumberType); },
            [](Transaction& t) { t.disconnect("b", "input"); },
            [](Transaction& t) { t.connect("b", "input", "z", "read"); },
            [](Transaction& t) { t.add_component("d", parts()); },
            [](Transaction& t) { t.connect("d", "output", "z", "write"); },
            [](Transaction& t) { t.start("d"); },
            [](Transaction& t) { t.remove_component("e"); },
            [](Transaction& t) { t.remove_resource("y"); },
            [](Transaction& t) { t.start("idle"); },
            [](Transaction& t) { t.stop("f"); }};
  }

  static std::vector<BadStep> bad_steps() {
    return {
        {"unknown core", ErrorCode::unknown_core, [](Transaction& t) { t.replace_core("g", "t/Nobody"); }},
        {"undeclared core", ErrorCode::undeclared_core,
         [](Transaction& t) { t.replace_core("g", "t/Undeclared"); }},
        {"core that does not configure", ErrorCode::prepare_failed,
         [](Transaction& t) { t.replace_core("g", "t/Unready"); }},
        {"core whose adopt returns false", ErrorCode::adopt_refused,
         [](Transaction& t) { t.replace_core("g", "t/Refusing"); }},
        {"core whose adopt throws", ErrorCode::adopt_refused,
         [](Transaction& t) { t.replace_core("g", "t/Throwing"); }},
        {"fsm of another shell", ErrorCode::prepare_failed,
         [](Transaction& t) { t.replace_fsm("g", "t/NarrowFsm"); }},
        {"unknown fsm", ErrorCode::unknown_fsm, [](Transaction& t) { t.replace_fsm("g", "t/Nobody"); }},
        {"shell without a connected port", ErrorCode::unknown_port,
         [](Transaction& t) { t.replace_shell("g", "t/NarrowShell"); }},
        {"shell that the core was not written for", ErrorCode::prepare_failed,
         [](Transaction& t) { t.replace_shell("resting", "t/NarrowShell"); }},
        {"property out of range", ErrorCode::out_of_range,
         [](Transaction& t) { t.set_property("g", "gain", 99.0); }},
        {"property of another type", ErrorCode::type_mismatch,
         [](Transaction& t) { t.set_property("g", "gain", "much"); }},
        {"unknown property", ErrorCode::unknown_property,
         [](Transaction& t) { t.set_property("g", "gian", 1.0); }},
        {"connected port", ErrorCode::duplicate_name,
         [](Transaction& t) { t.connect("g", "input", "x", "read"); }},
        {"unknown resource", ErrorCode::unknown_resource,
         [](Transaction& t) { t.connect("g", "output", "nowhere", "write"); }},
        {"unknown service", ErrorCode::unknown_service,
         [](Transaction& t) { t.connect("g", "output", "x", "wirte"); }},
        {"service of another kind", ErrorCode::type_mismatch,
         [](Transaction& t) { t.connect("g", "output", "x", "read"); }},
        {"second writer of a latest_value", ErrorCode::invalid_argument,
         [](Transaction& t) { t.connect("g", "output", "one", "write"); }},
        {"port that is not connected", ErrorCode::invalid_argument,
         [](Transaction& t) { t.disconnect("g", "output"); }},
        {"unknown port", ErrorCode::unknown_port, [](Transaction& t) { t.disconnect("g", "exit"); }},
        {"name taken", ErrorCode::duplicate_name, [](Transaction& t) { t.add_component("g", parts()); }},
        {"added component that does not configure", ErrorCode::configure_failed,
         [](Transaction& t) { t.add_component("h", parts(2, "t/Unready")); }},
        {"priority out of range", ErrorCode::out_of_range,
         [](Transaction& t) {
           ComponentParts urgent = parts();
           urgent.settings.priority = 99;
           t.add_component("h", urgent);
         }},
        {"unknown component", ErrorCode::unknown_component,
         [](Transaction& t) { t.remove_component("nobody"); }},
        {"resource name taken", ErrorCode::duplicate_name,
         [](Transaction& t) { t.add_resource("x", "shared_data", kNumberType); }},
        {"unknown type", ErrorCode::unknown_type,
         [](Transaction& t) { t.add_resource("w", "shared_data", "std_msgs/msg/Nothing"); }},
        {"connected resource", ErrorCode::invalid_argument, [](Transaction& t) { t.remove_resource("x"); }},
        {"running component", ErrorCode::already_running, [](Transaction& t) { t.start("g"); }},
        {"stopped component", ErrorCode::not_running, [](Transaction& t) { t.stop("resting"); }},
    };
  }

  // What the core of g does.
  std::atomic<bool> broken{false};
  std::atomic<bool> spin{false};
  std::atomic<bool> spinning{false};
  std::unique_ptr<ReleaseWitness> witness;
};

TEST_F(Rule10Failure, AtEveryStepAndOfEveryKindLeavesAllAsItWas) {
  const std::string before = described();
  const std::uint64_t revision = architecture.revision();
  const std::size_t good = good_steps().size();
  for (const BadStep& bad : bad_steps()) {
    for (std::size_t place = 0; place <= good; ++place) {
      Transaction transaction;
      const auto steps = good_steps();
      for (std::size_t i = 0; i <= good; ++i) {
        if (i == place) bad.enter(transaction);
        if (i < good) steps[i](transaction);
      }
      const Error error = error_of(transaction);
      ASSERT_EQ(bad.code, error.code()) << bad.what << " as step " << place + 1 << ": " << error.what();
      ASSERT_EQ(static_cast<int>(place) + 1, error.detail().step) << bad.what << ": " << error.what();
      ASSERT_EQ(before, described()) << bad.what << " as step " << place + 1;
      witness->look(deployer.drain_trace());
    }
    EXPECT_EQ(revision, architecture.revision()) << bad.what;
    for (const char* name : {"a", "b", "c", "e", "f", "g", "untouched"}) expect_running(name);
  }
  EXPECT_EQ(9U, architecture.trace_components().size()) << "no number was lost on a component that never was";
  EXPECT_GT(witness->releases(), 100);

  Transaction all_good;
  for (const Entry& enter : good_steps()) enter(all_good);
  commit(all_good);
  EXPECT_EQ("z.read", wire("b", "input"));
  EXPECT_EQ("t/WideShell", facts("c").parts.shell);
  EXPECT_EQ(ComponentState::stopped, facts("f").state);
  for (const char* name : {"a", "b", "c", "d", "g", "idle", "untouched"}) expect_running(name);
  witness->look(deployer.drain_trace());
}

TEST_F(Rule10Failure, ATransactionThatCannotGatherAllIsWithdrawnAndSaysWhoStillRuns) {
  spin = true;
  wait_until([&] { return spinning.load(); }, "g to spin");
  const std::string before = described();
  Transaction transaction;
  transaction.replace_core("a", "t/Counting").remove_component("e").set_property("g", "gain", 2.0).stop("f");
  const Error error = error_of(transaction, {.timeouts = {.commit_ns = ms_to_ns(100)}});
  EXPECT_EQ(ErrorCode::timeout, error.code());
  EXPECT_EQ("g", error.detail().component) << error.what();
  EXPECT_EQ("state Run", error.detail().element);
  EXPECT_EQ(3, error.detail().step);
  EXPECT_EQ(before, described());
  spin = false;
  for (const char* name : {"a", "b", "c", "e", "f", "g"}) expect_running(name);
  EXPECT_EQ(before, described());
}

TEST_F(Rule10Failure, AnAddedComponentWhoseThreadDoesNotGetToRunHoldsNobodyUp) {
  if (!may_use_fifo())
    GTEST_SKIP() << "needs the right to SCHED_FIFO: only then does a thread starve another";
  spin = true;
  wait_until([&] { return spinning.load(); }, "g to spin");
  const std::string before = described();
  Transaction transaction;
  ComponentParts less_urgent = parts();
  less_urgent.settings.priority = 30;
  transaction.set_property("untouched", "gain", 2.0).add_component("d", less_urgent).start("d");
  const Error error = error_of(transaction);
  EXPECT_EQ(ErrorCode::timeout, error.code()) << error.what();
  EXPECT_EQ("d", error.detail().component);
  EXPECT_EQ(2, error.detail().step);
  EXPECT_EQ(before, described());
  spin = false;
  for (const char* name : {"a", "g"}) expect_running(name);
  Transaction again;
  again.set_property("untouched", "gain", 2.0).add_component("d", less_urgent).start("d");
  commit(again);
  expect_running("d");
}

/// The start of one that gets no processor ends in time, and blocks no change of another.
TEST_F(Rule10Failure, AStartOfOneThatDoesNotGetToRunHasADeadline) {
  if (!may_use_fifo())
    GTEST_SKIP() << "needs the right to SCHED_FIFO: only then does a thread starve another";
  ComponentParts less_urgent = parts();
  less_urgent.settings.priority = 30;
  Transaction addition;
  addition.add_component("d", less_urgent);
  commit(addition);
  Task& starved = architecture.component("d").task();
  spin = true;
  wait_until([&] { return spinning.load(); }, "g to spin");
  try {
    starved.start(std::nullopt, ms_to_ns(100));
    ADD_FAILURE() << "it was started";
  } catch (const Error& error) {
    EXPECT_EQ(ErrorCode::timeout, error.code()) << error.what();
    EXPECT_EQ("d", error.detail().component);
  }
  EXPECT_TRUE(starved.is_parked());
  Transaction change;
  change.start("d");  // made: its start is posted, and waits for the processor
  commit(change, {.timeouts = {.commit_ns = ms_to_ns(200), .phase_ns = 0}});
  EXPECT_FALSE(starved.is_parked());
  starved.stop(0);  // takes the start back
  EXPECT_TRUE(starved.is_parked());
  spin = false;
  expect_running("a");
  EXPECT_EQ(ComponentState::stopped, facts("d").state);
  starved.start();
  expect_running("d");
}

TEST_F(Rule10Failure, AFaultedComponentCanBeRemovedButNotChanged) {
  broken = true;
  wait_until([&] { return facts("g").state == ComponentState::faulted; }, "the fault");
  Transaction change;
  change.set_property("a", "gain", 2.0).set_property("g", "gain", 2.0);
  const Error error = error_of(change);
  EXPECT_EQ(ErrorCode::faulted, error.code());
  EXPECT_EQ(2, error.detail().step);
  Transaction start;
  start.start("g");
  EXPECT_EQ(ErrorCode::faulted, error_of(start).code());
  Transaction exchange;
  exchange.remove_component("g").add_component("g", parts()).connect("g", "input", "x", "read").start("g");
  commit(exchange);
  EXPECT_EQ(ComponentState::running, facts("g").state);
  expect_running("g");
}

TEST_F(Rule10Failure, AProtectedComponentIsStartedAndStoppedOnly) {
  architecture.component("g").allow({}, false);
  const std::string before = described();
  for (const Entry& enter : std::vector<Entry>{
           [](Transaction& t) { t.replace_core("g", "t/Core"); },
           [](Transaction& t) { t.set_property("g", "gain", 2.0); },
           [](Transaction& t) { t.disconnect("g", "input"); },
           [](Transaction& t) { t.replace_shell("g", "t/WideShell"); },
           [](Transaction& t) { t.remove_component("g"); },
       }) {
    Transaction transaction;
    enter(transaction);
    EXPECT_EQ(ErrorCode::not_reconfigurable, error_of(transaction).code());
    EXPECT_EQ(before, described());
  }
  Transaction stop;
  stop.stop("g");
  commit(stop);
  EXPECT_EQ(ComponentState::stopped, facts("g").state);
}

}  // namespace mauve::testing::test_transaction_failure
