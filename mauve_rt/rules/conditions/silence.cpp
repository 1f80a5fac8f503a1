// SPDX-License-Identifier: LGPL-3.0-or-later
#include "conditions/kinds.hpp"

namespace mauve::rules {

namespace {

const ParameterSpec kLongerThan{
    .name = "longer_than_s", .type = "float", .unit = "s", .minimum = 1e-9, .required = true};

std::unique_ptr<Condition> make_age(const Parameters& parameters, std::span<Signal* const> signals) {
  return std::make_unique<Age>(*signals[0], nanoseconds(told<double>(parameters, "longer_than_s")));
}

}  // namespace

ConditionKind silence_kind() {
  return {.name = "silence",
          .summary =
              "the last message of a topic that can be read, or the last write to a resource, is older than "
              "`longer_than_s`; before the first one, the time counts from arming",
          .parameters = {kTopic, kMessageType, kResource, kLongerThan},
          .hears =
              [](const Parameters& told) {
                return std::vector{topic_or_resource(told, SignalKind::message, SignalKind::write)};
              },
          .make = make_age};
}

ConditionKind link_silence_kind() {
  ParameterSpec topic = kTopic;
  topic.required = true;
  return {.name = "link_silence",
          .summary =
              "the last message of a topic that has arrived, also one that waits for an earlier one to be "
              "repaired, is older than `longer_than_s`; before the first one, the time counts from arming",
          .parameters = {topic, kMessageType, kLongerThan},
          .hears =
              [](const Parameters& told) {
                return std::vector{SignalSpec{SignalKind::arrival, text(told, "topic")}};
              },
          .make = make_age};
}

}  // namespace mauve::rules
