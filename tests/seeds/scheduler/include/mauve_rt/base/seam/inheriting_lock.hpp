// SPDX-License-Identifier: LGPL-3.0-or-later
// InheritingLock under the seeded scheduler.
#pragma once

#include "mauve_rt/base/rt.hpp"

#include "seeds/scheduler.hpp"

namespace mauve {

class InheritingLock {
 public:
  InheritingLock() = default;
  InheritingLock(const InheritingLock&) = delete;
  InheritingLock& operator=(const InheritingLock&) = delete;

  bool lock() MAUVE_RT { return lock_.lock(); }
  bool try_lock() MAUVE_RT { return lock_.try_lock(); }
  bool try_lock_until(time_ns_t instant_ns) MAUVE_RT { return lock_.lock_until(instant_ns); }
  void unlock() MAUVE_RT { lock_.unlock(); }

 private:
  seeds::Lock lock_{false, true};
};

}  // namespace mauve
