// SPDX-License-Identifier: LGPL-3.0-or-later
// Another fsm, in its initial state.
#include "change/steps/step_kind.hpp"

namespace mauve {

constexpr StepKind steps::replace_fsm{.name = "replace_fsm",
                                      .element = "fsm",
                                      .words = part_words<FsmBase>,
                                      .draft = [](Draft& draft, TransactionStep& step) {
                                        const bool by_name = !brings<FsmBase>(step);
                                        std::unique_ptr<FsmBase> fsm =
                                            by_name ? draft.registry().make_fsm(step.name)
                                                    : take(value_of<std::unique_ptr<FsmBase>>(step));
                                        DraftComponent& changed = replacing(draft, step.target);
                                        changed.fresh.fsm = std::move(fsm);
                                        changed.fsm_step = draft.step();
                                      }};

}  // namespace mauve
