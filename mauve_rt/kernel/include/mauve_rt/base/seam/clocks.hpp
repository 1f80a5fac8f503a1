// SPDX-License-Identifier: LGPL-3.0-or-later
// The clocks of the system.
#pragma once

#include <cstdint>

#include "mauve_rt/base/rt.hpp"

namespace mauve {

using time_ns_t = std::int64_t;

/// CLOCK_MONOTONIC now. [rt]
time_ns_t monotonic_now_ns() MAUVE_RT;
/// CLOCK_REALTIME now. [rt]
time_ns_t realtime_now_ns() MAUVE_RT;
/// The CPU time that the calling thread has used. [rt] A call of the system, of about 0.2 us.
time_ns_t thread_cpu_now_ns() MAUVE_RT;

}  // namespace mauve
