// SPDX-License-Identifier: LGPL-3.0-or-later
// The ports of a component that executes the goals of an action, or sends goals, as one member of its shell.
#pragma once

#include "mauve_rt/data/action_type.hpp"
#include "mauve_rt/data/port.hpp"

namespace mauve {

/// Ports to a resource of kind action_server: NAME_status, NAME_goal, NAME_decide, NAME_feedback and NAME_result.
///
///   struct DriveShell : mauve::Shell {
///     mauve::ActionServerPorts<Drive> drive = action_server<Drive>("drive");
///   };
///
/// In a core: `if (shell().drive.state() == GoalState::executing) ...`. A replaced core goes on with the goal; a stop aborts all goals.
template <DescribedAction A>
struct ActionServerPorts {
  using Goal = typename A::Goal;
  using Result = typename A::Result;
  using Feedback = typename A::Feedback;

  ReadPort<ActionGoal>& status;
  ReadPort<Goal>& goal;
  WritePort<ActionGoal>& decide;
  WritePort<Feedback>& feedback;
  WritePort<Result>& result;

  /// The state of the current goal; unknown: there is none. Goals that wait for an answer are accepted by it. [rt]
  GoalState state() MAUVE_RT { return status.read().value.its_state(); }
  /// Ends the current goal, with that result; false: there is none. [rt]
  bool succeed(const Result& reached) MAUVE_RT { return end(GoalState::succeeded, reached); }
  bool abort(const Result& reached = {}) MAUVE_RT { return end(GoalState::aborted, reached); }
  /// The same of a goal whose state is canceling. [rt]
  bool cancel(const Result& reached = {}) MAUVE_RT { return end(GoalState::canceled, reached); }

 private:
  bool end(GoalState state, const Result& reached) MAUVE_RT {
    result.write(reached);
    return decide.write({.state = static_cast<std::uint8_t>(state)});
  }
};

/// Ports to a resource of kind action_client: NAME_goal, NAME_decide, NAME_status, NAME_feedback and NAME_result.
template <DescribedAction A>
struct ActionClientPorts {
  using Goal = typename A::Goal;
  using Result = typename A::Result;
  using Feedback = typename A::Feedback;

  WritePort<Goal>& goal;
  WritePort<ActionGoal>& decide;
  ReadPort<ActionGoal>& status;
  ReadPort<Feedback>& feedback;
  ReadPort<Result>& result;

  /// Sends a goal; false: the one before has not ended. [rt]
  bool send(const Goal& wanted) MAUVE_RT { return goal.write(wanted); }
  /// Asks to cancel the goal. [rt]
  void cancel() MAUVE_RT { decide.write({.state = static_cast<std::uint8_t>(GoalState::canceling)}); }
  /// The state of the goal that was sent last; unknown: it is not answered, or there is none. [rt]
  GoalState state() MAUVE_RT { return status.read().value.its_state(); }
};

}  // namespace mauve
