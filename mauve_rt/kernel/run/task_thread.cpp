// SPDX-License-Identifier: LGPL-3.0-or-later
// The thread of a task: how it is made, and what it does between two steps of the machine.
#include <sys/prctl.h>
#include <unistd.h>

#include <csignal>
#include <cstring>

#include "mauve_rt/base/error.hpp"
#include "mauve_rt/base/futex.hpp"
#include "mauve_rt/run/task.hpp"
#include "mauve_rt/run/watchdog.hpp"

#include "base/prefault.hpp"
#include "base/thread_attributes.hpp"

namespace mauve {

namespace {

constexpr time_ns_t kReadyTimeout = s_to_ns(1);
/// How long before its first release a thread wakes once: what it needs is in the caches then, and the first releases of
/// components deployed together come closer than those of threads that wake from a long sleep (here 2 times).
constexpr time_ns_t kWarmUp = us_to_ns(300);

thread_local Task* task_of_this_thread = nullptr;
thread_local const Task* task_simulated_here = nullptr;

}  // namespace

void Task::create_thread(pthread_barrier_t* barrier, bool require_realtime, bool trace,
                         std::shared_ptr<Watchdog> watchdog) {
  if (!end_thread(0)) throw_state_running("the component's thread has not ended", 0, kLeftBehindRemedy);
  const std::lock_guard lock(command_mutex_);
  watchdog_ = std::move(watchdog);
  demoted_ = false;
  barrier_ = barrier;
  begin_trace(trace);
  parked_.store(1, std::memory_order_relaxed);  // relaxed: the thread does not exist yet
  ended_.store(0, std::memory_order_relaxed);
  ready_.store(0, std::memory_order_relaxed);

  ThreadAttributes attributes(settings_.stack_bytes, settings_.priority);
  if (!settings_.cpus.empty()) {
    cpu_set_t cpus;
    CPU_ZERO(&cpus);
    for (const int cpu : settings_.cpus) CPU_SET(static_cast<std::size_t>(cpu), &cpus);
    pthread_attr_setaffinity_np(&attributes.value, sizeof(cpus), &cpus);
  }
  sigset_t all_signals;
  sigset_t callers_signals;
  sigfillset(&all_signals);
  pthread_sigmask(SIG_SETMASK, &all_signals, &callers_signals);  // the new thread inherits it

  int result = pthread_create(&thread_, &attributes.value, &Task::thread_entry, this);
  if (result == EPERM && !require_realtime) {
    attributes.set_policy(SCHED_OTHER, 0);
    result = pthread_create(&thread_, &attributes.value, &Task::thread_entry, this);
  }
  pthread_sigmask(SIG_SETMASK, &callers_signals, nullptr);
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
  read_back_thread();
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

Task* Task::of_this_thread() noexcept { return MAUVE_RT_TRUSTED(task_of_this_thread); }

const Task* Task::executing_here() noexcept {
  return MAUVE_RT_TRUSTED(task_of_this_thread != nullptr ? task_of_this_thread : task_simulated_here);
}

void Task::set_simulated_here(const Task* task) noexcept { MAUVE_RT_TRUSTED(task_simulated_here = task); }

void* Task::thread_entry(void* self) noexcept {
  static_cast<Task*>(self)->thread_main();
  return nullptr;
}

void Task::thread_main() noexcept {
  pthread_setname_np(pthread_self(), name_.substr(0, 15).c_str());
  task_of_this_thread = this;
  locks_held_ = &PiMutex::count_of_this_thread();
  TraceRing::set_for_this_thread(ring_.get());
  prctl(PR_SET_TIMERSLACK, 1UL);  // of use where SCHED_FIFO was refused
  counters_.attach();
  ready_.store(1, std::memory_order_release);
  futex_wake_all(ready_);
  if (barrier_ != nullptr) pthread_barrier_wait(barrier_);
  for (;;) {
    const std::uint32_t control = control_.load(std::memory_order_acquire);
    if (waiting_ == nullptr && (control & kExit) != 0) break;
    if (!must_act(control)) {
      if (waiting_ == nullptr) {
        futex_wait_until(control_, control, kForever);
        continue;
      }
      // Bits not acted on now stay in the word; any further command changes it and ends the sleep.
      if (!clock_->sleep_until(due_ns() - (is_cold_ ? kWarmUp : 0), control_, control)) continue;
      if (is_cold_) warm_up();
    }
    resume();
  }
  counters_.detach();
  // seq_cst: a commit posted this moment is found here, or post() finds that the thread has ended
  ended_.store(1, std::memory_order_seq_cst);
  refuse_commit();
  futex_wake_all(ended_);
}

void Task::warm_up() noexcept {
  is_cold_ = false;
  const auto fetch = [](const auto* object) {
    constexpr std::size_t kCacheLine = 64;
    const auto* bytes = reinterpret_cast<const std::byte*>(object);
    for (std::size_t at = 0; at < sizeof(*object); at += kCacheLine) __builtin_prefetch(bytes + at, 1);
  };
  fetch(this);
  if (ring_ != nullptr) ring_->warm_up();
  for (const auto& state : fsm_->states()) {
    fetch(state.get());
    if (state->execution_time != nullptr) fetch(state->execution_time);
  }
}

bool Task::must_act(std::uint32_t control) noexcept {
  if (waiting_ == nullptr) return (control & (kStart | kCommit)) != 0;
  if ((control & kStop) != 0) return true;
  if ((control & kEvent) != 0 && !event_settled_) return true;
  return (control & kCommit) != 0 && may_commit_now();
}

void Task::read_back_thread() {
  int policy = 0;
  sched_param scheduling{};
  pthread_getschedparam(thread_, &policy, &scheduling);
  facts_ = {.policy = policy == SCHED_FIFO ? "SCHED_FIFO" : "SCHED_OTHER",
            .priority = scheduling.sched_priority,
            .cpus = {},
            .guard_bytes = 0};
  pthread_attr_t attributes;
  if (pthread_getattr_np(thread_, &attributes) == 0) {
    pthread_attr_getguardsize(&attributes, &facts_.guard_bytes);
    void* stack = nullptr;
    std::size_t stack_bytes = 0;
    // All of it, at its full declared length: no state of the component is to wait for a page.
    if (pthread_attr_getstack(&attributes, &stack, &stack_bytes) == 0) prefault(stack, stack_bytes);
    pthread_attr_destroy(&attributes);
  }
  cpu_set_t cpus;
  CPU_ZERO(&cpus);
  pthread_getaffinity_np(thread_, sizeof(cpus), &cpus);
  for (int cpu = 0; cpu < CPU_SETSIZE; ++cpu) {
    if (CPU_ISSET(static_cast<std::size_t>(cpu), &cpus)) facts_.cpus.push_back(cpu);
  }
}

}  // namespace mauve
