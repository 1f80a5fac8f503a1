// SPDX-License-Identifier: LGPL-3.0-or-later
// What keeps a rule's steps from being made ready.
#include <algorithm>

#include "mauve_rt/rules/action.hpp"

namespace mauve::rules {

namespace {

bool needs_running(const ActionStep& step) {
  return step.kind.starts_with("replace_") || step.kind == "set_property";
}

/// Whether they start or stop the step's component themselves.
bool is_stopped_by(const ActionSteps& steps, const ActionStep& step) {
  return std::any_of(steps.begin(), steps.end(), [&](const ActionStep& other) {
    return other.target == step.target && (other.kind == "start" || other.kind == "stop");
  });
}

}  // namespace

std::string hindrance(const ActionSteps& steps, const ArchitectureDescription& description) {
  for (const ActionStep& step : steps) {
    if (!needs_running(step) || is_stopped_by(steps, step)) continue;
    const auto facts = std::find_if(description.components.begin(), description.components.end(),
                                    [&](const ComponentFacts& one) { return one.name == step.target; });
    if (facts == description.components.end()) return "there is no component " + step.target;
    if (facts->state != ComponentState::running)
      return "component " + step.target + " is " + std::string(to_string(facts->state));
  }
  return {};
}

}  // namespace mauve::rules
