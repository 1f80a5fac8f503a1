// SPDX-License-Identifier: LGPL-3.0-or-later
// The end of a port's connection.
#include "change/steps/step_kind.hpp"
#include "parts/lookup.hpp"

namespace mauve {

constexpr StepKind steps::disconnect{
    .name = "disconnect",
    .element = "port",
    .is_structural = true,
    .words = element_words,
    .draft = [](Draft& draft, TransactionStep& step) {
      DraftComponent& component = draft.change(step.target);
      if (component.wires.erase(step.name) != 0) {
        component.disconnected.insert_or_assign(step.name, draft.step());
        return;
      }
      find_port(component.shell(), step.name, component.name());
      throw Error(
          ErrorCode::invalid_argument, "the port is not connected",
          {.component = component.name(), .element = "port " + step.name, .remedy = "leave the step out"});
    }};

}  // namespace mauve
