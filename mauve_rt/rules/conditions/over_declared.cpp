// SPDX-License-Identifier: LGPL-3.0-or-later
#include "conditions/kinds.hpp"

namespace mauve::rules {

ConditionKind over_declared_kind() {
  return {
      .name = "over_declared",
      .summary = "executions of a component lasted longer than declared, `at_least` times within `within_s`",
      .parameters = often_parameters(),
      .hears = [](const Parameters& told) { return heard_of_component(told, SignalKind::over_declared); },
      .make = make_often};
}

}  // namespace mauve::rules
