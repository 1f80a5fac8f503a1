// SPDX-License-Identifier: LGPL-3.0-or-later
// Times as the system's calls take and give them.
#pragma once

#include <ctime>

#include "mauve_rt/base/time.hpp"

namespace mauve {

/// [rt]
inline timespec to_timespec(time_ns_t time_ns) MAUVE_RT {
  return {.tv_sec = time_ns / s_to_ns(1), .tv_nsec = time_ns % s_to_ns(1)};
}
/// [rt]
inline time_ns_t to_ns(const timespec& time) MAUVE_RT { return s_to_ns(time.tv_sec) + time.tv_nsec; }

}  // namespace mauve
