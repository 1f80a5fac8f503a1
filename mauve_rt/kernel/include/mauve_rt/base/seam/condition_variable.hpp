// SPDX-License-Identifier: LGPL-3.0-or-later
// ConditionVariable: ordinary threads wait for what others do under a Mutex.
#pragma once

#include <chrono>
#include <condition_variable>

#include "mauve_rt/base/seam/clocks.hpp"
#include "mauve_rt/base/seam/mutex.hpp"

namespace mauve {

/// All functions [non-rt]. A wait may end without a cause, too: in a loop that looks again.
class ConditionVariable {
 public:
  void notify_one() noexcept { system_.notify_one(); }
  void notify_all() noexcept { system_.notify_all(); }

  /// Of a mutex that the caller holds, and holds again afterwards.
  void wait(Mutex& mutex) MAUVE_REQUIRES(mutex) {
    std::unique_lock<std::mutex> lock(mutex.system_, std::adopt_lock);
    system_.wait(lock);
    lock.release();
  }
  /// At most until the instant; false: at the instant.
  bool wait_until(Mutex& mutex, time_ns_t instant_ns) MAUVE_REQUIRES(mutex) {
    const std::chrono::steady_clock::time_point until{std::chrono::nanoseconds(instant_ns)};
    std::unique_lock<std::mutex> lock(mutex.system_, std::adopt_lock);
    const bool is_in_time = system_.wait_until(lock, until) == std::cv_status::no_timeout;
    lock.release();
    return is_in_time;
  }

 private:
  std::condition_variable system_;
};

}  // namespace mauve
