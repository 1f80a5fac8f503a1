// SPDX-License-Identifier: LGPL-3.0-or-later
#include "conditions/kinds.hpp"

namespace mauve::rules {

ConditionKind since_change_kind() {
  return {.name = "since_change",
          .summary =
              "the last change of a component, or of the architecture, is older than `longer_than_s`; "
              "before the first change, the time counts from arming",
          .parameters =
              {{.name = "component", .type = "component"},
               {.name = "longer_than_s", .type = "float", .unit = "s", .minimum = 1e-9, .required = true}},
          .hears =
              [](const Parameters& told) {
                return std::vector{SignalSpec{SignalKind::change, text(told, "component")}};
              },
          .make = [](const Parameters& parameters,
                     std::span<Signal* const> signals) -> std::unique_ptr<Condition> {
            return std::make_unique<Age>(*signals[0], nanoseconds(told<double>(parameters, "longer_than_s")));
          }};
}

}  // namespace mauve::rules
