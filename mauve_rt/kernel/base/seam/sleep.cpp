// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/base/seam/sleep.hpp"

#include <sched.h>

#include <algorithm>
#include <cerrno>
#include <ctime>

namespace mauve {

void sleep_for(time_ns_t length_ns) noexcept {
  constexpr time_ns_t kSecond = 1'000'000'000;
  length_ns = std::max<time_ns_t>(0, length_ns);  // the system refuses lengths below 0
  timespec left{.tv_sec = length_ns / kSecond, .tv_nsec = length_ns % kSecond};
  // Its callers say how long it is bounded.
  while (MAUVE_RT_TRUSTED(clock_nanosleep(CLOCK_MONOTONIC, 0, &left, &left)) == EINTR) {
  }
}

void yield_thread() noexcept { sched_yield(); }

}  // namespace mauve
