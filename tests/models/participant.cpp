// SPDX-License-Identifier: LGPL-3.0-or-later
// The steps of a component's own thread: its waits and releases, its vote, its take, its way into a park.
#include <algorithm>

#include "model.hpp"

namespace mauve::model {

void Model::step_component(const State& from, int i) {
  const Component& component = from.components[i];
  if (component.slot == Slot::kBusy && component.step != Step::kClearing &&
      component.step != Step::kAdoptHung)
    check_record(from, component.slot_change);
  switch (component.step) {
    case Step::kWaiting:
      return wait(from, i);
    case Step::kNoticed:
    case Step::kLooked:
      return notice(from, i);
    case Step::kAdopting:
      return adopt(from, i);
    case Step::kVoting:
    case Step::kCounting:
      return vote(from, i);
    case Step::kClosing:
    case Step::kPublishing:
      return close(from, i);
    case Step::kIdleLooking:
    case Step::kIdleScanning:
    case Step::kIdleClosing:
      return close_if_idle(from, i);
    case Step::kLooking:
      return look(from, i);
    case Step::kTaking:
    case Step::kPassing:
      return take(from, i);
    case Step::kClearing:
      return clear(from, i);
    case Step::kRaising:
      return raise(from, i);
    case Step::kBeginning:
    case Step::kExecuting:
      return execute(from, i);
    case Step::kParking:
    case Step::kLookingParked:
    case Step::kParked:
      return park(from, i);
    case Step::kCallingOff:
      return call_off(from, i);
    case Step::kAdoptHung:
    case Step::kHung:
    case Step::kClaimed:
      return come_back(from, i);
    case Step::kEnded:
      return;
  }
}

void Model::wait(const State& from, int i) {
  const Component& component = from.components[i];
  State state = from;
  if (component.stop) return go(state, i, Step::kParking);
  check_notice(from, i);
  if (component.notified) {
    const bool keeps_notice = is(Twin::kLooksBeforeNotice) && component.slot == Slot::kEmpty;
    state.components[i].notified = keeps_notice;
    go(state, i, keeps_notice ? Step::kLooked : Step::kNoticed);
  }
  if (waits_for_events(i)) {
    for (int stamp = component.entered + 1; stamp <= from.now; ++stamp) {
      state = from;
      state.components[i].clock = static_cast<std::uint8_t>(stamp);
      release(state, i);
    }
  } else if (component.clock <= options_.last_instant && from.now >= component.clock) {
    release(from, i);
  }
}

/// The notice went before the look: one that comes after it stays.
void Model::notice(State state, int i) {
  Component& component = state.components[i];
  if (component.step == Step::kLooked) {
    component.notified = false;
    return go(state, i, Step::kWaiting);
  }
  if (component.slot != Slot::kPosted) return go(state, i, Step::kWaiting);
  component.slot = Slot::kBusy;
  if (!component.voted) return go(state, i, Step::kAdopting);
  const bool looks = options_.idle && state.changes[component.slot_change].to_vote == 0;
  go(state, i, looks ? Step::kIdleLooking : Step::kLooking);
}

/// A release, before the guards of the wait are tested.
void Model::release(State state, int i) {
  Component& component = state.components[i];
  if (component.slot != Slot::kPosted || !component.voted) return go(state, i, Step::kBeginning);
  component.slot = Slot::kBusy, component.after = After::kExecute;
  go(state, i, Step::kRaising);
}

void Model::adopt(State state, int i) {
  check_adopt(state, i);
  if (options_.hang && i == 0) go(state, i, Step::kAdoptHung);
  if (options_.refuse) go(state, i, Step::kCallingOff);
  go(state, i, is(Twin::kVoteDoesNotRaise) ? Step::kCounting : Step::kVoting);
}

void Model::vote(State state, int i) {
  Component& component = state.components[i];
  const int change = component.slot_change;
  if (component.step == Step::kVoting) {
    const CutWord seen = call_cut(state, change, [&](auto& cut) { return cut.raise(component.entered); });
    return go(state, i, seen.is_off() ? Step::kClearing : Step::kCounting);
  }
  component.voted = true;
  const bool is_last = --state.changes[change].to_vote == 0;
  const bool looks = options_.idle && !is(Twin::kClosesWithoutLook);
  go(state, i, !is_last ? Step::kLooking : looks ? Step::kIdleLooking : Step::kClosing);
}

/// What a component tells of itself: a pending instant in a wait, until it begins to execute; the next one when it waits again.
bool Model::has_job_at(const State& state, int i, int frontier) const {
  const Component& component = state.components[i];
  if (component.is_parked() || component.step == Step::kClaimed || component.step == Step::kEnded)
    return false;
  const bool executes = component.step == Step::kBeginning || component.step == Step::kExecuting ||
                        component.step == Step::kHung;
  if (executes && is(Twin::kDueMovesAtRelease)) return component.clock + kPeriod[i] <= frontier;
  if (executes) return true;
  const bool has_instant = component.clock != 0 && component.clock <= options_.last_instant;
  return has_instant && component.clock <= frontier;
}

/// One step for the look at the cut, one for each participant, one for the close.
void Model::close_if_idle(State state, int i) {
  Component& component = state.components[i];
  const int k = component.slot_change;
  if (component.step == Step::kIdleLooking) {
    component.seen = state.changes[k].word, component.at = 0;
    return go(state, i, CutWord{component.seen}.is_open() ? Step::kIdleScanning : Step::kLooking);
  }
  if (component.step == Step::kIdleScanning) {
    const bool is_idle =
        !has_job_at(state, component.at, static_cast<int>(CutWord{component.seen}.frontier_ns()));
    if (is_idle && ++component.at < options_.components) return go(state, i, Step::kIdleScanning);
    component.at = 0;
    return go(state, i, is_idle ? Step::kIdleClosing : Step::kLooking);
  }
  const CutWord seen{is(Twin::kDuesBeforeCut) ? state.changes[k].word : component.seen};
  const bool is_closed = seen.is_open() && call_cut(state, k, [&](auto& cut) { return cut.close_if(seen); });
  component.seen = 0;
  if (is_closed) check_closed(state, k);
  go(state, i, Step::kLooking);
}

void Model::close(State state, int i) {
  Component& component = state.components[i];
  const int k = component.slot_change;
  Change& change = state.changes[k];
  if (is(Twin::kChooseThenPublish)) {
    if (!change.cut().is_open()) return go(state, i, Step::kLooking);
    if (component.step == Step::kClosing) {
      component.chosen = state.now;
      return go(state, i, Step::kPublishing);
    }
    change.word = static_cast<std::uint8_t>(CutWord::open_at(component.chosen).bits | CutWord::kClosed);
    component.chosen = 0;
  } else {
    call_cut(state, k, [](auto& cut) { return cut.close(); });
  }
  if (change.cut().is_closed()) check_closed(state, k);
  go(state, i, Step::kLooking);
}

/// In a wait. The component takes if its next execution belongs to T or later.
void Model::look(State state, int i) {
  Component& component = state.components[i];
  const CutWord seen = call_cut(state, component.slot_change, [](auto& cut) { return cut.look(); });
  if (seen.is_off()) return go(state, i, Step::kClearing);
  const bool has_pending_clock = !waits_for_events(i) && component.clock <= options_.last_instant;
  const bool has_reached =
      !has_pending_clock || component.clock >= seen.instant_ns() || options_.idle || is(Twin::kTakeAtOnce);
  if (seen.is_closed() && has_reached) return go(state, i, after_decision());
  require(!seen.is_closed() || options_.components > 1,
          "a single participant does not take in the visit in which it closes");
  component.slot = Slot::kPosted;
  go(state, i, Step::kWaiting);
}

/// The step of a thread that has seen the change made.
Step Model::after_decision() const { return is(Twin::kPassBeforeTake) ? Step::kPassing : Step::kTaking; }

void Model::take(State state, int i) {
  Component& component = state.components[i];
  const int change = component.slot_change;
  const bool is_taking = component.step == Step::kTaking;
  if (is_taking) {
    take_parts(state, i, change);
    if (options_.remove && i == 0) component.after = After::kPark;
  } else {
    --state.changes[change].to_pass;
  }
  go(state, i,
     is_taking == is(Twin::kPassBeforeTake) ? Step::kClearing
     : is_taking                            ? Step::kPassing
                                            : Step::kTaking);
}

/// By the component's thread, or by the requester for a parked one.
void Model::take_parts(State& state, int i, int change) {
  Component& component = state.components[i];
  const Change& taken = state.changes[change];
  require(taken.cut().is_closed(), "a participant takes a change that is not made");
  require(!taken.old_freed, "a participant takes from parts that are freed");
  component.has_new[change] = true;
  if (options_.moved_writer && i == 1 && !is(Twin::kNoFloor)) state.has_floor = true;
  if (!is(Twin::kTakeDoesNotRaise))
    component.entered = static_cast<std::uint8_t>(std::max<int>(component.entered, taken.frontier()));
  if (options_.idle && waits_for_events(i) && component.clock != 0)
    component.clock = static_cast<std::uint8_t>(std::max<int>(component.clock, taken.instant()));
  if (!options_.epoch || waits_for_events(i)) return;
  const int start = is(Twin::kEpochOfEachOne) ? state.now + 1 : epoch(taken);
  component.clock = static_cast<std::uint8_t>(std::min(start, options_.last_instant + 1));
  if (component.after == After::kExecute) component.after = After::kWait;  // its instant is another one now
}

void Model::clear(State state, int i) {
  Component& component = state.components[i];
  const Step next = component.after == After::kExecute ? Step::kBeginning
                    : component.after == After::kPark  ? Step::kParked
                                                       : Step::kWaiting;
  component.slot = Slot::kEmpty, component.slot_change = 0, component.voted = false;
  component.after = After::kWait;
  if (next == Step::kParked && options_.remove && i == 0 && component.has_new[0])
    return go(state, i, Step::kEnded);
  go(state, i, next);
}

/// The cut says in one step whether this clock is before T, now and for good.
void Model::raise(State state, int i) {
  Component& component = state.components[i];
  const bool raises = !is(Twin::kReleaseDoesNotRaise) && !is(Twin::kChooseThenPublish);
  const bool raises_always = options_.idle && waits_for_events(i) && !is(Twin::kEventWritesNothing);
  const CutWord seen = call_cut(state, component.slot_change, [&](auto& cut) {
    if (!raises) return cut.look();
    return raises_always ? cut.raise_always(component.clock) : cut.raise(component.clock);
  });
  if (seen.is_off()) return go(state, i, Step::kClearing);
  const bool has_reached =
      component.clock >= seen.instant_ns() || (options_.idle && !is(Twin::kEventKeepsItsClock));
  if (seen.is_closed() && has_reached) return go(state, i, after_decision());
  component.slot = Slot::kPosted, component.after = After::kWait;
  go(state, i, Step::kBeginning);
}

void Model::execute(State state, int i) {
  Component& component = state.components[i];
  if (component.step == Step::kBeginning) {
    check_begin(state, i);
    component.last = component.clock;
    component.entered = std::max(component.entered, component.clock);
    return go(state, i, Step::kExecuting);
  }
  check_parts(state, i);
  if (options_.hang && i == 0) go(state, i, Step::kHung);
  if (options_.moved_writer && i == 1 && component.has_new[0]) state.newest_is_new = true;
  if (options_.moved_writer && i == 0 && !component.has_new[0] && !state.has_floor)
    require(!state.newest_is_new, "a late old value replaces a new one");
  component.notified = true;  // it looks at its slot once more before it sleeps
  if (waits_for_events(i)) {
    component.clock = 0;
    return go(state, i, Step::kWaiting);
  }
  const auto wait_until = [&](int clock) {
    component.clock = static_cast<std::uint8_t>(std::min(clock, options_.last_instant + 1));
    go(state, i, Step::kWaiting);
  };
  int next = component.clock + kPeriod[i];
  wait_until(next);
  if (!options_.skip || state.now <= next) return;
  while (next < state.now) next += kPeriod[i];
  wait_until(next);
}

/// The thread sets its flag "parked", then reads its slot. A requester that has not seen the flag has posted before,
/// so the thread sees the change.
void Model::park(State state, int i) {
  Component& component = state.components[i];
  if (component.step == Step::kParking && component.slot == Slot::kPosted && is(Twin::kStopWithoutTake)) {
    component.slot = Slot::kEmpty, component.slot_change = 0, component.voted = false;
    return go(state, i, Step::kParked);
  }
  const bool keeps_vote = is(Twin::kStopKeepsVote) && component.voted;
  if (component.slot == Slot::kPosted && !keeps_vote && component.step != Step::kParked) {
    component.slot = Slot::kBusy, component.after = After::kPark;
    return go(state, i, Step::kCallingOff);
  }
  if (component.step == Step::kParking) return go(state, i, Step::kLookingParked);
  if (component.step == Step::kLookingParked) {
    component.clock = 0;
    component.notified = false;
    go(state, i, options_.remove && i == 0 && component.has_new[0] ? Step::kEnded : Step::kParked);
  }
}

/// The component parks, or its adopt has refused. A change that is made already has to be taken first.
void Model::call_off(State state, int i) {
  const CutWord seen = call_cut(state, state.components[i].slot_change, [](auto& cut) {
    cut.call_off();
    return cut.look();  // decided, so nothing can come between the two
  });
  go(state, i, seen.is_closed() ? after_decision() : Step::kClearing);
}

/// A thread that timed out may come back, or never.
void Model::come_back(State state, int i) {
  Component& component = state.components[i];
  const bool may_come_back = component.timed_out && !options_.lost;
  if (component.step == Step::kHung) {
    check_parts(state, i);  // it still reads them
    if (may_come_back) go(state, i, Step::kParking);
  } else if (component.step == Step::kAdoptHung) {
    component.after = After::kPark;
    if (may_come_back) go(state, i, Step::kCallingOff);
  } else {
    require(!state.changes[0].old_freed, "parts are freed below a claimed thread");
    if (!state.changes[0].cut().is_closed() || options_.lost) return;
    check_record(state, 0);
    component.has_new[0] = true;
    --state.changes[0].to_pass;
    go(state, i, Step::kEnded);
  }
}

}  // namespace mauve::model
