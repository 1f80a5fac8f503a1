// SPDX-License-Identifier: LGPL-3.0-or-later
// How the threads of the process are made: policy, processors, stack, signals, name.
#pragma once

#include <pthread.h>

#include <csignal>
#include <cstddef>
#include <string>
#include <vector>

#include "mauve_rt/base/rt.hpp"

namespace mauve {

/// Below each stack lies memory that nobody may touch: what is too large for the stack ends the process there, and does
/// not overwrite what lies beyond. The usual 4 KiB are jumped over by one large variable; code that is compiled with
/// -fstack-clash-protection, as all that links mauve_rt::kernel, meets any guard, other libraries at least this one.
/// Address space only: a guard has no pages that could be held, or locked, in memory.
inline constexpr std::size_t kStackGuardBytes = std::size_t{1024} * 1024;

/// Blocks every signal on the calling thread for as long as it lives; threads made meanwhile inherit that, for signals are
/// the process's business. [non-rt]
class SignalsBlocked {
 public:
  SignalsBlocked() noexcept {
    sigset_t all;
    sigfillset(&all);
    pthread_sigmask(SIG_SETMASK, &all, &before_);
  }
  ~SignalsBlocked() { pthread_sigmask(SIG_SETMASK, &before_, nullptr); }
  SignalsBlocked(const SignalsBlocked&) = delete;
  SignalsBlocked& operator=(const SignalsBlocked&) = delete;

 private:
  sigset_t before_;
};

/// Waits for one of the signals, which the threads of the process block; which one came. [non-rt]
int await_signal(const sigset_t& signals) noexcept;

struct ThreadSettings {
  std::string name;              // 15 characters of it
  int priority{0};               // SCHED_FIFO; 0: an ordinary thread
  std::vector<int> cpus{};       // empty: any
  std::size_t stack_bytes{0};    // 0: what the system gives
  bool require_realtime{false};  // else an ordinary thread where SCHED_FIFO is refused
};

/// What the system gave the thread, read back from it.
struct ThreadFacts {
  std::string policy;
  int priority{0};
  std::vector<int> cpus;
  std::size_t guard_bytes{0};  // below its stack
};

/// A thread with all signals blocked. Whoever starts it joins or detaches it.
class Thread {
 public:
  /// As pthread_create: 0, or why not. [non-rt]
  int start(const ThreadSettings& settings, void* (*entry)(void*), void* argument);
  /// [non-rt]
  void join() noexcept { pthread_join(handle_, nullptr); }
  void detach() noexcept { pthread_detach(handle_); }
  /// Of one that runs. [non-rt]
  ThreadFacts facts() const;
  /// Touches its whole stack, at its full declared length, so that none of it faults later. [setup]
  void prefault_stack() const noexcept;
  /// [rt]
  pthread_t handle() const MAUVE_RT { return handle_; }

 private:
  pthread_t handle_{};
};

}  // namespace mauve
