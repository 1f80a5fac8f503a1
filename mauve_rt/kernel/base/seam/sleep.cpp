// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/base/seam/sleep.hpp"

#include <sched.h>

#include <algorithm>
#include <cerrno>

#include "base/seam/timespec.hpp"

namespace mauve {

void sleep_for(time_ns_t length_ns) noexcept {
  timespec left = to_timespec(std::max<time_ns_t>(0, length_ns));  // the system refuses lengths below 0
  // Its callers say how long it is bounded.
  while (MAUVE_RT_TRUSTED(clock_nanosleep(CLOCK_MONOTONIC, 0, &left, &left)) == EINTR) {
  }
}

void yield_thread() noexcept { sched_yield(); }

}  // namespace mauve
