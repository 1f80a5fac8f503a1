// SPDX-License-Identifier: LGPL-3.0-or-later
// The possible switches at atomic operations: a countdown to the next one, so that the others cost next to nothing.
#pragma once

#include <cstdint>

namespace mauve::seeds {

/// To the next switch; without an end before begin().
extern constinit std::uint64_t atomics_left;

/// The countdown has ended: threads switch, and the next one begins.
void switch_at_atomic() noexcept;

/// Before and after each atomic operation.
inline void atomic_step() noexcept {
  if (--atomics_left == 0) [[unlikely]]
    switch_at_atomic();
}

}  // namespace mauve::seeds
