// SPDX-License-Identifier: LGPL-3.0-or-later
#include "conditions/kinds.hpp"

namespace mauve::rules {

ConditionKind overruns_kind() {
  return {.name = "overruns",
          .summary = "a component overran `at_least` times within `within_s`",
          .parameters = often_parameters(),
          .hears = [](const Parameters& told) { return heard_of_component(told, SignalKind::overruns); },
          .make = make_often};
}

}  // namespace mauve::rules
