// SPDX-License-Identifier: LGPL-3.0-or-later
// An action of the tests, and who carries its goals as a bridge to ROS does.
#pragma once

#include <deque>
#include <map>

#include "fixtures.hpp"

namespace mauve::testing {

struct Walk {
  struct Goal {
    std::int64_t steps{};
  };
  struct Result {
    std::int64_t steps{};
  };
  struct Feedback {
    std::int64_t step{};
  };
};

}  // namespace mauve::testing

MAUVE_TYPE(mauve::testing::Walk::Goal, "test_interfaces/action/Walk_Goal", steps)
MAUVE_TYPE(mauve::testing::Walk::Result, "test_interfaces/action/Walk_Result", steps)
MAUVE_TYPE(mauve::testing::Walk::Feedback, "test_interfaces/action/Walk_Feedback", step)
MAUVE_ACTION_TYPE(mauve::testing::Walk, "test_interfaces/action/Walk")

namespace mauve::testing {

inline GoalId goal_id(std::uint8_t number) {
  GoalId id{};
  id[0] = number;
  return id;
}

inline ActionGoal decision(GoalState state, std::uint32_t number = 0) {
  return {.number = number, .state = static_cast<std::uint8_t>(state)};
}

/// Asks for goals, and keeps the events of them.
struct GoalCarrier {
  explicit GoalCarrier(ActionServerBase& asked) : server(asked) {}

  GoalReason ask(std::uint8_t number, std::int64_t steps, time_ns_t now_ns = 0) {
    std::vector<std::byte> message;
    CdrWriter(message).put(Walk::Goal{steps});
    return server.ask(goal_id(number), message, now_ns);
  }
  /// All states that were told since the last call, by goal.
  std::map<int, std::vector<GoalState>> take() {
    std::map<int, std::vector<GoalState>> states;
    GoalEvent event;
    std::vector<std::byte> message;
    while (server.next_event(event, message)) {
      CdrReader reader(message);
      if (event.has_feedback) {
        Walk::Feedback value;
        EXPECT_TRUE(reader.get(value));
        feedback.push_back(value.step);
        continue;
      }
      states[event.id[0]].push_back(event.state);
      reasons[event.id[0]] = event.reason;
      if (!event.has_result) continue;
      Walk::Result value;
      EXPECT_TRUE(reader.get(value));
      results[event.id[0]] = value.steps;
    }
    return states;
  }

  ActionServerBase& server;
  std::deque<std::int64_t> feedback;
  std::map<int, std::int64_t> results;
  std::map<int, GoalReason> reasons;
};

}  // namespace mauve::testing
