// SPDX-License-Identifier: LGPL-3.0-or-later
// Thread under the seeded scheduler: SCHED_FIFO is always granted, processors are ignored.
#pragma once

#include <pthread.h>

#include <vector>

#include "mauve_rt/base/rt.hpp"
#include "mauve_rt/base/seam/thread_settings.hpp"

#include "seeds/scheduler.hpp"

namespace mauve {

class Thread {
 public:
  int start(const ThreadSettings& settings, void* (*entry)(void*), void* argument);
  void join() noexcept { seeds::join(*thread_); }
  void detach() noexcept {}
  ThreadFacts facts() const;
  void prefault_stack() const noexcept {}
  pthread_t handle() const MAUVE_RT { return seeds::handle(*thread_); }
  time_ns_t cpu_now_ns() const MAUVE_RT { return seeds::cpu_ns(*thread_); }

 private:
  seeds::Thread* thread_{nullptr};
  std::vector<int> cpus_;
};

}  // namespace mauve
