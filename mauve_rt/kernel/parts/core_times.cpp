// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/parts/core_times.hpp"

#include "mauve_rt/base/error.hpp"

namespace mauve {

void check_core_times(const std::string& core, const CoreTimes& times) {
  for (const auto& [method, time_ns] : times) {
    if (time_ns > 0 && time_ns <= kLongest) continue;
    std::string element = "core ";
    element.append(core).append(", wcet_ns of ").append(method);
    throw Error(ErrorCode::out_of_range, "a method's worst-case execution time is out of range",
                {.element = element,
                 .expected = "1 to " + std::to_string(kLongest) + " ns",
                 .found = std::to_string(time_ns),
                 .remedy = "leave the method out where its time is not known"});
  }
}

}  // namespace mauve
