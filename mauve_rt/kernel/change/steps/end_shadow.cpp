// SPDX-License-Identifier: LGPL-3.0-or-later
// The end of a component's shadow. Without a shadow there is nothing to do, so that a rule may have the step ready at any time.
#include "change/actions.hpp"
#include "change/steps/step_kind.hpp"

namespace mauve {

constexpr StepKind steps::end_shadow{
    .name = "end_shadow", .element = "shadow", .draft = [](Draft& draft, TransactionStep& step) {
      DraftComponent& changed = draft.change(step.target);
      const auto shadow = changed.component->last_shadow();
      if (shadow != nullptr && !shadow->has_ended())
        changed.actions.push_back(
            std::make_unique<ShadowEnd>(changed.component->task(), ShadowCause::request));
    }};

}  // namespace mauve
