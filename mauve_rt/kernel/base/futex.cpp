// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/base/futex.hpp"

#include <linux/futex.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <climits>
#include <ctime>

namespace mauve {

namespace {

static_assert(sizeof(std::atomic<std::uint32_t>) == sizeof(std::uint32_t),
              "the futex word is the atomic itself");

long futex(const std::atomic<std::uint32_t>& word, int operation, std::uint32_t value,
           const timespec* until) noexcept {
  return syscall(SYS_futex, reinterpret_cast<const std::uint32_t*>(&word), operation, value, until, nullptr,
                 FUTEX_BITSET_MATCH_ANY);
}

}  // namespace

bool futex_wait_until(const std::atomic<std::uint32_t>& word, std::uint32_t expected,
                      time_ns_t until_ns) noexcept {
  const timespec until{.tv_sec = until_ns / s_to_ns(1), .tv_nsec = until_ns % s_to_ns(1)};
  for (;;) {
    // FUTEX_WAIT_BITSET: the timeout is an absolute instant of CLOCK_MONOTONIC
    if (futex(word, FUTEX_WAIT_BITSET_PRIVATE, expected, until_ns == kForever ? nullptr : &until) == 0)
      return true;
    if (errno == ETIMEDOUT) return false;
    if (errno != EINTR) return true;  // EAGAIN: the word had changed already
  }
}

void futex_wake_all(const std::atomic<std::uint32_t>& word) noexcept {
  futex(word, FUTEX_WAKE_BITSET_PRIVATE, static_cast<std::uint32_t>(INT_MAX), nullptr);
}

}  // namespace mauve
