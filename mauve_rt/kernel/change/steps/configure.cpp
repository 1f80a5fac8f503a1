// SPDX-License-Identifier: LGPL-3.0-or-later
// A component that is not running is cleaned up and configured anew.
#include "change/steps/step_kind.hpp"

namespace mauve {

namespace {

void configure_component(Draft& draft, const std::string& name) {
  DraftComponent& configured = draft.change(name);
  if (configured.is_added) return;  // it is, as it comes
  if (configured.ran) {
    throw Error(ErrorCode::already_running, "the component is running",
                {.component = name,
                 .expected = "a parked component",
                 .found = "RUNNING",
                 .remedy = "stop it before, or replace its core in flight"});
  }
  configured.configure_step = draft.step();
}

}  // namespace

constexpr StepKind steps::configure{
    .name = "configure",
    .element = "state",
    .is_structural = true,
    .draft = [](Draft& draft, TransactionStep& step) { configure_component(draft, step.target); }};

}  // namespace mauve
