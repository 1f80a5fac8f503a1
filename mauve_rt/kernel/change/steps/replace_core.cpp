// SPDX-License-Identifier: LGPL-3.0-or-later
// Another core; a running component goes on with it at its pending instant.
#include <algorithm>

#include "change/steps/step_kind.hpp"

namespace mauve {

namespace {

/// The core it was added with stays one it may be given back.
void allow_first_core(DraftComponent& added, const CoreBase& core) {
  std::vector<std::string> alternatives = added.component->alternatives();
  const std::string first = added.fresh.core->implementation();
  const bool is_named = std::find(alternatives.begin(), alternatives.end(), first) != alternatives.end();
  if (first != core.implementation() && !is_named) alternatives.push_back(first);
  added.component->allow(std::move(alternatives), added.component->is_reconfigurable());
}

}  // namespace

constexpr StepKind steps::replace_core{.name = "replace_core",
                                       .element = "core",
                                       .words = part_words<CoreBase>,
                                       .draft = [](Draft& draft, TransactionStep& step) {
                                         const bool by_name = !brings<CoreBase>(step);
                                         std::unique_ptr<CoreBase> core =
                                             by_name ? draft.registry().make_core(step.name)
                                                     : take(value_of<std::unique_ptr<CoreBase>>(step));
                                         DraftComponent& changed = replacing(draft, step.target);
                                         if (by_name && !changed.is_added)
                                           changed.component->check_allowed(core->implementation());
                                         if (changed.is_added) allow_first_core(changed, *core);
                                         changed.fresh.core = std::move(core);
                                         changed.core_step = draft.step();
                                         changed.core_unready = false;
                                       }};

}  // namespace mauve
