// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/commit.hpp"

#include <pthread.h>

#include <algorithm>
#include <tuple>

#include "mauve_rt/futex.hpp"
#include "mauve_rt/task.hpp"

namespace mauve {

namespace {

/// Gives the calling thread the highest priority among the participants for as long as it works for all of them: else a
/// thread of a priority in between would keep the most urgent of them waiting.
class PriorityLoan {
 public:
  explicit PriorityLoan(const std::vector<Participant>& participants) noexcept {
    if (participants.size() < 2) return;
    int policy = 0;
    sched_param own{};
    if (pthread_getschedparam(pthread_self(), &policy, &own) != 0 || policy != SCHED_FIFO) return;
    int highest = own.sched_priority;
    for (const Participant& place : participants) {
      if (place.in_flight) highest = std::max(highest, place.task->settings().priority);
    }
    if (highest == own.sched_priority) return;
    own_priority_ = own.sched_priority;
    pthread_setschedprio(pthread_self(), highest);
  }
  ~PriorityLoan() {
    if (own_priority_ != 0) pthread_setschedprio(pthread_self(), own_priority_);
  }
  PriorityLoan(const PriorityLoan&) = delete;
  PriorityLoan& operator=(const PriorityLoan&) = delete;

 private:
  int own_priority_{0};  // 0: nothing was lent
};

}  // namespace

Commit::Commit(std::size_t participants, std::vector<CommitAction*> actions)
    : participants_(participants), actions_(std::move(actions)) {
  for (Participant& place : participants_) place.commit = this;
  for (const CommitAction* action : actions_) budget_ns_ += action->budget_ns();
}

Commit::~Commit() {
  for (Participant& place : participants_) {
    if (committed_ && place.in_flight && place.afterwards != Afterwards::stop)
      place.task->forget_release(place);
  }
}

void Commit::order_participants() {
  order_.clear();
  for (Participant& place : participants_) order_.push_back(&place);
  std::sort(order_.begin(), order_.end(), [](const Participant* a, const Participant* b) {
    const auto rank = [](const Participant& place) {
      return std::tuple(-place.budget_ns, -place.task->grid().period_ns, place.task->number());
    };
    return rank(*a) < rank(*b);
  });
}

Commit::Answer Commit::arrive() noexcept {
  std::uint32_t seen = gate_.load(std::memory_order_acquire);
  for (;;) {
    if ((seen & (kClosed | kWithdrawn | kRefused)) != 0) return Answer::closed;
    const bool last = (seen & kCount) + 1 == expected_;
    // acq_rel: the last one sees what the others wrote before they came
    if (gate_.compare_exchange_weak(seen, last ? (seen + 1) | kClosed : seen + 1, std::memory_order_acq_rel,
                                    std::memory_order_acquire)) {
      if (!last) return Answer::wait;
      make_change();
      return Answer::made_it;
    }
  }
}

bool Commit::wait_others(time_ns_t leave_at_ns) noexcept {
  for (;;) {
    std::uint32_t seen = gate_.load(std::memory_order_acquire);
    if ((seen & (kDone | kWithdrawn | kRefused)) != 0) return true;
    const bool stays = (seen & (kClosed | kStrict)) != 0;
    if (futex_wait_until(gate_, seen, stays ? kForever : leave_at_ns)) continue;
    // acq_rel: who comes last counts only those who are still there
    if ((seen & (kClosed | kStrict)) == 0 &&
        gate_.compare_exchange_strong(seen, seen - 1, std::memory_order_acq_rel, std::memory_order_acquire)) {
      return false;
    }
  }
}

void Commit::make_change() noexcept {
  const PriorityLoan loan(participants_);
  for (Participant& place : participants_) {
    if (place.in_flight) place.task->write_outputs(true);
  }
  const Clock& clock =
      participants_.empty() ? MonotonicClock::instance() : participants_.front().task->clock();
  time_ns_t began = clock.now_ns();
  committed_ = true;
  for (CommitAction* action : actions_) {
    try {
      committed_ = action->adopt();
    } catch (...) {
      committed_ = false;
      refusal_ = std::current_exception();
    }
    const time_ns_t now = clock.now_ns();
    action->adopt_ns = now - began;
    began = now;
    if (committed_) continue;
    refused_by_ = action;
    break;
  }
  for (CommitAction* action : actions_) {
    if (!committed_) break;
    action->take();
    const time_ns_t now = clock.now_ns();
    action->take_ns = now - began;
    began = now;
  }
  gate_.fetch_or(kDone | kClosed, std::memory_order_acq_rel);  // publishes the results
  futex_wake_all(gate_);
}

void Commit::refuse() noexcept {
  gate_.fetch_or(kRefused, std::memory_order_acq_rel);
  futex_wake_all(gate_);
}

void Commit::be_strict() noexcept {
  gate_.fetch_or(kStrict, std::memory_order_acq_rel);
  futex_wake_all(gate_);
}

bool Commit::wait_end(time_ns_t until_ns) noexcept {
  for (;;) {
    const std::uint32_t seen = gate_.load(std::memory_order_acquire);
    if ((seen & (kDone | kWithdrawn | kRefused)) != 0) return true;
    if (!futex_wait_until(gate_, seen, until_ns)) {
      return (gate_.load(std::memory_order_acquire) & (kDone | kWithdrawn | kRefused)) != 0;
    }
  }
}

bool Commit::withdraw() noexcept {
  std::uint32_t seen = gate_.load(std::memory_order_acquire);
  while ((seen & kClosed) == 0) {
    if (gate_.compare_exchange_weak(seen, seen | kWithdrawn, std::memory_order_acq_rel,
                                    std::memory_order_acquire)) {
      futex_wake_all(gate_);
      return true;
    }
  }
  wait_end(kForever);
  return false;
}

bool conduct(Commit& commit, time_ns_t timeout_ns) noexcept {
  const time_ns_t began = monotonic_now_ns();
  for (Participant* place : commit.in_order()) {
    if (place->in_flight) place->task->post(*place);
  }
  bool in_time = commit.wait_end(began + timeout_ns / 2);
  if (!in_time) {
    commit.be_strict();
    in_time = commit.wait_end(began + timeout_ns) || !commit.withdraw();
  }
  for (Participant& place : commit.participants()) {
    if (place.in_flight) place.task->retract();
  }
  return in_time;
}

}  // namespace mauve
