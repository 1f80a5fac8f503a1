// SPDX-License-Identifier: LGPL-3.0-or-later
// Counters and a latency histogram that a component's thread writes and anyone may read.
#pragma once

#include <array>
#include <cstdint>

#include "mauve_rt/base/seam/atomic.hpp"
#include "mauve_rt/base/time.hpp"

namespace mauve {

/// The largest value since the start, and since somebody took it last. One writer, one taker; relaxed, for each value
/// stands for itself: one that is recorded while it is taken counts for the next time at the latest.
class Maximum {
 public:
  /// [rt]
  void record(time_ns_t value_ns) MAUVE_RT {
    if (value_ns > max_ns()) max_.store(value_ns, std::memory_order_relaxed);
    if (value_ns > recent_.load(std::memory_order_relaxed))
      recent_.store(value_ns, std::memory_order_relaxed);
  }
  /// [rt]
  time_ns_t max_ns() const MAUVE_RT { return max_.load(std::memory_order_relaxed); }
  /// Of the values since the last call; 0 when there was none. [rt]
  time_ns_t take_recent_ns() const MAUVE_RT { return recent_.exchange(0, std::memory_order_relaxed); }

 private:
  Atomic<time_ns_t> max_{0};
  mutable Atomic<time_ns_t> recent_{0};  // the taker's, who may only look at the rest
};

/// Latencies in buckets of at most 1/8 relative width. One writer; readers see a recent state.
/// All memory orders are relaxed: counts stand for themselves, nothing is published with them.
class LatencyHistogram {
 public:
  /// [rt]
  void record(time_ns_t latency_ns) MAUVE_RT;
  /// The upper edge of the bucket that holds the quantile (0 to 1); 0 when empty. [non-rt]
  time_ns_t quantile_ns(double quantile) const noexcept;
  time_ns_t max_ns() const noexcept { return max_.max_ns(); }
  const Maximum& maximum() const noexcept { return max_; }

 private:
  static constexpr std::size_t kSubBuckets = 8;
  std::array<Atomic<std::uint32_t>, 40 * kSubBuckets> counts_{};
  Maximum max_;
};

/// How long a state executed: how often, on average and at most. One writer, relaxed for the same reason; the
/// average of a reader who comes in between can lack the newest execution's time.
class ExecutionTime {
 public:
  /// [rt]
  void record(time_ns_t duration_ns) MAUVE_RT {
    count_.store(count_.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
    total_.store(total_.load(std::memory_order_relaxed) + duration_ns, std::memory_order_relaxed);
    max_.record(duration_ns);
  }
  /// [rt]
  std::uint64_t count() const MAUVE_RT { return count_.load(std::memory_order_relaxed); }
  /// 0 when there was none. [rt]
  time_ns_t mean_ns() const MAUVE_RT {
    const std::uint64_t executions = count();
    return executions == 0 ? 0 : total_.load(std::memory_order_relaxed) / static_cast<time_ns_t>(executions);
  }
  /// [rt]
  time_ns_t max_ns() const MAUVE_RT { return max_.max_ns(); }
  const Maximum& maximum() const MAUVE_RT { return max_; }

 private:
  Atomic<std::uint64_t> count_{0};
  Atomic<time_ns_t> total_{0};
  Maximum max_;
};

/// One writer (the component's thread), relaxed for the same reason.
struct TaskStatistics {
  Atomic<std::uint64_t> releases{0};
  Atomic<std::uint64_t> overruns{0};
  Atomic<std::uint64_t> skipped{0};
  LatencyHistogram wakeup;
  Maximum response;
};

}  // namespace mauve
