// SPDX-License-Identifier: LGPL-3.0-or-later
// The steps of a component's own thread: its waits and executions, its vote, its take, its way into a park.
#include <algorithm>

#include "open_change/model.hpp"

namespace mauve::model::open_change {

void Model::step_component(const State& from, int i) {
  switch (from.components[i].step) {
    case Step::kUnstarted:
      return rest_unstarted(from, i);
    case Step::kWaiting:
      return wait(from, i);
    case Step::kExecuting:
      return execute(from, i);
    case Step::kReturning:
      return come_back(from, i);
    case Step::kAdopting:
      return adopt(from, i);
    case Step::kAdoptHung:
      return come_back_from_hook(from, i, Step::kAdopting);
    case Step::kVoting:
      return vote(from, i);
    case Step::kClosing:
      return close(from, i);
    case Step::kTaking:
      return take(from, i);
    case Step::kTakeHung:
      return come_back_from_hook(from, i, Step::kTaking);
    case Step::kParked:
      return rest_parked(from, i);
    case Step::kHung:
    case Step::kEnded:
      return;
  }
}

// ---- waits

void Model::wait(State state, int i) {
  Component& component = state.components[i];
  if (component.stop) return stop_in_wait(state, i);
  if (is_posted(component)) look(state, i);
  if (component.clock > options_.horizon) return;
  if (is_posted(component) && component.voted) {
    const int k = component.slot_change;
    const CutWord seen = call_cut(state, k, [&](Cut& cut) { return cut.raise(component.clock); });
    if (seen.is_off()) leave_slot(component);
    if (seen.is_closed() && component.clock >= seen.instant_ns()) {
      begin_take(state, i, After::kExecute);
      return emit(state);
    }
  }
  begin_execution(state, i);
  emit(state);
}

/// In a wait, or parked: looks at its slot.
void Model::look(State state, int i) {
  Component& component = state.components[i];
  const CutWord seen = state.changes[component.slot_change].cut();
  const After after = component.step == Step::kParked      ? After::kStayParked
                      : component.step == Step::kUnstarted ? After::kStayUnstarted
                                                           : After::kWait;
  if (seen.is_off()) {
    leave_slot(component);
    return emit(state);
  }
  if (!component.voted) {
    if (!seen.is_open()) return;
    component.slot = Slot::kBusy, component.after = after;
    return go(state, i, Step::kAdopting);
  }
  const bool has_reached =
      after != After::kWait || component.clock >= seen.instant_ns() || component.clock > options_.horizon;
  if (!seen.is_closed() || !has_reached) return;
  begin_take(state, i, after);
  emit(state);
}

/// On the way into the park: an open change is called off, a made one is taken first.
void Model::stop_in_wait(State state, int i) {
  const Component& component = state.components[i];
  if (is_posted(component)) {
    if (state.changes[component.slot_change].cut().is_closed() && component.voted) {
      begin_take(state, i, After::kPark);
      return emit(state);
    }
    call_off_and_leave(state, i);
  }
  park(state, i);
  emit(state);
}

void Model::call_off_and_leave(State& state, int i) {
  call_off(state, state.components[i].slot_change);
  leave_slot(state.components[i]);
}

/// A stop comes by a shutdown, or by a command to a component that a made change starts.
void Model::rest_unstarted(State state, int i) {
  Component& component = state.components[i];
  if (!component.stop) {
    if (is_posted(component)) look(state, i);
    return;
  }
  if (is_posted(component)) {
    if (state.changes[component.slot_change].cut().is_closed() && component.voted) {
      begin_take(state, i, After::kStayUnstarted);
      return emit(state);
    }
    call_off_and_leave(state, i);
  }
  component.stop = false;
  go(state, i, state.shutdown != Shutdown::kNone ? Step::kEnded : Step::kUnstarted);
}

// ---- executions

void Model::begin_execution(State& state, int i) {
  check_begin(state, i);
  Component& component = state.components[i];
  component.step = Step::kExecuting;
  component.last = component.clock;
  component.entered = std::max(component.entered, component.clock);
}

void Model::execute(State state, int i) {
  Component& component = state.components[i];
  if (component.condemned) return go(state, i, Step::kReturning);
  if (has(scenario_.hang, i)) {
    State hung = state;
    go(hung, i, Step::kHung);
  }
  for (int r = 0; r < kResources; ++r) {
    if ((component.ends & writes(r)) != 0) write(state, i, r, component.clock, false, component.owner[r]);
  }
  ++component.clock;
  go(state, i, Step::kWaiting);
}

/// A condemned thread. A claimed one waits until the removal is decided.
void Model::come_back(State state, int i) {
  Component& component = state.components[i];
  if (component.claimed && !component.abandoned) {
    bool is_removed = false;
    for (int k = 0; k < kChanges; ++k)
      is_removed |= takes_part(k, i) && part(k, i).removes && state.changes[k].cut().is_closed();
    if (!is_removed) return;
    component.abandoned = true;
  }
  if (component.abandoned && !is(Twin::kAbandonedTakes)) {
    leave_slot(component);
    component.ends = 0;
    return go(state, i, Step::kEnded);
  }
  for (int r = 0; is(Twin::kCondemnedWrites) && r < kResources; ++r) {
    if ((component.ends & writes(r)) != 0) write(state, i, r, component.clock, false, component.owner[r]);
  }
  if (component.slot != Slot::kEmpty) {
    if (state.changes[component.slot_change].cut().is_closed() && component.voted) {
      begin_take(state, i, After::kFault);
      return emit(state);
    }
    call_off_and_leave(state, i);
  }
  component.stop = component.start = false;
  go(state, i, Step::kParked);
}

/// A hook that hangs may end once its thread is condemned, or never.
void Model::come_back_from_hook(State state, int i, Step hook) {
  Component& component = state.components[i];
  if (!component.condemned || component.is_lost) return;
  if (hook == Step::kTaking) component.after = After::kFault;
  go(state, i, hook);
}

// ---- the vote

void Model::adopt(State state, int i) {
  Component& component = state.components[i];
  check_adopt(state, i);
  if (component.condemned) {
    component.after = After::kWait;
    return go(state, i, Step::kReturning);
  }
  if (has(scenario_.hang_in_adopt, i)) {
    State hung = state;
    go(hung, i, Step::kAdoptHung);
    hung.components[i].is_lost = true;
    emit(hung);
  }
  if (has(scenario_.refuse, i)) {
    State refused = state;
    call_off_and_leave(refused, i);
    go_on(refused, i);
    emit(refused);
  }
  go(state, i, Step::kVoting);
}

void Model::vote(State state, int i) {
  Component& component = state.components[i];
  const int k = component.slot_change;
  const CutWord seen = call_cut(state, k, [&](Cut& cut) { return cut.raise(component.entered); });
  if (seen.is_off()) {
    leave_slot(component);
    go_on(state, i);
    return emit(state);
  }
  component.voted = true;
  if (--state.changes[k].to_vote == 0) return go(state, i, Step::kClosing);
  component.slot = Slot::kPosted;
  go_on(state, i);
  emit(state);
}

void Model::close(State state, int i) {
  Component& component = state.components[i];
  const int k = component.slot_change;
  close_cut(state, k);
  if (state.changes[k].cut().is_off())
    leave_slot(component);
  else
    component.slot = Slot::kPosted;
  go_on(state, i);
  emit(state);
}

/// Where its visit of the slot has interrupted it.
void Model::go_on(State& state, int i) {
  Component& component = state.components[i];
  switch (component.after) {
    case After::kWait:
      component.step = Step::kWaiting;
      break;
    case After::kExecute:
      begin_execution(state, i);
      break;
    case After::kStayParked:
      component.step = Step::kParked;
      break;
    case After::kPark:
    case After::kFault:
      park(state, i);
      break;
    case After::kStayUnstarted:
      component.step = Step::kUnstarted;
      break;
  }
  component.after = After::kWait;
}

// ---- the take

/// Raises the floors of the ends that it gains, so that no former owner writes after T.
void Model::begin_take(State& state, int i, After after) {
  Component& component = state.components[i];
  const int k = component.slot_change;
  component.slot = Slot::kBusy, component.step = Step::kTaking, component.after = after;
  for (int r = 0; r < kResources; ++r) {
    if (!gains(k, i, r, component.ends)) continue;
    bool is_given = false;  // by a component of this change
    for (int j = 0; j < kComponents; ++j) {
      const bool loses =
          j != i && takes_part(k, j) && part(k, j).rewires && (part(k, j).ends & writes(r)) == 0;
      is_given |= loses && (state.components[j].ends & writes(r)) != 0;
    }
    if (is(Twin::kFloorOnlyInSameChange) && !is_given) continue;
    const auto instant = static_cast<std::uint8_t>(state.changes[k].instant());
    state.resources[r].floor = std::max(state.resources[r].floor, instant);
  }
}

void Model::take(State state, int i) {
  if (has(scenario_.hang_in_take, i) && !state.components[i].condemned) {
    State hung = state;
    go(hung, i, Step::kTakeHung);
    hung.components[i].is_lost = true;
    emit(hung);
  }
  end_take(state, i);
  emit(state);
}

void Model::end_take(State& state, int i) {
  Component& component = state.components[i];
  const int k = component.slot_change;
  Change& change = state.changes[k];
  if (part(k, i).removes) write_safe(state, i, change.frontier());  // a new owner's value stays
  if (part(k, i).rewires) put_in(state, i, k);
  if (part(k, i).replaces_core) {
    component.core = static_cast<std::uint8_t>(1 + k);
    const bool ends_probation = state.probation == Probation::kRunning && part(0, i).has_probation;
    if (part(k, i).has_probation)
      state.probation = Probation::kRunning;
    else if (ends_probation)
      state.probation = Probation::kEndedByTake;
  }
  component.taken |= static_cast<std::uint8_t>(1 << k);
  --change.to_pass;
  leave_slot(component);
  const auto frontier = static_cast<std::uint8_t>(change.frontier());
  if (options_.take_raises) component.entered = std::max(component.entered, frontier);
  go_on_after_take(state, i, k);
}

/// Old ends out, new ends in.
void Model::put_in(State& state, int i, int k) {
  Component& component = state.components[i];
  const Change& change = state.changes[k];
  for (int r = 0; r < kResources; ++r) {
    Resource& resource = state.resources[r];
    const bool has_command = resource.value == Value::kCommand && resource.commander == i;
    const bool loses = (component.ends & writes(r)) != 0 && (part(k, i).ends & writes(r)) == 0;
    if (loses && has_command) {
      resource.value = part(k, i).removes ? Value::kSafe : Value::kHandedOver;
      resource.commander = 0;
    }
    if (!gains(k, i, r, component.ends)) continue;
    component.owner[r] = change.owner[r];
    component.gained_at[r] = static_cast<std::uint8_t>(change.instant());
  }
  component.ends = part(k, i).ends;
}

void Model::go_on_after_take(State& state, int i, int k) {
  Component& component = state.components[i];
  if (part(k, i).removes) {
    component.removed = true, component.start = component.stop = false;
    component.ends = 0;
    component.step = component.condemned ? Step::kReturning : Step::kParked;
    component.after = After::kWait;
    return;
  }
  if (component.condemned) {
    component.step = Step::kReturning, component.after = After::kWait;
    return;
  }
  if (part(k, i).stops && component.after != After::kFault && component.after != After::kStayParked)
    return park(state, i);
  if (part(k, i).adds && component.stop) return park(state, i);
  if (part(k, i).adds) {
    component.clock = static_cast<std::uint8_t>(state.changes[k].instant());
    component.after = After::kWait;
  }
  go_on(state, i);
}

// ---- parked

/// Its safe outputs have the stamp of now.
void Model::park(State& state, int i) {
  constexpr int kBeyond = 6;
  Component& component = state.components[i];
  if (!component.condemned) write_safe(state, i, options_.horizon + kBeyond);
  component.step = Step::kParked, component.after = After::kWait;
  component.stop = component.start = false;
}

void Model::rest_parked(State state, int i) {
  Component& component = state.components[i];
  if (component.removed) return rest_removed(state, i);
  if (component.condemned) {
    if (!is_posted(component) || component.abandoned) return;
    call_off(state, component.slot_change);
    if (!state.changes[component.slot_change].cut().is_off()) return;
    leave_slot(component);
    return emit(state);
  }
  if (component.stop) {  // of a shutdown: it leaves its slot, and starts no more
    if (is_posted(component) && component.voted && state.changes[component.slot_change].cut().is_closed()) {
      begin_take(state, i, After::kStayParked);
      return emit(state);
    }
    if (is_posted(component)) call_off_and_leave(state, i);
    component.stop = component.start = false;
    return emit(state);
  }
  if (component.start) start(state, i);
  if (is_posted(component)) look(state, i);
}

void Model::rest_removed(State state, int i) {
  Component& component = state.components[i];
  if (component.stop) {
    component.stop = false;
    return emit(state);
  }
  if (component.start) require(false, "a removed component starts");
}

/// It looks at its slot first: a made removal wins. A vote that it has given stands, as it raises the cut from now on.
void Model::start(State state, int i) {
  Component& component = state.components[i];
  const bool is_free =
      !is_posted(component) || (component.voted && state.changes[component.slot_change].cut().is_open());
  if (!is_free && !is(Twin::kStartBeforeSlot)) return;
  for (int k = 0; k < kChanges; ++k) {
    const bool is_removed = takes_part(k, i) && part(k, i).removes && state.changes[k].cut().is_closed();
    require(!is_removed, "a removed component starts");
  }
  component.start = false;
  if (component.clock <= component.entered)
    component.clock = static_cast<std::uint8_t>(component.entered + 1);
  go(state, i, Step::kWaiting);
}

}  // namespace mauve::model::open_change
