// SPDX-License-Identifier: LGPL-3.0-or-later
// GoalSender: sends goals to an action_server without ROS, for tests and programs.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <utility>
#include <vector>

#include "mauve_rt/data/action_server.hpp"
#include "mauve_rt/data/action_type.hpp"
#include "mauve_rt/data/cdr.hpp"

namespace mauve {

/// The id of a goal that a program asks for by a number of its own, and the number again. [non-rt]
inline GoalId id_of_goal(std::uint64_t goal) {
  GoalId id{};
  for (std::size_t i = 0; i < sizeof(goal); ++i) id[i] = static_cast<std::uint8_t>(goal >> (8 * i));
  return id;
}
inline std::uint64_t goal_of_id(const GoalId& id) {
  std::uint64_t goal = 0;
  for (std::size_t i = 0; i < sizeof(goal); ++i) goal |= std::uint64_t{id[i]} << (8 * i);
  return goal;
}

/// Sends goals as a client of the action does; one for each resource, where no ROS action is bound to the resource.
/// All functions [non-rt], one thread.
///
///   GoalSender<Drive> drive(server, [&] { return host.now_ns(); });
///   const std::uint64_t goal = drive.ask({.distance = 2.0});
///   simulation.run_until(...);
///   EXPECT_EQ(GoalState::succeeded, drive.events().back().state);
template <DescribedAction A>
class GoalSender {
 public:
  /// Another state of a goal, or feedback about the goal.
  struct Event {
    std::uint64_t goal;  // as ask() returned it
    GoalState state;
    GoalReason reason;
    std::optional<typename A::Feedback> feedback{};  // none: it is another state
    std::optional<typename A::Result> result{};      // none: the goal has not ended
  };
  using Now = std::function<time_ns_t()>;

  GoalSender(ActionServer<A>& server, Now now) : server_(server), now_(std::move(now)) {}

  /// Asks for a goal; returns its number.
  std::uint64_t ask(const typename A::Goal& goal) {
    CdrWriter(message_).put(goal);
    const GoalReason reason = server_.ask(id_of_goal(++asked_), message_, now_());
    if (reason != GoalReason::none)
      rejected_.push_back({.goal = asked_, .state = GoalState::rejected, .reason = reason});
    return asked_;
  }
  /// Asks to cancel a goal; false: the goal is not accepted, or has ended.
  bool cancel(std::uint64_t goal) { return server_.cancel(id_of_goal(goal), now_()); }
  /// What became of the goals since the last call; states in between may be missing.
  std::vector<Event> events() {
    std::vector<Event> found = std::exchange(rejected_, {});
    server_.poll(now_());
    for (GoalEvent event; server_.next_event(event, message_);) {
      Event& made = found.emplace_back(
          Event{.goal = goal_of_id(event.id), .state = event.state, .reason = event.reason});
      if (event.has_feedback) CdrReader(message_).get(made.feedback.emplace());
      if (event.has_result) CdrReader(message_).get(made.result.emplace());
    }
    return found;
  }

 private:
  ActionServer<A>& server_;
  Now now_;
  std::uint64_t asked_{0};
  std::vector<std::byte> message_;
  std::vector<Event> rejected_;
};

}  // namespace mauve
