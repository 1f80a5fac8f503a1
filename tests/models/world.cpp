// SPDX-License-Identifier: LGPL-3.0-or-later
// The world of the model: the first state, real time, commands and the watchdog.
#include "model.hpp"

namespace mauve::model {

namespace {
constexpr int kFirst[kMostComponents] = {1, 1, 2};
constexpr int kParkedAt = 2;
}  // namespace

State Model::initial() const {
  State state{};
  for (int i = 0; i < options_.components; ++i)
    state.components[i].clock = static_cast<std::uint8_t>(waits_for_events(i) ? 0 : kFirst[i]);
  if (options_.parked) {
    Component& parked = state.components[1];
    state.now = parked.last = parked.entered = kParkedAt;
    parked.step = Step::kParked;
    parked.clock = 0;
  }
  for (int k = 0; k < options_.changes; ++k) {
    Change& change = state.changes[k];
    for (int i = 0; i < options_.components; ++i)
      if (takes_part(k, i)) ++change.to_vote;
    change.to_pass = change.to_vote;
  }
  return state;
}

bool Model::takes_part(int change, int i) const {
  if (options_.components < 3 || options_.changes < 2) return i < options_.components;
  return i == 0 || i == 1 + change;
}

/// The first instant of a component's grid that is not before `from`; beyond the end: the first one that never comes.
int Model::next_instant(int i, int from) const {
  int instant = kFirst[i];
  while (instant < from) instant += kPeriod[i];
  return instant > options_.last_instant ? options_.last_instant + 1 : instant;
}

Decisions Model::decisions(const State& state) const {
  Decisions decisions;
  for (int k = 0; k < options_.changes; ++k)
    ++(state.changes[k].cut().is_closed() ? decisions.made : decisions.off);
  return decisions;
}

const std::vector<State>& Model::successors(const State& from) {
  next_.clear();
  for (int i = 0; i < options_.components; ++i) {
    const std::size_t before = next_.size();
    step_component(from, i);
    require(from.components[i].may_rest() || next_.size() > before, "a participant waits for another thread");
  }
  for (int k = 0; k < options_.changes; ++k) step_requester(from, k);
  step_world(from);
  return next_;
}

void Model::step_world(const State& from) {
  if (from.now < options_.last_instant) {
    State later = from;
    ++later.now;
    emit(later);
  }
  const int stoppable = options_.shutdown ? options_.components : options_.stop ? 1 : 0;
  for (int i = 0; i < stoppable; ++i) {
    State stopped = from;
    stopped.components[i].stop = true;
    if (!from.components[i].stop && !from.components[i].started) emit(stopped);
  }
  const Component& first = from.components[0];
  if ((first.step == Step::kHung || first.step == Step::kAdoptHung) && !first.timed_out) {
    State timed_out = from;
    timed_out.components[0].timed_out = true;
    emit(timed_out);
  }
  for (int i = 0; options_.start && i < options_.components; ++i) {
    State started = from;
    Component& component = started.components[i];
    const bool is_locked = component.mutex_holder != 0 && !is(Twin::kStartDuringChange);
    if (component.step != Step::kParked || component.started || component.timed_out || is_locked) continue;
    if (options_.remove && component.has_new[0]) continue;
    component.started = true, component.stop = false;
    component.clock = static_cast<std::uint8_t>(waits_for_events(i) ? 0 : next_instant(i, from.now + 1));
    go(started, i, Step::kWaiting);
  }
}

}  // namespace mauve::model
