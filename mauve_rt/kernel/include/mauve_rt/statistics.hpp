// SPDX-License-Identifier: LGPL-3.0-or-later
// Counters and a latency histogram that a component's thread writes and anyone may read.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>

#include "mauve_rt/time.hpp"

namespace mauve {

/// Latencies in buckets of at most 1/8 relative width. One writer; readers see a recent state.
/// All memory orders are relaxed: counts stand for themselves, nothing is published with them.
class LatencyHistogram {
 public:
  /// [rt]
  void record(time_ns_t latency_ns) noexcept;
  /// The upper edge of the bucket that holds the quantile (0 to 1); 0 when empty. [non-rt]
  time_ns_t quantile_ns(double quantile) const noexcept;
  time_ns_t max_ns() const noexcept { return max_.load(std::memory_order_relaxed); }

 private:
  static constexpr std::size_t kSubBuckets = 8;
  std::array<std::atomic<std::uint32_t>, 40 * kSubBuckets> counts_{};
  std::atomic<time_ns_t> max_{0};
};

/// One writer (the component's thread), relaxed for the same reason.
struct TaskStatistics {
  std::atomic<std::uint64_t> releases{0};
  std::atomic<std::uint64_t> overruns{0};
  std::atomic<std::uint64_t> skipped{0};
  LatencyHistogram wakeup;
};

}  // namespace mauve
