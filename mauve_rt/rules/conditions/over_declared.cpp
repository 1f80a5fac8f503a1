// SPDX-License-Identifier: LGPL-3.0-or-later
#include "conditions/kinds.hpp"

namespace mauve::rules {

ConditionKind over_declared_kind() {
  return {
      .name = "over_declared",
      .summary = "executions of a component lasted longer than declared, `at_least` times within `within_s`",
      .parameters = often_parameters(),
      .hears =
          [](const Parameters& told) {
            return std::vector{SignalSpec{SignalKind::over_declared, text(told, "component")}};
          },
      .make = make_often};
}

}  // namespace mauve::rules
