// SPDX-License-Identifier: LGPL-3.0-or-later
// What threads are made with: policy, processors, stack, signals, name; and what the system gave them.
#pragma once

#include <csignal>
#include <cstddef>
#include <string>
#include <vector>

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

}  // namespace mauve
