// SPDX-License-Identifier: LGPL-3.0-or-later
// How the kernel's real-time threads are made.
#pragma once

#include <pthread.h>

#include <cstddef>

namespace mauve {

/// Below each stack lies memory that nobody may touch: what is too large for the stack ends the process there, and does
/// not overwrite what lies beyond. The usual 4 KiB are jumped over by one large variable; code that is compiled with
/// -fstack-clash-protection, as all that links mauve_rt::kernel, meets any guard, other libraries at least this one.
/// Address space only: a guard has no pages that could be held, or locked, in memory.
inline constexpr std::size_t kStackGuardBytes = std::size_t{1024} * 1024;

/// SCHED_FIFO of a priority, on a stack with such a guard.
class ThreadAttributes {
 public:
  ThreadAttributes(std::size_t stack_bytes, int priority) noexcept {
    pthread_attr_init(&value);
    pthread_attr_setstacksize(&value, stack_bytes);
    pthread_attr_setguardsize(&value, kStackGuardBytes);
    pthread_attr_setinheritsched(&value, PTHREAD_EXPLICIT_SCHED);
    set_policy(SCHED_FIFO, priority);
  }
  ~ThreadAttributes() { pthread_attr_destroy(&value); }
  ThreadAttributes(const ThreadAttributes&) = delete;
  ThreadAttributes& operator=(const ThreadAttributes&) = delete;

  void set_policy(int policy, int priority) noexcept {
    const sched_param scheduling{.sched_priority = priority};
    pthread_attr_setschedpolicy(&value, policy);
    pthread_attr_setschedparam(&value, &scheduling);
  }

  pthread_attr_t value;
};

}  // namespace mauve
