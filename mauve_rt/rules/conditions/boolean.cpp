// SPDX-License-Identifier: LGPL-3.0-or-later
#include "conditions/kinds.hpp"

namespace mauve::rules {

ConditionKind boolean_kind() {
  return {
      .name = "boolean",
      .summary = "the last message of a topic was true, or false",
      .parameters = {{.name = "topic", .type = "topic", .required = true},
                     {.name = "type", .type = "message_type", .initial = std::string("std_msgs/msg/Bool")},
                     {.name = "field", .type = "field", .initial = std::string("data")},
                     {.name = "is", .type = "bool", .initial = true}},
      .hears =
          [](const Parameters& told) {
            return std::vector{SignalSpec{SignalKind::field, text(told, "topic"), text(told, "field")}};
          },
      .make = [](const Parameters& parameters,
                 std::span<Signal* const> signals) -> std::unique_ptr<Condition> {
        return std::make_unique<Equal>(*signals[0], told<bool>(parameters, "is") ? 1.0 : 0.0);
      }};
}

}  // namespace mauve::rules
