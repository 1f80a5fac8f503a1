// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/run/watchdog.hpp"

#include <algorithm>

#include "mauve_rt/base/error.hpp"
#include "mauve_rt/base/seam/futex.hpp"
#include "mauve_rt/base/seam/mutex.hpp"
#include "mauve_rt/run/task.hpp"

#include "base/touch_stack.hpp"

namespace mauve {

namespace {

constexpr int kWatchPriority = 99;
constexpr int kWriterPriority = 98;  // below who sees to it that others are watched
constexpr std::size_t kWatchStackBytes = std::size_t{128} * 1024;
constexpr std::size_t kWriterStackBytes = std::size_t{256} * 1024;  // it runs resources' code
constexpr time_ns_t kLeastBetweenLooks = ms_to_ns(1);
constexpr time_ns_t kRetryOutputs = ms_to_ns(1);

}  // namespace

Watchdog::Watchdog() {
  const ThreadSettings watching{
      .name = "watchdog", .priority = kWatchPriority, .stack_bytes = kWatchStackBytes};
  if (watcher_.start(watching, &Watchdog::watch_entry, this) != 0)
    throw Error(ErrorCode::internal, "the system refuses the watchdog's thread");
  const ThreadSettings writing{
      .name = "safe outputs", .priority = kWriterPriority, .stack_bytes = kWriterStackBytes};
  if (writer_.start(writing, &Watchdog::write_entry, this) != 0) {
    ending_.store(1, std::memory_order_release);
    wake();
    watcher_.join();
    throw Error(ErrorCode::internal, "the system refuses the thread that writes outputs for the watchdog");
  }
  runs_ = true;
}

Watchdog::~Watchdog() { stop(); }

void Watchdog::stop() noexcept {
  if (!runs_) return;
  runs_ = false;
  ending_.store(1, std::memory_order_release);
  wake();
  write_what_is_left();
  futex_wake_all(ending_);
  watcher_.join();
  writer_.join();
}

void Watchdog::watch(Task& task) {
  const LockGuard lock(tasks_mutex_);
  tasks_.push_back(&task);
}

void Watchdog::forget(Task& task) noexcept {
  const LockGuard lock(tasks_mutex_);
  std::erase(tasks_, &task);
}

void Watchdog::wake() noexcept {
  alarm_.fetch_add(1, std::memory_order_acq_rel);
  futex_wake_all(alarm_);
}

void Watchdog::write_what_is_left() noexcept {
  left_.fetch_add(1, std::memory_order_acq_rel);
  futex_wake_all(left_);
}

void* Watchdog::watch_entry(void* self) noexcept {
  touch_stack(kWatchStackBytes / 4);
  static_cast<Watchdog*>(self)->run();
  return nullptr;
}

void* Watchdog::write_entry(void* self) noexcept {
  static_cast<Watchdog*>(self)->write_left_outputs();
  return nullptr;
}

void Watchdog::run() noexcept {
  for (;;) {
    const std::uint32_t alarm = alarm_.load(std::memory_order_acquire);
    if (ending_.load(std::memory_order_acquire) != 0)
      return;  // after the alarm: stop() sets both, this one first
    const time_ns_t looked_ns = monotonic_now_ns();
    const time_ns_t next_ns = look(looked_ns);
    if (!futex_wait_until(alarm_, alarm, next_ns)) continue;
    // Woken for an execution that ends earlier: not more than a look in a millisecond, and nobody needs to wake it twice.
    wake_before_ns_.store(0, std::memory_order_seq_cst);
    futex_wait_until(ending_, 0, looked_ns + kLeastBetweenLooks);
  }
}

/// Times out what is over its bound; returns when to look again.
time_ns_t Watchdog::look(time_ns_t now_ns) noexcept {
  looks_.fetch_add(1, std::memory_order_relaxed);
  wake_before_ns_.store(kForever, std::memory_order_seq_cst);
  const time_ns_t soonest_ns = now_ns + kLeastBetweenLooks;
  time_ns_t earliest_ns = kForever;
  {
    const LockGuard lock(tasks_mutex_);
    for (Task* task : tasks_) {
      task->time_out_if_over(now_ns);
      earliest_ns = std::min(earliest_ns, task->earliest_excess_ns(now_ns));
    }
  }
  // At the soonest look it comes anyway: nobody needs to wake it.
  wake_before_ns_.store(earliest_ns <= soonest_ns ? 0 : earliest_ns, std::memory_order_seq_cst);
  return std::max(earliest_ns, soonest_ns);
}

/// Takes the next one with outputs left; it stays while they are being written.
Task* Watchdog::next_left(std::size_t& place) noexcept {
  const LockGuard lock(tasks_mutex_);
  while (place < tasks_.size()) {
    Task* const task = tasks_[place++];
    if (task->take_outputs_left()) return task;
  }
  return nullptr;
}

void Watchdog::write_left_outputs() noexcept {
  for (;;) {
    const std::uint32_t left = left_.load(std::memory_order_acquire);
    if (ending_.load(std::memory_order_acquire) != 0) return;  // as in run()
    bool all_written = true;
    std::size_t place = 0;
    while (Task* task = next_left(place)) all_written &= task->write_outputs_left();
    futex_wait_until(left_, left, all_written ? kForever : monotonic_now_ns() + kRetryOutputs);
  }
}

}  // namespace mauve
