// SPDX-License-Identifier: LGPL-3.0-or-later
// A new common epoch for all components that can take one.
#include "change/steps/step_kind.hpp"

namespace mauve {

constexpr StepKind steps::resynchronise{
    .name = "resynchronise",
    .target = StepTarget::all,
    .is_structural = true,
    .words = [](const TransactionStep&) { return std::string(); },
    .draft = [](Draft& draft, TransactionStep&) { draft.resynchronise(); }};

}  // namespace mauve
