// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/base/seam/futex.hpp"

#include <linux/futex.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <climits>

#include "base/seam/timespec.hpp"

namespace mauve {

namespace {

static_assert(sizeof(Atomic<std::uint32_t>) == sizeof(std::uint32_t), "the futex word is the atomic itself");
static_assert(kFutexHolder == FUTEX_TID_MASK);

/// Returns 0, or the error's number.
int futex(const Atomic<std::uint32_t>& word, int operation, std::uint32_t value, const timespec* until)
    MAUVE_RT {
  // The one call of the system that [rt] allows.
  return MAUVE_RT_TRUSTED(syscall(SYS_futex, reinterpret_cast<const std::uint32_t*>(&word), operation, value,
                                  until, nullptr, FUTEX_BITSET_MATCH_ANY) >= 0
                              ? 0
                              : errno);
}

}  // namespace

bool futex_wait_until(const Atomic<std::uint32_t>& word, std::uint32_t expected,
                      time_ns_t until_ns) noexcept {
  until_ns = std::max<time_ns_t>(0, until_ns);  // the system refuses instants before its clock began
  const timespec until = to_timespec(until_ns);
  for (;;) {
    // FUTEX_WAIT_BITSET: the timeout is an absolute instant of CLOCK_MONOTONIC
    const int error =
        futex(word, FUTEX_WAIT_BITSET_PRIVATE, expected, until_ns == kForever ? nullptr : &until);
    if (error == ETIMEDOUT) return false;
    if (error != EINTR) return true;  // 0: woken; EAGAIN: the word had changed already
  }
}

void futex_wake_all(const Atomic<std::uint32_t>& word) noexcept {
  futex(word, FUTEX_WAKE_BITSET_PRIVATE, static_cast<std::uint32_t>(INT_MAX), nullptr);
}

bool futex_lock_pi(Atomic<std::uint32_t>& word) noexcept {
  return futex(word, FUTEX_LOCK_PI_PRIVATE, 0, nullptr) == 0;
}

bool futex_unlock_pi(Atomic<std::uint32_t>& word) noexcept {
  return futex(word, FUTEX_UNLOCK_PI_PRIVATE, 0, nullptr) == 0;
}

}  // namespace mauve
