// SPDX-License-Identifier: LGPL-3.0-or-later
// Time: int64 nanoseconds of CLOCK_MONOTONIC, behind a Clock interface.
#pragma once

#include <cstdint>

#include "mauve_rt/base/rt.hpp"
#include "mauve_rt/base/seam/atomic.hpp"
#include "mauve_rt/base/seam/clocks.hpp"

namespace mauve {

class Task;

/// [rt]
constexpr time_ns_t us_to_ns(std::int64_t us) MAUVE_RT { return us * 1'000; }
constexpr time_ns_t ms_to_ns(std::int64_t ms) MAUVE_RT { return ms * 1'000'000; }
constexpr time_ns_t s_to_ns(std::int64_t s) MAUVE_RT { return s * 1'000'000'000; }

/// An instant that never comes, and a length of time that never ends.
inline constexpr time_ns_t kForever = INT64_MAX;
/// What an fsm's waits may last together, and an offset: 73 years. Added to any instant of the clock it is one still.
inline constexpr time_ns_t kLongest = INT64_MAX / 4;
/// The last instant at which virtual time can begin: a year before kLongest, the last clock at which a change can be made (cut.hpp).
inline constexpr time_ns_t kLatestBegin = kLongest - s_to_ns(365LL * 24 * 60 * 60);

/// instant + length; kForever when that is later than there are instants. [rt]
constexpr time_ns_t later_by(time_ns_t instant_ns, time_ns_t length_ns) MAUVE_RT {
  time_ns_t later = 0;
  if (!__builtin_add_overflow(instant_ns, length_ns, &later)) return later;
  return length_ns > 0 ? kForever : INT64_MIN;
}

/// Where a component's time comes from.
class Clock {
 public:
  virtual ~Clock() = default;
  /// The present instant. [rt]
  virtual time_ns_t now_ns() const MAUVE_RT = 0;
  /// Sleeps until the instant, or until the word no longer holds `expected`, whichever is first. [rt]
  /// Returns true when the instant was reached. Interrupted sleeps (EINTR) are resumed.
  virtual bool sleep_until(time_ns_t instant_ns, const Atomic<std::uint32_t>& word,
                           std::uint32_t expected) const MAUVE_RT = 0;
  /// The CPU time that the calling thread has used, from any origin; where time is simulated, the time that passes by spend(). [rt]
  virtual time_ns_t cpu_now_ns() const MAUVE_RT { return now_ns(); }
  /// An execution state has ended that takes so much time where time is simulated: that passes by it. [rt]
  virtual void spend(time_ns_t /*simulated_ns*/) const MAUVE_RT {}
  /// A simulated task waits for another instant now, or for none. [rt]
  virtual void due_changed(Task& /*task*/) const MAUVE_RT {}
  /// A simulated task lives by this clock no longer. [rt]
  virtual void leave(Task& /*task*/) const MAUVE_RT {}
};

/// CLOCK_MONOTONIC, with absolute futex waits.
class MonotonicClock final : public Clock {
 public:
  time_ns_t now_ns() const noexcept override;
  time_ns_t cpu_now_ns() const noexcept override { return thread_cpu_now_ns(); }
  bool sleep_until(time_ns_t instant_ns, const Atomic<std::uint32_t>& word,
                   std::uint32_t expected) const noexcept override;
  /// The process's one instance. [rt]
  static const MonotonicClock& instance() MAUVE_RT;
};

/// A component's grid: the instants reference + k * period.
struct Grid {
  time_ns_t reference_ns{0};
  time_ns_t period_ns{0};

  /// The first instant that is not before `earliest_ns` (period 0: the reference itself, or earliest). [rt]
  time_ns_t first_not_before(time_ns_t earliest_ns) const MAUVE_RT;
  /// Signed distance of an instant from the nearest one of the grid. [rt]
  time_ns_t phase_error(time_ns_t instant_ns) const MAUVE_RT;
};

}  // namespace mauve
