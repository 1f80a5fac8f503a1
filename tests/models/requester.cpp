// SPDX-License-Identifier: LGPL-3.0-or-later
// The steps of a requester: it locks, posts, waits for the decision, and frees the old parts once no thread uses them.
#include <algorithm>

#include "model.hpp"

namespace mauve::model {

void Model::step_requester(const State& from, int change) {
  switch (from.changes[change].step) {
    case Request::kAwaiting:
    case Request::kUrgentCall:
      return await(from, change);
    case Request::kLocking:
      return lock(from, change);
    case Request::kPosting:
      return post(from, change);
    case Request::kNotifying:
      return notify(from, change);
    case Request::kVotingFor:
    case Request::kCountingFor:
    case Request::kClosingFor:
      return vote_for(from, change);
    case Request::kDeciding:
      return decide(from, change);
    case Request::kRetracting:
      return retract(from, change);
    case Request::kWaking:
      return wake(from, change);
    case Request::kTakenFor:
      return pass_for(from, change);
    case Request::kPassing:
    case Request::kAnswered:
      return pass(from, change);
    case Request::kFreed:
      return;
  }
}

/// To the next participant, or past the last one.
void Model::go_to_next(State& state, int change) const {
  std::uint8_t& at = state.changes[change].at;
  do ++at;
  while (at < options_.components && !takes_part(change, at));
}

bool Model::slots_are_empty(const State& state, int change) const {
  for (int i = 0; i < options_.components; ++i)
    if (takes_part(change, i) && state.components[i].slot != Slot::kEmpty) return false;
  return true;
}

/// A closed change that is not passed yet is waited for; an open one may be called off by an urgent one.
void Model::await(State state, int k) {
  Change& change = state.changes[k];
  const Change& other = state.changes[1 - k];
  if (change.step == Request::kUrgentCall) {
    check_record(state, 1 - k);
    call_cut(state, 1 - k, [](auto& cut) { return cut.call_off(); });
    change.step = Request::kAwaiting;
    return emit(state);
  }
  if (slots_are_empty(state, k) || is(Twin::kSecondOverFirst)) {
    change.step = Request::kLocking;
    return emit(state);
  }
  if (options_.urgent && k == 1 && !change.has_pressed) {
    State urgent = state;
    urgent.changes[k].has_pressed = true;
    // Under the lock of the list of changes: a requester takes its record off the list before it frees the record.
    const bool is_listed = !other.record_freed;
    if (is(Twin::kUrgentWithoutLock)) {
      urgent.changes[k].step = Request::kUrgentCall;
    } else if (is_listed) {
      call_cut(urgent, 1 - k, [](auto& cut) { return cut.call_off(); });
    }
    emit(urgent);
  }
  time_out(state, k);
}

/// All mutexes in one step: the order of numbers excludes a deadlock, and nothing is done between two of them.
void Model::lock(State state, int k) {
  for (int i = 0; i < options_.components; ++i)
    if (takes_part(k, i) && state.components[i].mutex_holder != 0) return time_out(state, k);
  Change& change = state.changes[k];
  if (!slots_are_empty(state, k) && !is(Twin::kSecondOverFirst)) {
    change.step = Request::kAwaiting;
    return emit(state);
  }
  for (int i = 0; i < options_.components; ++i)
    if (takes_part(k, i)) state.components[i].mutex_holder = static_cast<std::uint8_t>(1 + k);
  if (options_.epoch) {
    change.requested_at = state.now;
    if (!is(Twin::kEpochWithoutRaise)) call_cut(state, k, [&](auto& cut) { return cut.raise(state.now); });
  }
  change.step = Request::kPosting;
  if (!takes_part(k, change.at)) go_to_next(state, k);
  emit(state);
}

void Model::post(State state, int k) {
  Change& change = state.changes[k];
  if (change.at == options_.components) {
    for (Component& component : state.components) {
      const bool is_held = component.mutex_holder == 1 + k && component.slot != Slot::kClaimed;
      if (is_held) component.mutex_holder = 0;
    }
    change.step = Request::kDeciding, change.at = 0;
    return emit(state);
  }
  Component& component = state.components[change.at];
  if (options_.remove && component.step == Step::kHung && component.timed_out) {
    component.step = Step::kClaimed;
    change.step = is(Twin::kClaimDoesNotRaise) ? Request::kCountingFor : Request::kVotingFor;
    return emit(state);
  }
  component.slot = Slot::kPosted, component.slot_change = static_cast<std::uint8_t>(k),
  component.voted = false;
  if (options_.changes == 2 && takes_part(1 - k, change.at) && state.earlier == 0)
    state.earlier = static_cast<std::uint8_t>(1 + k);
  change.step = Request::kNotifying;
  emit(state);
}

void Model::notify(State state, int k) {
  Change& change = state.changes[k];
  Component& component = state.components[change.at];
  if (component.is_parked() && component.is_at(k) && component.slot == Slot::kPosted) {
    component.slot = Slot::kClaimed;
    change.step = is(Twin::kParkedDoesNotRaise) ? Request::kCountingFor : Request::kVotingFor;
    return emit(state);
  }
  component.notified = !component.is_parked();
  change.step = Request::kPosting;
  go_to_next(state, k);
  emit(state);
}

/// For a parked participant, or for a hung one that is to be removed.
void Model::vote_for(State state, int k) {
  Change& change = state.changes[k];
  if (change.step == Request::kVotingFor) {
    const std::uint8_t entered = state.components[change.at].entered;
    call_cut(state, k, [&](auto& cut) { return cut.raise(entered); });
    change.step = Request::kCountingFor;
    return emit(state);
  }
  // An idle one is closed by a participant that runs.
  if (change.step == Request::kCountingFor && --change.to_vote == 0 && !options_.idle) {
    change.step = Request::kClosingFor;
    return emit(state);
  }
  if (change.step == Request::kClosingFor) {
    call_cut(state, k, [](auto& cut) { return cut.close(); });
    if (change.cut().is_closed()) check_closed(state, k);
  }
  change.step = Request::kPosting;
  go_to_next(state, k);
  emit(state);
}

void Model::time_out(State state, int k) {
  Change& change = state.changes[k];
  call_cut(state, k, [](auto& cut) { return cut.call_off(); });
  change.step = change.cut().is_closed() ? Request::kWaking : Request::kRetracting;
  change.at = 0;
  if (!takes_part(k, 0)) go_to_next(state, k);
  emit(state);
}

void Model::decide(const State& from, int k) {
  const Change& change = from.changes[k];
  if (change.cut().is_open() || is(Twin::kOffOverClosed)) time_out(from, k);
  if (change.cut().is_open()) return;
  State state = from;
  Change& decided = state.changes[k];
  decided.step = change.cut().is_closed() ? Request::kWaking : Request::kRetracting;
  decided.old_freed = decided.cut().is_closed() && is(Twin::kRetireAtClose);
  emit(state);
}

void Model::retract(State state, int k) {
  Change& change = state.changes[k];
  if (change.at == options_.components) {
    change.record_freed = !change.kept;
    change.step = change.kept ? Request::kAnswered : Request::kFreed;
    return emit(state);
  }
  Component& component = state.components[change.at];
  if (component.step == Step::kClaimed) component.step = Step::kHung;  // the claim is given up
  if (component.is_at(k) && component.slot == Slot::kBusy && !is(Twin::kFreeWithoutRetract)) {
    if (component.step != Step::kAdoptHung || !component.timed_out)
      return;  // a few instructions, or its adopt
    change.kept = true;
  } else if (component.is_at(k)) {
    if (component.slot != Slot::kBusy)
      component.slot = Slot::kEmpty, component.slot_change = 0, component.voted = false;
  }
  if (component.mutex_holder == 1 + k) component.mutex_holder = 0;
  go_to_next(state, k);
  emit(state);
}

void Model::wake(State state, int k) {
  Change& change = state.changes[k];
  if (change.at == options_.components) {
    change.step = Request::kPassing, change.at = 0;
    return emit(state);
  }
  Component& component = state.components[change.at];
  if (component.slot == Slot::kClaimed && component.is_at(k)) {
    if (!is(Twin::kParkedIsNotTaken)) take_parts(state, change.at, k);
    change.step = Request::kTakenFor;
    return emit(state);
  }
  if (!is(Twin::kNoWake) && !component.is_parked()) component.notified = true;
  go_to_next(state, k);
  emit(state);
}

/// Start: at the first instant of its grid that is neither past nor before T.
void Model::pass_for(State state, int k) {
  Change& change = state.changes[k];
  Component& component = state.components[change.at];
  --change.to_pass;
  component.slot = Slot::kEmpty, component.slot_change = 0;
  component.mutex_holder = 0;
  if (options_.start_by_change && !component.started && !component.stop) {
    const int earliest =
        is(Twin::kStartBeforeInstant) ? state.now : std::max<int>(change.instant(), state.now + 1);
    const int grid = options_.epoch ? epoch(change) : next_instant(change.at, earliest);
    component.started = true, component.step = Step::kWaiting;
    component.clock = static_cast<std::uint8_t>(waits_for_events(change.at) ? 0 : grid);
    component.notified = true;
  } else {
    component.clock = 0;
  }
  change.step = Request::kWaking;
  go_to_next(state, k);
  emit(state);
}

void Model::pass(State state, int k) {
  Change& change = state.changes[k];
  bool has_timed_out = false, is_referred_to = false;
  for (int i = 0; i < options_.components; ++i) {
    const Component& component = state.components[i];
    has_timed_out |= takes_part(k, i) && component.timed_out && !component.has_new[k];
    is_referred_to |= component.is_at(k);
  }
  const bool was_made = change.cut().is_closed();
  const bool has_passed = was_made ? change.to_pass == 0 : !is_referred_to;
  if (has_passed || (was_made && has_timed_out && is(Twin::kTimedOutCountsAsPassed))) {
    change.old_freed = was_made, change.record_freed = true;
    change.step = Request::kFreed;
    return emit(state);
  }
  if (change.step == Request::kAnswered || !has_timed_out) return;
  change.step = Request::kAnswered;  // made, but one has not passed: its record is kept
  emit(state);
}

}  // namespace mauve::model
