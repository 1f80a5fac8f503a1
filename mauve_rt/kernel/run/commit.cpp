// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/run/commit.hpp"

#include <pthread.h>

#include <algorithm>
#include <tuple>

#include "mauve_rt/base/futex.hpp"
#include "mauve_rt/run/task.hpp"

namespace mauve {

Commit::Commit(std::size_t participants, std::vector<CommitAction*> actions)
    : participants_(participants), actions_(std::move(actions)) {
  for (Participant& place : participants_) place.commit = this;
  for (const CommitAction* action : actions_) {
    budget_ns_ += action->budget_ns();
    declared_ns_ += action->declared_ns();
  }
}

Commit::~Commit() {
  if (!committed()) return;
  for (Participant& place : participants_) {
    if (place.in_flight && place.afterwards != Afterwards::stop) place.task->forget_release(place);
  }
}

void Commit::order_participants() {
  order_.clear();
  for (Participant& place : participants_) {
    place.period_ns = place.task->grid().period_ns;
    order_.push_back(&place);
  }
  std::sort(order_.begin(), order_.end(), [](const Participant* a, const Participant* b) {
    const auto rank = [](const Participant& place) {
      return std::tuple(-place.budget_ns, -place.task->grid().period_ns, place.task->number());
    };
    return rank(*a) < rank(*b);
  });
}

void Commit::expect(std::uint32_t parties) noexcept {
  expected_ = parties;
  going_.store(parties, std::memory_order_relaxed);  // relaxed: nobody was posted yet
}

// ---- those who come to the gate

Commit::Answer Commit::meet(Participant& place) noexcept {
  note_came(place);
  if (const std::optional<Answer> answer = arrive(place)) return *answer;
  return make_change();
}

void Commit::note_came(Participant& place) noexcept {
  // relaxed: counts only; who sees the last one late spends its instants a wait later
  if (!place.came.exchange(true, std::memory_order_relaxed)) came_.fetch_add(1, std::memory_order_relaxed);
}

std::int64_t Commit::may_miss(const Participant& place) const noexcept {
  if (came_.load(std::memory_order_relaxed) != expected_) return 0;
  // A stall may have lost it more than were allowed.
  return std::max<std::int64_t>(0, max_missed_ - place.lost);
}

time_ns_t Commit::holds_until_ns(const Participant& place) const noexcept {
  if (place.pending_ns == kForever) return kForever;
  return place.pending_ns + may_miss(place) * place.task->grid().period_ns;
}

/// Nothing: it is the last and makes the change.
std::optional<Commit::Answer> Commit::arrive(Participant& place) noexcept {
  std::uint32_t seen = gate_.load(std::memory_order_acquire);
  for (;;) {
    if ((seen & kOff) != 0) return Answer::off;
    const time_ns_t now = place.task->clock().now_ns();
    const bool last = (seen & kCount) + 1 == expected_ && have_time(place, now);
    if (last) {  // nobody else can be: all but this one are there
      began_ns_.store(now, std::memory_order_relaxed);
      maker_.store(&place, std::memory_order_relaxed);
    }
    // acq_rel: the last one sees what the others wrote before they came
    if (gate_.compare_exchange_weak(seen, last ? (seen + 1) | kAdopting : seen + 1, std::memory_order_acq_rel,
                                    std::memory_order_acquire)) {
      if (last) return std::nullopt;
      return wait_others(place);
    }
  }
}

/// Somebody whose time is over may not have got its processor to leave: then it leaves first, and comes back.
bool Commit::have_time(const Participant& last, time_ns_t now_ns) const noexcept {
  return std::all_of(participants_.begin(), participants_.end(), [&](const Participant& place) {
    return &place == &last || !place.in_flight ||
           place.leaves_at_ns.load(std::memory_order_relaxed) >= now_ns;
  });
}

Commit::Answer Commit::wait_others(Participant& place) noexcept {
  for (;;) {
    const std::uint32_t seen = gate_.load(std::memory_order_acquire);
    if ((seen & kOff) != 0) return Answer::off;
    if ((seen & kDone) != 0) return Answer::done;
    if ((seen & kAbandoned) != 0) return Answer::abandoned;
    time_ns_t until = place.leaves_at_ns.load(std::memory_order_relaxed);
    if ((seen & kTaking) != 0) {
      until = kForever;
    } else if ((seen & kAdopting) != 0) {
      const time_ns_t budget_ends = began_ns_.load(std::memory_order_relaxed) + budget_ns_;
      place.holds_until_ns = holds_until_ns(place);  // all have been here now
      until = declared_ns_ != 0 ? budget_ends : std::max(budget_ends, place.holds_until_ns);
    } else if (place.task->has_event()) {
      until = 0;
    }
    if (futex_wait_until(gate_, seen, until)) continue;
    if ((seen & kTaking) != 0) continue;
    if ((seen & kAdopting) != 0) {
      call_off(Off::overran);  // unless taking begins this moment
      continue;
    }
    // acq_rel: who comes last counts only those who are still there
    std::uint32_t gathering = seen;
    if (gate_.compare_exchange_strong(gathering, seen - 1, std::memory_order_acq_rel,
                                      std::memory_order_acquire)) {
      return Answer::left;
    }
  }
}

void Commit::poke() noexcept {
  gate_.fetch_add(kPoke, std::memory_order_acq_rel);
  futex_wake_all(gate_);
}

void Commit::gone_on(bool made_it) noexcept {
  if (made_it) {
    if (expected_ > 1) futex_wake_all(gate_);
    repay_priority();
  }
  if (going_.fetch_sub(1, std::memory_order_acq_rel) == 1) settle();
}

// ---- who makes the change

Commit::Answer Commit::make_change() noexcept {
  borrow_priority();
  const Clock& clock =
      participants_.empty() ? MonotonicClock::instance() : participants_.front().task->clock();
  if (adopt_all(clock) && begin_taking()) {
    for (Participant& place : participants_) {
      if (place.in_flight && place.replaces_parts) place.task->write_outputs(true);
    }
    take_all(clock);
    committed_ = true;
  }
  const std::uint32_t before = gate_.fetch_or(kDone, std::memory_order_acq_rel);  // publishes the results
  // Nobody is woken yet: a more urgent thread would keep this one from going on itself (gone_on).
  if ((before & (kOff | kAbandoned)) == 0) return Answer::made_it;
  repay_priority();
  return (before & kAbandoned) != 0 ? Answer::abandoned : Answer::off;
}

void Commit::make_alone() noexcept {
  make_change();
  repay_priority();
}

bool Commit::adopt_all(const Clock& clock) noexcept {
  time_ns_t began = clock.now_ns();
  for (CommitAction* action : actions_) {
    adopting_.store(action, std::memory_order_release);
    bool agreed = false;
    try {
      agreed = action->adopt();
    } catch (...) {
      refusal_ = std::current_exception();
    }
    const time_ns_t now = clock.now_ns();
    action->adopt_ns = now - began;
    began = now;
    const bool is_off = (gate_.load(std::memory_order_acquire) & kOff) != 0;
    const time_ns_t declared = action->declared_ns();
    const bool is_late = declared != 0 && action->adopt_ns > declared;
    if (agreed && !is_late && !is_off) continue;
    refused_by_ = agreed && !is_late ? nullptr : action;  // called off: the actions may be gone by now
    adopt_was_late_ = agreed && is_late;
    return false;
  }
  return true;
}

const CommitAction* Commit::put_down() noexcept {
  if (began_ns_.load(std::memory_order_relaxed) == 0 || actions_.empty()) return nullptr;
  const CommitAction* slowest =
      *std::max_element(actions_.begin(), actions_.end(), [](const CommitAction* a, const CommitAction* b) {
        return a->adopt_ns - a->budget_ns() < b->adopt_ns - b->budget_ns();
      });
  if (slowest->task == nullptr) return nullptr;
  return refused_by_ = slowest;
}

/// Decides against all who would call it off.
bool Commit::begin_taking() noexcept {
  std::uint32_t seen = gate_.load(std::memory_order_acquire);
  while ((seen & kOff) == 0) {
    if (gate_.compare_exchange_weak(seen, seen | kTaking, std::memory_order_acq_rel,
                                    std::memory_order_acquire)) {
      return true;
    }
  }
  return false;
}

void Commit::take_all(const Clock& clock) noexcept {
  time_ns_t began = clock.now_ns();
  for (CommitAction* action : actions_) {
    adopting_.store(action, std::memory_order_release);
    const time_ns_t declared = action->declared_ns();  // of the new core; after take, that is another
    action->take();
    const time_ns_t now = clock.now_ns();
    action->take_ns = now - began;
    began = now;
    const time_ns_t took = action->adopt_ns + action->take_ns;
    if (declared == 0 || took <= declared) continue;
    for (Participant& place : participants_) {
      if (place.task == action->task) place.overlong_ns = took;
    }
  }
}

/// The highest among the participants, for as long as it works for all of them: else a thread of a priority in between
/// would keep the most urgent of them waiting.
void Commit::borrow_priority() noexcept {
  if (participants_.size() < 2) return;
  int policy = 0;
  sched_param own{};
  if (pthread_getschedparam(pthread_self(), &policy, &own) != 0 || policy != SCHED_FIFO) return;
  int highest = own.sched_priority;
  for (const Participant& place : participants_) {
    if (place.in_flight) highest = std::max(highest, place.task->settings().priority);
  }
  if (highest == own.sched_priority) return;
  own_priority_ = own.sched_priority;
  pthread_setschedprio(pthread_self(), highest);
}

void Commit::repay_priority() noexcept {
  if (own_priority_ == 0) return;
  MAUVE_RT_TRUSTED(
      pthread_setschedprio(pthread_self(), own_priority_));  // once a change of several components
  own_priority_ = 0;
}

// ---- who conducts it, and who wants it not to happen

bool Commit::call_off(Off why, const Task* task) noexcept {
  Off none = Off::not_yet;
  // relaxed: who tells of it waits for this call's end first
  if (off_.compare_exchange_strong(none, why, std::memory_order_relaxed))
    off_by_.store(task, std::memory_order_relaxed);
  std::uint32_t seen = gate_.load(std::memory_order_acquire);
  while ((seen & (kTaking | kDone | kOff)) == 0) {
    if (!gate_.compare_exchange_weak(seen, seen | kOff, std::memory_order_acq_rel,
                                     std::memory_order_acquire)) {
      continue;
    }
    futex_wake_all(gate_);
    settle();
    return true;
  }
  return (seen & kOff) != 0;
}

Commit::Off Commit::off() const noexcept {
  const bool is_off = (gate_.load(std::memory_order_acquire) & kOff) != 0;
  return is_off ? off_.load(std::memory_order_relaxed) : Off::not_yet;
}

void Commit::settle() noexcept {
  settled_.store(1, std::memory_order_release);
  futex_wake_all(settled_);
}

bool Commit::wait_settled(time_ns_t until_ns) noexcept {
  while (settled_.load(std::memory_order_acquire) == 0) {
    if (!futex_wait_until(settled_, 0, until_ns)) return settled_.load(std::memory_order_acquire) != 0;
  }
  return true;
}

void Commit::hurry() noexcept {
  patience_ns_.store(monotonic_now_ns() + kPatience, std::memory_order_relaxed);
}

time_ns_t Commit::patience_ends_ns(time_ns_t timeout_at_ns) const noexcept {
  const time_ns_t began = began_ns_.load(std::memory_order_relaxed);
  return std::min(patience_ns_.load(std::memory_order_relaxed), std::max(timeout_at_ns, began + kPatience));
}

bool Commit::abandon() noexcept {
  std::uint32_t seen = gate_.load(std::memory_order_acquire);
  while ((seen & kAdopting) != 0 && (seen & (kDone | kAbandoned)) == 0) {
    if (gate_.compare_exchange_weak(seen, seen | kAbandoned, std::memory_order_acq_rel,
                                    std::memory_order_acquire)) {
      futex_wake_all(gate_);  // who waits for its take
      return true;
    }
  }
  return (seen & kAbandoned) != 0;
}

}  // namespace mauve
