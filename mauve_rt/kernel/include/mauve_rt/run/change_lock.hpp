// SPDX-License-Identifier: LGPL-3.0-or-later
// ChangeLock: under it an architecture is changed, one change at a time.
#pragma once

#include <atomic>
#include <mutex>
#include <thread>

namespace mauve {

/// Held from a change's draft to its retirement, hooks of parts included. Ordinary threads.
///
/// | member  | written by      | read by | order                                                        |
/// | ------- | --------------- | ------- | ------------------------------------------------------------ |
/// | holder_ | who holds mutex_| anyone  | relaxed: a thread finds itself only where it has put itself  |
class ChangeLock {
 public:
  /// Waits for the change under way. [non-rt]
  /// Throws Error (would_deadlock) from inside that change, by a hook of a part, and as check_caller().
  void lock();
  /// Only where no change is under way, this thread's included; not on a component's own thread. [non-rt]
  bool try_lock() noexcept;
  void unlock() noexcept;
  /// Whether the calling thread holds it: it is inside a change. [non-rt]
  bool is_held_here() const noexcept {
    return holder_.load(std::memory_order_relaxed) == std::this_thread::get_id();
  }
  /// Held by the calling thread when it was not yet, until what is returned goes. [non-rt] Throws as check_caller().
  [[nodiscard]] std::unique_lock<ChangeLock> join();
  /// Throws Error (would_deadlock) on a component's own thread: a change waits for that one to come to a wait. [non-rt]
  static void check_caller();

 private:
  std::mutex mutex_;
  std::atomic<std::thread::id> holder_{};
};

}  // namespace mauve
