// SPDX-License-Identifier: LGPL-3.0-or-later
#include "conditions/kinds.hpp"

namespace mauve::rules {

ConditionKind silence_kind() {
  return {.name = "silence",
          .summary =
              "the last message of a topic, or the last write to a resource, is older than `longer_than_s`; "
              "before the first one, the time counts from arming",
          .parameters =
              {kTopic,
               kMessageType,
               kResource,
               {.name = "longer_than_s", .type = "float", .unit = "s", .minimum = 1e-9, .required = true}},
          .hears =
              [](const Parameters& told) {
                return std::vector{topic_or_resource(told, SignalKind::message, SignalKind::write)};
              },
          .make = [](const Parameters& parameters,
                     std::span<Signal* const> signals) -> std::unique_ptr<Condition> {
            return std::make_unique<Age>(*signals[0], nanoseconds(told<double>(parameters, "longer_than_s")));
          }};
}

}  // namespace mauve::rules
