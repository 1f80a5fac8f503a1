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

std::string core_words(const TransactionStep& step) {
  const auto* with = std::get_if<CoreWithOptions>(&step.value);
  if (with == nullptr) return part_words<CoreBase>(step);
  return step.target + " " + (with->core != nullptr ? shown({}, with->core) : step.name) +
         (with->options.bumpless ? " bumpless" : "") + (with->options.probation ? " on probation" : "");
}

/// The core that the step brings; nullptr: it names one.
std::unique_ptr<CoreBase>* find_object(TransactionStep& step) {
  if (auto* with = std::get_if<CoreWithOptions>(&step.value))
    return step.name.empty() ? &with->core : nullptr;
  return brings<CoreBase>(step) ? &value_of<std::unique_ptr<CoreBase>>(step) : nullptr;
}

}  // namespace

constexpr StepKind steps::replace_core{.name = "replace_core",
                                       .element = "core",
                                       .words = core_words,
                                       .draft = [](Draft& draft, TransactionStep& step) {
                                         std::unique_ptr<CoreBase>* const object = find_object(step);
                                         std::unique_ptr<CoreBase> core =
                                             object == nullptr ? draft.registry().make_core(step.name)
                                                               : take(*object);
                                         DraftComponent& changed = replacing(draft, step.target);
                                         require_not_promoted(changed);
                                         if (object == nullptr && !changed.is_added)
                                           changed.component->check_allowed(core->implementation());
                                         if (changed.is_added) allow_first_core(changed, *core);
                                         changed.fresh.core = std::move(core);
                                         changed.core_step = draft.step();
                                         changed.core_unready = false;
                                         changed.probation.reset();
                                         changed.bumpless.reset();
                                         if (const auto* with = std::get_if<CoreWithOptions>(&step.value)) {
                                           changed.probation = with->options.probation;
                                           changed.bumpless = with->options.bumpless;
                                         }
                                       }};

}  // namespace mauve
