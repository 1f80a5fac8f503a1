// SPDX-License-Identifier: LGPL-3.0-or-later
// Futex waits and wakes on a 32-bit word, CLOCK_MONOTONIC, EINTR retried.
#pragma once

#include <cstdint>

#include "mauve_rt/base/seam/atomic.hpp"
#include "mauve_rt/base/time.hpp"

namespace mauve {

/// Sleeps while the word holds `expected`, at most until the instant. [rt]
/// Returns false at the instant, true when the word changed or a wake came (re-check the word).
bool futex_wait_until(const Atomic<std::uint32_t>& word, std::uint32_t expected, time_ns_t until_ns) MAUVE_RT;

/// Wakes every thread that sleeps on the word. [rt]
void futex_wake_all(const Atomic<std::uint32_t>& word) MAUVE_RT;

/// A futex with priority inheritance: its word holds the id of the holder (kFutexHolder), as this_thread_id(), or 0.
inline constexpr std::uint32_t kFutexHolder = 0x3fff'ffff;
/// Locks it. [rt] Bounded by the section of the holder. False where no thread of the process has the id of the holder.
bool futex_lock_pi(Atomic<std::uint32_t>& word) MAUVE_RT;
/// By the holder, where the word could not be set from its id to 0. [rt]
bool futex_unlock_pi(Atomic<std::uint32_t>& word) MAUVE_RT;

}  // namespace mauve
