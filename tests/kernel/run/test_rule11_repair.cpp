// SPDX-License-Identifier: LGPL-3.0-or-later
// Rule 11: a FAULTED component is repaired in place, by threads and in virtual time alike.
#include "simulated.hpp"

namespace mauve::testing::test_rule11_repair {

struct Broken : TestCore {
  void act() override {
    TestCore::act();
    throw std::runtime_error("broken");
  }
};

struct Suspicious : TestCore {
  bool adopt(const CoreBase& /*old*/) override {
    throw std::runtime_error("asked to adopt a broken core's state");
  }
  void take(CoreBase& /*old*/) noexcept override { took = true; }
  bool took{false};
};

/// Carries out one thing on both hosts.
struct ThreadsHost {
  void deploy(Architecture& architecture) {
    architecture.configure();
    deployer = std::make_unique<Deployer>(architecture);
    deployer->deploy();
  }
  void pass() { std::this_thread::sleep_for(std::chrono::milliseconds(1)); }
  std::unique_ptr<Deployer> deployer;
};
struct VirtualHost {
  void deploy(Architecture& architecture) {
    architecture.configure();
    simulation.add(architecture);
    simulation.deploy();
  }
  void pass() { simulation.run_until(simulation.now_ns() + ms_to_ns(1)); }
  Simulation simulation;
};

template <typename Host>
class Rule11Repaired : public ::testing::Test {
 protected:
  void SetUp() override {
    component = &architecture.add_component("c", std::make_unique<TestShell>(), std::make_unique<Broken>(),
                                            new_part<FsmBase, TestFsm>(), {});
    host.deploy(architecture);
    until([&] {
      return component->task().state() == ComponentState::faulted && component->task().is_parked();
    });
  }
  template <typename Condition>
  void until(Condition condition) {
    wait_until(
        [&] {
          host.pass();
          return condition();
        },
        "it");
  }
  void expect_runs() {
    TestCore& running = component->core_as<TestCore>();
    until([&] { return running.runs >= 3; });
    EXPECT_EQ(ComponentState::running, component->task().state());
    EXPECT_EQ("", component->task().fault().what);
  }
  void commit(Transaction transaction) {
    architecture.commit(std::move(transaction), {.timeouts = {.phase_ns = 0}});
  }

  Architecture architecture;
  Host host;
  Component* component{nullptr};
};
using Hosts = ::testing::Types<ThreadsHost, VirtualHost>;
TYPED_TEST_SUITE(Rule11Repaired, Hosts);

TYPED_TEST(Rule11Repaired, ByANewCoreThatTakesNothingOver) {
  auto fresh = std::make_unique<Suspicious>();
  const Suspicious& core = *fresh;
  Transaction repair;
  repair.replace_core("c", std::move(fresh));
  this->commit(std::move(repair));
  EXPECT_FALSE(core.took);
  EXPECT_EQ(ComponentState::stopped, this->component->task().state());
  EXPECT_EQ("", this->component->task().fault().what);
  Transaction start;
  start.start("c");
  this->commit(std::move(start));
  this->expect_runs();
}

TYPED_TEST(Rule11Repaired, AndStartedInOneTransaction) {
  Transaction transaction;
  transaction.replace_core("c", std::make_unique<TestCore>()).start("c");
  this->commit(std::move(transaction));
  this->expect_runs();
}

TYPED_TEST(Rule11Repaired, ByConfiguringItAnew) {
  Transaction transaction;
  transaction.set_property("c", "period_ms", std::int64_t{2}).configure("c");  // a structural property
  this->commit(std::move(transaction));
  EXPECT_EQ(ComponentState::stopped, this->component->task().state());
  EXPECT_EQ(ms_to_ns(2), this->component->task().grid().period_ns);
}

TYPED_TEST(Rule11Repaired, OrRefusedWhereAnotherStepIsAndFaultedAsBefore) {
  struct Unwilling : TestCore {
    bool configure_hook() override { return false; }
  };
  Transaction transaction;
  transaction.configure("c").replace_core("c", std::make_unique<Unwilling>());
  EXPECT_THROW(this->commit(std::move(transaction)), Error);
  EXPECT_EQ(ComponentState::faulted, this->component->task().state());
  EXPECT_EQ("broken", this->component->task().fault().what);
}

struct Picky : TestCore {
  static inline std::atomic<bool> fails{false};
  static inline std::atomic<bool> breaks{false};
  bool configure_hook() override { return !fails; }
  void act() override {
    TestCore::act();
    if (breaks) throw std::runtime_error("broken");
  }
};

TYPED_TEST(Rule11Repaired, OrAsItWasWhereItsPartsCannotBeConfiguredAnew) {
  Picky::breaks = false;
  Component& picky = this->architecture.template add_component<TestShell, Picky, TestFsm>("picky");
  const Shell* const shell = &picky.shell();
  const auto refused = [&] {
    Picky::fails = true;
    EXPECT_THROW(this->commit(std::move(
                     Transaction().set_property("picky", "period_ms", std::int64_t{2}).configure("picky"))),
                 Error);
    Picky::fails = false;
    EXPECT_EQ(shell, &picky.shell());
    EXPECT_EQ(ms_to_ns(1), picky.task().grid().period_ns);
  };
  refused();
  EXPECT_EQ(ComponentState::stopped, picky.task().state());
  this->commit(std::move(Transaction().start("picky")));
  this->until([&] { return picky.core_as<TestCore>().runs >= 3; });
  Picky::breaks = true;
  this->until([&] { return picky.task().state() == ComponentState::faulted && picky.task().is_parked(); });
  Picky::breaks = false;
  refused();
  EXPECT_EQ(ComponentState::faulted, picky.task().state());
  EXPECT_EQ("broken", picky.task().fault().what);
  this->commit(std::move(Transaction().configure("picky").start("picky")));
  EXPECT_NE(shell, &picky.shell());
  this->until([&] { return picky.core_as<TestCore>().runs >= 3; });
}

TYPED_TEST(Rule11Repaired, OrUnconfiguredWherePartsThatAreObjectsFail) {
  Picky::breaks = false;
  const Component& own = this->architecture.add_component(
      "own", std::make_unique<TestShell>(), std::make_unique<Picky>(), std::make_unique<TestFsm>(), {});
  Picky::fails = true;
  EXPECT_THROW(this->commit(std::move(Transaction().configure("own"))), Error);
  Picky::fails = false;
  EXPECT_EQ(ComponentState::unconfigured, own.task().state());
  this->commit(std::move(Transaction().configure("own").start("own")));
  EXPECT_EQ(ComponentState::running, own.task().state());
}

TYPED_TEST(Rule11Repaired, NotByAPropertyNorByAStart) {
  Transaction set;
  set.set_property("c", "gain", 2.0);
  Transaction start;
  start.start("c");
  for (Transaction* each : {&set, &start}) {
    try {
      this->commit(std::move(*each));
      FAIL();
    } catch (const Error& error) {
      EXPECT_EQ(ErrorCode::faulted, error.code());
      EXPECT_THAT(error.detail().remedy, ::testing::HasSubstr("a step configure, or replace_core"));
    }
  }
}

TYPED_TEST(Rule11Repaired, ARunningOneIsNotConfiguredAnew) {
  Transaction repair;
  repair.replace_core("c", std::make_unique<TestCore>()).start("c");
  this->commit(std::move(repair));
  this->expect_runs();
  Transaction transaction;
  transaction.configure("c");
  EXPECT_THROW(this->commit(std::move(transaction)), Error);
}

}  // namespace mauve::testing::test_rule11_repair
