// SPDX-License-Identifier: LGPL-3.0-or-later
// Mutex under the seeded scheduler.
#pragma once

#include "mauve_rt/base/seam/guards.hpp"
#include "mauve_rt/base/thread_safety.hpp"

#include "seeds/scheduler.hpp"

namespace mauve {

template <bool is_recursive>
class MAUVE_LOCK SeededMutex {
 public:
  void lock() MAUVE_ACQUIRE() {
    if (!lock_.lock()) seeds::fail("a thread locks a mutex that it holds");
  }
  bool try_lock() MAUVE_TRY_ACQUIRE(true) { return lock_.try_lock(); }
  void unlock() MAUVE_RELEASE() { lock_.unlock(); }

 private:
  friend class ConditionVariable;

  seeds::Lock lock_{is_recursive, false};
};

using Mutex = SeededMutex<false>;
using RecursiveMutex = SeededMutex<true>;

}  // namespace mauve
