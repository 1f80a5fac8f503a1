// SPDX-License-Identifier: LGPL-3.0-or-later
// What a description of an architecture says of a rule's steps.
#include <algorithm>
#include <cmath>

#include "mauve_rt/rules/action.hpp"

namespace mauve::rules {

namespace {

template <typename Facts>
const Facts* find(const std::vector<Facts>& all, const std::string& name) {
  const auto found = std::find_if(all.begin(), all.end(), [&](const Facts& one) { return one.name == name; });
  return found != all.end() ? &*found : nullptr;
}

std::optional<double> number(const PropertyValue& value) {
  if (const auto* whole = std::get_if<std::int64_t>(&value)) return static_cast<double>(*whole);
  if (const auto* real = std::get_if<double>(&value)) return *real;
  return std::nullopt;
}

bool is_same(const PropertyValue& one, const PropertyValue& other) {
  const auto first = number(one);
  const auto second = number(other);
  if (!first || !second) return one == other;
  return std::abs(*first - *second) <= 1e-9 * std::max(std::abs(*first), std::abs(*second));
}

std::string wired_to(const ShownPort& port) {
  return port.resource.empty() ? "" : port.resource + "." + port.service;
}

bool has_property(const ComponentFacts& facts, const ActionStep& step) {
  const ShownProperty* const property = find(facts.parts.properties, step.name);
  return property != nullptr && step.value && is_same(property->value, *step.value);
}

bool is_wired(const ComponentFacts& facts, const ActionStep& step) {
  const ShownPort* const port = find(facts.parts.ports, step.name);
  const auto* const wanted = step.value ? std::get_if<std::string>(&*step.value) : nullptr;
  return port != nullptr && wired_to(*port) == (wanted != nullptr ? *wanted : "");
}

/// Of a step about a component that is there; nothing: of a kind that leaves nothing behind.
std::optional<bool> shows(const ComponentFacts& facts, const ActionStep& step) {
  if (step.kind == "replace_core") return facts.parts.core == step.name;
  if (step.kind == "replace_fsm") return facts.parts.fsm == step.name;
  if (step.kind == "replace_shell") return facts.parts.shell == step.name;
  if (step.kind == "set_property") return has_property(facts, step);
  if (step.kind == "connect" || step.kind == "disconnect") return is_wired(facts, step);
  if (step.kind == "start") return facts.state == ComponentState::running;
  if (step.kind == "stop") return facts.state == ComponentState::stopped;
  if (step.kind == "configure")
    return facts.state == ComponentState::stopped || facts.state == ComponentState::running;
  return std::nullopt;
}

std::optional<bool> shows(const ArchitectureDescription& description, const ActionStep& step) {
  if (step.kind == "remove_resource") return find(description.resources, step.target) == nullptr;
  if (step.kind == "add_resource") return find(description.resources, step.target) != nullptr;
  const ComponentFacts* const facts = find(description.components, step.target);
  if (step.kind == "remove_component") return facts == nullptr;
  if (step.kind == "add_component") return facts != nullptr;
  if (step.target.empty()) return std::nullopt;
  return facts != nullptr ? shows(*facts, step) : false;
}

bool needs_running(const ActionStep& step) {
  return step.kind.starts_with("replace_") || step.kind == "set_property";
}

}  // namespace

std::string hindrance(const ActionSteps& steps, const ArchitectureDescription& description) {
  for (const ActionStep& step : steps) {
    if (!needs_running(step)) continue;
    const ComponentFacts* const facts = find(description.components, step.target);
    if (facts == nullptr) return "there is no component " + step.target;
    if (facts->state != ComponentState::running)
      return "component " + step.target + " is " + std::string(to_string(facts->state));
  }
  return {};
}

std::optional<bool> is_in_place(const ActionSteps& steps, const ArchitectureDescription& description) {
  bool is_known = false;
  for (const ActionStep& step : steps) {
    const std::optional<bool> shown = shows(description, step);
    if (shown == false) return false;
    is_known = is_known || shown.has_value();
  }
  return is_known ? std::optional(true) : std::nullopt;
}

}  // namespace mauve::rules
