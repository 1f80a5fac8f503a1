// SPDX-License-Identifier: LGPL-3.0-or-later
// SlewedOutputs: the max_slew of a component, by output, whatever its shell.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "mauve_rt/data/slew_limit.hpp"
#include "mauve_rt/parts/shell.hpp"

namespace mauve {

/// "command.torque" and the units of the number per second. A vector: settings may be constants of a program.
using MaxSlew = std::vector<std::pair<std::string, double>>;

/// Throws Error (invalid_argument, out_of_range, duplicate_name): no port and path, no finite number above 0, named twice. [non-rt]
void check_max_slew(const MaxSlew& max_slew, const std::string& component);

/// A limited number as anyone may see it.
struct SlewRecord {
  std::string output{};          // command.torque
  double max_slew{0.0};          // units per second
  std::uint64_t limited{0};      // writes in which the kernel wrote another value than was asked for
  std::uint64_t not_limited{0};  // values of a stop that were written at once, further away than allowed
  bool operator==(const SlewRecord&) const = default;
};

/// All functions [non-rt].
class SlewedOutputs {
 public:
  SlewedOutputs() = default;
  /// Throws as check_max_slew().
  SlewedOutputs(const MaxSlew& max_slew, const std::string& component);

  /// Limits the ports of a shell. [setup] Throws Error: unknown_port; invalid_argument, as PortBase::limit_slew().
  void limit(const Shell& shell, const std::string& component) const;
  /// SlewedOutput::continue_from(), of a component with the same max_slew.
  void continue_from(const SlewedOutputs& other) noexcept;
  std::vector<SlewRecord> records() const;

 private:
  std::map<std::string, std::shared_ptr<SlewedOutput>> by_port_;
};

}  // namespace mauve
