// SPDX-License-Identifier: LGPL-3.0-or-later
// The world of the model: the first state, commands by name, the watchdog, a revert, and the shutdown.
#include <algorithm>

#include "open_change/model.hpp"

namespace mauve::model::open_change {

State Model::initial() const {
  State state{};
  for (bool& has_resource : state.table.has_resource) has_resource = true;
  for (int i = 0; i < kComponents; ++i) {
    Component& component = state.components[i];
    state.table.has_component[i] = !has(scenario_.absent, i);
    state.table.ends[i] = component.ends = scenario_.ends[i];
    component.clock = 1;
    component.step = has(scenario_.absent, i)   ? Step::kUnstarted
                     : has(scenario_.parked, i) ? Step::kParked
                                                : Step::kWaiting;
  }
  for (int k = 0; k < kChanges; ++k) {
    if (!exists(k)) continue;
    Change& change = state.changes[k];
    for (int i = 0; i < kComponents; ++i) {
      if (takes_part(k, i)) ++change.to_vote;
    }
    change.to_pass = change.to_vote;
    change.step = k == kUrgent ? Request::kInstalling : Request::kDrafting;
    if (k == kUrgent) note_versions(state, k);  // prepared beforehand
  }
  return state;
}

Decisions Model::decisions(const State& state) const {
  Decisions decisions;
  for (int k = 0; k < kChanges; ++k) {
    if (exists(k)) ++(state.changes[k].cut().is_closed() ? decisions.made : decisions.off);
  }
  return decisions;
}

const std::vector<State>& Model::successors(const State& from) {
  next_.clear();
  check_state(from);
  for (int i = 0; i < kComponents; ++i) step_component(from, i);
  for (int k = 0; k < kChanges; ++k) step_requester(from, k);
  step_world(from);
  return next_;
}

void Model::step_world(const State& from) {
  State folded = from;
  if (look_at_table(folded)) emit(folded);  // by any thread
  for (int i = 0; i < kComponents; ++i) {
    if (has(scenario_.stop, i)) stop_by_name(folded, i);
    if (has(scenario_.force, i) && is_listed(folded, i)) force_stop(folded, i);
    if (has(scenario_.start, i)) start_by_name(folded, i);
    if (scenario_.revert) revert(from, i);
  }
  if (scenario_.shutdown) shut_down(folded);
}

// ---- commands by name

/// A stop of a component that a made change starts is remembered: its take parks it.
void Model::stop_by_name(State state, int i) {
  Component& component = state.components[i];
  if (component.stop || !is_listed(state, i)) return;
  const bool is_running = component.can_run();
  const bool will_start = component.step == Step::kUnstarted ||
                          (component.after == After::kStayUnstarted && component.step != Step::kEnded &&
                           component.step != Step::kParked && component.step != Step::kWaiting);
  if (!is_running && !will_start) return;
  const bool forgets = is(Twin::kStopOfUnstartedForgotten);
  if (component.was_asked_to_stop && (will_start || forgets)) return;
  component.was_asked_to_stop = true;
  component.stop = is_running || !forgets;
  emit(state);
}

void Model::start_by_name(State state, int i) {
  Component& component = state.components[i];
  const bool is_refused = component.condemned || component.start || component.was_started ||
                          (component.removed && !is(Twin::kRemovedMayStart));
  if (component.step != Step::kParked || is_refused || is_gate_closed(state)) return;
  component.start = component.was_started = true;
  component.was_asked_to_stop = false;
  emit(state);
}

/// By the component's own thread, in its wait. An open change of its core is called off; a made one ends the probation.
void Model::revert(State state, int i) {
  Component& component = state.components[i];
  const bool is_in_wait = component.step == Step::kWaiting || component.step == Step::kParked;
  if (state.probation != Probation::kRunning || !part(0, i).has_probation || !is_in_wait) return;
  const bool is_known = !is(Twin::kProbationKnownWhenAllPassed) || state.changes[0].to_pass == 0;
  require(is_known, "a component runs on probation, and its revert is refused");
  const bool has_change = component.slot != Slot::kEmpty && part(component.slot_change, i).replaces_core;
  if (has_change && !is(Twin::kRevertLeavesOpenChange)) {
    if (state.changes[component.slot_change].cut().is_closed()) return;
    call_off_and_leave(state, i);
  }
  state.probation = Probation::kReverted;
  component.core = 0;
  ++state.table.version[i];
  require((state.old_core_freed[i] & 1) == 0, "a revert puts in a core that is freed");
  emit(state);
}

// ---- the watchdog

bool Model::can_condemn(const Component& component) const {
  const bool runs_user_code = component.hangs() || component.step == Step::kExecuting ||
                              component.step == Step::kAdopting || component.step == Step::kTaking;
  return !component.condemned && runs_user_code && component.after != After::kStayUnstarted;
}

void Model::force_stop(State state, int i) {
  if (!can_condemn(state.components[i])) return;
  condemn(state, i);
  emit(state);
}

/// The thread may never come back, so its safe outputs are written in its place.
void Model::condemn(State& state, int i) {
  Component& component = state.components[i];
  component.condemned = true;
  if (component.slot != Slot::kEmpty) call_off(state, component.slot_change);  // a made one stays made
  for (int r = 0; r < kResources; ++r) write_condemned(state, i, r);
  for (Resource& resource : state.resources) {
    const bool has_command = resource.value == Value::kCommand && resource.commander == i;
    if (!has_command || resource.floor <= component.entered) continue;
    resource.value = Value::kHandedOver;  // a new owner has the end
    resource.commander = 0;
  }
}

void Model::write_condemned(State& state, int i, int r) {
  const Component& component = state.components[i];
  const bool has_end = (component.ends & writes(r)) != 0;
  const bool is_in_take = component.step == Step::kTaking || component.step == Step::kTakeHung;
  // Not before the T by which it has the end: a successor's value stays, and its own floor does not stop it.
  int gained_at = is(Twin::kSafeOutputByOwnClock) ? 0 : component.gained_at[r];
  if (is(Twin::kSafeOutputInTakeAtT) && is_in_take)
    gained_at = state.changes[component.slot_change].instant();
  if (has_end && !(is_in_take && is(Twin::kSafeOutputByPresentEnds)))
    write(state, i, r, std::max<int>(component.entered, gained_at), true, component.owner[r]);
  // An end that a made change gives it, and that it has not taken: it is the owner from T on.
  if (component.slot == Slot::kEmpty || is(Twin::kSafeOutputByTakenEnds)) return;
  const Change& change = state.changes[component.slot_change];
  if (!change.cut().is_closed() || state.resources[r].is_retired) return;
  if (!gains(component.slot_change, i, r, component.ends)) return;
  std::uint8_t& floor = state.resources[r].floor;
  floor = std::max(floor, static_cast<std::uint8_t>(change.instant()));
  write(state, i, r, change.instant(), true, change.owner[r]);
}

// ---- the shutdown

void Model::shut_down(State state) {
  switch (state.shutdown) {
    case Shutdown::kNone:
      if (is(Twin::kShutdownListsBeforeGate)) {
        list_threads(state);
        state.shutdown = Shutdown::kListedTooEarly;
        return emit(state);
      }
      [[fallthrough]];
    case Shutdown::kListedTooEarly:
      state.shutdown = Shutdown::kGateClosed;
      return emit(state);
    case Shutdown::kGateClosed:
      return shut_down_changes(state);
    case Shutdown::kAllDecided:
      if (!is(Twin::kShutdownListsBeforeGate)) list_threads(state);
      state.shutdown = Shutdown::kListed;
      return emit(state);
    case Shutdown::kListed:
      for (int i = 0; i < kComponents; ++i) {
        Component& component = state.components[i];
        const bool is_listed = has(state.shutdown_list, i) && component.step != Step::kEnded;
        if (is_listed && !component.condemned) component.stop = true;
      }
      state.shutdown = Shutdown::kStopping;
      return emit(state);
    case Shutdown::kStopping:
      return shut_down_threads(state);
    case Shutdown::kAnswered:
      return;
  }
}

/// Calls off each installed change that is open, one by one.
void Model::shut_down_changes(State state) {
  for (int k = 0; k < kChanges; ++k) {
    const Change& change = state.changes[k];
    const bool is_installed = change.step >= Request::kPosting && change.step != Request::kAnswered;
    if (!is_installed || !change.cut().is_open()) continue;
    call_off(state, k);
    return emit(state);
  }
  state.shutdown = Shutdown::kAllDecided;
  emit(state);
}

/// The threads of this host, by whatever name. A change attaches the thread of a component that it adds before its install.
void Model::list_threads(State& state) const {
  state.shutdown_list = 0;
  for (int i = 0; i < kComponents; ++i) {
    bool is_attached = state.components[i].is_alive();
    for (int k = 0; k < kChanges; ++k) {
      const bool is_installed = state.changes[k].step >= Request::kPosting;
      const bool attaches = takes_part(k, i) && part(k, i).adds && is_installed;
      is_attached |= attaches && state.components[i].step != Step::kEnded;
    }
    if (is(Twin::kShutdownByNames) ? is_listed(state, i) : is_attached)
      state.shutdown_list |= static_cast<std::uint8_t>(1 << i);
  }
}

/// Parked with an empty slot, ended, or condemned.
bool Model::is_at_rest(const Component& component) const {
  const bool has_left = component.slot == Slot::kEmpty && !component.start && !component.stop;
  const bool is_parked = component.step == Step::kParked || component.step == Step::kUnstarted;
  return (is_parked && (has_left || is(Twin::kShutdownLeavesSlots))) || component.step == Step::kEnded ||
         component.condemned;
}

void Model::shut_down_threads(State state) {
  bool is_each_at_rest = true;
  for (int i = 0; i < kComponents; ++i) {
    if (!has(state.shutdown_list, i) || is_at_rest(state.components[i])) continue;
    is_each_at_rest = false;
    force_stop(state, i);
  }
  if (!is_each_at_rest) return;
  state.shutdown = Shutdown::kAnswered;
  emit(state);
}

}  // namespace mauve::model::open_change
