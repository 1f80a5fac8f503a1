// SPDX-License-Identifier: LGPL-3.0-or-later
// The old core of one whose core on probation hangs goes on: the component that hangs leaves with its thread, and another one of its
// name comes, with that core, and with new instances of shell and fsm. In no table: users do not name it.
#include "change/steps/step_kind.hpp"

namespace mauve {

namespace {

template <typename Part>
std::unique_ptr<Part> another(const std::string& component, const Part& part) {
  std::unique_ptr<Part> made = part.another();
  if (made != nullptr) return made;
  throw Error(ErrorCode::prepare_failed, "no other instance of the part can be made",
              {.component = component, .element = part.description()});
}

/// The change was decided for the component that hangs, and its thread takes the change when the state ends: the component is late. New
/// parts of the change end the probation.
void require_no_decided_change(Draft& draft, const std::shared_ptr<Component>& hung, Probation& probation) {
  if (draft.architecture().find_awaited(hung->name()) != hung) return;
  if (draft.architecture().awaits_parts(hung->name())) probation.conclude(ProbationCause::replaced);
  throw Error(
      ErrorCode::wrong_revision, "the component has yet to take a change that is made",
      {.component = hung->name(), .remedy = "remove the component and add it anew, in one transaction"});
}

}  // namespace

constexpr StepKind steps::bring_back{
    .name = "bring_back",
    .element = "core",
    .is_structural = true,
    .draft = [](Draft& draft, TransactionStep& step) {
      const auto hung = draft.architecture().hold_component(step.target);
      const auto probation = hung->present_probation();
      const bool hangs = hung->task().is_given_up_on_probation();
      // With the core back the state may have ended: the component is FAULTED then, with the core that hung.
      if (probation == nullptr || (!hangs && !probation->has_core_back())) {
        throw Error(ErrorCode::wrong_revision, "no core of the component hangs on probation",
                    {.component = step.target});
      }
      const Wires wires = draft.touch(step.target).wires;
      require_no_decided_change(draft, hung, *probation);
      draft.remove_component(step.target);
      DraftComponent& added = draft.add_component(step.target, hung->task().settings());
      Component& component = *added.component;
      component.allow(hung->alternatives(), hung->is_reconfigurable());
      if (auto fallback = hung->another_fallback()) component.set_fallback(std::move(fallback));
      component.declare_frames(hung->declared_frames());
      added.fresh.shell = another(step.target, hung->shell());
      component.continue_outputs_of(*hung);
      component.set_up_ports(*added.fresh.shell);
      added.fresh.fsm = another(step.target, probation->old_fsm());
      added.wires = wires;
      for (const ShownProperty& property : hung->shown().properties)
        draft.set_property(added, property.name, property.value);
      added.runs = !hung->task().is_to_stop();
      added.clock_ns = hung->task().grid().reference_ns;
      added.fresh.core = probation->take_over();
      if (added.fresh.core == nullptr) {
        throw Error(ErrorCode::wrong_revision, "the state has ended meanwhile, and the old core is back",
                    {.component = step.target});
      }
      added.comeback_of = probation;
      component.begin_with(probation->record());
    }};

}  // namespace mauve
