// SPDX-License-Identifier: LGPL-3.0-or-later
// Messages that went through the bridge, kept for a recorder.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "mauve_rt/base/seam/atomic.hpp"
#include "mauve_rt/base/seam/mutex.hpp"
#include "mauve_rt/base/time.hpp"

namespace mauve::bridge {

/// A message as it was sent or received.
struct LoggedMessage {
  std::size_t topic;  // as Bridge numbers them
  time_ns_t time_ns;
  std::vector<std::byte> data;
};

/// Grows up to a limit between two looks of the recorder; what exceeds it is dropped and counted.
///
/// | member           | written by                     | under                                             |
/// | ---------------- | ------------------------------ | ------------------------------------------------- |
/// | messages_ ...    | the bridge's threads, take()   | mutex_                                            |
/// | enabled_         | enable()                       | relaxed: whether a message of now is logged is    |
/// |                  |                                | anyone's guess while it changes                   |
class TopicLog {
 public:
  static constexpr std::size_t kMaxBytes = 64UL << 20U;

  /// [non-rt]
  void enable(bool on) noexcept { enabled_.store(on, std::memory_order_relaxed); }
  /// [non-rt]
  void add(std::size_t topic, time_ns_t time_ns, std::span<const std::byte> data) {
    if (!enabled_.load(std::memory_order_relaxed)) return;
    const LockGuard lock(mutex_);
    if (bytes_ + data.size() > kMaxBytes) {
      ++dropped_;
      return;
    }
    bytes_ += data.size();
    messages_.push_back({.topic = topic, .time_ns = time_ns, .data = {data.begin(), data.end()}});
  }
  /// What came since the last call. [non-rt]
  std::vector<LoggedMessage> take() {
    const LockGuard lock(mutex_);
    bytes_ = 0;
    return std::exchange(messages_, {});
  }
  /// Messages that found no room so far. [non-rt]
  std::uint64_t dropped() {
    const LockGuard lock(mutex_);
    return dropped_;
  }

 private:
  Atomic<bool> enabled_{false};
  Mutex mutex_;
  std::vector<LoggedMessage> messages_ MAUVE_GUARDED_BY(mutex_);
  std::size_t bytes_ MAUVE_GUARDED_BY(mutex_){0};
  std::uint64_t dropped_ MAUVE_GUARDED_BY(mutex_){0};
};

}  // namespace mauve::bridge
