// SPDX-License-Identifier: LGPL-3.0-or-later
// ConditionVariable: ordinary threads wait for what others do under a Mutex.
#pragma once

#include <chrono>
#include <condition_variable>

#include "mauve_rt/base/seam/clocks.hpp"
#include "mauve_rt/base/seam/mutex.hpp"

namespace mauve {

/// All functions [non-rt]. Waits may end without a cause: look again.
class ConditionVariable {
 public:
  void notify_one() noexcept { system_.notify_one(); }
  void notify_all() noexcept { system_.notify_all(); }

  void wait(std::unique_lock<Mutex>& lock) { system_.wait(lock); }
  /// At most until the instant; false: at the instant.
  bool wait_until(std::unique_lock<Mutex>& lock, time_ns_t instant_ns) {
    const std::chrono::steady_clock::time_point until{std::chrono::nanoseconds(instant_ns)};
    return system_.wait_until(lock, until) == std::cv_status::no_timeout;
  }

 private:
  std::condition_variable system_;
};

}  // namespace mauve
