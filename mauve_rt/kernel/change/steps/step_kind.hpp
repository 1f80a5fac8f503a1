// SPDX-License-Identifier: LGPL-3.0-or-later
// The kinds of steps: a file each in this folder, and the table of them.
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <variant>

#include "mauve_rt/change/transaction.hpp"

#include "change/draft.hpp"

namespace mauve {

enum class StepTarget : std::uint8_t { component, resource, all };

/// What a step of this kind says and does.
struct StepKind {
  std::string_view name;
  /// What of its target it sets: core, state, "property" and "port" with the step's name; empty: the target itself.
  std::string_view element{};
  bool removes{false};
  StepTarget target{StepTarget::component};
  /// Whether it may make a draft structural: Draft::is_structural().
  bool is_structural{false};
  /// "mapping.scan lidar.read": what follows the kind where a step is told.
  std::string (*words)(const TransactionStep& step) = [](const TransactionStep& step) { return step.target; };
  /// Checks the step and enters its effect into the draft; uses up the parts it was given. Throws Error.
  void (*draft)(Draft& draft, TransactionStep& step);
};

/// The table; a file of this folder defines each.
// clang-format off
#define MAUVE_STEP_KINDS(kind) \
  kind(replace_core) \
  kind(place_core) \
  kind(revert_core) \
  kind(shadow) \
  kind(end_shadow) \
  kind(promote) \
  kind(replace_fsm) \
  kind(replace_shell) \
  kind(set_property) \
  kind(connect) \
  kind(disconnect) \
  kind(add_component) \
  kind(remove_component) \
  kind(add_resource) \
  kind(remove_resource) \
  kind(start) \
  kind(stop) \
  kind(configure) \
  kind(resynchronise)
// clang-format on

namespace steps {
#define MAUVE_DECLARE_STEP_KIND(name) extern const StepKind name;
MAUVE_STEP_KINDS(MAUVE_DECLARE_STEP_KIND)
#undef MAUVE_DECLARE_STEP_KIND
extern const StepKind bring_back;  // in no table
}  // namespace steps

[[noreturn]] void throw_other_value(const TransactionStep& step);

/// The step's value. Throws Error (invalid_argument) when it is another one.
template <typename Value>
Value& value_of(TransactionStep& step) {
  if (auto* value = std::get_if<Value>(&step.value)) return *value;
  throw_other_value(step);
}
/// The same of a plain value.
template <typename Value>
const Value& plain_value_of(TransactionStep& step) {
  if (const auto* value = std::get_if<Value>(&value_of<PropertyValue>(step))) return *value;
  throw_other_value(step);
}

/// Objects serve one commit; a second draft of the same step finds nothing left.
template <typename Part>
std::unique_ptr<Part> take(std::unique_ptr<Part>& part) {
  if (part != nullptr) return std::move(part);
  throw Error(
      ErrorCode::invalid_argument, "the step has no part to put in",
      {.expected = "an object", .found = "none", .remedy = "give each transaction objects of its own"});
}

/// How a part is told: by its registered name.
template <typename Part>
std::string shown(const std::string& name, const std::unique_ptr<Part>& part) {
  if (part == nullptr) return name;
  return part->implementation().empty() ? "(an object)" : part->implementation();
}

/// Whether the step brings its part as an object.
template <typename Part>
bool brings(const TransactionStep& step) noexcept {
  return std::holds_alternative<std::unique_ptr<Part>>(step.value);
}

/// "guidance.path_step 0.5": an element of a component, and a plain value if there is one.
std::string element_words(const TransactionStep& step);

/// "exploration mauve_examples/LocalExploration"
template <typename Part>
std::string part_words(const TransactionStep& step) {
  const auto* part = std::get_if<std::unique_ptr<Part>>(&step.value);
  return step.target + " " + (part != nullptr ? shown({}, *part) : step.name);
}

/// A shell and an fsm of the component's classes, for a shadow. Throws Error (prepare_failed): none can be made.
std::unique_ptr<Shell> make_shadow_shell(const Component& component);
std::unique_ptr<FsmBase> make_shadow_fsm(const Component& component);
/// Throws Error: it has a shadow that runs, or is FAULTED, or not deployed.
void require_no_shadow(const Draft& draft, const DraftComponent& changed);

/// The component whose part is to be replaced. Throws Error.
DraftComponent& replacing(Draft& draft, const std::string& component);
/// Throws Error (invalid_argument) when a step before has promoted the candidate of its shadow.
void require_not_promoted(const DraftComponent& component);

}  // namespace mauve
