// SPDX-License-Identifier: LGPL-3.0-or-later
// A property's value.
#include "change/steps/step_kind.hpp"

namespace mauve {

const StepKind steps::set_property{
    .name = "set_property",
    .words =
        [](const TransactionStep& step) {
          const auto* value = std::get_if<PropertyValue>(&step.value);
          return step.target + "." + step.name + (value != nullptr ? " " + to_string(*value) : "");
        },
    .draft =
        [](Draft& draft, TransactionStep& step) {
          draft.set_property(draft.change(step.target), step.name, value_of<PropertyValue>(step));
        }};

}  // namespace mauve
