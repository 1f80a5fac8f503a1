// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/base/time.hpp"

#include "mauve_rt/base/seam/futex.hpp"

namespace mauve {

namespace {

/// The way from one instant to the next that is whole periods away from another: 0 to period - 1, whatever the instants.
time_ns_t to_grid(time_ns_t from, time_ns_t reference, time_ns_t period) noexcept {
  const time_ns_t way = reference % period - from % period;  // within 2 periods
  return (way % period + period) % period;
}

constinit const MonotonicClock the_monotonic_clock{};  // there before anybody asks: no first call makes it

}  // namespace

time_ns_t MonotonicClock::now_ns() const noexcept { return monotonic_now_ns(); }

bool MonotonicClock::sleep_until(time_ns_t instant_ns, const Atomic<std::uint32_t>& word,
                                 std::uint32_t expected) const noexcept {
  // acquire: what the waker wrote before it changed the word is visible to who returns
  while (word.load(std::memory_order_acquire) == expected) {
    if (!futex_wait_until(word, expected, instant_ns)) return true;
  }
  return false;
}

const MonotonicClock& MonotonicClock::instance() noexcept { return the_monotonic_clock; }

time_ns_t Grid::first_not_before(time_ns_t earliest_ns) const noexcept {
  if (period_ns <= 0) return earliest_ns > reference_ns ? earliest_ns : reference_ns;
  return later_by(earliest_ns, to_grid(earliest_ns, reference_ns, period_ns));
}

time_ns_t Grid::phase_error(time_ns_t instant_ns) const noexcept {
  if (period_ns <= 0) return 0;
  const time_ns_t after = to_grid(reference_ns, instant_ns, period_ns);
  return after > period_ns / 2 ? after - period_ns : after;
}

}  // namespace mauve
