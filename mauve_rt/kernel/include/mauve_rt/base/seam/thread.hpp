// SPDX-License-Identifier: LGPL-3.0-or-later
// Thread: one of the process, made as its settings say.
#pragma once

#include <pthread.h>
#include <time.h>

#include "mauve_rt/base/rt.hpp"
#include "mauve_rt/base/seam/clocks.hpp"
#include "mauve_rt/base/seam/thread_settings.hpp"

namespace mauve {

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
  /// The CPU time that it has used, as thread_cpu_now_ns() says on the thread itself; 0: it has ended. [rt]
  time_ns_t cpu_now_ns() const MAUVE_RT;

 private:
  pthread_t handle_{};
  clockid_t cpu_clock_{};  // from the start: a handle of a thread that was joined may not be asked
};

}  // namespace mauve
