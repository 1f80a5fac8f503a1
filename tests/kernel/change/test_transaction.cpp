// SPDX-License-Identifier: LGPL-3.0-or-later
// Rule 10: every kind of step on a running architecture.
#include "transaction_fixtures.hpp"

namespace mauve::testing::test_transaction {

class Rule10Transaction : public Transacted {
 protected:
  void SetUp() override {
    for (const char* name : {"a", "b"}) add(name);
    add("untouched", 1, {.priority = 60});
    architecture.add_resource<SharedData<Number>>("x");
    architecture.add_resource<SharedData<Number>>("y");
    architecture.connect("a", "output", "x", "write");
    architecture.connect("b", "input", "x", "read");
    deploy();
    for (const char* name : {"a", "b", "untouched"}) {
      wait_until([&] { return runs(name) > 0; }, name);
    }
    witness = std::make_unique<ReleaseWitness>(architecture.component("untouched").task(), ms_to_ns(1));
  }
  void TearDown() override { witness->look(deployer.drain_trace()); }

  std::unique_ptr<ReleaseWitness> witness;
};

TEST_F(Rule10Transaction, CoresAndPropertiesOfTwoComponentsChangeAtOnce) {
  const int runs_before = runs("a");
  Transaction transaction;
  transaction.replace_core("a", "t/Counting").set_property("a", "gain", 2.5).set_property("b", "gain", 3);
  const TransactionReport report = commit(transaction);
  EXPECT_EQ("t/Counting", facts("a").parts.core);
  EXPECT_EQ(PropertyValue(2.5), property("a", "gain"));
  EXPECT_EQ(PropertyValue(3.0), property("b", "gain"));
  EXPECT_GE(runs("a"), runs_before) << "take() carried the count over";
  expect_running("a");
  expect_running("b");

  ASSERT_EQ(3U, report.steps.size());
  EXPECT_EQ("replace_core a t/Counting", report.steps[0].step);
  EXPECT_EQ("t/Core", report.steps[0].from_core);
  EXPECT_EQ("t/Counting", report.steps[0].to_core);
  EXPECT_EQ("set_property b.gain 3", report.steps[2].step);
  for (const StepReport& step : report.steps) {
    EXPECT_GT(step.prepare_ns, 0) << step.step;
    EXPECT_GT(step.blackout_ns, 0) << step.step;
    EXPECT_EQ(0, step.phase_nominal_ns) << step.step;
    EXPECT_NE(kNotMeasured, step.phase_actual_ns) << step.step;
    EXPECT_LE(step.blackout_ns, report.blackout_ns);
  }
  EXPECT_EQ(report.revision, architecture.revision());
  const TraceDrain drain = deployer.drain_trace();
  witness->look(drain);
  for (const std::uint16_t component : {std::uint16_t{0}, std::uint16_t{1}}) {
    EXPECT_EQ(1U, records_of(drain, TraceKind::parked, component).size());
    EXPECT_EQ(1U, records_of(drain, TraceKind::armed, component).size());
  }
}

TEST_F(Rule10Transaction, WiresAreSwappedBetweenTwoRunningComponents) {
  Transaction transaction;
  transaction.disconnect("a", "output")
      .disconnect("b", "input")
      .connect("a", "input", "x", "read")
      .connect("b", "output", "x", "write");
  commit(transaction);
  EXPECT_EQ("", wire("a", "output"));
  EXPECT_EQ("", wire("b", "input"));
  EXPECT_EQ("x.read", wire("a", "input"));
  EXPECT_EQ("x.write", wire("b", "output"));
  auto& b = architecture.component("b").shell_as<TestShell>();
  ASSERT_NE(nullptr, b.output.service());
  EXPECT_EQ("x", b.output.resource_name());
  EXPECT_FALSE(b.input.is_connected());
  expect_running("a");
  expect_running("b");
}

TEST_F(Rule10Transaction, AnotherChainIsAddedAndWiredInAndTheOldOneRemoved) {
  Transaction transaction;
  transaction.add_resource("z", "shared_data", kNumberType)
      .add_component("sensor_2", parts())
      .connect("sensor_2", "output", "z", "write")
      .disconnect("b", "input")
      .connect("b", "input", "z", "read")
      .remove_component("a")
      .remove_resource("x")
      .start("sensor_2");
  const TransactionReport report = commit(transaction);
  EXPECT_EQ(8U, report.steps.size());
  expect_running("sensor_2");
  expect_running("b");
  EXPECT_EQ("z.read", wire("b", "input"));
  EXPECT_THROW(architecture.component("a"), Error);
  EXPECT_THROW(architecture.resource("x"), Error);
  EXPECT_EQ(0, facts("sensor_2").reference_ns) << "the deployment's own epoch (rule 5)";
  const TraceDrain drain = deployer.drain_trace();
  witness->look(drain);
  EXPECT_FALSE(records_of(drain, TraceKind::stop, 0).empty()) << "what the removed one recorded is not lost";
  EXPECT_EQ("a", architecture.trace_components()[0]) << "numbers are not used again";
  EXPECT_EQ("sensor_2", architecture.trace_components()[3]);
  for (const TraceRecord& release : records_of(drain, TraceKind::release, 3))
    EXPECT_EQ(0, (release.a - deployer.epoch_ns()) % ms_to_ns(2));
}

TEST_F(Rule10Transaction, TheOutputsOfARemovedComponentAreWrittenBeforeAnotherWritesThere) {
  auto& a = architecture.component("a").shell_as<TestShell>();
  auto held = architecture.hold_component("a");
  ReadPort<Number> reader("reader");
  reader.connect(*architecture.resource("x").find_service("read"), "x");
  Transaction stop;
  stop.stop("a");
  commit(stop);
  a.output.write({42.0});
  deployer.start("a");
  expect_running("a");
  EXPECT_EQ(42.0, reader.read().value.value);
  Transaction transaction;
  transaction.remove_component("a");
  commit(transaction);
  EXPECT_FALSE(a.output.is_connected());
  EXPECT_EQ(0.0, reader.read().value.value) << "on_stop: the type's zero";
  reader.disconnect();
}

TEST_F(Rule10Transaction, StartAndStopAreStepsToo) {
  Transaction stop;
  stop.stop("a").set_property("a", "gain", 4.0);
  commit(stop);
  EXPECT_EQ(ComponentState::stopped, facts("a").state);
  EXPECT_EQ(PropertyValue(4.0), property("a", "gain"));
  const int stopped_at = runs("a");
  Transaction start;
  start.replace_core("a", "t/Counting").start("a");
  commit(start);
  wait_until([&] { return runs("a") > stopped_at + 1; }, "a to run again");
  Transaction again;
  again.stop("a").start("a");
  commit(again);
  EXPECT_EQ(ComponentState::running, facts("a").state);
  expect_running("a");
}

TEST_F(Rule10Transaction, ADryRunChangesNothingAndReportsPerStep) {
  const std::string before = described();
  const std::uint64_t revision = architecture.revision();
  Transaction transaction;
  transaction.replace_core("a", "t/Counting")
      .add_component("new", parts())
      .connect("new", "input", "x", "read")
      .remove_component("b")
      .start("new");
  const TransactionReport report = commit(transaction, {.dry_run = true});
  ASSERT_EQ(5U, report.steps.size());
  EXPECT_GT(report.prepare_ns, 0);
  EXPECT_EQ(0, report.blackout_ns);
  for (const StepReport& step : report.steps) EXPECT_EQ(kNotMeasured, step.phase_actual_ns) << step.step;
  EXPECT_EQ(before, described());
  EXPECT_EQ(revision, architecture.revision());
  expect_running("a");
  Transaction bad;
  bad.set_property("a", "gain", 1.0).replace_core("b", "t/Unready");
  EXPECT_EQ(2, error_of(bad, {.dry_run = true}).detail().step) << "a dry run prepares";
}

TEST_F(Rule10Transaction, ARevisionThatIsPastIsRefused) {
  const std::uint64_t revision = architecture.revision();
  Transaction first;
  first.set_property("a", "gain", 2.0);
  const TransactionReport report = commit(first, {.expected_revision = revision});
  EXPECT_GT(report.revision, revision);
  Transaction second;
  second.set_property("a", "gain", 3.0);
  EXPECT_EQ(ErrorCode::wrong_revision, error_of(second, {.expected_revision = revision}).code());
  EXPECT_EQ(PropertyValue(2.0), property("a", "gain"));
  deployer.stop("b");
  EXPECT_GT(architecture.revision(), report.revision) << "a stop is a change too";
}

TEST_F(Rule10Transaction, AComponentStoppedMeanwhileRefusesTheCommit) {
  struct StoppingCore : TestCore {
    std::function<void()> while_prepared;
    bool configure_hook() override {
      while_prepared();
      return true;
    }
  };
  auto core = std::make_unique<StoppingCore>();
  core->while_prepared = [this] { deployer.stop("b"); };  // a stop is not kept waiting by a preparation
  Transaction transaction;
  transaction.set_property("b", "gain", 2.0).replace_core("a", std::move(core));
  const Error error = error_of(transaction);
  EXPECT_EQ(ErrorCode::wrong_revision, error.code()) << error.what();
  EXPECT_EQ("b", error.detail().component);
  EXPECT_EQ(1, error.detail().step);
  EXPECT_EQ(PropertyValue(1.0), property("b", "gain"));
  EXPECT_EQ("t/Core", facts("a").parts.core);
}

TEST_F(Rule10Transaction, ASingleWriterStaysSingle) {
  Transaction add_latest;
  add_latest.add_resource("one", "latest_value", kNumberType)
      .disconnect("a", "output")
      .connect("a", "output", "one", "write");
  commit(add_latest);
  Transaction second_writer;
  second_writer.set_property("a", "gain", 2.0).connect("b", "output", "one", "write");
  EXPECT_EQ(2, error_of(second_writer).detail().step);
  Transaction exchange;  // in whatever order it is written down
  exchange.connect("b", "output", "one", "write").disconnect("a", "output");
  commit(exchange);
  EXPECT_EQ("one.write", wire("b", "output"));
  EXPECT_EQ("", wire("a", "output"));
}

TEST_F(Rule10Transaction, PartsAsObjectsServeOneCommit) {
  Transaction transaction;
  auto core = std::make_unique<CountingCore>();
  core->set_implementation("test/Counting");
  transaction.add_component<TestShell, TestCore, TestFsm>("typed")
      .replace_core("a", std::move(core))
      .start("typed");
  commit(transaction);
  EXPECT_EQ("test/Counting", facts("a").parts.core);
  expect_running("typed");
  Transaction empty;
  empty.replace_core("a", std::unique_ptr<CoreBase>());
  EXPECT_EQ(ErrorCode::invalid_argument, error_of(empty).code());
}

TEST(Rule10Setup, ATransactionOnAnArchitectureThatIsNotDeployed) {
  PluginRegistry registry;
  register_parts(registry);
  Architecture architecture(&registry);
  Deployer deployer(architecture);
  Transaction build;
  build.add_resource("x", "shared_data", kNumberType)
      .add_component("a", {.shell = "t/Shell", .core = "t/Core", .fsm = "t/Fsm"})
      .connect("a", "output", "x", "write")
      .set_property("a", "gain", 2.0);
  deployer.commit(std::move(build));
  EXPECT_EQ(ComponentState::unconfigured, architecture.component("a").task().state());
  architecture.configure();
  Transaction change;
  change.replace_core("a", std::make_unique<CountingCore>()).set_property("a", "gain", 3.0);
  deployer.commit(std::move(change));
  EXPECT_EQ(3.0, architecture.component("a").shell_as<TestShell>().gain.value());
  Transaction start;
  start.start("a");
  EXPECT_THROW(deployer.commit(std::move(start)), Error);
  deployer.deploy();
  auto& core = architecture.component("a").core_as<CountingCore>();
  wait_until([&] { return core.runs > 1; }, "the component to run");
}

}  // namespace mauve::testing::test_transaction
