// SPDX-License-Identifier: LGPL-3.0-or-later
// The thread of a task: how it is made, and what it does between two steps of the machine.
#include <sys/prctl.h>

#include <cerrno>
#include <cstring>

#include "mauve_rt/base/error.hpp"
#include "mauve_rt/base/seam/futex.hpp"
#include "mauve_rt/run/task.hpp"
#include "mauve_rt/run/watchdog.hpp"

namespace mauve {

namespace {

constexpr time_ns_t kReadyTimeout = s_to_ns(1);
/// How long before its first release a thread wakes once: what it needs is in the caches then, and the first releases of
/// components deployed together come closer than those of threads that wake from a long sleep (here 2 times).
constexpr time_ns_t kWarmUp = us_to_ns(300);

thread_local const Task* task_of_this_thread = nullptr;
thread_local const Task* task_simulated_here = nullptr;

}  // namespace

void Task::create_thread(Barrier* barrier, bool require_realtime, bool trace,
                         std::shared_ptr<Watchdog> watchdog) {
  if (!end_thread(0)) throw_state_running("the component's thread has not ended", 0, kLeftBehindRemedy);
  const LockGuard lock(command_mutex_);
  watchdog_ = std::move(watchdog);
  machine_.set_watchdog(watchdog_.get());
  demoted_ = false;
  barrier_ = barrier;
  begin_trace(trace);
  begin_log();
  parked_.store(1, std::memory_order_relaxed);  // relaxed: the thread does not exist yet
  ended_.store(0, std::memory_order_relaxed);
  ready_.store(0, std::memory_order_relaxed);

  const int result = thread_.start({.name = name_,
                                    .priority = settings_.priority,
                                    .cpus = settings_.cpus,
                                    .stack_bytes = settings_.stack_bytes,
                                    .require_realtime = require_realtime},
                                   &Task::thread_entry, this);
  if (result == EPERM) {
    throw Error(ErrorCode::realtime_denied, "the system refuses a SCHED_FIFO thread",
                {.component = name_,
                 .expected = "the right to priority " + std::to_string(settings_.priority),
                 .remedy = "raise the rtprio limit, or do not require real time"});
  }
  if (result != 0) {
    throw Error(ErrorCode::invalid_argument,
                std::string("the system refuses the thread: ") + std::strerror(result),
                {.component = name_, .remedy = "check priority, cpus and stack_bytes"});
  }
  facts_ = thread_.facts();
  thread_.prefault_stack();  // no state of the component is to wait for a page
  has_thread_.store(true, std::memory_order_release);
  if (watchdog_ != nullptr) watchdog_->watch(*this);
  // At deployment nothing runs yet; later, more urgent components may keep it from its processor.
  const time_ns_t until = barrier != nullptr ? kForever : monotonic_now_ns() + kReadyTimeout;
  while (ready_.load(std::memory_order_acquire) == 0) {
    if (futex_wait_until(ready_, 0, until) || ready_.load(std::memory_order_acquire) != 0) continue;
    throw Error(ErrorCode::timeout, "the component's thread does not get to run",
                {.component = name_,
                 .element = "priority " + std::to_string(settings_.priority),
                 .remedy = "look for a component of equal or higher priority that does not wait"});
  }
}

const Task* Task::executing_here() noexcept {
  return MAUVE_RT_TRUSTED(task_of_this_thread != nullptr ? task_of_this_thread : task_simulated_here);
}

void Task::set_simulated_here(const Task* task) noexcept { MAUVE_RT_TRUSTED(task_simulated_here = task); }

void* Task::thread_entry(void* self) noexcept {
  static_cast<Task*>(self)->thread_main();
  return nullptr;
}

void Task::thread_main() noexcept {
  set_of_this_thread(this);
  task_of_this_thread = this;
  locks_held_ = &PiMutex::count_of_this_thread();
  TraceRing::set_for_this_thread(ring_.get());
  LogRing::set_for_this_thread(log_ring_.get());
  prctl(PR_SET_TIMERSLACK, 1UL);  // of use where SCHED_FIFO was refused
  counters_.attach();
  ready_.store(1, std::memory_order_release);
  futex_wake_all(ready_);
  if (barrier_ != nullptr) barrier_->arrive_and_wait();
  for (;;) {
    const std::uint32_t control = control_.load(std::memory_order_acquire);
    if (!machine_.is_started() && (control & kExit) != 0) break;
    if (!must_act(control)) {
      if (!machine_.is_started()) {
        futex_wait_until(control_, control, kForever);
        continue;
      }
      // Bits not acted on now stay in the word; any further command changes it and ends the sleep.
      if (!clock().sleep_until(due_ns() - (machine_.is_cold() ? kWarmUp : 0), control_, control)) continue;
      if (machine_.is_cold()) machine_.warm_up();
    }
    resume();
  }
  counters_.detach();
  // seq_cst: a commit posted this moment is found here, or post() finds that the thread has ended
  ended_.store(1, std::memory_order_seq_cst);
  settle_slot(true);
  release_withdrawn();
  end_wait_for_start();  // one that a change posted and this thread has not taken up
  futex_wake_all(ended_);
}

bool Task::must_act(std::uint32_t control) noexcept {
  if (!machine_.is_started()) return (control & (kStart | kCommit)) != 0;
  if ((control & kStop) != 0)  // relaxed: its own
    return !is_ramping_.load(std::memory_order_relaxed) || (control & (kCommit | kExit | kAtOnce)) != 0;
  if ((control & kEvent) != 0 && !machine_.is_settled()) return true;
  return (control & (kCommit | kRevert)) != 0;
}

}  // namespace mauve
