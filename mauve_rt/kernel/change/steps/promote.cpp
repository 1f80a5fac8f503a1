// SPDX-License-Identifier: LGPL-3.0-or-later
// The candidate of a component's shadow becomes the component's core.
#include "change/steps/step_kind.hpp"

namespace mauve {

constexpr StepKind steps::promote{
    .name = "promote", .element = "core", .draft = [](Draft& draft, TransactionStep& step) {
      DraftComponent& changed = replacing(draft, step.target);
      const auto shadow = changed.is_added ? nullptr : changed.component->last_shadow();
      require_not_promoted(changed);
      if (shadow == nullptr) {
        throw Error(ErrorCode::not_running, "the component has no candidate to promote",
                    {.component = step.target,
                     .element = "shadow",
                     .expected = "a shadow that runs",
                     .found = "none",
                     .remedy = "give it a shadow first, or replace its core"});
      }
      if (const auto* options = std::get_if<PromoteOptions>(&step.value)) {
        changed.bumpless = options->bumpless;
        changed.is_fresh = options->is_fresh;
      }
      changed.promoted = shadow;
      changed.core_step = draft.step();
      changed.core_unready = false;
      changed.probation.reset();
    }};

}  // namespace mauve
