// SPDX-License-Identifier: LGPL-3.0-or-later
#include "conditions/kinds.hpp"

namespace mauve::rules {

ConditionKind overruns_kind() {
  return {.name = "overruns",
          .summary = "a component overran `at_least` times within `within_s`",
          .parameters = often_parameters(),
          .hears =
              [](const Parameters& told) {
                return std::vector{SignalSpec{SignalKind::overruns, text(told, "component")}};
              },
          .make = make_often};
}

}  // namespace mauve::rules
