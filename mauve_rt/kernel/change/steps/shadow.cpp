// SPDX-License-Identifier: LGPL-3.0-or-later
// A candidate core that executes in the component's shadow (shadow.hpp).
#include "change/steps/step_kind.hpp"

namespace mauve {

void require_no_shadow(const Draft& draft, const DraftComponent& changed) {
  if (!draft.is_deployed() || changed.is_added) {
    throw Error(ErrorCode::not_configured, "only a component of a deployed architecture has a shadow",
                {.component = changed.name(), .element = "shadow", .remedy = "deploy it first"});
  }
  if (changed.state == ComponentState::faulted) {
    throw Error(ErrorCode::faulted, "a FAULTED component gets no shadow",
                {.component = changed.name(), .element = "shadow", .remedy = Task::kRepairRemedy});
  }
  const auto present = changed.component->last_shadow();
  if (changed.shadow == nullptr && (present == nullptr || present->has_ended())) return;
  const auto& shadow = changed.shadow != nullptr ? changed.shadow : present;
  throw Error(ErrorCode::already_running, "the component has a shadow already",
              {.component = changed.name(),
               .element = "shadow",
               .expected = "none",
               .found = shadow->core_name(),
               .remedy = "end the other shadow in a transaction before"});
}

std::unique_ptr<Shell> make_shadow_shell(const Component& component) {
  std::unique_ptr<Shell> shell = component.shell().another();
  if (shell != nullptr) return shell;
  throw Error(ErrorCode::prepare_failed, "a shadow needs another instance of the component's shell",
              {.component = component.name(),
               .element = component.shell().description(),
               .remedy = "give the step a shell as an object"});
}

std::unique_ptr<FsmBase> make_shadow_fsm(const Component& component) {
  std::unique_ptr<FsmBase> fsm = component.fsm().another();
  if (fsm != nullptr) return fsm;
  throw Error(ErrorCode::prepare_failed, "a shadow needs another instance of the fsm, and none can be made",
              {.component = component.name(),
               .element = component.fsm().description(),
               .remedy = "give the component a factory of its fsm"});
}

namespace {

std::string shadow_words(const TransactionStep& step) {
  const auto* wanted = std::get_if<CoreInShadow>(&step.value);
  return step.target + " " +
         (wanted != nullptr && wanted->core != nullptr ? shown({}, wanted->core) : step.name);
}

}  // namespace

constexpr StepKind steps::shadow{
    .name = "shadow",
    .element = "shadow",
    .words = shadow_words,
    .draft = [](Draft& draft, TransactionStep& step) {
      auto& wanted = value_of<CoreInShadow>(step);
      DraftComponent& changed = replacing(draft, step.target);
      require_no_shadow(draft, changed);
      Component& component = *changed.component;
      component.settle_shadow();
      ShadowParts parts{.shell = std::move(wanted.shell)};
      parts.core = step.name.empty() ? take(wanted.core) : draft.registry().make_core(step.name);
      if (!step.name.empty()) component.check_allowed(parts.core->implementation());
      if (parts.shell == nullptr) parts.shell = make_shadow_shell(component);
      parts.fsm = make_shadow_fsm(component);
      changed.shadow = std::make_shared<Shadow>(component, std::move(parts), wanted.options);
      changed.shadow_step = draft.step();
    }};

}  // namespace mauve
