// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/time.hpp"

#include <ctime>

#include "mauve_rt/futex.hpp"

namespace mauve {

namespace {

time_ns_t read_clock(clockid_t clock) noexcept {
  timespec now{};
  clock_gettime(clock, &now);
  return s_to_ns(now.tv_sec) + now.tv_nsec;
}

/// k * period at or below the distance, for negative distances too.
time_ns_t floor_to_period(time_ns_t distance, time_ns_t period) noexcept {
  const time_ns_t remainder = distance % period;
  return distance - (remainder < 0 ? remainder + period : remainder);
}

}  // namespace

time_ns_t monotonic_now_ns() noexcept { return read_clock(CLOCK_MONOTONIC); }
time_ns_t realtime_now_ns() noexcept { return read_clock(CLOCK_REALTIME); }

time_ns_t MonotonicClock::now_ns() const noexcept { return monotonic_now_ns(); }

bool MonotonicClock::sleep_until(time_ns_t instant_ns, const std::atomic<std::uint32_t>& word,
                                 std::uint32_t expected) const noexcept {
  // acquire: what the waker wrote before it changed the word is visible to who returns
  while (word.load(std::memory_order_acquire) == expected) {
    if (!futex_wait_until(word, expected, instant_ns)) return true;
  }
  return false;
}

const MonotonicClock& MonotonicClock::instance() noexcept {
  static const MonotonicClock clock;
  return clock;
}

time_ns_t Grid::first_not_before(time_ns_t earliest_ns) const noexcept {
  if (period_ns <= 0) return earliest_ns > reference_ns ? earliest_ns : reference_ns;
  return reference_ns + floor_to_period(earliest_ns - reference_ns + period_ns - 1, period_ns);
}

time_ns_t Grid::phase_error(time_ns_t instant_ns) const noexcept {
  if (period_ns <= 0) return 0;
  const time_ns_t distance = instant_ns - reference_ns;
  const time_ns_t after = distance - floor_to_period(distance, period_ns);
  return after > period_ns / 2 ? after - period_ns : after;
}

}  // namespace mauve
