// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/parts/slewed_outputs.hpp"

#include <cmath>
#include <set>

#include "mauve_rt/base/error.hpp"

#include "parts/lookup.hpp"

namespace mauve {

void check_max_slew(const MaxSlew& max_slew, const std::string& component) {
  std::set<std::string> named;
  for (const auto& [output, per_second] : max_slew) {
    if (!named.insert(output).second) {
      throw Error(ErrorCode::duplicate_name, "max_slew names a number twice",
                  {.component = component, .element = "max_slew " + output, .remedy = "remove one of them"});
    }
    if (const std::size_t dot = output.find('.'); dot == 0 || dot >= output.size() - 1) {
      throw Error(ErrorCode::invalid_argument, "max_slew names no number of an output",
                  {.component = component,
                   .element = "max_slew " + output,
                   .expected = "the name of a write port, a dot and the path of a number",
                   .found = output,
                   .remedy = "name port and field, such as command.torque"});
    }
    if (!std::isfinite(per_second) || per_second <= 0.0) {
      throw Error(ErrorCode::out_of_range, "max_slew is no change per second",
                  {.component = component,
                   .element = "max_slew " + output,
                   .expected = "a finite number above 0",
                   .found = std::to_string(per_second),
                   .remedy = "give the greatest change per second, in units of the number"});
    }
  }
}

SlewedOutputs::SlewedOutputs(const MaxSlew& max_slew, const std::string& component) {
  check_max_slew(max_slew, component);
  std::map<std::string, std::map<std::string, double>> paths;
  for (const auto& [output, per_second] : max_slew) {
    const std::size_t dot = output.find('.');
    paths[output.substr(0, dot)].emplace(output.substr(dot + 1), per_second);
  }
  for (const auto& [port, numbers] : paths) by_port_.emplace(port, std::make_shared<SlewedOutput>(numbers));
}

void SlewedOutputs::limit(const Shell& shell, const std::string& component) const {
  for (const auto& [port, output] : by_port_) find_port(shell, port, component).limit_slew(output);
}

void SlewedOutputs::continue_from(const SlewedOutputs& other) noexcept {
  for (const auto& [port, output] : by_port_) {
    const auto same = other.by_port_.find(port);
    if (same != other.by_port_.end()) output->continue_from(*same->second);
  }
}

std::vector<SlewRecord> SlewedOutputs::records() const {
  std::vector<SlewRecord> records;
  for (const auto& [port, output] : by_port_) {
    for (const SlewedNumber& number : output->numbers()) {
      records.push_back({.output = port + "." + number.path,
                         .max_slew = number.max_slew,
                         .limited = number.limited.load(std::memory_order_relaxed),  // relaxed: figures
                         .not_limited = number.not_limited.load(std::memory_order_relaxed)});
    }
  }
  return records;
}

}  // namespace mauve
