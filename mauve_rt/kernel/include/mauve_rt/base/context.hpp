// SPDX-License-Identifier: LGPL-3.0-or-later
// What a component's ports, core and fsm may ask of the task that runs them.
#pragma once

#include <cstdint>

#include "mauve_rt/base/log.hpp"
#include "mauve_rt/base/seam/atomic.hpp"
#include "mauve_rt/base/time.hpp"
#include "mauve_rt/base/trace.hpp"

namespace mauve {

/// The logical side of a component's task.
///
/// | member     | written by | read by    | order                                                |
/// | ---------- | ---------- | ---------- | ---------------------------------------------------- |
/// | clock_ns   | component  | any thread | relaxed: a lone number, nothing is published with it |
/// | instant_ns | component  | any thread | relaxed: likewise                                    |
/// | period_ns  | commits    | any thread | relaxed: likewise                                    |
/// | log        | [setup]    | any thread | its own: log.hpp                                     |
struct Context {
  Atomic<time_ns_t> clock_ns{0};    // the logical clock
  Atomic<time_ns_t> instant_ns{0};  // nominal instant of the last entry of the initial state
  Atomic<time_ns_t> period_ns{0};   // g; 0 for a sporadic fsm
  LogSource log{};                  // the component, or a shadow of it
};

}  // namespace mauve
