// SPDX-License-Identifier: LGPL-3.0-or-later
// The possible switches at atomic operations: a countdown to the next one, so that the others cost next to nothing.
#pragma once

#include <atomic>
#include <cstdint>

namespace mauve::seeds {

/// To the next switch; without an end before begin(). One thread runs at a time; atomic for ThreadSanitizer alone.
extern constinit std::atomic<std::uint64_t> atomics_left;

/// The countdown has ended: threads switch, and the next one begins.
void switch_at_atomic() noexcept;

/// Before and after each atomic operation.
inline void atomic_step() noexcept {
  const std::uint64_t left = atomics_left.load(std::memory_order_relaxed) - 1;
  atomics_left.store(left, std::memory_order_relaxed);
  if (left == 0) [[unlikely]]
    switch_at_atomic();
}

}  // namespace mauve::seeds
