// SPDX-License-Identifier: LGPL-3.0-or-later
// Rule 11: a worst case that is enforced is a budget of CPU time of each execution.
#include "free_fsm.hpp"
#include "hosts.hpp"

namespace mauve::testing::test_enforced_wcet {

using ::testing::HasSubstr;

constexpr time_ns_t kBudget = ms_to_ns(20);
constexpr time_ns_t kPause = ms_to_ns(50);

void spin(time_ns_t cpu_ns) {
  const time_ns_t until = thread_cpu_now_ns() + cpu_ns;
  while (thread_cpu_now_ns() < until) {
  }
}

template <typename Way>
class EnforcedWcet : public OnBothHosts<Way> {
 protected:
  ~EnforcedWcet() override { go_on = true; }

  /// Each execution has a worst case of kBudget; in virtual time it takes `takes_ns`.
  Component& add_enforced(time_ns_t takes_ns, const std::string& name = "c", bool enforces = true,
                          time_ns_t max_execution_ns = 0) {
    return add_free(this->architecture, name,
                    [=](FreeFsm& fsm) {
                      State& run = fsm.run("Run", max_execution_ns);
                      run.simulated_execution_ns = takes_ns;
                      run.wcet_ns = kBudget;
                      State& pause = fsm.wait("Pause", kPause);
                      fsm.set_initial(run);
                      fsm.next(run, pause);
                      fsm.next(pause, run);
                    },
                    {.cpus = {kComponentsCpu}, .enforce_wcet = enforces});
  }
  static std::string fault(Component& component) { return component.task().fault().what; }

  std::atomic<bool> go_on{false};
};
TYPED_TEST_SUITE(EnforcedWcet, EveryHost, HostNames);

TYPED_TEST(EnforcedWcet, FaultsAnExecutionThatUsesMoreCpuTime) {
  Component& component = this->add_enforced(kBudget + 1);
  if (!TestFixture::is_virtual) this->core(component).work = [] { spin(kBudget + 1); };
  this->deploy();
  this->wait_state(component, ComponentState::faulted);
  this->host.until([&] { return component.task().is_parked(); }, "the park");
  EXPECT_EQ("Run", component.task().fault().where);
  EXPECT_THAT(this->fault(component), HasSubstr("state Run used 2"));
  EXPECT_THAT(this->fault(component), HasSubstr(" ms of CPU time, and its wcet_ns is 20 ms"));
  EXPECT_EQ(1, this->core(component).runs);
}

TYPED_TEST(EnforcedWcet, IsOnTimeWithAllOfItsBudget) {
  Component& component = this->add_enforced(kBudget);
  if (!TestFixture::is_virtual) this->core(component).work = [] { spin(kBudget / 20); };
  this->deploy();
  this->wait_runs(component, 5);
  EXPECT_EQ("", this->fault(component));
}

TYPED_TEST(EnforcedWcet, IsNotEnforcedUnlessAskedFor) {
  Component& component = this->add_enforced(kBudget + 1, "c", false);
  if (!TestFixture::is_virtual) this->core(component).work = [] { spin(kBudget + 1); };
  this->deploy();
  this->wait_runs(component, 2);
  EXPECT_EQ("", this->fault(component));
  EXPECT_FALSE(component.described_states().front().wcet_enforced);
}

TYPED_TEST(EnforcedWcet, WithABoundTooTheFirstOfThemFaults) {
  Component& component = this->add_enforced(s_to_ns(7), "c", true, s_to_ns(6));
  if (!TestFixture::is_virtual) {
    this->core(component).work = [this] {
      while (!this->go_on) spin(us_to_ns(100));
    };
  }
  this->deploy();
  this->wait_state(component, ComponentState::faulted);
  EXPECT_THAT(this->fault(component), HasSubstr("its wcet_ns is 20 ms"));
  this->go_on = true;
}

TYPED_TEST(EnforcedWcet, IsDescribedOfExecutionStatesAlone) {
  Component& component = this->add_enforced(0);
  this->deploy();
  const auto states = component.described_states();
  ASSERT_EQ(2U, states.size());
  EXPECT_TRUE(states[0].wcet_enforced);
  EXPECT_FALSE(states[1].wcet_enforced) << "a wait";
}

/// The worst case of the core that is in force counts.
TYPED_TEST(EnforcedWcet, FollowsTheCore) {
  Component& component = this->architecture.template add_component<TestShell, TestCore, TestFsm>(
      "c", {.cpus = {kComponentsCpu},
            .enforce_wcet = true,
            .states = {{.name = "Run", .simulated_execution_ns = 2}}});
  component.set_property("period_ms", std::int64_t{2});
  this->core(component).instants.reserve(10'000);
  this->deploy();
  this->wait_runs(component, 3);
  EXPECT_FALSE(component.described_states().front().wcet_enforced) << "no worst case is known";
  auto other = std::make_unique<TestCore>();
  other->instants.reserve(10'000);
  other->set_wcet_ns({{"act", 1}});
  Transaction transaction;
  transaction.replace_core("c", std::move(other));
  this->host.commit(std::move(transaction), 0);
  this->wait_state(component, ComponentState::faulted);
  EXPECT_THAT(this->fault(component), HasSubstr("its wcet_ns is 1e-06 ms"));
}

TYPED_TEST(EnforcedWcet, LetsAFallbackTakeOver) {
  Component& component = this->add_enforced(kBudget + 1);
  std::atomic<int> spare_runs{0};
  auto spare = std::make_unique<TestCore>();
  spare->instants.reserve(10'000);
  spare->work = [&spare_runs] { ++spare_runs; };
  component.set_fallback(std::move(spare));
  if (!TestFixture::is_virtual) this->core(component).work = [] { spin(kBudget + 1); };
  this->deploy();
  this->host.until([&] { return spare_runs.load() >= 1; }, "the fallback");
  EXPECT_THAT(this->fault(component), HasSubstr("of CPU time"));
}

// ---- while it lasts, by the watchdog

class EnforcedWhileItLasts : public Deployed {
 protected:
  ~EnforcedWhileItLasts() override {
    go_on = true;
    deployer.shutdown();
  }
  Component& add_enforced(const std::string& name, int priority = 50) {
    return add_free(architecture, name,
                    [](FreeFsm& fsm) {
                      State& run = fsm.run("Run");
                      run.wcet_ns = kBudget;
                      State& pause = fsm.wait("Pause", kPause);
                      fsm.set_initial(run);
                      fsm.next(run, pause);
                      fsm.next(pause, run);
                    },
                    {.priority = priority, .cpus = {kComponentsCpu}, .enforce_wcet = true});
  }
  static void wait_faulted(const Component& component) {
    wait_until([&] { return component.task().state() == ComponentState::faulted; }, "the fault");
  }

  std::atomic<bool> go_on{false};
};

TEST_F(EnforcedWhileItLasts, AStateThatSpinsIsFaultedThoughItHasNoBound) {
  Component& component = add_enforced("c");
  core(component).work = [this] {
    while (!go_on) spin(us_to_ns(100));
  };
  deploy();
  wait_faulted(component);
  EXPECT_FALSE(component.task().is_parked()) << "the state has not ended";
  EXPECT_FALSE(go_on);
  EXPECT_THAT(component.task().fault().what, HasSubstr(" ms of CPU time, and its wcet_ns is 20 ms"));
  go_on = true;
  wait_until([&] { return component.task().is_parked(); }, "the park");
}

TEST_F(EnforcedWhileItLasts, AStateThatSpinsAfterALongSleepIsFaultedToo) {
  Component& component = add_enforced("c");
  core(component).work = [this] {
    std::this_thread::sleep_for(std::chrono::milliseconds(60));  // looked at meanwhile, and left alone
    while (!go_on) spin(us_to_ns(100));
  };
  deploy();
  wait_faulted(component);
  EXPECT_FALSE(component.task().is_parked());
}

TEST_F(EnforcedWhileItLasts, AStateThatSleepsLongerThanItsWorstCaseIsNot) {
  Component& component = add_enforced("c");
  core(component).work = [] { std::this_thread::sleep_for(std::chrono::nanoseconds(4 * kBudget)); };
  deploy();
  wait_runs(component, 4);
  EXPECT_GT(deployer.watchdog()->looks(), 0U);
  EXPECT_EQ("", component.task().fault().what);
}

/// Without real-time rights the two share the processor, which lengthens the lower one as well.
TEST_F(EnforcedWhileItLasts, APreemptedStateIsNot) {
  Component& component = add_enforced("c");
  Component& high = add_free(architecture, "high",
                             [](FreeFsm& fsm) {
                               State& run = fsm.run("Run");
                               State& pause = fsm.wait("Pause", ms_to_ns(10));
                               fsm.set_initial(pause);
                               fsm.next(run, pause);
                               fsm.next(pause, run);
                             },
                             {.priority = 60, .cpus = {kComponentsCpu}});
  std::atomic<time_ns_t> longest_ns{0};
  core(component).work = [&longest_ns] {
    const time_ns_t began = monotonic_now_ns();
    spin(kBudget * 3 / 5);
    longest_ns = std::max(longest_ns.load(), monotonic_now_ns() - began);
  };
  core(high).work = [] { spin(ms_to_ns(8)); };
  deploy();
  wait_until(
      [&] { return longest_ns.load() > kBudget || component.task().state() == ComponentState::faulted; },
      "a preempted state");
  wait_runs(component, core(component).runs + 2);
  EXPECT_EQ("", component.task().fault().what);
  deployer.shutdown();
}

}  // namespace mauve::testing::test_enforced_wcet
