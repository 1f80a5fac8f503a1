// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/base/seam/clocks.hpp"

#include "base/seam/timespec.hpp"

namespace mauve {

namespace {

time_ns_t read_clock(clockid_t clock) MAUVE_RT {
  timespec now{};
  MAUVE_RT_TRUSTED(
      clock_gettime(clock, &now));  // reads a page of the system's; of CPU time a call that waits for nothing
  return to_ns(now);
}

}  // namespace

time_ns_t monotonic_now_ns() noexcept { return read_clock(CLOCK_MONOTONIC); }
time_ns_t realtime_now_ns() noexcept { return read_clock(CLOCK_REALTIME); }
time_ns_t thread_cpu_now_ns() noexcept { return read_clock(CLOCK_THREAD_CPUTIME_ID); }

}  // namespace mauve
