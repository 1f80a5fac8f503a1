// SPDX-License-Identifier: LGPL-3.0-or-later
// The table of the architecture, what a change excludes, the values of resources, and the keeper, which retires.
#include <algorithm>

#include "open_change/model.hpp"

namespace mauve::model::open_change {

// ---- the fold

/// Under the gate's mutex, first: puts each made change into the table (CommitGate::Look). Whether there was one.
bool Model::look_at_table(State& state) {
  if (is(Twin::kLookDoesNotFold) || publishes_late()) return false;
  bool has_folded = false;
  for (int k = 0; k < kChanges; ++k) {
    if (!state.changes[k].cut().is_closed() || state.changes[k].is_published) continue;
    publish(state, k);
    has_folded = true;
  }
  return has_folded;
}

void Model::publish(State& state, int k) {
  Change& change = state.changes[k];
  change.is_published = true;
  state.table.has_changed = true;
  for (int i = 0; i < kComponents; ++i) {
    if (takes_part(k, i)) publish_part(state, k, i);
  }
  for (int r = 0; r < kResources; ++r) {
    if (change.moves_writer[r]) state.table.resource_since[r] = static_cast<std::uint8_t>(change.instant());
    if (removes_resource(k, r)) state.table.has_resource[r] = false;
  }
  check_table(state);
}

void Model::publish_part(State& state, int k, int i) {
  Table& table = state.table;
  if (part(k, i).rewires) table.ends[i] = part(k, i).ends;
  if (part(k, i).removes) table.has_component[i] = false, table.ends[i] = 0;
  if (part(k, i).adds) table.has_component[i] = true;
  if (!part(k, i).stops) ++table.version[i];
  table.since[i] = static_cast<std::uint8_t>(state.changes[k].instant());
}

/// By the last vote. The change is made; the next look at the table puts it in.
void Model::close_cut(State& state, int k) {
  if (!state.changes[k].cut().is_open()) return;
  call_cut(state, k, [](Cut& cut) { return cut.close(); });
  number_owners(state, k);
  check_closed(state, k);
}

/// The owners of a writer's end are numbered by the decisions that give the end to them.
void Model::number_owners(State& state, int k) {
  Change& change = state.changes[k];
  for (int r = 0; r < kResources; ++r) {
    change.moves_writer[r] = moves_writer(state, k, r);
    for (int i = 0; i < kComponents; ++i) {
      if (takes_part(k, i) && gains(k, i, r, state.table.ends[i]))
        change.owner[r] = ++state.resources[r].owners;
    }
  }
}

// ---- what an install tests

/// Whether the change's steps are possible in the table.
bool Model::is_valid(const State& state, int k) const {
  Ends ends[kComponents];
  for (int i = 0; i < kComponents; ++i) {
    ends[i] = state.table.ends[i];
    if (!takes_part(k, i)) continue;
    if (state.table.has_component[i] == part(k, i).adds) return false;
    if (part(k, i).rewires) ends[i] = part(k, i).ends;
  }
  for (int r = 0; r < kResources; ++r) {
    if (removes_resource(k, r) && !state.table.has_resource[r]) return false;
    if (!is_connectable(state, k, r, ends, state.table.has_resource[r] && !removes_resource(k, r)))
      return false;
  }
  return true;
}

/// With these ends: the resource exists if it is connected, and it has one writer.
bool Model::is_connectable(const State& state, int k, int r, const Ends* ends, bool exists) const {
  int writers = 0;
  for (int i = 0; i < kComponents; ++i) {
    if ((ends[i] & both(r)) != 0 && !exists) return false;
    const bool counts_thread = is(Twin::kWritersCountedByThreads) && !takes_part(k, i);
    if (((counts_thread ? state.components[i].ends : ends[i]) & writes(r)) != 0) ++writers;
  }
  return writers <= 1;
}

bool Model::is_current(const State& state, int k) const {
  if (is(Twin::kVersionsNotCompared)) return true;
  if (is(Twin::kUrgentStaleByAnyChange) && k == kUrgent && state.table.has_changed) return false;
  for (int i = 0; i < kComponents; ++i) {
    const bool compares = takes_part(k, i) && !part(k, i).stops;
    if (compares && state.table.version[i] != state.changes[k].drafted_for[i]) return false;
  }
  return is_valid(state, k);
}

/// A mere stop does not rely on the parts of the component.
void Model::note_versions(State& state, int k) const {
  for (int i = 0; i < kComponents; ++i) {
    if (takes_part(k, i) && !part(k, i).stops) state.changes[k].drafted_for[i] = state.table.version[i];
  }
}

/// From the install to the decision.
bool Model::has_claims(const State& state, int k) const {
  const Change& change = state.changes[k];
  const CutWord cut = change.cut();
  if (change.step < Request::kPosting) return false;
  if (is(Twin::kClaimsUntilAllPassed)) return !cut.is_off() && change.to_pass != 0;
  if (publishes_late() && cut.is_closed() && !change.is_published) return true;
  return cut.is_open() && change.step != Request::kAnswered;
}

/// They share an element. Two connections of readers do not exclude each other.
bool Model::conflicts(const State& state, int j, int k) const {
  for (int i = 0; i < kComponents; ++i) {
    if (takes_part(j, i) && takes_part(k, i)) return true;
  }
  if (is(Twin::kNoClaimsOfResources)) return false;
  for (int r = 0; r < kResources; ++r) {
    const bool j_removes = removes_resource(j, r), k_removes = removes_resource(k, r);
    if (j_removes && (k_removes || moves_any_end(state, k, both(r)))) return true;
    if (k_removes && moves_any_end(state, j, both(r))) return true;
    if (moves_writer(state, j, r) && moves_writer(state, k, r)) return true;
  }
  return false;
}

bool Model::moves_writer(const State& state, int k, int r) const {
  return moves_any_end(state, k, writes(r));
}

/// The change connects or disconnects one of these ends.
bool Model::moves_any_end(const State& state, int k, Ends ends) const {
  for (int i = 0; i < kComponents; ++i) {
    const bool rewires = takes_part(k, i) && part(k, i).rewires;
    if (rewires && ((part(k, i).ends ^ state.table.ends[i]) & ends) != 0) return true;
  }
  return false;
}

/// A made change removes it, and its thread has not taken that yet.
bool Model::is_leaving(const State& state, int i) const {
  const Component& component = state.components[i];
  if (is(Twin::kLeavingNotListed) || !component.is_alive() || component.removed) return false;
  for (int k = 0; k < kChanges; ++k) {
    if (takes_part(k, i) && part(k, i).removes && state.changes[k].cut().is_closed()) return true;
  }
  return false;
}

bool Model::is_listed(const State& state, int i) const {
  return state.table.has_component[i] || is_leaving(state, i);
}

// ---- the values of resources

/// A write by component i. Safe outputs are writes too.
void Model::write(State& state, int i, int r, int stamp, bool is_safe, int owner) {
  Resource& resource = state.resources[r];
  require(!resource.is_retired, "a write to a retired resource");
  if (resource.is_retired) return;
  const bool passes = is_safe && is(Twin::kSafeOutputPassesFloor);
  if (stamp < resource.floor && !passes) return;
  require(owner >= resource.newest_owner, "an old writer's value takes the place of a newer writer's");
  resource.newest_owner = static_cast<std::uint8_t>(owner);
  resource.value = is_safe ? Value::kSafe : Value::kCommand;
  resource.commander = static_cast<std::uint8_t>(is_safe ? 0 : i);
}

void Model::write_safe(State& state, int i, int stamp) {
  const Component& component = state.components[i];
  for (int r = 0; r < kResources; ++r) {
    if ((component.ends & writes(r)) != 0) write(state, i, r, stamp, true, component.owner[r]);
  }
}

// ---- the keeper: an ordinary thread

void Model::keep(State& state) {
  for (int k = 0; k < kChanges; ++k) {
    Change& change = state.changes[k];
    if (exists(k) && !is_held(state, k)) change.is_freed = true;
    const bool has_passed = change.cut().is_closed() && change.to_pass == 0;
    if (is(Twin::kPublishedWhenAllPassed) && has_passed && !change.is_published) publish(state, k);
  }
  for (int r = 0; r < kResources; ++r) {
    if (!state.table.has_resource[r] && !is_in_use(state, r)) state.resources[r].is_retired = true;
  }
  retire_old_cores(state);
}

/// The record of a change: by its requester, and by the slots.
bool Model::is_held(const State& state, int k) const {
  if (state.changes[k].step != Request::kAnswered) return true;
  for (const Component& component : state.components) {
    const bool counts = !component.condemned || !is(Twin::kRecordFreedAtAnswer);
    if (component.is_at(k) && counts) return true;
  }
  return false;
}

/// A removed resource: by a thread that is connected to it, and by a change that is in a slot.
bool Model::is_in_use(const State& state, int r) const {
  if (is(Twin::kRetiredByRemoverAlone)) {
    for (int k = 0; k < kChanges; ++k) {
      const Change& change = state.changes[k];
      if (removes_resource(k, r) && change.cut().is_closed() && change.to_pass != 0) return true;
    }
    return false;
  }
  for (int k = 0; k < kChanges; ++k) {
    if (removes_resource(k, r) && state.changes[k].cut().is_open()) return true;
  }
  for (const Component& component : state.components) {
    const bool ignores = is(Twin::kRetiredUnderCondemned);
    if (component.is_alive() && (component.ends & both(r)) != 0 && !(ignores && component.condemned))
      return true;
    if (ignores || component.slot == Slot::kEmpty) continue;
    const int i = static_cast<int>(&component - state.components);
    if (((component.ends | part(component.slot_change, i).ends) & both(r)) != 0) return true;
  }
  return false;
}

/// At the pass of its component; on probation, when that ends.
void Model::retire_old_cores(State& state) const {
  for (int k = 0; k < kUrgent; ++k) {
    for (int i = 0; i < kComponents; ++i) {
      if (!takes_part(k, i) || !part(k, i).replaces_core || !state.components[i].has_taken(k)) continue;
      const bool ends_by_verdict =
          state.probation == Probation::kRunning || state.probation == Probation::kReverted;
      const bool is_kept = part(k, i).has_probation && ends_by_verdict && !is(Twin::kOldCoreFreedOnProbation);
      if (!is_kept) state.old_core_freed[i] |= static_cast<std::uint8_t>(1 << k);
    }
  }
}

/// Clears what no later step reads: fewer states, the same runs.
void Model::forget(State& state) {
  for (int k = 0; k < kChanges; ++k) {
    Change& change = state.changes[k];
    const bool is_answered = change.step == Request::kAnswered;
    if (is_answered && k != kUrgent) change.answer = Answer::kUnknown;
    if (change.cut().is_open() && !is_answered) continue;
    change.to_vote = 0;
    for (std::uint8_t& version : change.drafted_for) version = 0;
    if (!is_answered || change.cut().is_closed() || !change.is_freed) continue;
    change.word = CutWord::kOff;
    change.to_pass = 0;
  }
}

}  // namespace mauve::model::open_change
