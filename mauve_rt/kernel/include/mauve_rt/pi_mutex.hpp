// SPDX-License-Identifier: LGPL-3.0-or-later
// A priority-inheritance mutex that traces contention and knows how many its thread holds.
#pragma once

#include <pthread.h>

#include <atomic>
#include <cstdint>

namespace mauve {

/// PTHREAD_PRIO_INHERIT mutex. Keep sections to a copy: a contended lock costs microseconds.
///
/// | member    | written by            | under         | hot |
/// |-----------|-----------------------|---------------|-----|
/// | mutex_    | lock, unlock          | itself        | yes |
/// | holder_   | the thread that locks | mutex_        | yes |
/// | trace_id_ | set_trace_id [setup]  | before start  | no  |
class PiMutex {
 public:
  PiMutex();
  ~PiMutex();
  PiMutex(const PiMutex&) = delete;
  PiMutex& operator=(const PiMutex&) = delete;

  /// Locks; a wait is traced with the holder and its duration. [rt]
  void lock() noexcept;
  /// Locks if free. [rt]
  bool try_lock() noexcept;
  /// Unlocks. [rt]
  void unlock() noexcept;

  /// The name traced when the lock is contended. [setup]
  void set_trace_id(std::uint32_t id) noexcept { trace_id_ = id; }
  /// How many PiMutexes the calling thread holds; not 0 at a state boundary is a fault. [rt]
  static int held_by_this_thread() noexcept;
  /// The same for others to look at, while the calling thread lives. [rt]
  static const std::atomic<int>& count_of_this_thread() noexcept;

 private:
  void lock_contended() noexcept;
  void note_holder() noexcept;

  pthread_mutex_t mutex_;
  std::atomic<std::int32_t> holder_{0};  // thread id, for the trace only
  std::uint32_t trace_id_{0};
};

}  // namespace mauve
