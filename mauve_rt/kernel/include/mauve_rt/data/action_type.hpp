// SPDX-License-Identifier: LGPL-3.0-or-later
// Types of actions, as ROS has them: a goal, a result and feedback, by the name of the type.
#pragma once

#include <array>
#include <concepts>
#include <cstdint>
#include <string>
#include <string_view>
#include <type_traits>

#include "mauve_rt/base/rt.hpp"
#include "mauve_rt/base/time.hpp"
#include "mauve_rt/data/cdr.hpp"

namespace mauve {

/// Of a goal; the numbers up to `aborted` are those of action_msgs/msg/GoalStatus.
enum class GoalState : std::uint8_t {
  unknown = 0,  // there is no goal, or it waits for an answer
  accepted,     // and waits for its turn
  executing,
  canceling,  // it executes, and its client asks to cancel it
  succeeded,
  canceled,
  aborted,
  rejected,
};

/// Why a goal was rejected or aborted otherwise than by a component's decision.
enum class GoalReason : std::uint8_t {
  none = 0,
  stopped,    // the component was stopped, or is FAULTED
  removed,    // no component is connected now, or the resource is removed
  no_answer,  // within the declared time
  full,       // there are as many goals as allowed
  no_server,  // no server is there, or it has gone
  malformed,  // a message that does not fit the declared type
};

/// "unknown", "accepted", ... [rt]
std::string_view to_string(GoalState state) MAUVE_RT;
/// In words: "the component did not answer in time"; "" of none. [rt]
std::string_view to_string(GoalReason reason) MAUVE_RT;

/// Whether nothing comes after it. [rt]
constexpr bool is_final(GoalState state) MAUVE_RT { return state >= GoalState::succeeded; }

/// A goal as components read it, and what they decide about it.
struct ActionGoal {
  std::uint32_t number{0};   // from 1 on, as they come; 0: there is none
  std::uint8_t state{0};     // GoalState
  std::uint8_t reason{0};    // GoalReason
  std::uint32_t asked{0};    // of a server: the oldest goal that waits for an answer; 0: none
  std::uint32_t waiting{0};  // of a server: so many accepted goals wait for their turn

  /// [rt]
  GoalState its_state() const MAUVE_RT { return static_cast<GoalState>(state); }
  GoalReason its_reason() const MAUVE_RT { return static_cast<GoalReason>(reason); }
};

/// The goals of a server or a client as rules see them.
struct GoalsNow {
  bool is_aborted{false};      // see is_failure(); until a goal is accepted, or ends otherwise
  std::uint32_t executing{0};  // the number of the goal that executes or is canceling; 0: none does
  time_ns_t accepted_ns{0};    // of that goal
};

/// Whether a goal ended by a fault: aborted, or rejected by the kernel. [rt]
constexpr bool is_failure(GoalState state, GoalReason reason) MAUVE_RT {
  return state == GoalState::aborted || (state == GoalState::rejected && reason != GoalReason::none);
}
/// `was_failed` after a goal has come to this state: an answer of a component that rejects the goal changes nothing. [rt]
constexpr bool failed_after(bool was_failed, GoalState state, GoalReason reason) MAUVE_RT {
  if (is_failure(state, reason)) return true;
  return was_failed && state != GoalState::accepted && state != GoalState::succeeded &&
         state != GoalState::canceled;
}

/// By which a goal is known on the network.
using GoalId = std::array<std::uint8_t, 16>;

/// What MAUVE_ACTION_TYPE specialises: `name`, the type's identity.
template <typename A>
struct ActionTraits;

/// A struct with Goal, Result and Feedback that live in place, so that a component thread may copy them.
template <typename A>
concept DescribedAction =
    requires {
      { ActionTraits<A>::name } -> std::convertible_to<std::string_view>;
    } && Described<typename A::Goal> && Described<typename A::Result> && Described<typename A::Feedback> &&
    std::is_trivially_copyable_v<typename A::Goal> && std::is_trivially_copyable_v<typename A::Result> &&
    std::is_trivially_copyable_v<typename A::Feedback>;

}  // namespace mauve

MAUVE_TYPE(mauve::ActionGoal, "mauve_msgs/msg/ActionGoal", number, state, reason, asked, waiting)

/// Declares a struct with Goal, Result and Feedback (each a MAUVE_TYPE of its own) as a ROS action's type, once, at global scope:
///   MAUVE_TYPE(my::Drive::Goal, "my_interfaces/action/Drive_Goal", pose)
///   MAUVE_TYPE(my::Drive::Result, "my_interfaces/action/Drive_Result", distance)
///   MAUVE_TYPE(my::Drive::Feedback, "my_interfaces/action/Drive_Feedback", distance)
///   MAUVE_ACTION_TYPE(my::Drive, "my_interfaces/action/Drive")
#define MAUVE_ACTION_TYPE(type, type_name)              \
  template <>                                           \
  struct mauve::ActionTraits<type> {                    \
    static constexpr std::string_view name = type_name; \
  };
