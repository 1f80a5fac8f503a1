// SPDX-License-Identifier: LGPL-3.0-or-later
// ConditionVariable under the seeded scheduler.
#pragma once

#include "mauve_rt/base/seam/clocks.hpp"
#include "mauve_rt/base/seam/mutex.hpp"

namespace mauve {

class ConditionVariable {
 public:
  ConditionVariable() = default;
  ConditionVariable(const ConditionVariable&) = delete;
  ConditionVariable& operator=(const ConditionVariable&) = delete;

  void notify_one() noexcept {
    seeds::step(seeds::Call::condition_notify);
    seeds::wake_one(this);
  }
  void notify_all() noexcept {
    seeds::step(seeds::Call::condition_notify);
    seeds::wake_all(this);
  }
  void wait(Mutex& mutex) MAUVE_REQUIRES(mutex) { wait_until(mutex, INT64_MAX); }
  bool wait_until(Mutex& mutex, time_ns_t instant_ns) MAUVE_REQUIRES(mutex) {
    seeds::step(seeds::Call::condition_wait);
    mutex.lock_.release();
    const bool is_in_time = seeds::block(seeds::Call::condition_wait, this, instant_ns, true);
    mutex.lock_.lock();
    return is_in_time;
  }
};

}  // namespace mauve
