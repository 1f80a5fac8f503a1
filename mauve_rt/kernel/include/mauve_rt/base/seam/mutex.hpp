// SPDX-License-Identifier: LGPL-3.0-or-later
// Mutex: for ordinary threads. Where a thread of a component may come, PiMutex.
#pragma once

#include <mutex>

#include "mauve_rt/base/seam/guards.hpp"
#include "mauve_rt/base/thread_safety.hpp"

namespace mauve {

/// All functions [non-rt].
template <typename System>
class MAUVE_LOCK SystemMutex {
 public:
  void lock() MAUVE_ACQUIRE() { system_.lock(); }
  bool try_lock() MAUVE_TRY_ACQUIRE(true) { return system_.try_lock(); }
  void unlock() MAUVE_RELEASE() { system_.unlock(); }

 private:
  friend class ConditionVariable;

  System system_;
};

using Mutex = SystemMutex<std::mutex>;
using RecursiveMutex = SystemMutex<std::recursive_mutex>;

}  // namespace mauve
