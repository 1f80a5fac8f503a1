// SPDX-License-Identifier: LGPL-3.0-or-later
// Rule 7: a hold keeps the position and the pending instant.
#include <algorithm>
#include <random>

#include "free_fsm.hpp"
#include "transaction_fixtures.hpp"

namespace mauve::testing::test_rule7_hold {

using ::testing::ElementsAre;
using Rule7Simulated = Simulated;

/// Entered in turn: First, two units of 5 ms later Second, one unit later First again.
void syncopated(FreeFsm& fsm) {
  State& first = fsm.run("First");
  State& second = fsm.run("Second");
  State& longer = fsm.wait("Longer", ms_to_ns(10));
  State& shorter = fsm.wait("Shorter", ms_to_ns(5));
  fsm.set_initial(first);
  fsm.next(first, longer);
  fsm.next(longer, second);
  fsm.next(second, shorter);
  fsm.next(shorter, first);
}

/// Notes its states' names, and hands that on to the core that replaces it.
struct NotingCore : TestCore {
  void act() override {
    TestCore::act();
    if (noted != nullptr) noted->push_back(task->current_state());
  }
  void take(CoreBase& old) noexcept override {
    auto& before = static_cast<NotingCore&>(old);
    noted = before.noted;
    task = before.task;
    instants.swap(before.instants);
  }
  std::vector<std::string>* noted{nullptr};
  const Task* task{nullptr};
};

TEST_F(Rule7Simulated, ThousandsOfCommitsAtRandomInstantsChangeNothingOfTheRhythm) {
  add_free(architecture, "c", syncopated);
  Component& component = architecture.component("c");
  std::vector<std::string> noted;
  auto first = std::make_unique<NotingCore>();
  first->instants.reserve(10'000);
  first->noted = &noted;
  first->task = &component.task();
  component.replace_core(std::move(first));
  deploy();
  std::mt19937_64 random(31);
  int commits = 0;
  for (int i = 0; i < 2'000; ++i) {
    const auto when = static_cast<time_ns_t>(random() % s_to_ns(10));
    simulation.at(simulation.epoch_ns() + when, [&, i] {
      Transaction change;
      if (i % 2 == 0) change.replace_core("c", std::make_unique<NotingCore>());
      if (i % 2 == 1) change.set_property("c", "gain", static_cast<double>(i % 10));
      host().commit(std::move(change));
      ++commits;
    });
  }
  run_to(s_to_ns(10));
  EXPECT_EQ(2'000, commits);
  const auto& instants = core(component).instants;
  ASSERT_EQ(1334U, instants.size());
  for (std::size_t k = 0; k < instants.size(); ++k) {
    ASSERT_EQ(k % 2 == 0 ? "First" : "Second", noted[k]);
    ASSERT_EQ(simulation.epoch_ns() + ms_to_ns(static_cast<std::int64_t>(k / 2 * 15 + k % 2 * 10)),
              instants[k]);
  }
  EXPECT_EQ(0U, component.task().statistics().overruns);
}

TEST_F(Rule7Simulated, ANewFsmStartsInItsInitialStateOnItsOwnPeriod) {
  Component& component = add_free(architecture, "c", syncopated);
  std::vector<std::string> entered;
  core(component).work = [&] { entered.push_back(component.task().current_state()); };
  deploy();
  simulation.at(simulation.epoch_ns() + ms_to_ns(11), [this] {
    Transaction change;
    change.replace_fsm("c", std::make_unique<FreeFsm>(varying({0, 0}, ms_to_ns(4))));
    host().commit(std::move(change));
  });
  run_to(ms_to_ns(21));
  EXPECT_THAT(instants_ms(component), ElementsAre(0, 10, 16, 20))
      << "the first multiple of 4 that is not before 15";
  EXPECT_THAT(entered, ElementsAre("First", "Second", "Run0", "Run1"));
  EXPECT_EQ(ms_to_ns(4), component.task().grid().period_ns);
  EXPECT_EQ(simulation.epoch_ns(), component.task().grid().reference_ns);
}

TEST_F(Rule7Simulated, RewiringKeepsTheInstantToo) {
  architecture.add_resource<SharedData<Number>>("x");
  architecture.add_resource<SharedData<Number>>("y");
  Component& component = add("c", 10);
  architecture.connect("c", "output", "x", "write");
  std::vector<std::string> wires;
  core(component).work = [&] { wires.push_back(core(component).exposed_shell().output.resource_name()); };
  deploy();
  simulation.at(simulation.epoch_ns() + ms_to_ns(15), [this] {
    Transaction change;
    change.disconnect("c", "output").connect("c", "output", "y", "write");
    host().commit(std::move(change));
  });
  run_to(ms_to_ns(30));
  EXPECT_THAT(instants_ms(component), ElementsAre(0, 10, 20, 30));
  EXPECT_THAT(wires, ElementsAre("x", "x", "y", "y"));
  const TraceDrain drain = architecture.drain_trace();
  const auto parked = records_of(drain, TraceKind::parked);
  const auto armed = records_of(drain, TraceKind::armed);
  ASSERT_EQ(1U, parked.size());
  ASSERT_EQ(1U, armed.size());
  EXPECT_EQ(simulation.epoch_ns() + ms_to_ns(20), parked[0].a) << "the pending instant";
  EXPECT_EQ(parked[0].a, armed[0].a);
}

using Rule7Threads = Deployed;

TEST_F(Rule7Threads, WhoWaitsForALongExecutionOfAnotherMissesNoRelease) {
  Component& fast = add("fast", 2, {.priority = 60, .cpus = {0}, .trace_records = std::size_t{1} << 15U});
  Component& slow = add("slow", 20, {.priority = 40});
  std::atomic<bool> go_on{true};
  const ComponentsEndFirst guard(deployer);
  core(slow).work = [&] {
    while (!go_on) std::this_thread::yield();
  };
  deploy();
  ReleaseWitness witness(fast.task(), ms_to_ns(2));
  for (int round = 0; round < 5; ++round) {
    go_on = false;
    const int slow_runs = core(slow).runs;
    wait_until([&] { return core(slow).runs > slow_runs; }, "the slow one to execute");  // until told
    std::thread committing([&] {
      Transaction change;
      change.set_property("fast", "gain", 2.0).set_property("slow", "gain", 2.0);
      deployer.commit(std::move(change), {.timeouts = {.commit_ns = s_to_ns(20), .phase_ns = s_to_ns(10)}});
    });
    const int fast_runs = core(fast).runs;
    wait_until([&] { return core(fast).runs >= fast_runs + 20; }, "the fast one to go on meanwhile");
    EXPECT_EQ(PropertyValue(1.0 + (round > 0 ? 1.0 : 0.0)), fast.shown().properties[0].value)
        << "not committed yet";
    go_on = true;
    committing.join();
    EXPECT_EQ(PropertyValue(2.0), fast.shown().properties[0].value);
    const TraceDrain drain = deployer.drain_trace();
    witness.look(drain);
    const auto armed = records_of(drain, TraceKind::armed, fast.task().number());
    const auto is_change = [](const TraceRecord& record) { return record.b == 1; };
    EXPECT_EQ(1, std::count_if(armed.begin(), armed.end(), is_change)) << "one park that counts";
  }
  EXPECT_GE(witness.releases(), 100);
}

}  // namespace mauve::testing::test_rule7_hold
