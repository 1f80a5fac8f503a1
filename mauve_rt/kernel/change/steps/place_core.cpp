// SPDX-License-Identifier: LGPL-3.0-or-later
// A core that is put into a stopped component as it is.
#include "change/steps/step_kind.hpp"

namespace mauve {

constexpr StepKind steps::place_core{
    .name = "place_core",
    .element = "core",
    .words = part_words<CoreBase>,
    .draft = [](Draft& draft, TransactionStep& step) {
      std::unique_ptr<CoreBase> core = take(value_of<std::unique_ptr<CoreBase>>(step));
      DraftComponent& changed = draft.touch(step.target);
      changed.component->check_reconfigurable();
      changed.component->require_parked("replace_core");
      require_not_promoted(changed);
      changed.fresh.core = std::move(core);
      changed.core_step = draft.step();
      changed.probation.reset();
      changed.bumpless.reset();
      changed.core_unready = !changed.is_added;  // an added one is configured as a whole
    }};

}  // namespace mauve
