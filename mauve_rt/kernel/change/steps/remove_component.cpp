// SPDX-License-Identifier: LGPL-3.0-or-later
// A component that leaves: parked, its outputs written, its ports disconnected.
#include "change/steps/step_kind.hpp"

namespace mauve {

constexpr StepKind steps::remove_component{
    .name = "remove_component",
    .removes = true,
    .is_structural = true,
    .draft = [](Draft& draft, TransactionStep& step) { draft.remove_component(step.target); }};

}  // namespace mauve
