// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/base/seam/inheriting_lock.hpp"

#include "mauve_rt/base/error.hpp"
#include "mauve_rt/base/seam/sleep.hpp"

#include "base/seam/timespec.hpp"

namespace mauve {

InheritingLock::InheritingLock() {
  pthread_mutexattr_t attributes;
  pthread_mutexattr_init(&attributes);
  pthread_mutexattr_setprotocol(&attributes, PTHREAD_PRIO_INHERIT);
  pthread_mutexattr_settype(&attributes, PTHREAD_MUTEX_ERRORCHECK);
  const int result = pthread_mutex_init(&mutex_, &attributes);
  pthread_mutexattr_destroy(&attributes);
  if (result != 0) throw Error(ErrorCode::internal, "the system has no priority-inheritance mutexes");
}

bool InheritingLock::try_lock_until(time_ns_t instant_ns) noexcept {
#if !defined(__SANITIZE_THREAD__)  // it does not know the timed lock of the monotonic clock
  const timespec until = to_timespec(instant_ns);
  const int result = MAUVE_RT_TRUSTED(pthread_mutex_clocklock(&mutex_, CLOCK_MONOTONIC, &until));
  if (result != EINVAL) return result == 0;  // else the system has no timed lock with inheritance
#endif
  constexpr time_ns_t kBetweenTries = us_to_ns(50);
  while (!try_lock()) {
    if (monotonic_now_ns() >= instant_ns) return false;
    sleep_for(kBetweenTries);
  }
  return true;
}

}  // namespace mauve
