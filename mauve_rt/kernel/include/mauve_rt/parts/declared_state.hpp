// SPDX-License-Identifier: LGPL-3.0-or-later
// DeclaredState: what who uses an fsm declares of one of its states, in the place of the fsm's own words.
#pragma once

#include <optional>
#include <string>

#include "mauve_rt/base/time.hpp"

namespace mauve {

/// The times of an execution state. What is empty stays as the fsm says.
struct DeclaredState {
  std::string name{};
  std::optional<time_ns_t> max_execution_ns{};        // the bound that the watchdog enforces; > 0
  std::optional<time_ns_t> simulated_execution_ns{};  // what it takes in virtual time; >= 0
  bool operator==(const DeclaredState&) const = default;
};

}  // namespace mauve
