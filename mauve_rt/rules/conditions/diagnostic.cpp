// SPDX-License-Identifier: LGPL-3.0-or-later
#include "conditions/kinds.hpp"

namespace mauve::rules {

namespace {

double level_of(const std::string& name) {
  if (name == "WARN") return 1.0;
  return name == "ERROR" ? 2.0 : 3.0;
}

}  // namespace

ConditionKind diagnostic_kind() {
  return {.name = "diagnostic",
          .summary = "a status of /diagnostics has this level or a worse one",
          .parameters = {{.name = "status", .type = "str", .required = true},
                         {.name = "level", .type = "WARN|ERROR|STALE", .initial = std::string("ERROR")}},
          .hears =
              [](const Parameters& told) {
                return std::vector{SignalSpec{SignalKind::diagnostic, text(told, "status")}};
              },
          .make = [](const Parameters& told, std::span<Signal* const> signals) -> std::unique_ptr<Condition> {
            return std::make_unique<Range>(*signals[0], -kInfinity, level_of(text(told, "level")) - 0.5);
          }};
}

}  // namespace mauve::rules
