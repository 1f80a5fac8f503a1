// SPDX-License-Identifier: LGPL-3.0-or-later
#include "conditions/kinds.hpp"

namespace mauve::rules {

ConditionKind late_kind() {
  return {.name = "late",
          .summary =
              "a component woke up, or ended its response, later than `longer_than_s` after its instant, "
              "`at_least` times within `within_s`",
          .parameters = often_parameters(
              {{.name = "what", .type = "wake_up|response", .initial = std::string("response")},
               {.name = "longer_than_s", .type = "float", .unit = "s", .minimum = 1e-9, .required = true}}),
          .hears =
              [](const Parameters& parameters) {
                const time_ns_t bound_ns = nanoseconds(told<double>(parameters, "longer_than_s"));
                return heard_of_component(parameters, SignalKind::late,
                                          text(parameters, "what") + " " + std::to_string(bound_ns));
              },
          .make = make_often};
}

}  // namespace mauve::rules
