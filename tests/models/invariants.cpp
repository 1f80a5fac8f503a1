// SPDX-License-Identifier: LGPL-3.0-or-later
// What must hold in every state of the model, and in every state at which a run ends.
#include "model.hpp"

namespace mauve::model {

void Model::require(bool holds, const char* invariant) {
  if (!holds && violation_.empty()) violation_ = invariant;
}

void Model::check_record(const State& state, int change) {
  require(!state.changes[change].record_freed, "a change's record is used after it is freed");
}

/// A component that sleeps does not oversleep a change that was posted to it.
void Model::check_notice(const State& state, int i) {
  const Component& component = state.components[i];
  if (component.slot != Slot::kPosted || component.voted) return;
  const Change& change = state.changes[component.slot_change];
  const bool is_to_be_notified = change.step == Request::kNotifying && change.at == i;
  require(component.notified || is_to_be_notified || !change.cut().is_open(),
          "the notice of a change is lost");
}

/// An execution begins: it has new parts if and only if its clock is T or later.
void Model::check_begin(const State& state, int i) {
  const Component& component = state.components[i];
  require(component.last < component.clock, "a clock is executed twice");
  for (int k = 0; k < options_.changes; ++k) {
    if (!takes_part(k, i)) continue;
    const Change& change = state.changes[k];
    const bool is_made = change.cut().is_closed();
    if (component.has_new[k]) {
      require(is_made, "an execution has new parts of a change that is not made");
      require(component.clock >= change.instant(), "an execution before T has new parts");
    } else {
      require(!is_made || component.clock < change.instant(), "an execution from T on has old parts");
      require(!is_made || !options_.idle, "a job has old parts after the idle close");
    }
  }
  check_parts(state, i);
  check_epoch(state, i);
  if (state.earlier == 0 || !takes_part(0, i) || !takes_part(1, i)) return;
  const int first = state.earlier - 1, second = 1 - first;
  require(!component.has_new[second] || component.has_new[first] || !state.changes[first].cut().is_closed(),
          "an execution has the second change's parts without the first's");
}

void Model::check_parts(const State& state, int i) {
  for (int k = 0; k < options_.changes; ++k)
    require(!takes_part(k, i) || state.components[i].has_new[k] || !state.changes[k].old_freed,
            "parts are freed below an execution");
}

/// All participants count from one epoch, which was not past when the change was asked for.
void Model::check_epoch(const State& state, int i) {
  if (!options_.epoch || waits_for_events(i) || !state.components[i].has_new[0]) return;
  const int since = state.components[i].clock - epoch(state.changes[0]);
  require(since >= 0 && since % kPeriod[i] == 0, "an execution is not on the grid of the new epoch");
}

void Model::check_adopt(const State& state, int i) {
  const Component& component = state.components[i];
  check_record(state, component.slot_change);
  const int other = 1 - component.slot_change;
  const bool follows =
      state.earlier == 1 + other && takes_part(other, i) && state.changes[other].cut().is_closed();
  require(!follows || component.has_new[other], "an adopt copies from parts that are not in yet");
}

void Model::check_closed(const State& state, int k) {
  const Change& change = state.changes[k];
  const Change& other = state.changes[1 - k];
  for (int i = 0; i < options_.components; ++i)
    require(!takes_part(k, i) || state.components[i].last < change.instant(),
            "T lies before an execution that had old parts");
  for (int i = 0; i < options_.components && options_.idle; ++i) {
    const Component& component = state.components[i];
    const bool executes = component.step == Step::kBeginning || component.step == Step::kExecuting ||
                          component.step == Step::kHung;
    // An event that has not been released belongs to T, however old it is.
    const bool has_instant =
        !waits_for_events(i) && !component.is_parked() && component.clock <= options_.last_instant;
    const bool is_due = has_instant && component.clock <= change.frontier();
    require(!executes && !is_due, "a job is pending at T");
  }
  require(!options_.epoch || epoch(change) > change.requested_at,
          "the new epoch was past when it was asked for");
  const bool is_second = options_.changes == 2 && state.earlier == 2 - k;
  require(!is_second || !other.cut().is_closed() || change.instant() >= other.instant(),
          "the second change takes effect before the first");
}

bool Model::is_lost(const Component& component) const {
  return options_.lost && component.timed_out && !component.has_come_to_rest();
}

void Model::check_end(const State& state) {
  for (int k = 0; k < options_.changes; ++k) {
    const Change& change = state.changes[k];
    require(change.step == Request::kAnswered || change.step == Request::kFreed,
            "a requester is never answered");
    require(!change.cut().is_open(), "a change is never decided");
    for (int i = 0; i < options_.components; ++i) {
      if (!takes_part(k, i) || is_lost(state.components[i])) continue;
      const bool has_new = state.components[i].has_new[k];
      require(!change.cut().is_closed() || has_new, "a change is made, but a participant has not taken");
      require(!change.cut().is_off() || !has_new, "a change is off, but a participant has taken");
    }
  }
  for (int i = 0; i < options_.components; ++i) {
    const Component& component = state.components[i];
    require(component.mutex_holder == 0, "a command mutex is never unlocked");
    if (is_lost(component)) continue;
    require(component.has_come_to_rest(), "a component stands still outside of its wait");
    require(!component.stop || component.step != Step::kWaiting, "a stop never ends");
    require(component.slot == Slot::kEmpty, "a slot is never emptied");
  }
}

}  // namespace mauve::model
