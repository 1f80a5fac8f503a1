// SPDX-License-Identifier: LGPL-3.0-or-later
// Thread under the seeded scheduler: SCHED_FIFO is always granted, processors are ignored.
#pragma once

#include <pthread.h>

#include <csignal>
#include <cstddef>
#include <string>
#include <vector>

#include "mauve_rt/base/rt.hpp"

#include "seeds/scheduler.hpp"

namespace mauve {

inline constexpr std::size_t kStackGuardBytes = std::size_t{1024} * 1024;

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

/// No signal comes: the caller waits for ever.
int await_signal(const sigset_t& signals) noexcept;

struct ThreadSettings {
  std::string name;
  int priority{0};
  std::vector<int> cpus{};
  std::size_t stack_bytes{0};
  bool require_realtime{false};
};

struct ThreadFacts {
  std::string policy;
  int priority{0};
  std::vector<int> cpus;
  std::size_t guard_bytes{0};
};

class Thread {
 public:
  int start(const ThreadSettings& settings, void* (*entry)(void*), void* argument);
  void join() noexcept { seeds::join(*thread_); }
  void detach() noexcept {}
  ThreadFacts facts() const;
  void prefault_stack() const noexcept {}
  pthread_t handle() const MAUVE_RT { return seeds::handle(*thread_); }

 private:
  seeds::Thread* thread_{nullptr};
  std::vector<int> cpus_;
};

}  // namespace mauve
