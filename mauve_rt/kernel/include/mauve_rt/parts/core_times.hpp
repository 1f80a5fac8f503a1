// SPDX-License-Identifier: LGPL-3.0-or-later
// CoreTimes: the worst-case execution times of a core's methods, for the timing analysis.
#pragma once

#include <map>
#include <string>

#include "mauve_rt/base/time.hpp"

namespace mauve {

/// By the method's name, in ns. They belong to the core's algorithm; nothing enforces them.
using CoreTimes = std::map<std::string, time_ns_t>;

/// Throws Error (out_of_range): a time is not 1 to kLongest ns. `core`: its name. [setup]
void check_core_times(const std::string& core, const CoreTimes& times);

}  // namespace mauve
