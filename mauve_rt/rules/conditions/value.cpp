// SPDX-License-Identifier: LGPL-3.0-or-later
#include "conditions/kinds.hpp"

namespace mauve::rules {

namespace {

std::vector<SignalSpec> heard(const Parameters& parameters) {
  if (!is_told(parameters, "above") && !is_told(parameters, "below")) {
    throw Error(ErrorCode::invalid_argument, "a value is held against a bound",
                {.element = "above", .expected = "above, below, or both", .found = "neither"});
  }
  return {topic_or_resource(parameters, SignalKind::field, SignalKind::field, text(parameters, "field"))};
}

std::unique_ptr<Condition> make(const Parameters& parameters, std::span<Signal* const> signals) {
  const double low = is_told(parameters, "below") ? told<double>(parameters, "below") : -kInfinity;
  const double high = is_told(parameters, "above") ? told<double>(parameters, "above") : kInfinity;
  return std::make_unique<Range>(*signals[0], low, high, told<double>(parameters, "hysteresis"));
}

}  // namespace

ConditionKind value_kind() {
  return {
      .name = "value",
      .summary =
          "a field of a message or of a resource's struct is above or below a bound, or is no number; with "
          "`hysteresis`, until the field is back by this much",
      .parameters = {kTopic,
                     kMessageType,
                     kResource,
                     {.name = "field", .type = "field", .required = true},
                     {.name = "above", .type = "float"},
                     {.name = "below", .type = "float"},
                     {.name = "hysteresis", .type = "float", .minimum = 0, .initial = 0.0}},
      .hears = heard,
      .make = make};
}

}  // namespace mauve::rules
