// SPDX-License-Identifier: LGPL-3.0-or-later
#include "conditions/kinds.hpp"

namespace mauve::rules {

ConditionKind since_change_kind() {
  return {.name = "since_change",
          .summary =
              "a component, or with none named the architecture, was last changed longer ago than a time; "
              "before a "
              "first change that counts from arming on",
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
