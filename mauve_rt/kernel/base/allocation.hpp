// SPDX-License-Identifier: LGPL-3.0-or-later
// The replaced operators new count into the calling thread's counter.
#pragma once

#include <atomic>
#include <cstdint>

namespace mauve {

/// The counter that the calling thread's allocations go to; nullptr, as in every ordinary thread: to none. [rt]
/// The first call in a thread may allocate the thread-local storage of this library.
std::atomic<std::uint64_t>* allocation_counter() noexcept;
void set_allocation_counter(std::atomic<std::uint64_t>* counter) noexcept;

}  // namespace mauve
