// SPDX-License-Identifier: LGPL-3.0-or-later
// InheritingLock: the system's mutex with priority inheritance. PiMutex is made of one.
#pragma once

#include <pthread.h>

#include <cerrno>

#include "mauve_rt/base/rt.hpp"
#include "mauve_rt/base/seam/clocks.hpp"

namespace mauve {

/// PTHREAD_PRIO_INHERIT, PTHREAD_MUTEX_ERRORCHECK. A wait is bounded by the section of the holder, which inherits the priority.
class InheritingLock {
 public:
  /// Throws Error (internal) where the system has no such mutex.
  InheritingLock();
  ~InheritingLock() { pthread_mutex_destroy(&mutex_); }
  InheritingLock(const InheritingLock&) = delete;
  InheritingLock& operator=(const InheritingLock&) = delete;

  /// False where the caller holds it. [rt]
  bool lock() MAUVE_RT { return MAUVE_RT_TRUSTED(pthread_mutex_lock(&mutex_)) != EDEADLK; }
  /// [rt]
  bool try_lock() MAUVE_RT { return MAUVE_RT_TRUSTED(pthread_mutex_trylock(&mutex_)) == 0; }
  /// False at the instant, or where the caller holds it. [rt]
  bool try_lock_until(time_ns_t instant_ns) MAUVE_RT;
  /// By its holder. [rt]
  void unlock() MAUVE_RT { MAUVE_RT_TRUSTED(pthread_mutex_unlock(&mutex_)); }

 private:
  pthread_mutex_t mutex_;
};

}  // namespace mauve
