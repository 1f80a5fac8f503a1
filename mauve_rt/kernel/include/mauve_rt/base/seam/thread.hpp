// SPDX-License-Identifier: LGPL-3.0-or-later
// Thread: one of the process, made as its settings say.
#pragma once

#include <pthread.h>

#include "mauve_rt/base/rt.hpp"
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

 private:
  pthread_t handle_{};
};

}  // namespace mauve
