// SPDX-License-Identifier: LGPL-3.0-or-later
// A priority-inheritance mutex that traces contention and knows how many its thread holds.
#pragma once

#include <cstdint>

#include "mauve_rt/base/rt.hpp"
#include "mauve_rt/base/seam/atomic.hpp"
#include "mauve_rt/base/seam/inheriting_lock.hpp"
#include "mauve_rt/base/thread_safety.hpp"
#include "mauve_rt/base/time.hpp"

namespace mauve {

/// PTHREAD_PRIO_INHERIT mutex. Keep sections to a copy: a contended lock costs microseconds.
/// Its holder may not take it again. Who does gets it, rather than wait for itself for ever, and a component is FAULTED for
/// it at the end of the state; so is one that lets go of a lock that it does not hold.
///
/// | member    | written by            | under         | hot |
/// |-----------|-----------------------|---------------|-----|
/// | mutex_    | lock, unlock          | itself        | yes |
/// | holder_   | the thread that locks | mutex_        | yes |
/// | depth_    | lock, unlock          | mutex_        | yes |
/// | below_    | lock, unlock          | mutex_        | yes |
/// | trace_id_ | set_trace_id [setup]  | before start  | no  |
class MAUVE_LOCK PiMutex {
 public:
  PiMutex() = default;
  ~PiMutex();
  PiMutex(const PiMutex&) = delete;
  PiMutex& operator=(const PiMutex&) = delete;

  /// Locks; a wait is traced with the holder and its duration. [rt]
  void lock() MAUVE_RT MAUVE_ACQUIRE();
  /// Locks if free. [rt]
  bool try_lock() MAUVE_RT MAUVE_TRY_ACQUIRE(true);
  /// Locks, or gives up at the instant; whether it has. Not of one that the caller holds: false. [rt]
  bool try_lock_until(time_ns_t until_ns) MAUVE_RT MAUVE_TRY_ACQUIRE(true);
  /// Unlocks. [rt]
  void unlock() MAUVE_RT MAUVE_RELEASE();

  /// The name traced when the lock is contended. [setup]
  void set_trace_id(std::uint32_t id) noexcept { trace_id_ = id; }
  /// Whether the calling thread holds it. [rt]
  bool is_held_here() const MAUVE_RT;
  /// How many PiMutexes the calling thread holds; not 0 at a state boundary is a fault. [rt]
  static int held_by_this_thread() MAUVE_RT;
  /// The same for others to look at, while the calling thread lives. [rt]
  static const Atomic<int>& count_of_this_thread() MAUVE_RT;
  /// Unlocks what the calling thread has locked since it held so many. [rt]
  static void let_go_of_all_but(int held) MAUVE_RT MAUVE_LOCKS_UNSEEN;  // which, its list says
  /// Whether the calling thread has, since the last call, taken a lock twice or let go of one it did not hold. [rt]
  static bool was_misused_by_this_thread() MAUVE_RT;

 private:
  bool lock_contended() MAUVE_RT;
  void note_holder() MAUVE_RT;
  void forget_held() noexcept MAUVE_LOCKS_UNSEEN;  // the thread holds it, says its list

  InheritingLock mutex_;
  Atomic<std::int32_t> holder_{0};  // thread id, for the trace only
  std::uint32_t trace_id_{0};
  std::uint32_t depth_{0};   // how often its holder has taken it again
  PiMutex* below_{nullptr};  // the one that its holder had locked last before it
};

}  // namespace mauve
