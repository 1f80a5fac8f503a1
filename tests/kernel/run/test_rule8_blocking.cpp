// SPDX-License-Identifier: LGPL-3.0-or-later
// Rule 8: no lock past a state's end, and no wait that a stop or a hold has to wait for.
#include "free_fsm.hpp"

namespace mauve::testing::test_rule8_blocking {

using ::testing::HasSubstr;
using Rule8Locks = Simulated;

constexpr time_ns_t kHour = s_to_ns(3600);

TEST_F(Rule8Locks, HeldAtAStatesEndIsAFault) {
  static auto* const mutex = new PiMutex;  // never destroyed: nobody unlocks it where it was locked
  Component& component = add("c", 1);
  Component& other = add("other", 1);
  core(component).work = [&] {
    if (core(component).runs == 3) mutex->lock();
  };
  core(other).work = [] { PiMutex own; };
  deploy();
  run_to(ms_to_ns(2));
  EXPECT_EQ(ComponentState::faulted, component.task().state());
  EXPECT_THAT(component.task().fault().what, HasSubstr("lock"));
  EXPECT_EQ("Run", component.task().fault().where);
  mutex->unlock();
  run_to(ms_to_ns(5));
  EXPECT_EQ(ComponentState::running, other.task().state());
}

TEST_F(Rule8Locks, HeldWithinAStateIsNone) {
  PiMutex mutex;
  Component& component = add("c", 1);
  core(component).work = [&] { const std::lock_guard lock(mutex); };
  deploy();
  run_to(ms_to_ns(5));
  EXPECT_EQ(ComponentState::running, component.task().state());
  EXPECT_EQ(6, core(component).runs);
}

/// One activation, then a wait of an hour, plain or for an event that never comes.
class Rule8Waits : public Deployed, public ::testing::WithParamInterface<bool> {
 protected:
  Component& add_waiting(const std::string& name) {
    const bool for_event = GetParam();
    Component& component =
        add_free(architecture, name,
                 [=](FreeFsm& fsm) {
                   State& run = fsm.run("Run");
                   State& pause = for_event ? fsm.wait_event("Pause", fsm.ports().input, kHour, ms_to_ns(1))
                                            : fsm.wait("Pause", kHour);
                   fsm.set_initial(run);
                   fsm.next(run, pause);
                   fsm.next(pause, run);
                 },
                 {.cpus = {0}});
    architecture.connect(name, "input", "x", "read");
    return component;
  }
  void SetUp() override { architecture.add_resource<SharedData<Number>>("x"); }
  static void wait_for_its_wait(Component& component) {
    wait_runs(component, 1);
    wait_until([&] { return component.task().current_state() == "Pause"; }, "its wait");
  }
};

TEST_P(Rule8Waits, AreInterruptedByAStop) {
  Component& component = add_waiting("c");
  deploy();
  wait_for_its_wait(component);
  deployer.stop("c", s_to_ns(20));
  EXPECT_EQ(ComponentState::stopped, component.task().state());
  EXPECT_EQ(1, core(component).runs) << "a stop is no release";
  const auto stops = records_of(deployer.drain_trace(), TraceKind::stop);
  ASSERT_EQ(1U, stops.size());
  EXPECT_EQ("Pause", TraceNames::word(stops[0].name));
}

TEST_P(Rule8Waits, AreHeldAtOnceAndGoOn) {
  Component& component = add_waiting("c");
  Component& other = add_waiting("other");
  deploy();
  wait_for_its_wait(component);
  wait_for_its_wait(other);
  const time_ns_t due = deployer.epoch_ns() + kHour;
  for (int i = 0; i < 200; ++i) {
    Transaction change;
    change.set_property("c", "gain", 2.0).set_property("other", "gain", 3.0);
    deployer.commit(std::move(change), {.timeouts = {.commit_ns = s_to_ns(20), .phase_ns = 0}});
  }
  EXPECT_EQ(ComponentState::running, component.task().state());
  EXPECT_EQ(1, core(component).runs);
  const auto armed = records_of(deployer.drain_trace(), TraceKind::armed);
  ASSERT_EQ(200U, armed.size());
  for (const TraceRecord& record : armed) {
    EXPECT_EQ(due, record.a) << "the instant it was waiting for";
    EXPECT_LT(record.time_ns, due);
  }
}

TEST_P(Rule8Waits, AreInterruptedByTheEnd) {
  Component& component = add_waiting("c");
  deploy();
  wait_for_its_wait(component);
  deployer.shutdown();
  EXPECT_FALSE(component.task().has_thread());
  EXPECT_EQ(1, core(component).runs);
}

INSTANTIATE_TEST_SUITE_P(Of, Rule8Waits, ::testing::Values(false, true),
                         [](const auto& wait) { return wait.param ? "AnEvent" : "TheClock"; });

}  // namespace mauve::testing::test_rule8_blocking
