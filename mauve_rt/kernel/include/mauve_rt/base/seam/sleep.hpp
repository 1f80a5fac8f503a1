// SPDX-License-Identifier: LGPL-3.0-or-later
// Sleeping for a length of time, where no other thread is to end the sleep.
#pragma once

#include "mauve_rt/base/rt.hpp"
#include "mauve_rt/base/seam/clocks.hpp"

namespace mauve {

/// The calling thread sleeps for so long. [rt] For a loop that polls; EINTR retried.
void sleep_for(time_ns_t length_ns) MAUVE_RT;
/// The calling thread lets other threads of its priority run. [non-rt]
void yield_thread() noexcept;

}  // namespace mauve
