// SPDX-License-Identifier: LGPL-3.0-or-later
// What must hold in every state of the model, and in every state at which a run ends.
#include "open_change/model.hpp"

namespace mauve::model::open_change {

void Model::require(bool holds, const char* invariant) {
  if (!holds && violation_.empty()) violation_ = invariant;
}

// ---- each state

void Model::check_state(const State& state) {
  for (int i = 0; i < kComponents; ++i) check_thread(state, i);
  for (int k = 0; k < kChanges; ++k) check_exclusion(state, k);
  State seen = state;
  look_at_table(seen);
  for (int i = 0; i < kComponents; ++i)
    require(!seen.components[i].can_run() || is_listed(seen, i), "a component that can run is not listed");
  if (state.shutdown != Shutdown::kAnswered) return;
  for (const Component& component : state.components) {
    const bool is_over = component.step == Step::kParked || !component.is_alive() || component.condemned;
    require(is_over, "a component's thread runs on after shutdown");
  }
}

void Model::check_thread(const State& state, int i) {
  const Component& component = state.components[i];
  const bool is_in_take = component.step == Step::kTaking || component.step == Step::kTakeHung;
  const bool uses_ends = is_in_take || component.step == Step::kExecuting || component.step == Step::kHung ||
                         component.step == Step::kReturning;
  const bool is_over =
      component.step == Step::kParked || component.step == Step::kEnded || component.condemned;
  for (int r = 0; r < kResources; ++r) {
    const Resource& resource = state.resources[r];
    const bool uses = uses_ends && (component.ends & both(r)) != 0;
    require(!uses || !resource.is_retired, "a thread uses a resource that is retired");
    const bool connects = is_in_take && (part(component.slot_change, i).ends & both(r)) != 0;
    require(!connects || !resource.is_retired, "a take connects to a resource that is retired");
    const bool commands =
        resource.value == Value::kCommand && resource.commander == i && !resource.is_retired;
    require(!is_over || !commands, "a component that is stopped, ended or condemned still commands");
  }
  const bool is_in_record = component.slot == Slot::kBusy;
  require(!is_in_record || !state.changes[component.slot_change].is_freed,
          "a thread is in a record that is freed");
}

/// A change that holds a claim does not wait for a late component.
void Model::check_exclusion(const State& state, int k) {
  const Change& change = state.changes[k];
  if (change.step != Request::kPosting || !change.cut().is_open()) return;
  for (int i = 0; i < kComponents; ++i) {
    const Component& component = state.components[i];
    const bool is_late = takes_part(k, i) && component.slot != Slot::kEmpty && !component.is_at(k);
    require(!is_late || component.claimed, "innocents are claimed while their change waits for a late one");
  }
}

// ---- steps

/// An execution begins: it has new parts if and only if its clock is T or later.
void Model::check_begin(const State& state, int i) {
  const Component& component = state.components[i];
  for (int k = 0; k < kChanges; ++k) {
    if (!takes_part(k, i)) continue;
    const Change& change = state.changes[k];
    const bool has_new = component.has_taken(k);
    require(!has_new || change.cut().is_closed(), "new parts of a change that is not made");
    require(!has_new || !part(k, i).removes, "a removed component executes");
    if (!change.cut().is_closed()) continue;
    require(!has_new || component.clock >= change.instant(), "new parts before T");
    require(has_new || component.clock < change.instant(), "old parts from T on");
  }
  const bool is_reverted = state.probation == Probation::kReverted && component.core == 0;
  if (is_reverted && part(0, i).has_probation)
    require((state.old_core_freed[i] & 1) == 0, "a reverted core is freed already");
}

void Model::check_adopt(const State& state, int i) {
  const Component& component = state.components[i];
  const int k = component.slot_change;
  require(!state.changes[k].is_freed, "an adopt in a record that is freed");
  if (component.condemned || part(k, i).stops || state.changes[k].cut().is_off()) return;
  int versions = part(0, i).has_probation && state.probation == Probation::kReverted ? 1 : 0;
  for (int j = 0; j < kChanges; ++j)
    versions += j != k && takes_part(j, i) && !part(j, i).stops && component.has_taken(j);
  require(state.changes[k].drafted_for[i] == versions,
          "adopts from parts that are not the ones it was drafted for");
}

void Model::check_closed(const State& state, int k) {
  const Change& change = state.changes[k];
  for (int i = 0; i < kComponents; ++i) {
    const Component& component = state.components[i];
    require(!takes_part(k, i) || component.claimed || component.last < change.instant(),
            "T lies before an execution with old parts");
  }
  if (!options_.checks_order || is(Twin::kSameInstantAllowed)) return;
  for (int j = 0; j < kChanges; ++j) {
    const Change& earlier = state.changes[j];
    if (j == k || !exists(j) || !earlier.cut().is_closed()) continue;
    bool shares = false;
    for (int i = 0; i < kComponents; ++i) shares |= takes_part(j, i) && takes_part(k, i);
    for (int r = 0; r < kResources; ++r) shares |= earlier.moves_writer[r] && change.moves_writer[r];
    require(!shares || change.instant() > earlier.instant(),
            "of two changes with a common element the later has not the later instant");
  }
}

void Model::check_table(const State& state) {
  const Table& table = state.table;
  for (int r = 0; r < kResources; ++r) {
    int writers = 0;
    for (int i = 0; i < kComponents; ++i) {
      if (!table.has_component[i]) continue;
      if ((table.ends[i] & writes(r)) != 0) ++writers;
      require((table.ends[i] & both(r)) == 0 || table.has_resource[r],
              "a published component is connected to a removed resource");
    }
    require(writers <= 1 || is(Twin::kWritersCountedByThreads),
            "two writers of a single-writer resource are published");
  }
}

// ---- the end of a run

void Model::check_end(const State& state) {
  for (int k = 0; k < kChanges; ++k) {
    if (exists(k)) check_end_of_change(state, k);
  }
  for (int i = 0; i < kComponents; ++i) check_end_of_component(state, i);
  for (int r = 0; r < kResources; ++r) check_end_of_resource(state, r);
  require(!scenario_.shutdown || state.shutdown == Shutdown::kAnswered, "a shutdown is never answered");
}

void Model::check_end_of_change(const State& state, int k) {
  const Change& change = state.changes[k];
  require(change.step == Request::kAnswered, "a requester is never answered");
  bool is_innocent = state.shutdown == Shutdown::kNone;
  for (int i = 0; i < kComponents; ++i) {
    if (!takes_part(k, i)) continue;
    const Component& component = state.components[i];
    const bool is_well =
        !component.condemned && !component.claimed && !component.abandoned && !component.hangs();
    require(!change.cut().is_closed() || component.has_taken(k) || !is_well,
            "made, but a component that is well has not taken");
    require(!change.cut().is_off() || !component.has_taken(k), "called off, but a component has taken");
    const Set disturbed = scenario_.stop | scenario_.force | scenario_.hang | scenario_.hang_in_adopt;
    if (has(disturbed, i)) is_innocent = false;
  }
  require(k != kUrgent || !is_innocent || change.answer == Answer::kMade,
          "a prepared stop of an innocent component was not made");
}

void Model::check_end_of_component(const State& state, int i) {
  const Component& component = state.components[i];
  const bool is_stuck = component.hangs() || component.condemned;
  const bool is_waiting = component.step == Step::kWaiting;
  const bool has_come_to_rest = is_waiting || component.step == Step::kParked || !component.is_alive();
  require(has_come_to_rest || is_stuck, "a component stands still");
  require(!component.stop || !is_waiting, "a stop never ends");
  require(!component.was_asked_to_stop || !is_waiting, "a component runs on after its stop");
  require(component.slot == Slot::kEmpty || is_stuck, "a slot is never emptied");
}

void Model::check_end_of_resource(const State& state, int r) {
  const Resource& resource = state.resources[r];
  for (int i = 0; i < kComponents; ++i) {
    const bool is_owner = state.table.has_component[i] && (state.table.ends[i] & writes(r)) != 0;
    if (!is_owner || !state.components[i].condemned || resource.value == Value::kSafe) continue;
    const Component& commander = state.components[resource.commander];
    const bool is_taken_over = resource.value == Value::kCommand && (commander.ends & writes(r)) != 0 &&
                               !commander.condemned && commander.step != Step::kParked &&
                               commander.step != Step::kEnded;
    require(is_taken_over, "the owner is condemned, and a former owner's command stands");
  }
  bool is_used = state.table.has_resource[r];
  for (const Component& component : state.components)
    is_used |= component.is_alive() && component.step != Step::kParked && component.step != Step::kWaiting;
  require(is_used || resource.is_retired, "a removed resource is never retired");
}

}  // namespace mauve::model::open_change
