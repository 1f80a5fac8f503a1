// SPDX-License-Identifier: LGPL-3.0-or-later
// The steps of a requester: the draft, the install, the decision, the answer.
#include <algorithm>

#include "open_change/model.hpp"

namespace mauve::model::open_change {

void Model::step_requester(const State& from, int k) {
  State state = from;
  switch (from.changes[k].step) {
    case Request::kDrafting:
      return draft(from, k);
    case Request::kInstalling:
    case Request::kPressed:
      return install(from, k);
    case Request::kPosting:
      return post(from, k);
    case Request::kDeciding:
      return decide_for(from, k);
    case Request::kPublishing:
      publish(state, k);
      state.changes[k].step = Request::kPassing;
      return emit(state);
    case Request::kPassing:  // by the passes, or because its patience is over
      return answer(state, k, Answer::kMade);
    case Request::kRetracting:
      return retract(from, k);
    case Request::kNone:
    case Request::kAnswered:
      return;
  }
}

void Model::answer(State& state, int k, Answer answer) {
  state.changes[k].step = Request::kAnswered;
  state.changes[k].answer = answer;
  emit(state);
}

void Model::draft(State state, int k) {
  look_at_table(state);
  if (!is_valid(state, k)) return answer(state, k, Answer::kRefused);
  note_versions(state, k);
  state.changes[k].step = Request::kInstalling;
  emit(state);
}

/// One critical section. It waits without a claim.
void Model::install(State state, int k) {
  look_at_table(state);
  if (is_gate_closed(state)) return answer(state, k, Answer::kCalledOff);
  if (calls_off_for_urgent(state, k) || presses_once(state, k) || empties_slot(state, k)) return;
  bool is_unfit = false, waits_for_slot = false;
  for (int i = 0; i < kComponents; ++i) {
    const Component& component = state.components[i];
    if (!takes_part(k, i) || can_claim(state, k, i)) continue;
    waits_for_slot |= component.slot != Slot::kEmpty && !is(Twin::kClaimsBeforeSlotsAreFree);
    is_unfit |= component.condemned || component.removed || component.step == Step::kEnded;
  }
  if (waits_for_slot || waits_for_open(state, k)) return wait_for_late(state, k);
  if (is_unfit) return answer(state, k, Answer::kRefused);
  if (!is_current(state, k)) return answer(state, k, Answer::kStale);
  const int frontier = since(state, k);
  call_cut(state, k, [frontier](Cut& cut) { return cut.raise(frontier); });
  state.changes[k].step = Request::kPosting;
  if (is(Twin::kClaimsBeforeSlotsAreFree)) return emit(state);
  post(state, k);
}

/// An urgent change calls off the open ones that share an element with it.
bool Model::calls_off_for_urgent(State state, int k) {
  const bool is_over = is(Twin::kUrgentWaitsForOpen) || state.changes[k].step == Request::kPressed;
  if (k != kUrgent || is_over) return false;
  for (int j = 0; j < kUrgent; ++j) {
    const bool is_in_the_way = exists(j) && has_claims(state, j) && conflicts(state, j, k);
    if (!is_in_the_way || !state.changes[j].cut().is_open()) continue;
    call_off(state, j);
    emit(state);
    return true;
  }
  return false;
}

/// Of a twin only.
bool Model::presses_once(State state, int k) {
  if (!is(Twin::kUrgentPressesOnce) || k != kUrgent) return false;
  if (state.changes[k].step == Request::kInstalling) {
    state.changes[k].step = Request::kPressed;
    emit(state);
    return true;
  }
  if (!waits_for_open(state, k)) return false;
  answer(state, k, Answer::kStale);
  return true;
}

/// A slot whose change is off, and that its thread is not in.
bool Model::empties_slot(State state, int k) {
  if (is(Twin::kOnlyRequesterEmptiesSlot)) return false;
  for (int i = 0; i < kComponents; ++i) {
    Component& component = state.components[i];
    if (!takes_part(k, i) || can_claim(state, k, i) || !is_posted(component)) continue;
    if (!state.changes[component.slot_change].cut().is_off()) continue;
    leave_slot(component);
    emit(state);
    return true;
  }
  return false;
}

bool Model::waits_for_open(const State& state, int k) const {
  for (int j = 0; j < kChanges; ++j) {
    if (j != k && exists(j) && has_claims(state, j) && conflicts(state, j, k)) return true;
  }
  return false;
}

/// An urgent change waits for its own components only. Another one may give up, and answers who is late.
void Model::wait_for_late(State state, int k) {
  bool has_own = false, is_occupied = waits_for_open(state, k);
  for (int i = 0; i < kComponents; ++i) {
    const Component& component = state.components[i];
    if (!takes_part(k, i) || component.slot == Slot::kEmpty) continue;
    is_occupied = true;
    has_own |= !is_posted(component) || state.changes[component.slot_change].cut().is_closed();
  }
  if (k == kUrgent) return require(has_own, "a prepared stop of an innocent component waits for another one");
  require(is_occupied, "refused although nothing that it names is open");
  answer(state, k, Answer::kLate);
}

/// The latest T of the changes that it builds on. The cut starts there, so T lies later.
int Model::since(const State& state, int k) const {
  if (is(Twin::kCutStartsAtZero)) return 0;
  int latest = 0;
  for (int i = 0; i < kComponents; ++i) {
    const bool counts = takes_part(k, i) && !is(Twin::kRemovalOfHungIgnoresSince);
    if (counts) latest = std::max<int>(latest, state.table.since[i]);
  }
  for (int r = 0; r < kResources; ++r) {
    if (moves_writer(state, k, r)) latest = std::max<int>(latest, state.table.resource_since[r]);
  }
  return is(Twin::kSameInstantAllowed) ? latest - 1 : latest;
}

/// The change removes a component whose thread is condemned and has not come back.
bool Model::can_claim(const State& state, int k, int i) const {
  const Component& component = state.components[i];
  const bool is_away =
      component.step == Step::kExecuting || component.step == Step::kReturning || component.hangs();
  return part(k, i).removes && component.condemned && is_away;
}

/// In the critical section of the install: posts to each slot.
void Model::post(State state, int k) {
  const State before = state;
  if (state.changes[k].cut().is_off()) {
    state.changes[k].step = Request::kRetracting;
    return emit(state);
  }
  for (int i = 0; i < kComponents; ++i) {
    if (!takes_part(k, i)) continue;
    if (can_claim(state, k, i)) {
      claim(state, k, i);
    } else if (state.components[i].slot != Slot::kEmpty) {  // of a twin only
      State off = before;
      call_off(off, k);
      return emit(off);
    } else if (!post_to(state, k, i)) {
      break;
    }
  }
  state.changes[k].step = Request::kDeciding;
  if (state.changes[k].to_vote == 0) close_cut(state, k);
  emit(state);
}

bool Model::post_to(State& state, int k, int i) {
  Component& component = state.components[i];
  if (component.condemned || component.removed || component.step == Step::kEnded) {
    call_off(state, k);
    return false;
  }
  component.slot = Slot::kPosted, component.slot_change = static_cast<std::uint8_t>(k);
  component.voted = false;
  return true;
}

/// The removal does not ask a condemned component: its requester votes for it.
void Model::claim(State& state, int k, int i) {
  Component& component = state.components[i];
  if (component.slot != Slot::kEmpty) call_off(state, component.slot_change);
  component.claimed = true;
  --state.changes[k].to_vote;
  call_cut(state, k, [&component](Cut& cut) { return cut.raise(component.entered); });
}

void Model::decide_for(State state, int k) {
  Change& change = state.changes[k];
  if (change.cut().is_open()) {
    bool is_one_gone = false;  // it is condemned, so it does not vote
    for (int i = 0; i < kComponents; ++i)
      is_one_gone |= takes_part(k, i) && state.components[i].condemned && !state.components[i].claimed;
    const bool gives_up = k != kUrgent || is_one_gone || is_gate_closed(state);
    if (!gives_up) return;
    call_off(state, k);
    change.step = Request::kRetracting;
    return emit(state);
  }
  look_at_table(state);
  if (is(Twin::kLookDoesNotFold) && change.cut().is_closed()) publish(state, k);
  change.step = change.cut().is_off()             ? Request::kRetracting
                : is(Twin::kPublishedByRequester) ? Request::kPublishing
                                                  : Request::kPassing;
  if (change.cut().is_closed()) abandon_claimed(state, k);
  emit(state);
}

/// The removal is made: the claimed thread touches nothing any more.
void Model::abandon_claimed(State& state, int k) {
  for (int i = 0; i < kComponents; ++i) {
    if (!takes_part(k, i) || !part(k, i).removes || !state.components[i].claimed) continue;
    state.components[i].abandoned = true;
    --state.changes[k].to_pass;
  }
}

/// A busy slot keeps the record, and does not delay the answer.
void Model::retract(State state, int k) {
  for (int i = 0; i < kComponents; ++i) {
    Component& component = state.components[i];
    if (!takes_part(k, i)) continue;
    if (component.claimed && part(k, i).removes) component.claimed = false;
    if (component.is_at(k) && is_posted(component)) leave_slot(component);
    if (component.is_at(k) && is(Twin::kAnswerWaitsForBusySlot)) return;
    const bool never_starts = part(k, i).adds && component.slot == Slot::kEmpty;
    if (never_starts && component.step == Step::kUnstarted) component.step = Step::kEnded;
  }
  answer(state, k, Answer::kCalledOff);
}

}  // namespace mauve::model::open_change
