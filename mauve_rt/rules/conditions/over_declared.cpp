// SPDX-License-Identifier: LGPL-3.0-or-later
#include "conditions/kinds.hpp"

namespace mauve::rules {

ConditionKind over_declared_kind() {
  return {.name = "over_declared",
          .summary = "executions of a component have lasted longer than declared so often within a time",
          .parameters = often_parameters(),
          .hears =
              [](const Parameters& told) {
                return std::vector{SignalSpec{SignalKind::over_declared, text(told, "component")}};
              },
          .make = make_often};
}

}  // namespace mauve::rules
