// SPDX-License-Identifier: LGPL-3.0-or-later
// Who conducts commits, and the ordinary thread's side of one.
#include <algorithm>
#include <csignal>
#include <mutex>

#include "mauve_rt/commit.hpp"
#include "mauve_rt/error.hpp"
#include "mauve_rt/futex.hpp"
#include "mauve_rt/task.hpp"

#include "thread_attributes.hpp"

namespace mauve {

namespace {

constexpr int kConductorPriority = 99;
constexpr std::size_t kConductorStackBytes = std::size_t{128} * 1024;

void check_state(const Task& task) {
  switch (task.state()) {
    case ComponentState::stopping:
      task.throw_state_running("the component is STOPPING", 0, "try again when it has stopped");
    case ComponentState::faulted:
      throw Error(ErrorCode::faulted, "the component is FAULTED: " + task.fault().what,
                  {.component = task.name(), .remedy = "clean it up and configure it first"});
    default:
      return;
  }
}

}  // namespace

Conductor::Conductor() {
  ThreadAttributes attributes(kConductorStackBytes, kConductorPriority);
  sigset_t all_signals;
  sigset_t callers_signals;
  sigfillset(&all_signals);
  pthread_sigmask(SIG_SETMASK, &all_signals, &callers_signals);
  int result = pthread_create(&thread_, &attributes.value, &Conductor::entry, this);
  if (result == EPERM) {
    attributes.set_policy(SCHED_OTHER, 0);
    result = pthread_create(&thread_, &attributes.value, &Conductor::entry, this);
  }
  pthread_sigmask(SIG_SETMASK, &callers_signals, nullptr);
  if (result != 0) throw Error(ErrorCode::internal, "the system refuses the conductor's thread");
  pthread_setname_np(thread_, "conductor");
}

Conductor::~Conductor() {
  order_.store(kEnd, std::memory_order_release);
  futex_wake_all(order_);
  pthread_join(thread_, nullptr);
}

void* Conductor::entry(void* self) noexcept {
  static_cast<Conductor*>(self)->run();
  return nullptr;
}

void Conductor::run() noexcept {
  for (;;) {
    const std::uint32_t order = order_.load(std::memory_order_acquire);
    if (order == kEnd) return;
    if (order == kNone) {
      futex_wait_until(order_, kNone, kForever);
      continue;
    }
    order_.store(kNone, std::memory_order_relaxed);  // relaxed: the next order comes only after finished_
    in_time_ = mauve::conduct(*commit_, timeout_ns_);
    finished_.store(1, std::memory_order_release);
    futex_wake_all(finished_);
  }
}

bool Conductor::conduct(Commit& commit, time_ns_t timeout_ns) noexcept {
  commit_ = &commit;
  timeout_ns_ = timeout_ns;
  finished_.store(0, std::memory_order_relaxed);  // relaxed: the order publishes it
  order_.store(kConduct, std::memory_order_release);
  futex_wake_all(order_);
  while (finished_.load(std::memory_order_acquire) == 0) futex_wait_until(finished_, 0, kForever);
  return in_time_;
}

bool carry_out(Commit& commit, time_ns_t timeout_ns, Conductor* conductor) {
  // Whoever commands two tasks takes them in the order of their numbers, so that no two wait for each other.
  commit.order_participants();
  std::vector<Task*> tasks;
  for (const Participant& place : commit.participants()) tasks.push_back(place.task);
  std::sort(tasks.begin(), tasks.end(),
            [](const Task* a, const Task* b) { return a->number() < b->number(); });
  std::vector<std::unique_lock<std::mutex>> locks;
  locks.reserve(tasks.size());
  for (Task* task : tasks) locks.emplace_back(task->command_mutex());

  std::uint32_t running = 0;
  for (Participant& place : commit.participants()) {
    if (place.afterwards != Afterwards::stop) check_state(*place.task);
    place.in_flight = !place.task->is_parked();
    if (place.in_flight && !place.task->is_simulated()) ++running;
  }
  commit.expect(running);
  bool in_time = true;
  if (running == 0) {
    for (Participant& place : commit.participants()) place.task->hold_parked(place);
    commit.make_change();
  } else {
    in_time = conductor != nullptr ? conductor->conduct(commit, timeout_ns) : conduct(commit, timeout_ns);
  }
  for (Participant& place : commit.participants()) {
    if (!place.in_flight || place.task->is_simulated()) place.task->finish_parked(place, commit.committed());
  }
  if (commit.refusal()) std::rethrow_exception(commit.refusal());
  for (const Participant& place : commit.participants()) {
    if (commit.was_refused() && place.task->state() == ComponentState::faulted) check_state(*place.task);
    if (!in_time && place.in_flight && !place.arrived.load(std::memory_order_relaxed)) {
      place.task->throw_state_running("the component did not reach a wait in time; nothing was changed",
                                      timeout_ns, "try again, or allow a longer commit timeout");
    }
  }
  if (!in_time || commit.was_refused()) {
    throw Error(ErrorCode::timeout, "the components were never in their waits together; nothing was changed",
                {.remedy = "try again, or allow a longer commit timeout"});
  }
  return commit.committed();
}

}  // namespace mauve
