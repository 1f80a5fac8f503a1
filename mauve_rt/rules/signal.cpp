// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/rules/signal.hpp"

#include "mauve_rt/base/contract.hpp"

namespace mauve::rules {

void Signal::Record::write(const Last& report) noexcept {
  const std::uint64_t count = count_.load(std::memory_order_relaxed) + 1;  // relaxed: nobody else writes it
  Place& place = places_[count & 1U];
  // release: who sees these sees the count before this one, too
  place.time_ns.store(report.time_ns, std::memory_order_release);
  place.value.store(report.value, std::memory_order_release);
  place.count.store(report.count, std::memory_order_release);
  MAUVE_AUDIT(count_.load(std::memory_order_relaxed) + 1 == count);  // else another thread writes, too
  count_.store(count, std::memory_order_seq_cst);
}

/// Ends: the place that is read is written again only when two more were written meanwhile.
Signal::Last Signal::Record::read() const noexcept {
  for (;;) {
    const std::uint64_t count = count_.load(std::memory_order_seq_cst);
    if (count == 0) return {};
    const Place& place = places_[count & 1U];
    const Last found{.time_ns = place.time_ns.load(std::memory_order_acquire),
                     .value = place.value.load(std::memory_order_acquire),
                     .count = place.count.load(std::memory_order_acquire)};
    if (count_.load(std::memory_order_relaxed) == count) return found;
  }
}

void Signal::tell(time_ns_t time_ns, double value) noexcept {
  if (counts_crossings_) cross(time_ns, value);
  all_.write({.time_ns = time_ns, .value = value, .count = all_.written() + 1});  // after the crossing
  const Bounds quiet{.low = low_.load(std::memory_order_seq_cst),
                     .high = high_.load(std::memory_order_seq_cst)};
  if (quiet.contains(value)) return;
  word_->bump();
}

void Signal::cross(time_ns_t time_ns, double value) noexcept {
  if (!crosses(value, is_outside_)) return;
  is_outside_ = !is_outside_;
  (is_outside_ ? left_ : entered_).write({.time_ns = time_ns, .value = value, .count = ++crossings_});
}

bool Signal::listen(double low, double high, const Last& seen) noexcept {
  low_.store(low, std::memory_order_seq_cst);
  high_.store(high, std::memory_order_seq_cst);
  // Quiet or not: of several reports since then only the last is known to be quiet.
  return all_.written() == seen.count;
}

}  // namespace mauve::rules
