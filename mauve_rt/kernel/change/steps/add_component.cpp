// SPDX-License-Identifier: LGPL-3.0-or-later
// A component that was not there; it arrives STOPPED.
#include "change/steps/step_kind.hpp"
#include "parts/lookup.hpp"

namespace mauve {

namespace {

Parts parts_of(const Draft& draft, NewComponent& wanted) {
  if (!wanted.by_name) {
    return {
        .shell = take(wanted.parts.shell), .core = take(wanted.parts.core), .fsm = take(wanted.parts.fsm)};
  }
  const PluginRegistry& registry = draft.registry();
  return {.shell = registry.make_shell(wanted.rest.shell),
          .core = registry.make_core(wanted.rest.core),
          .fsm = registry.make_fsm(wanted.rest.fsm)};
}

}  // namespace

constexpr StepKind steps::add_component{
    .name = "add_component",
    .is_structural = true,
    .words =
        [](const TransactionStep& step) {
          const auto* wanted = std::get_if<NewComponent>(&step.value);
          if (wanted == nullptr) return step.target;
          return step.target + " " + (wanted->by_name ? wanted->rest.core : shown({}, wanted->parts.core));
        },
    .draft =
        [](Draft& draft, TransactionStep& step) {
          auto& wanted = value_of<NewComponent>(step);
          const ComponentParts& rest = wanted.rest;
          Parts parts = parts_of(draft, wanted);
          std::unique_ptr<CoreBase> fallback = std::move(wanted.fallback);
          DraftComponent& added = draft.add_component(step.target, rest.settings);
          added.fresh = std::move(parts);
          for (const auto& [port, frames] : rest.frames) find_port(*added.fresh.shell, port, step.target);
          added.component->declare_frames(rest.frames);
          try {
            added.component->set_up_ports(*added.fresh.shell);
          } catch (const Error& failure) {
            rethrow_as_of(failure, step.target, draft.step());
          }
          added.component->allow(rest.alternatives, rest.reconfigurable);
          if (fallback == nullptr && !rest.fallback.empty())
            fallback = draft.registry().make_core(rest.fallback);
          if (fallback != nullptr) added.component->set_fallback(std::move(fallback));
          for (const auto& [property, value] : rest.properties) draft.set_property(added, property, value);
        }};

}  // namespace mauve
