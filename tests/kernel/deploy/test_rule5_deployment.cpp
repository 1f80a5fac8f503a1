// SPDX-License-Identifier: LGPL-3.0-or-later
// Rule 5: one epoch for all, also for those who come later.
#include "free_fsm.hpp"

namespace mauve::testing::test_rule5_deployment {

using ::testing::ElementsAre;
using Rule5Epoch = Simulated;
using Rule5Threads = Deployed;

TEST_F(Rule5Epoch, IsTwentyMillisecondsAwayHoweverMany) {
  for (int i = 0; i < 300; ++i) add("c" + std::to_string(i));
  const time_ns_t before = simulation.now_ns();
  deploy();
  EXPECT_EQ(before + ms_to_ns(20), simulation.epoch_ns());
}

TEST_F(Rule5Epoch, AComponentAddedLaterJoinsIt) {
  add("first", 7);
  deploy();
  simulation.at(simulation.epoch_ns() + us_to_ns(10'300), [this] {
    Transaction change;
    change.add_component<TestShell, TestCore, BudgetFsm>(
        "later", {.settings = {.offset_ns = us_to_ns(500)},
                  .properties = {{"period_ms", std::int64_t{4}}, {"gain", 0.0}}});
    change.start("later");
    host().commit(std::move(change));
    core(architecture.component("later")).instants.reserve(100);
  });
  run_to(ms_to_ns(21));
  EXPECT_THAT(instants_ms(architecture.component("later")), ElementsAre(12.5, 16.5, 20.5));
  const Task& task = architecture.component("later").task();
  EXPECT_EQ(simulation.epoch_ns() + us_to_ns(500), task.grid().reference_ns);
  const auto deployed = records_of(architecture.drain_trace(), TraceKind::deployment, task.number());
  ASSERT_EQ(1U, deployed.size());
  EXPECT_EQ(simulation.epoch_ns(), deployed[0].a) << "the record says the same of all components";
}

TEST_F(Rule5Epoch, AComponentAddedBeforeItWaitsForIt) {
  add("first");
  deploy();
  Transaction change;
  change.add_component<TestShell, TestCore, BudgetFsm>(
      "early", {.properties = {{"period_ms", std::int64_t{6}}, {"gain", 0.0}}});
  change.start("early");
  host().commit(std::move(change));
  core(architecture.component("early")).instants.reserve(100);
  run_to(ms_to_ns(7));
  for (const double instant : instants_ms(architecture.component("early")))
    EXPECT_EQ(0, static_cast<int>(instant) % 6);
  EXPECT_EQ(0, instants_ms(architecture.component("early")).front()) << "not before the epoch";
}

TEST_F(Rule5Threads, TheEpochIsTwentyMillisecondsAfterAllThreadsAreReadyHoweverMany) {
  std::vector<Component*> components;
  for (int i = 0; i < 300; ++i) {
    components.push_back(&add("c" + std::to_string(i), 2'000));
    core(*components.back()).instants.reserve(2);
  }
  const time_ns_t before = monotonic_now_ns();
  deploy();
  const time_ns_t ready = deployer.epoch_ns() - kDeploymentLead;
  EXPECT_EQ(ms_to_ns(20), kDeploymentLead);
  EXPECT_GT(ready, before) << "it was taken while deploying";
  EXPECT_LT(ready, monotonic_now_ns()) << "and not later than that";
  for (Component* component : components) wait_runs(*component, 1);
  deployer.shutdown();
  for (Component* component : components) {
    EXPECT_EQ(deployer.epoch_ns(), core(*component).instants.front());
    EXPECT_EQ(0U, component->task().statistics().skipped);
  }
}

TEST_F(Rule5Threads, AThreadAddedLaterJoinsTheEpoch) {
  add("first", 1);
  deploy();
  Transaction change;
  change.add_component<TestShell, TestCore, TestFsm>("later",
                                                     {.settings = {.cpus = {0}, .offset_ns = us_to_ns(300)},
                                                      .properties = {{"period_ms", std::int64_t{3}}}});
  change.start("later");
  deployer.commit(std::move(change), {.timeouts = {.commit_ns = s_to_ns(10), .phase_ns = s_to_ns(10)}});
  Component& later = architecture.component("later");
  wait_runs(later, 5);
  const auto releases = records_of(deployer.drain_trace(), TraceKind::release, later.task().number());
  ASSERT_GE(releases.size(), 5U);
  for (const TraceRecord& release : releases)
    EXPECT_EQ(0, (release.a - deployer.epoch_ns() - us_to_ns(300)) % ms_to_ns(3));
}

}  // namespace mauve::testing::test_rule5_deployment
