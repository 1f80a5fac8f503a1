// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/rules/signal.hpp"

namespace mauve::rules {

void Signal::tell(time_ns_t time_ns, double value) noexcept {
  const std::uint64_t count = count_.load(std::memory_order_relaxed) + 1;  // relaxed: nobody else writes it
  Place& place = places_[count & 1U];
  // release: who sees these sees the count before this one, too
  place.time_ns.store(time_ns, std::memory_order_release);
  place.value.store(value, std::memory_order_release);
  count_.store(count, std::memory_order_seq_cst);
  const double low = low_.load(std::memory_order_seq_cst);
  const double high = high_.load(std::memory_order_seq_cst);
  if (is_quiet(value, low, high)) return;
  word_.fetch_add(1, std::memory_order_release);
  futex_wake_all(word_);
}

/// Ends: the place that is read is written again only when two more were told meanwhile.
Signal::Last Signal::last() const noexcept {
  for (;;) {
    const std::uint64_t count = count_.load(std::memory_order_seq_cst);
    if (count == 0) return {};
    const Place& place = places_[count & 1U];
    const Last found{.time_ns = place.time_ns.load(std::memory_order_acquire),
                     .value = place.value.load(std::memory_order_acquire),
                     .count = count};
    if (count_.load(std::memory_order_relaxed) == count) return found;
  }
}

bool Signal::listen(double low, double high, const Last& seen) noexcept {
  low_.store(low, std::memory_order_seq_cst);
  high_.store(high, std::memory_order_seq_cst);
  const Last now = last();
  return now.count == seen.count || is_quiet(now.value, low, high);
}

}  // namespace mauve::rules
