// SPDX-License-Identifier: LGPL-3.0-or-later
// DeclaredState: what who uses an fsm declares of one of its states, in the place of the fsm's own words.
#pragma once

#include <optional>
#include <string>

#include "mauve_rt/base/time.hpp"

namespace mauve {

/// The times of an execution state, or of the guards of a wait (wcet_ns alone). What is empty stays as the fsm says.
struct DeclaredState {
  std::string name{};
  std::optional<time_ns_t> max_execution_ns{};        // the bound that the watchdog enforces; > 0
  std::optional<time_ns_t> simulated_execution_ns{};  // what it takes in virtual time; >= 0
  std::optional<time_ns_t> wcet_ns{};                 // worst case; enforced where enforce_wcet is set; > 0
  bool operator==(const DeclaredState&) const = default;
};

/// Checks the worst-case execution time of a state; 0: not declared. Throws Error (out_of_range) for a time that is no
/// length of time, or is above the state's max_execution_ns (0: none). `core`: that declares it; empty: no core. [setup]
void check_wcet(const std::string& state, time_ns_t wcet_ns, time_ns_t max_execution_ns,
                const std::string& component = {}, const std::string& core = {});

}  // namespace mauve
