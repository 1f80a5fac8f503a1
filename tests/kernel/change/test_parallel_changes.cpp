// SPDX-License-Identifier: LGPL-3.0-or-later
// Changes of different components wait for each other neither while parts are prepared nor while components are awaited.
#include <future>
#include <random>

#include "hosts.hpp"

namespace mauve::testing::test_parallel_changes {

class ParallelChanges : public Hosted<OnThreads> {
 protected:
  void SetUp() override {
    for (const char* name : {"a", "b", "c"}) add(name);
    deploy();
    run_for(ms_to_ns(5));
  }
  void TearDown() override {
    doors->open = true;
    way.shutdown();
  }
  /// A change of a component whose preparation hangs until the doors open.
  std::future<void> hang_in_preparation(const std::string& name, TransactionOptions options = {}) {
    auto change = std::async(std::launch::async, [this, name, options] {
      commit(Transaction().replace_core(name, std::make_unique<HangingCore>(doors)), options);
    });
    wait_until([&] { return doors->entered.load(); }, "the preparation");
    return change;
  }
  /// A change of a component that stays in its state until the doors open.
  std::future<void> hang_in_commit(const std::string& name) {
    commit(Transaction().replace_core(name, std::make_unique<BusyCore>(doors)));
    wait_until([&] { return doors->entered.load(); }, "the long state");
    auto change = std::async(std::launch::async,
                             [this, name] { commit(Transaction().set_property(name, "gain", 2.0)); });
    std::this_thread::sleep_for(std::chrono::milliseconds(20));  // it waits by then; else it does later
    return change;
  }
  /// One change of each kind, of components that nothing hangs in.
  void change_others() {
    commit(Transaction().set_property("a", "gain", 3.0));
    commit(Transaction().replace_core("a", "t/Counting").replace_fsm("c", "t/Syncopated"));
    commit(Transaction().replace_shell("c", "t/WideShell"));
    commit(Transaction().add_component("new",
                                       ComponentParts{.shell = "t/Shell", .core = "t/Core", .fsm = "t/Fsm"}));
    commit(Transaction().remove_component("new"));
    architecture.component("a").set_property("gain", 4.0);
    EXPECT_EQ(PropertyValue(4.0), gain_of("a"));
    EXPECT_EQ("t/Counting", architecture.component("a").core_implementation());
  }
  /// Changes of other components are made while this one hangs, and it is made when the doors open.
  void expect_others_change_during(std::future<void> change) {
    change_others();
    EXPECT_FALSE(is_over(change));
    doors->open = true;
    change.get();
  }
  PropertyValue gain_of(const std::string& name) {
    return architecture.component(name).shell().find_property("gain")->boxed();
  }
  static bool is_over(std::future<void>& change) {
    return change.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
  }

  const std::shared_ptr<Doors> doors{std::make_shared<Doors>()};
};

TEST_F(ParallelChanges, WaitForNoPreparationOfOthers) {
  expect_others_change_during(hang_in_preparation("b"));
}

TEST_F(ParallelChanges, WaitForNoDryRunOfOthers) {
  expect_others_change_during(hang_in_preparation("b", {.dry_run = true}));
}

TEST_F(ParallelChanges, WaitForNoCommitOfOthers) {
  expect_others_change_during(hang_in_commit("b"));
  EXPECT_EQ(PropertyValue(2.0), gain_of("b"));
}

TEST_F(ParallelChanges, PrepareForLaterBesideAPreparation) {
  auto change = hang_in_preparation("b");
  auto prepared = host().prepare(std::move(Transaction().set_property("a", "gain", 3.0)));
  EXPECT_EQ(PreparedOutcome::committed, prepared->commit(s_to_ns(10)));
  prepared->complete();
  EXPECT_FALSE(is_over(change));
  doors->open = true;
  change.get();
}

TEST_F(ParallelChanges, OfOneComponentGoOneAfterTheOther) {
  auto first = hang_in_preparation("b");
  std::atomic<bool> was_first{true};
  auto second = std::async(std::launch::async, [&] {
    commit(Transaction().replace_core("b", "t/Counting"));
    was_first = !doors->open;
  });
  auto own = std::async(std::launch::async, [&] { architecture.component("b").set_property("gain", 5.0); });
  change_others();
  EXPECT_FALSE(is_over(second));
  EXPECT_FALSE(is_over(own));
  doors->open = true;
  first.get();
  second.get();
  own.get();
  EXPECT_FALSE(was_first);
  EXPECT_EQ("t/Counting", architecture.component("b").core_implementation());
  EXPECT_EQ(PropertyValue(5.0), gain_of("b"));
}

TEST_F(ParallelChanges, ThatAddOrRemoveGoOneAfterTheOther) {
  Transaction transaction;
  transaction.replace_shell("b", "t/WideShell").replace_core("b", std::make_unique<HangingCore>(doors));
  auto first = std::async(std::launch::async, [&] { commit(transaction); });
  wait_until([&] { return doors->entered.load(); }, "the preparation");
  auto second = std::async(std::launch::async, [&] { commit(Transaction().remove_component("c")); });
  commit(Transaction()
             .replace_fsm("a", "t/Syncopated")
             .set_property("a", "gain", 3.0));  // neither adds nor removes
  EXPECT_FALSE(is_over(first));
  EXPECT_FALSE(is_over(second));
  doors->open = true;
  first.get();
  second.get();
  EXPECT_EQ(nullptr, architecture.find_component("c"));
}

TEST_F(ParallelChanges, OfTwoThatExpectOneRevisionOneIsMade) {
  const std::uint64_t revision = architecture.revision();
  auto first = hang_in_preparation("b", {.expected_revision = revision});
  auto second = std::async(std::launch::async, [&] {
    return refusal(
        [&] { commit(Transaction().set_property("a", "gain", 3.0), {.expected_revision = revision}); });
  });
  std::this_thread::sleep_for(std::chrono::milliseconds(20));
  EXPECT_EQ(PropertyValue(1.0), gain_of("a")) << "it waits for the first one";
  doors->open = true;
  first.get();
  EXPECT_EQ(ErrorCode::wrong_revision, second.get().code());
  EXPECT_EQ(PropertyValue(1.0), gain_of("a"));
}

TEST_F(ParallelChanges, AShutdownEndsThemAndADeploymentWaits) {
  auto change = hang_in_preparation("b");
  way.shutdown();
  auto deployment = std::async(std::launch::async, [&] { host().deploy(); });
  std::this_thread::sleep_for(std::chrono::milliseconds(20));
  EXPECT_FALSE(host().is_deployed()) << "the change uses what was deployed before";
  doors->open = true;
  EXPECT_EQ(ErrorCode::not_configured, refusal([&] { change.get(); }).code());
  deployment.get();
  EXPECT_EQ("t/Core", architecture.component("b").core_implementation());
  run_for(ms_to_ns(5));
}

/// Clients with components of their own and common ones, and one that adds and removes.
TEST_F(ParallelChanges, Storm) {
  constexpr int kRounds = 200;
  std::atomic<int> made{0};
  const auto client = [&](unsigned seed) {
    std::mt19937_64 random(seed);
    const std::string own(1, static_cast<char>('a' + seed % 3));
    for (int i = 0; i < kRounds; ++i) {
      const std::string name =
          random() % 4 != 0 ? own : std::string(1, static_cast<char>('a' + random() % 3));
      const std::string extra = "extra_" + std::to_string(seed);
      Transaction transaction;
      switch (random() % 6) {
        case 0:
          transaction.replace_core(name, random() % 4 == 0 ? "t/Refusing" : "t/Counting");
          break;
        case 1:
          transaction.replace_fsm(name, random() % 2 == 0 ? "t/Fsm" : "t/Syncopated");
          break;
        case 2:
          transaction.replace_shell(name, random() % 2 == 0 ? "t/Shell" : "t/WideShell");
          break;
        case 3:
          if (architecture.find_component(extra) != nullptr) {
            transaction.remove_component(extra);
          } else {
            transaction.add_component(extra, {.shell = "t/Shell", .core = "t/Core", .fsm = "t/Fsm"})
                .start(extra);
          }
          break;
        default:
          transaction.set_property(name, "gain", static_cast<double>(random() % 10));
      }
      try {
        commit(transaction, {.timeouts = {.commit_ns = s_to_ns(30), .phase_ns = 0}});
        ++made;
      } catch (const Error& error) {
        EXPECT_EQ(ErrorCode::adopt_refused, error.code()) << error.what();
      }
    }
  };
  std::vector<std::thread> clients;
  for (unsigned seed = 0; seed < 6; ++seed) clients.emplace_back(client, seed);
  for (std::thread& each : clients) each.join();
  EXPECT_LT(6 * kRounds / 2, made.load());
  for (const char* name : {"a", "b", "c"}) {
    EXPECT_EQ(ComponentState::running, state(name));
    EXPECT_FALSE(architecture.component(name).change_mark().is_claimed());
  }
  const CommitGate::Look table(architecture.commit_gate());
  EXPECT_FALSE(architecture.claims().structure);
  EXPECT_FALSE(architecture.claims().revision);
}

}  // namespace mauve::testing::test_parallel_changes
