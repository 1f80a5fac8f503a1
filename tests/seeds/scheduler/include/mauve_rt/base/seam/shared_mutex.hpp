// SPDX-License-Identifier: LGPL-3.0-or-later
// SharedMutex under the seeded scheduler.
#pragma once

#include <mutex>
#include <shared_mutex>

#include "seeds/scheduler.hpp"

namespace mauve {

class SharedMutex {
 public:
  SharedMutex() = default;
  SharedMutex(const SharedMutex&) = delete;
  SharedMutex& operator=(const SharedMutex&) = delete;

  void lock() {
    seeds::step(seeds::Call::lock);
    while (is_written_ || readers_ != 0) seeds::block(seeds::Call::lock, this, INT64_MAX, false);
    is_written_ = true;
  }
  bool try_lock() {
    seeds::step(seeds::Call::try_lock);
    if (is_written_ || readers_ != 0) return false;
    return is_written_ = true;
  }
  void unlock() {
    is_written_ = false;
    seeds::wake_all(this);
    seeds::step(seeds::Call::unlock);
  }
  void lock_shared() {
    seeds::step(seeds::Call::lock_shared);
    while (is_written_) seeds::block(seeds::Call::lock_shared, this, INT64_MAX, false);
    ++readers_;
  }
  bool try_lock_shared() {
    seeds::step(seeds::Call::try_lock);
    if (is_written_) return false;
    ++readers_;
    return true;
  }
  void unlock_shared() {
    if (--readers_ == 0) seeds::wake_all(this);
    seeds::step(seeds::Call::unlock);
  }

 private:
  bool is_written_{false};
  int readers_{0};
};

}  // namespace mauve
