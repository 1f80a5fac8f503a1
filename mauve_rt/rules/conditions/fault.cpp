// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/run/task.hpp"

#include "conditions/kinds.hpp"

namespace mauve::rules {

ConditionKind fault_kind() {
  return {
      .name = "fault",
      .summary = "a component is FAULTED",
      .parameters = {kComponent},
      .hears = [](const Parameters& told) { return heard_of_component(told, SignalKind::state); },
      .make = [](const Parameters& /*told*/, std::span<Signal* const> signals) -> std::unique_ptr<Condition> {
        return of_running(std::make_unique<Equal>(*signals[0], static_cast<double>(ComponentState::faulted)),
                          signals);
      }};
}

}  // namespace mauve::rules
