// SPDX-License-Identifier: LGPL-3.0-or-later
// Goals of actions for programs and tests in Python, which carry them as a ROS client does.
#include <algorithm>
#include <cctype>

#include "host.hpp"
#include "python_call.hpp"

namespace mauve::bindings {

namespace {

ActionServerBase& server_of(Resource& resource) {
  if (ActionServerBase* const server = resource.action_server(); server != nullptr) return *server;
  throw Error(ErrorCode::type_mismatch, "the resource receives no goals",
              {.element = "resource " + resource.name(),
               .expected = "a resource of kind " + ActionServerKind::describe().name,
               .found = "kind " + resource.kind()});
}

std::string upper(std::string_view text) {
  std::string made(text);
  std::transform(made.begin(), made.end(), made.begin(),
                 [](unsigned char letter) { return static_cast<char>(std::toupper(letter)); });
  return made;
}

}  // namespace

std::pair<std::uint64_t, GoalReason> PyHost::ask_goal(const std::string& name, const py::bytes& data) {
  const std::string_view message = data;
  const InterpreterUnlocked release;
  const std::uint64_t goal = ++goals_asked_;
  const auto resource = architecture_.hold_resource(name);
  return {goal,
          server_of(*resource).ask(id_of_goal(goal), std::as_bytes(std::span(message)), host().now_ns())};
}

bool PyHost::cancel_goal(const std::string& name, std::uint64_t goal) {
  const auto resource = architecture_.hold_resource(name);
  return server_of(*resource).cancel(id_of_goal(goal), host().now_ns());
}

std::optional<PyGoalEvent> PyHost::next_event(const std::string& name) {
  GoalEvent event;
  std::vector<std::byte> message;
  {
    const InterpreterUnlocked release;
    const auto resource = architecture_.hold_resource(name);
    ActionServerBase& server = server_of(*resource);
    server.poll(host().now_ns());
    if (!server.next_event(event, message)) return std::nullopt;
  }
  PyGoalEvent made{.goal = goal_of_id(event.id), .state = event.state, .reason = event.reason};
  if (event.has_feedback) made.feedback = to_bytes(message);
  if (event.has_result) made.result = to_bytes(message);
  return made;
}

void bind_goals(py::module_& module) {
  py::enum_<GoalState> states(module, "GoalState",
                              "The state of a goal, by the numbers of mauve_msgs/msg/ActionGoal.");
  for (std::uint8_t i = 0; i <= static_cast<std::uint8_t>(GoalState::rejected); ++i) {
    const auto state = static_cast<GoalState>(i);
    states.value(upper(to_string(state)).c_str(), state);
  }
  states.def_property_readonly(
      "is_final", [](GoalState self) { return is_final(self); }, "Whether no state comes after it.");
  py::enum_<GoalReason>(module, "GoalReason",
                        "Why a goal ended without a decision of a component, as mauve_msgs/msg/ActionGoal.")
      .value("NONE", GoalReason::none)
      .value("STOPPED", GoalReason::stopped)
      .value("REMOVED", GoalReason::removed)
      .value("NO_ANSWER", GoalReason::no_answer)
      .value("FULL", GoalReason::full)
      .value("NO_SERVER", GoalReason::no_server)
      .value("MALFORMED", GoalReason::malformed)
      .def_property_readonly(
          "text", [](GoalReason self) { return std::string(to_string(self)); }, "The reason in words.");
  py::class_<PyGoalEvent>(module, "GoalEventData", "Another state of a goal, or feedback about the goal.")
      .def_readonly("goal", &PyGoalEvent::goal, "As ask_goal() returned it.")
      .def_readonly("state", &PyGoalEvent::state)
      .def_readonly("reason", &PyGoalEvent::reason)
      .def_readonly("feedback", &PyGoalEvent::feedback, "The serialized message; None of another state.")
      .def_readonly("result", &PyGoalEvent::result,
                    "The serialized message; None of a goal that has not ended.");
}

}  // namespace mauve::bindings
