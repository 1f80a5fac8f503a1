// SPDX-License-Identifier: LGPL-3.0-or-later
#include "conditions/kinds.hpp"

namespace mauve::rules {

namespace {

constexpr time_ns_t kPythonCalm = ms_to_ns(500);  // Python takes longer to go on than threads of C++

}  // namespace

ConditionKind node_silent_kind() {
  return {
      .name = "node_silent",
      .summary = "the executor's Python side, which answers requests, has not worked for `longer_than_s`",
      .parameters = {{.name = "longer_than_s", .type = "float", .unit = "s", .minimum = 2, .initial = 5.0}},
      .hears = [](const Parameters& /*told*/) { return std::vector{SignalSpec{SignalKind::node}}; },
      .make = [](const Parameters& parameters,
                 std::span<Signal* const> signals) -> std::unique_ptr<Condition> {
        return std::make_unique<Age>(*signals[0], nanoseconds(told<double>(parameters, "longer_than_s")),
                                     kPythonCalm);
      }};
}

}  // namespace mauve::rules
