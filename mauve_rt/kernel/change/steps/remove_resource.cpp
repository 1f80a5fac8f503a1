// SPDX-License-Identifier: LGPL-3.0-or-later
// A resource that leaves; no port is connected to it.
#include "change/steps/step_kind.hpp"

namespace mauve {

constexpr StepKind steps::remove_resource{
    .name = "remove_resource",
    .removes = true,
    .target = StepTarget::resource,
    .is_structural = true,
    .draft = [](Draft& draft, TransactionStep& step) { draft.remove_resource(step.target); }};

}  // namespace mauve
