// SPDX-License-Identifier: LGPL-3.0-or-later
// Rule 13: the same architecture on one thread in virtual time, the same every time.
#include <random>

#include "simulated.hpp"

namespace mauve::testing::test_simulation {

using ::testing::ElementsAre;
using Rule13Simulation = Simulated;

TEST_F(Rule13Simulation, ComponentsActAtTheirInstantsAndNoTimePassesByItself) {
  Component& fast = add("fast", 2);
  Component& slow = add("slow", 3, 0.0, {.offset_ns = ms_to_ns(1)});
  deploy();
  EXPECT_EQ(simulation.now_ns() + ms_to_ns(20), simulation.epoch_ns());
  run_to(ms_to_ns(6));
  EXPECT_THAT(instants_ms(fast), ElementsAre(0, 2, 4, 6));
  EXPECT_THAT(instants_ms(slow), ElementsAre(1, 4));
  EXPECT_EQ(simulation.epoch_ns() + ms_to_ns(6), simulation.now_ns());
}

TEST_F(Rule13Simulation, EqualInstantsGoByPriorityThenByDeclaration) {
  std::vector<std::string> order;
  const auto note = [&order](Component& component) {
    core(component).work = [&order, &component] { order.push_back(component.name()); };
  };
  note(add("first", 1, 0.0, {.priority = 20}));
  note(add("second", 1, 0.0, {.priority = 20}));
  note(add("urgent", 1, 0.0, {.priority = 30}));
  deploy();
  run_to(0);
  EXPECT_THAT(order, ElementsAre("urgent", "first", "second"));
}

TEST_F(Rule13Simulation, ExecutionTakesItsDeclaredTimeAndIsNotPreempted) {
  Component& slow = add("slow", 10, 3.0, {.priority = 10, .offset_ns = 0});
  Component& urgent = add("urgent", 10, 0.0, {.priority = 90, .offset_ns = ms_to_ns(1)});
  deploy();
  run_to(ms_to_ns(9));
  const TraceDrain trace = architecture.drain_trace();
  const auto end = records_of(trace, TraceKind::state_end, slow.task().number());
  const auto release = records_of(trace, TraceKind::release, urgent.task().number());
  ASSERT_EQ(1U, end.size());
  ASSERT_EQ(1U, release.size());
  EXPECT_EQ(simulation.epoch_ns() + ms_to_ns(3), end[0].time_ns);
  EXPECT_EQ(simulation.epoch_ns() + ms_to_ns(1), release[0].a) << "nominal";
  EXPECT_EQ(simulation.epoch_ns() + ms_to_ns(3), release[0].b) << "actual: the processor was taken";
}

TEST_F(Rule13Simulation, CallbacksComeBeforeTheTasksOfTheirInstant) {
  std::vector<std::string> order;
  core(add("c", 2)).work = [&order] { order.emplace_back("task"); };
  deploy();
  simulation.every(simulation.epoch_ns(), ms_to_ns(2), [&order] { order.emplace_back("every"); });
  simulation.at(simulation.epoch_ns() + ms_to_ns(1), [&] {
    order.emplace_back("once");
    EXPECT_EQ(simulation.epoch_ns() + ms_to_ns(1), simulation.now_ns());
  });
  run_to(ms_to_ns(2));
  EXPECT_THAT(order, ElementsAre("every", "task", "once", "every", "task"));
}

TEST_F(Rule13Simulation, CallbacksBeyondAllInstantsDoNotComeAgain) {
  add("c");
  deploy();
  int once = 0;
  int never = 0;
  simulation.every(simulation.epoch_ns(), kForever, [&once] { ++once; });
  simulation.every(simulation.epoch_ns(), INT64_MAX - 1, [&once] { ++once; });
  simulation.at(kForever, [&never] { ++never; });
  run_to(ms_to_ns(5));
  EXPECT_EQ(2, once);
  host().stop("c");
  simulation.run_until(kForever);
  EXPECT_EQ(2, once);
  EXPECT_EQ(0, never);
  EXPECT_EQ(kForever, simulation.now_ns());
}

TEST(SimulationOptions, ABeginNearTheLastInstantIsRefused) {
  for (const time_ns_t begin :
       {INT64_MIN, time_ns_t{-1}, time_ns_t{0}, kLatestBegin + 1, kLongest, kLongest + 1, INT64_MAX}) {
    try {
      Simulation simulation({.begin_ns = begin});
      ADD_FAILURE() << begin;
    } catch (const Error& error) {
      EXPECT_EQ(ErrorCode::invalid_argument, error.code());
      EXPECT_EQ("begin_ns", error.detail().element);
      EXPECT_EQ("1 to " + std::to_string(kLatestBegin) + " ns, which leaves a year to run",
                error.detail().expected);
      EXPECT_EQ(std::to_string(begin), error.detail().found);
      EXPECT_FALSE(error.detail().remedy.empty());
    }
  }
}

/// Near kLongest the cut cannot say at which instant the change is made (cut.hpp).
TEST(SimulationOptions, FromTheLatestBeginAChangeHasAnInstant) {
  Architecture architecture;
  architecture.add_component<TestShell, TestCore, BudgetFsm>("p", TaskSettings{})
      .set_property("period_ms", std::int64_t{10});
  architecture.configure();
  Simulation simulation({.begin_ns = kLatestBegin});
  SimulatedHost& host = simulation.add(architecture);
  simulation.deploy();
  simulation.run_until(simulation.epoch_ns() + ms_to_ns(25));
  Transaction change;
  change.replace_core("p", std::make_unique<TestCore>());
  const TransactionReport report = host.commit(std::move(change));
  EXPECT_GT(report.instant_ns, simulation.epoch_ns() + ms_to_ns(20));
  EXPECT_LE(report.instant_ns, simulation.epoch_ns() + ms_to_ns(30));
}

TEST_F(Rule13Simulation, StopAndStartKeepTheGrid) {
  Component& component = add("c", 5);
  deploy();
  simulation.at(simulation.epoch_ns() + ms_to_ns(7), [this] { host().stop("c"); });
  simulation.at(simulation.epoch_ns() + ms_to_ns(13), [this] { host().start("c"); });
  run_to(ms_to_ns(21));
  EXPECT_THAT(instants_ms(component), ElementsAre(0, 5, 15, 20));
}

TEST_F(Rule13Simulation, ATransactionTakesEffectWithinTheWaits) {
  Component& kept = add("kept", 1);
  add("changed", 4);
  deploy();
  TransactionReport report;
  auto fresh = std::make_unique<TestCore>();
  fresh->instants.reserve(100);
  TestCore& now = *fresh;
  simulation.at(simulation.epoch_ns() + ms_to_ns(6), [&] {
    Transaction change;
    change.replace_core("changed", std::move(fresh)).set_property("kept", "gain", 0.0).stop("kept");
    report = host().commit(std::move(change));
  });
  run_to(ms_to_ns(12));
  EXPECT_EQ(ComponentState::stopped, kept.task().state());
  EXPECT_THAT(instants_ms(kept), ElementsAre(0, 1, 2, 3, 4, 5));
  std::vector<double> later;
  for (const time_ns_t instant : now.instants)
    later.push_back(static_cast<double>(instant - simulation.epoch_ns()) / 1e6);
  EXPECT_THAT(later, ElementsAre(8, 12));
  ASSERT_EQ(3U, report.steps.size());
  EXPECT_EQ(0, report.blackout_ns) << "no virtual time passes in a commit";
}

TEST_F(Rule13Simulation, TwoArchitecturesHaveAProcessorEach) {
  Architecture other;
  Component& here = add("here", 4, 3.0);
  Component& there = other.add_component<TestShell, TestCore, BudgetFsm>("there");
  there.set_property("period_ms", std::int64_t{4});
  core(there).instants.reserve(10);
  architecture.configure();
  other.configure();
  simulation.add(architecture);
  simulation.add(other);
  simulation.deploy();
  run_to(ms_to_ns(4));
  const auto released = records_of(other.drain_trace(), TraceKind::release);
  ASSERT_EQ(2U, released.size());
  EXPECT_EQ(released[0].a, released[0].b) << "the other's execution does not delay it";
  EXPECT_EQ(2, core(here).runs);
  simulation.shutdown();  // before `other` goes
}

TEST_F(Rule13Simulation, WhatIsAddedMustBeConfiguredAndFree) {
  add("c");
  EXPECT_THROW(simulation.add(architecture), Error);
  architecture.configure();
  simulation.add(architecture);
  simulation.deploy();
  Simulation second;
  EXPECT_THROW(second.add(architecture), Error);
  simulation.shutdown();
  EXPECT_NO_THROW(second.add(architecture));
  second.shutdown();
}

/// Eight components that read, write and decide by a seeded generator; the whole trace.
std::vector<TraceRecord> random_run(std::uint64_t seed) {
  Architecture architecture;
  std::mt19937_64 random(seed);
  architecture.add_resource<SharedData<Number>>("shared");
  std::vector<TestCore*> cores;
  for (int i = 0; i < 8; ++i) {
    Component& component = architecture.add_component<TestShell, TestCore, BudgetFsm>(
        "c" + std::to_string(i), {.priority = 10 + i % 3, .offset_ns = us_to_ns(100 * (i % 4))});
    component.set_property("period_ms", std::int64_t{1 + i % 5});
    component.set_property("gain", 0.05 * i);
    architecture.connect(component.name(), "input", "shared", "read");
    architecture.connect(component.name(), "output", "shared", "write");
    TestCore& core = component.core_as<TestCore>();
    core.work = [&core, &random] {
      const double value = core.exposed_shell().input.read().value.value;
      trace_mark(0, static_cast<std::int64_t>(value));
      core.exposed_shell().output.write({static_cast<double>(random() % 1000)});
    };
  }
  architecture.configure();
  Simulation simulation;
  SimulatedHost& host = simulation.add(architecture);
  simulation.deploy();
  simulation.every(simulation.epoch_ns() + ms_to_ns(10), ms_to_ns(7), [&] {
    const std::string name = "c" + std::to_string(random() % 8);
    Transaction change;
    if (architecture.component(name).task().state() == ComponentState::running) {
      change.stop(name);
    } else {
      change.start(name);
    }
    host.commit(std::move(change));
  });
  simulation.run_until(simulation.epoch_ns() + ms_to_ns(300));
  return architecture.drain_trace().records;
}

/// A change hands a writer's end over at the instant T of its clock. The clock of the next simulation begins sooner.
TEST(Rule13SimulationClocks, WhatOneOrderedDoesNotBindTheNext) {
  Architecture architecture;
  for (const char* name : {"p", "q"}) {
    Component& component = architecture.add_component<TestShell, TestCore, TestFsm>(name);
    component.core_as<TestCore>().work = [&component] {
      component.core_as<TestCore>().exposed_shell().output.write({component.name() == "q" ? 2.0 : 1.0});
    };
  }
  architecture.add_resource<SharedData<Number>>("r");
  architecture.connect("p", "output", "r", "write");
  architecture.configure();
  {
    Simulation first({.begin_ns = s_to_ns(1'000'000)});
    SimulatedHost& host = first.add(architecture);
    first.deploy();
    first.run_until(first.epoch_ns() + ms_to_ns(5));
    Transaction change;
    change.disconnect("p", "output").connect("q", "output", "r", "write");
    host.commit(std::move(change));
    first.run_until(first.epoch_ns() + ms_to_ns(10));
  }
  Simulation second({.begin_ns = s_to_ns(1)});
  second.add(architecture);
  second.deploy();
  second.run_until(second.epoch_ns() + ms_to_ns(5));
  auto& resource = static_cast<SharedData<Number>&>(architecture.resource("r"));
  ReadPort<Number> port("port");
  port.connect(resource.read, "r");
  const Sample<Number> sample = port.read();
  EXPECT_EQ(2.0, sample.value.value);
  EXPECT_EQ(second.epoch_ns() + ms_to_ns(5), sample.time_ns);
}

TEST(Rule13SimulationSeeds, EqualSeedsGiveEqualTracesBitForBit) {
  const auto first = random_run(7);
  const auto again = random_run(7);
  const auto other = random_run(8);
  ASSERT_GT(first.size(), 1000U);
  ASSERT_EQ(first.size(), again.size());
  EXPECT_EQ(0, std::memcmp(first.data(), again.data(), first.size() * sizeof(TraceRecord)));
  EXPECT_TRUE(first.size() != other.size() ||
              std::memcmp(first.data(), other.data(), first.size() * sizeof(TraceRecord)) != 0);
}

}  // namespace mauve::testing::test_simulation
