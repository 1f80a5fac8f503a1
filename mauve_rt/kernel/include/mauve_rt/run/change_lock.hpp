// SPDX-License-Identifier: LGPL-3.0-or-later
// ChangeLock: under it one thread at a time reads and changes what an architecture consists of.
#pragma once

#include "mauve_rt/base/seam/condition_variable.hpp"

namespace mauve {

/// A change holds it from its draft to its retirement, except in a Pause: there it prepares its parts and waits for its
/// components, which it has claimed (ChangeMark), and other changes go on. Ordinary threads.
///
/// | member  | written by       | read by | under  |
/// | ------- | ---------------- | ------- | ------ |
/// | paused_ | changes          | changes | mutex_ |
class MAUVE_LOCK ChangeLock {
 public:
  /// Waits for the thread that holds it. [non-rt]
  /// Throws Error (would_deadlock) from inside a change, by a hook of a part, and as check_caller().
  void lock() MAUVE_ACQUIRE();
  /// The same, and waits for the changes that are paused. [non-rt] Throws as lock().
  void lock_alone() MAUVE_ACQUIRE();
  /// Only where no thread holds it, and the calling thread is not inside a change; not on a component's own thread. [non-rt]
  bool try_lock() noexcept MAUVE_TRY_ACQUIRE(true);
  void unlock() noexcept MAUVE_RELEASE();
  /// lock(), or lock_alone(), unless the calling thread is inside a change. [non-rt] Throws as check_caller().
  [[nodiscard]] std::unique_lock<ChangeLock> join() MAUVE_LOCKS_UNSEEN;
  [[nodiscard]] std::unique_lock<ChangeLock> join_alone() MAUVE_LOCKS_UNSEEN;
  /// Whether the calling thread holds it: it is inside a change, and not in a Pause. [non-rt]
  bool is_held_here() const noexcept;
  /// Lets others have it until one of them gives it back, at most for 1 ms. [non-rt]
  void wait_for_others() MAUVE_LOCKS_UNSEEN;  // who has the lock has mutex_
  /// Throws Error (would_deadlock) on a component's own thread: a change waits for that one to come to a wait. [non-rt]
  static void check_caller();

  /// While it lives other threads can have the lock, and the calling thread is inside its change still. [non-rt]
  class Pause {
   public:
    explicit Pause(ChangeLock& lock);
    ~Pause();
    Pause(const Pause&) = delete;
    Pause& operator=(const Pause&) = delete;

   private:
    ChangeLock& lock_;
  };

  /// While it lives the calling thread counts as inside the change of another thread, which waits for it. [non-rt]
  class Inside {
   public:
    explicit Inside(const ChangeLock& lock);
    ~Inside();
    Inside(const Inside&) = delete;
    Inside& operator=(const Inside&) = delete;

   private:
    const ChangeLock& lock_;
  };

 private:
  void check_outside() const;
  bool is_inside() const noexcept;

  Mutex mutex_;
  ConditionVariable given_back_;
  int paused_ MAUVE_GUARDED_BY(mutex_){0};
};

}  // namespace mauve
