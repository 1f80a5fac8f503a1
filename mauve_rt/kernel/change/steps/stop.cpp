// SPDX-License-Identifier: LGPL-3.0-or-later
// A running component is parked.
#include "change/steps/step_kind.hpp"

namespace mauve {

namespace {

void stop_component(Draft& draft, const std::string& name) {
  DraftComponent& stopped = draft.touch(name);
  if (!stopped.runs) {
    const ComponentState found = stopped.ran ? ComponentState::stopped : stopped.state;
    throw Error(ErrorCode::not_running, "the component is not running",
                {.component = name, .expected = "RUNNING", .found = std::string(to_string(found))});
  }
  stopped.runs = false;
}

}  // namespace

constexpr StepKind steps::stop{
    .name = "stop", .element = "state", .draft = [](Draft& draft, TransactionStep& step) {
      stop_component(draft, step.target);
    }};

}  // namespace mauve
