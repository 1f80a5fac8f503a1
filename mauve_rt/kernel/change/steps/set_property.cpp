// SPDX-License-Identifier: LGPL-3.0-or-later
// A property's value.
#include "change/steps/step_kind.hpp"

namespace mauve {

constexpr StepKind steps::set_property{.name = "set_property",
                                       .element = "property",
                                       .words = element_words,
                                       .draft = [](Draft& draft, TransactionStep& step) {
                                         draft.set_property(draft.change(step.target), step.name,
                                                            value_of<PropertyValue>(step));
                                       }};

}  // namespace mauve
