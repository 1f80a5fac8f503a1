// SPDX-License-Identifier: LGPL-3.0-or-later
// The watchdog: finds states that last longer than they declared, while they last. It does not poll.
#pragma once

#include <cstdint>
#include <vector>

#include "mauve_rt/base/pi_mutex.hpp"
#include "mauve_rt/base/seam/atomic.hpp"
#include "mauve_rt/base/seam/futex.hpp"
#include "mauve_rt/base/seam/thread.hpp"
#include "mauve_rt/base/time.hpp"

namespace mauve {

class Task;

/// A thread above all components (SCHED_FIFO where that is granted) that sleeps until the earliest instant at which an
/// execution can be over its bound, for ever where nobody declares one; and a second one that writes the outputs for which
/// the first would have to wait. It allocates nothing and waits for no lock but its own.
///
/// Before a look it says that whoever begins a bounded execution from now on is to wake it; after the look, up to which
/// instant. So a component wakes it only when its execution ends before the next look, which is at most one in a
/// millisecond.
///
/// | member              | written by                   | read by     | order                                             |
/// | ------------------- | ---------------------------- | ----------- | ------------------------------------------------- |
/// | wake_before_ns_     | the thread                   | components  | seq_cst, as the begin of an execution: either the |
/// |                     |                              |             | look sees the execution, or the component this    |
/// | alarm_ (futex)      | components, stop()           | the thread  | acq_rel: why it was woken                         |
/// | left_ (futex)       | the thread, stop()           | the writer  | acq_rel: likewise                                 |
/// | ending_             | stop()                       | both        | release/acquire                                   |
/// | tasks_              | ordinary threads             | both        | tasks_mutex_ (PI)                                 |
/// | looks_              | the thread                   | anyone      | relaxed: a lone fact                              |
class Watchdog {
 public:
  /// Starts both threads. [setup] Throws Error (internal) when the system refuses them.
  Watchdog();
  ~Watchdog();
  Watchdog(const Watchdog&) = delete;
  Watchdog& operator=(const Watchdog&) = delete;

  /// [non-rt]
  void watch(Task& task);
  /// After this it does not refer to the task any more. [non-rt]
  void forget(Task& task) noexcept;
  /// Ends both threads. [non-rt]
  void stop() noexcept;

  /// By a component that has begun an execution which must end by then. [rt]
  void expect_end(time_ns_t end_ns) MAUVE_RT {
    // seq_cst: a plain load on the usual machines; see above
    if (end_ns < wake_before_ns_.load(std::memory_order_seq_cst)) [[unlikely]]
      wake();
  }
  /// Has the outputs written that a component that timed out lacks because of a lock. [rt]
  void write_what_is_left() MAUVE_RT;
  /// How often it has looked. [non-rt]
  std::uint64_t looks() const noexcept { return looks_.load(std::memory_order_relaxed); }

 private:
  static void* watch_entry(void* self) noexcept;
  static void* write_entry(void* self) noexcept;
  void run() noexcept;
  time_ns_t look(time_ns_t now_ns) noexcept;
  void write_left_outputs() noexcept;
  Task* next_left(std::size_t& place) noexcept;
  void wake() MAUVE_RT;

  Thread watcher_;
  Thread writer_;
  bool runs_{false};
  PiMutex tasks_mutex_;
  std::vector<Task*> tasks_ MAUVE_GUARDED_BY(tasks_mutex_);
  Atomic<time_ns_t> wake_before_ns_{kForever};
  Atomic<std::uint32_t> alarm_{0};
  Atomic<std::uint32_t> left_{0};
  Atomic<std::uint32_t> ending_{0};
  Atomic<std::uint64_t> looks_{0};
};

}  // namespace mauve
