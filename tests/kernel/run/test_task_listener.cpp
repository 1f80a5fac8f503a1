// SPDX-License-Identifier: LGPL-3.0-or-later
// Who listens to a component is told of what befalls it, at the instants of virtual time.
#include "free_fsm.hpp"

namespace mauve::testing::test_task_listener {

using ::testing::ElementsAre;
using ::testing::Pair;

struct Listener final : TaskListener {
  void on_late_wakeup(time_ns_t now, time_ns_t late) noexcept override { wakeups.emplace_back(now, late); }
  void on_late_response(time_ns_t now, time_ns_t response) noexcept override {
    responses.emplace_back(now, response);
  }
  void on_overrun(time_ns_t now, std::uint64_t count) noexcept override { overruns.emplace_back(now, count); }
  void on_over_declared(time_ns_t now) noexcept override { over_declared.push_back(now); }
  void on_state(time_ns_t /*now*/, ComponentState state) noexcept override { states.push_back(state); }

  std::vector<std::pair<time_ns_t, time_ns_t>> wakeups, responses;
  std::vector<std::pair<time_ns_t, std::uint64_t>> overruns;
  std::vector<time_ns_t> over_declared;
  std::vector<ComponentState> states;
};

class TaskListenerTest : public Simulated {
 protected:
  static constexpr time_ns_t kPeriod = ms_to_ns(10);

  void TearDown() override { architecture.component("c").task().listening().unlisten(); }

  Task& listened(const std::vector<std::int64_t>& tenths, time_ns_t late_ns = kForever,
                 time_ns_t response_ns = kForever) {
    std::vector<time_ns_t> lengths;
    for (const std::int64_t tenth : tenths) lengths.push_back(tenth * kPeriod / 10);
    Task& task = add_free(architecture, "c", varying(lengths, kPeriod), {}).task();
    EXPECT_TRUE(task.listening().listen(listener, late_ns, response_ns));
    deploy();
    return task;
  }
  time_ns_t at(time_ns_t since_epoch_ns) const { return simulation.epoch_ns() + since_epoch_ns; }

  Listener listener;
};

TEST_F(TaskListenerTest, IsToldOfEveryOverrunAndOfNothingElse) {
  Task& task = listened({25, 10, 15});
  run_to(ms_to_ns(80));
  EXPECT_THAT(listener.overruns, ElementsAre(Pair(at(ms_to_ns(25)), 1U), Pair(at(ms_to_ns(55)), 2U)));
  EXPECT_TRUE(listener.wakeups.empty() && listener.responses.empty() && listener.over_declared.empty());
  EXPECT_EQ(at(ms_to_ns(80)), task.released_ns());
}

TEST_F(TaskListenerTest, IsToldOfResponsesFromItsBoundOn) {
  listened({3, 5, 4}, kForever, ms_to_ns(4));
  run_to(ms_to_ns(50));
  EXPECT_THAT(listener.responses,
              ElementsAre(Pair(at(ms_to_ns(15)), ms_to_ns(5)), Pair(at(ms_to_ns(24)), ms_to_ns(4))));
}

TEST_F(TaskListenerTest, IsToldOfStates) {
  Task& task = listened({0});
  run_to(ms_to_ns(20));
  listener.states.clear();
  task.stop(0);
  EXPECT_THAT(listener.states, ElementsAre(ComponentState::stopped));
}

TEST_F(TaskListenerTest, OneListensAndIsToldNothingAfterwards) {
  Task& task = listened({25, 25, 25});
  Listener other;
  EXPECT_FALSE(task.listening().listen(other, 0, 0)) << "one listens already";
  run_to(ms_to_ns(26));
  task.listening().unlisten();
  run_to(ms_to_ns(90));
  EXPECT_EQ(1U, listener.overruns.size());
  EXPECT_TRUE(task.listening().listen(other, 0, 0));
  task.listening().unlisten();
}

}  // namespace mauve::testing::test_task_listener
