// SPDX-License-Identifier: LGPL-3.0-or-later
// How the kernel's real-time threads are made.
#pragma once

#include <alloca.h>
#include <pthread.h>

#include <cerrno>
#include <csignal>
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

/// A thread of the kernel's own, all signals blocked; an ordinary one where SCHED_FIFO is refused. As pthread_create.
inline int start_thread(pthread_t& thread, ThreadAttributes& attributes, void* (*entry)(void*),
                        void* argument) noexcept {
  sigset_t all_signals;
  sigset_t callers_signals;
  sigfillset(&all_signals);
  pthread_sigmask(SIG_SETMASK, &all_signals, &callers_signals);  // the new thread inherits it
  int result = pthread_create(&thread, &attributes.value, entry, argument);
  if (result == EPERM) {
    attributes.set_policy(SCHED_OTHER, 0);
    result = pthread_create(&thread, &attributes.value, entry, argument);
  }
  pthread_sigmask(SIG_SETMASK, &callers_signals, nullptr);
  return result;
}

/// Touches so much of the calling thread's stack that none of it faults later. [setup]
[[gnu::noinline]] inline void touch_stack(std::size_t bytes) noexcept {
  constexpr std::size_t kPage = 4096;
  auto* pages = static_cast<volatile char*>(alloca(bytes));
  for (std::size_t offset = 0; offset < bytes; offset += kPage) pages[offset] = 0;
}

}  // namespace mauve
