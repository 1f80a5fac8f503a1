// SPDX-License-Identifier: LGPL-3.0-or-later
// The core that another one on probation has replaced goes back in. Without a probation there is nothing to do, so that a rule
// may have the step ready at any time.
#include "change/actions.hpp"
#include "change/steps/step_kind.hpp"

namespace mauve {

constexpr StepKind steps::revert_core{
    .name = "revert_core", .element = "core", .draft = [](Draft& draft, TransactionStep& step) {
      DraftComponent& changed = draft.change(step.target);
      if (const auto probation = changed.component->present_probation())
        changed.actions.push_back(std::make_unique<RevertRequest>(changed.component->task(), probation));
    }};

}  // namespace mauve
