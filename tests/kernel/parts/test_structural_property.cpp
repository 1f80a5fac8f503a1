// SPDX-License-Identifier: LGPL-3.0-or-later
// Structural properties: what is read in configure or define changes with the part that reads it, or not at all.
#include "simulated.hpp"
#include "transaction_fixtures.hpp"

namespace mauve::testing::test_structural_property {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

struct SizedShell : TestShell {
  Property<std::int64_t>& size = property("size", 4, {.structural = ReadBy::core});
  Property<std::string>& label = property("label", "small", {.structural = ReadBy::core | ReadBy::fsm});
};

/// Is configured with a size, and looks at every activation whether that is still the one in force.
struct SizedCore : Core<SizedShell> {
  std::function<void()> meanwhile = [] {};
  std::vector<int> room;
  std::atomic<int> runs{0};
  std::atomic<int> strangers{0};

  bool configure_hook() override {
    room.resize(static_cast<std::size_t>(shell().size.value()));
    meanwhile();
    return true;
  }
  void act() {
    const bool is_mine = static_cast<std::size_t>(shell().size.value()) == room.size();
    strangers.fetch_add(is_mine ? 0 : 1, std::memory_order_relaxed);
    runs.fetch_add(1, std::memory_order_relaxed);
  }
};

struct SizedFsm : Fsm<SizedShell, SizedCore> {
  void define() override {
    State& run = execution("Run", "act", &SizedCore::act);
    State& pause = wait("Pause", ms_to_ns(shell().period_ms.value()));
    set_initial(run);
    next(run, pause);
    next(pause, run);
  }
};

Error refusal_of(const std::function<void()>& change) {
  try {
    change();
  } catch (const Error& error) {
    return error;
  }
  ADD_FAILURE() << "should have been refused";
  return {ErrorCode::internal, "no error"};
}

class StructuralThreads : public Transacted {
 protected:
  void SetUp() override {
    add("c", 2);
    deploy();
    expect_running("c");
  }
  void expect_refused(const std::function<void()>& change) {
    const std::string before = described();
    const Error error = refusal_of(change);
    EXPECT_EQ(ErrorCode::structural_property, error.code());
    EXPECT_EQ("c", error.detail().component);
    EXPECT_THAT(error.detail().element, HasSubstr("period_ms"));
    EXPECT_THAT(error.detail().remedy, HasSubstr("replace the fsm beside it"));
    EXPECT_EQ(before, described());
  }
};

TEST_F(StructuralThreads, AloneItIsRefusedRunningOrStopped) {
  for (const bool stopped : {false, true}) {
    if (stopped) deployer.stop("c");
    expect_refused([&] { deployer.set_property("c", "period_ms", std::int64_t{7}); });
    expect_refused([&] { architecture.component("c").set_property("period_ms", std::int64_t{7}); });
    expect_refused([&] {
      Transaction beside_another_part;
      beside_another_part.replace_core("c", "t/Counting").set_property("c", "period_ms", 7);
      commit(beside_another_part);
    });
    deployer.set_property("c", "period_ms", std::int64_t{2});  // as it is: nothing to change
  }
}

TEST_F(StructuralThreads, BesideTheFsmThatReadsItItTakesEffectInEitherOrder) {
  Transaction before;
  before.set_property("c", "period_ms", 7).replace_fsm("c", "t/Fsm");
  commit(before);
  EXPECT_EQ(ms_to_ns(7), facts("c").period_ns);
  Transaction after;
  after.replace_fsm("c", "t/Fsm").set_property("c", "period_ms", 3);
  commit(after);
  EXPECT_EQ(ms_to_ns(3), facts("c").period_ns);
  EXPECT_EQ(PropertyValue(std::int64_t{3}), property("c", "period_ms"));
  expect_running("c");
}

TEST_F(StructuralThreads, ANewShellBringsAnFsmOfItsOwn) {
  Transaction transaction;
  transaction.replace_shell("c", "t/WideShell").set_property("c", "period_ms", 7);
  commit(transaction);
  EXPECT_EQ(ms_to_ns(7), facts("c").period_ns);
}

TEST_F(StructuralThreads, ADryRunRefusesAndAllowsTheSame) {
  Transaction alone;
  alone.set_property("c", "period_ms", 7);
  EXPECT_EQ(ErrorCode::structural_property, error_of(alone, {.dry_run = true}).code());
  Transaction beside;
  beside.replace_fsm("c", "t/Fsm").set_property("c", "period_ms", 7);
  commit(beside, {.dry_run = true});
  EXPECT_EQ(PropertyValue(std::int64_t{2}), property("c", "period_ms"));
  EXPECT_EQ(ms_to_ns(2), facts("c").period_ns);
}

TEST_F(StructuralThreads, WhatWasCleanedUpIsConfiguredWithIt) {
  deployer.stop("c");
  Component& component = architecture.component("c");
  component.cleanup();
  component.set_property("period_ms", std::int64_t{6});
  component.configure();
  deployer.start("c");
  EXPECT_EQ(ms_to_ns(6), facts("c").period_ns);
  expect_running("c");
}

TEST(StructuralCore, IsConfiguredWithTheNewValueWhileTheOldOneReadsItsOwn) {
  AwayFromComponents away;
  Architecture architecture;
  Deployer deployer(architecture);
  Component& component = architecture.add_component<SizedShell, SizedCore, SizedFsm>("c");
  architecture.configure();
  deployer.deploy();
  auto& old = component.core_as<SizedCore>();
  auto fresh = std::make_unique<SizedCore>();
  fresh->meanwhile = [&old] {
    const int before = old.runs;
    wait_until([&] { return old.runs > before + 2; }, "the old core to act during the preparation");
    EXPECT_EQ(0, old.strangers);
  };
  Transaction transaction;
  transaction.set_property("c", "size", 9).replace_core("c", std::move(fresh));
  deployer.commit(std::move(transaction), {.timeouts = {.commit_ns = s_to_ns(10)}});
  auto& now = component.core_as<SizedCore>();
  wait_until([&] { return now.runs > 2; }, "the new core to act");
  EXPECT_EQ(9U, now.room.size());
  EXPECT_EQ(0, now.strangers);
  deployer.shutdown();
}

TEST(StructuralCore, APropertyOfTwoPartsNeedsBoth) {
  Architecture architecture;
  Simulation simulation;
  architecture.add_component<SizedShell, SizedCore, SizedFsm>("c");
  architecture.configure();
  SimulatedHost& host = simulation.add(architecture);
  simulation.deploy();
  Transaction one;
  one.replace_core("c", std::make_unique<SizedCore>()).set_property("c", "label", "large");
  const Error error = refusal_of([&] { host.commit(std::move(one)); });
  EXPECT_EQ(ErrorCode::structural_property, error.code());
  EXPECT_EQ("a replacement of the fsm in the same transaction", error.detail().expected);
  EXPECT_EQ(2, error.detail().step);
  Transaction both;
  both.replace_core("c", std::make_unique<SizedCore>()).replace_fsm("c", std::make_unique<SizedFsm>());
  both.set_property("c", "label", "large");
  host.commit(std::move(both));
  EXPECT_EQ("large", architecture.component("c").shell_as<SizedShell>().label.value());
}

using StructuralSimulation = Simulated;

TEST_F(StructuralSimulation, TheInstantsFollowTheNewFsm) {
  Component& component = add("c", 2);
  deploy();
  run_to(ms_to_ns(3));
  Transaction alone;
  alone.set_property("c", "period_ms", 5);
  EXPECT_EQ(ErrorCode::structural_property, refusal_of([&] { host().commit(std::move(alone)); }).code());
  Transaction beside;
  beside.set_property("c", "period_ms", 5).replace_fsm("c", std::make_unique<BudgetFsm>());
  host().commit(std::move(beside));
  run_to(ms_to_ns(15));
  EXPECT_THAT(instants_ms(component), ElementsAre(0, 2, 5, 10, 15));
}

TEST_F(StructuralSimulation, AFallbackIsConfiguredWithItToo) {
  Component& component = architecture.add_component<SizedShell, SizedCore, SizedFsm>("c");
  auto spare = std::make_unique<SizedCore>();
  const SizedCore* const fallback = spare.get();
  spare->set_implementation("t/Fallback");
  component.set_fallback(std::move(spare));
  deploy();
  EXPECT_EQ(4U, fallback->room.size());
  Transaction change;
  change.set_property("c", "size", 9).replace_core("c", std::make_unique<SizedCore>());
  host().commit(std::move(change));
  EXPECT_EQ(9U, fallback->room.size());
}

}  // namespace mauve::testing::test_structural_property
