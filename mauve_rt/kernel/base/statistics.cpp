// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/base/statistics.hpp"

#include <algorithm>
#include <bit>

namespace mauve {

// Bucket of a latency x: below 8 ns x itself; else 8 sub-buckets for each power of two.
void LatencyHistogram::record(time_ns_t latency_ns) noexcept {
  const auto latency = static_cast<std::uint64_t>(std::max<time_ns_t>(latency_ns, 0));
  std::size_t bucket = latency;
  if (latency >= kSubBuckets) {
    const auto exponent = static_cast<std::size_t>(std::bit_width(latency)) - 4;  // 8..15 -> 0
    bucket = (exponent + 1) * kSubBuckets + ((latency >> exponent) - kSubBuckets);
  }
  auto& count = counts_[std::min(bucket, counts_.size() - 1)];
  count.store(count.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
  max_.record(latency_ns);
}

time_ns_t LatencyHistogram::quantile_ns(double quantile) const noexcept {
  std::uint64_t total = 0;
  for (const auto& count : counts_) total += count.load(std::memory_order_relaxed);
  if (total == 0) return 0;
  const auto rank = static_cast<std::uint64_t>(quantile * static_cast<double>(total - 1));
  std::uint64_t below = 0;
  for (std::size_t bucket = 0; bucket < counts_.size(); ++bucket) {
    below += counts_[bucket].load(std::memory_order_relaxed);
    if (below <= rank) continue;
    if (bucket < kSubBuckets) return static_cast<time_ns_t>(bucket);
    const std::size_t exponent = bucket / kSubBuckets - 1;
    const std::size_t upper = ((bucket % kSubBuckets + kSubBuckets + 1) << exponent) - 1;
    return std::min(static_cast<time_ns_t>(upper), max_ns());
  }
  return max_ns();
}

}  // namespace mauve
