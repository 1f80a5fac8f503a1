// SPDX-License-Identifier: LGPL-3.0-or-later
// A resource that was not there.
#include "change/steps/step_kind.hpp"

namespace mauve {

constexpr StepKind steps::add_resource{
    .name = "add_resource",
    .target = StepTarget::resource,
    .is_structural = true,
    .words =
        [](const TransactionStep& step) {
          const auto* wanted = std::get_if<NewResource>(&step.value);
          std::string words = step.target;
          if (wanted == nullptr) return words;
          if (wanted->by_kind) words += " " + wanted->kind + (wanted->type.empty() ? "" : " " + wanted->type);
          if (wanted->resource != nullptr) words += " " + wanted->resource->kind();
          return words;
        },
    .draft =
        [](Draft& draft, TransactionStep& step) {
          auto& wanted = value_of<NewResource>(step);
          auto resource = wanted.by_kind
                              ? draft.registry().make_resource(wanted.kind, wanted.type, wanted.parameters)
                              : take(wanted.resource);
          draft.add_resource(step.target, std::move(resource), wanted.topic, wanted.longest_hold_ns,
                             wanted.frames);
        }};

}  // namespace mauve
