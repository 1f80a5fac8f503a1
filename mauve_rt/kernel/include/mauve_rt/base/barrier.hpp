// SPDX-License-Identifier: LGPL-3.0-or-later
// Barrier: threads meet once.
#pragma once

#include <cstdint>

#include "mauve_rt/base/seam/atomic.hpp"
#include "mauve_rt/base/seam/futex.hpp"

namespace mauve {

/// All functions [non-rt]. Outlives the threads that meet.
///
/// | member           | written by           | read by  | order                                                             |
/// | ---------------- | -------------------- | -------- | ----------------------------------------------------------------- |
/// | missing_ (futex) | each who arrives     | the same | acq_rel: who leaves sees what all did before they arrived         |
class Barrier {
 public:
  explicit Barrier(std::uint32_t parties) noexcept : missing_(parties) {}
  Barrier(const Barrier&) = delete;
  Barrier& operator=(const Barrier&) = delete;

  /// So many arrive, or never will; the caller does not wait.
  void arrive(std::uint32_t parties) noexcept {
    if (missing_.fetch_sub(parties, std::memory_order_acq_rel) == parties) futex_wake_all(missing_);
  }
  /// Waits until all have arrived.
  void arrive_and_wait() noexcept {
    arrive(1);
    while (const std::uint32_t missing = missing_.load(std::memory_order_acquire))
      futex_wait_until(missing_, missing, kForever);
  }

 private:
  Atomic<std::uint32_t> missing_;
};

}  // namespace mauve
