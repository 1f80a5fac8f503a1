// SPDX-License-Identifier: LGPL-3.0-or-later
// A change of running components at one logical instant, as a model: which steps are possible in a state.
//
// One step is one atomic operation on a shared word. A thread may stall between any two steps, for any time: the
// explorer just does not choose it. Real time passes in steps of its own; a release of clock c is possible once real
// time has reached c, and may come arbitrarily late.
#pragma once

#include <string>
#include <vector>

#include "options.hpp"
#include "search.hpp"
#include "state.hpp"
#include "weak_cuts.hpp"

namespace mauve::model {

class Model {
 public:
  using State = model::State;

  static constexpr int kPeriod[kMostComponents] = {2, 3, 2};

  explicit Model(const Options& options) : options_(options) {}

  State initial() const;
  /// Every state that one step leads to. Checks the invariants of the steps.
  const std::vector<State>& successors(const State& from);
  /// Checks a state in which no step is left.
  void check_end(const State& state);
  /// Of the changes, in a state in which no step is left.
  Decisions decisions(const State& state) const;

  /// The first invariant that does not hold; empty: all hold so far.
  const std::string& violation() const { return violation_; }
  std::string describe(const State& state) const;

 private:
  // invariants.cpp
  void require(bool holds, const char* invariant);
  void check_record(const State& state, int change);
  void check_notice(const State& state, int i);
  void check_begin(const State& state, int i);
  void check_parts(const State& state, int i);
  void check_adopt(const State& state, int i);
  void check_closed(const State& state, int change);
  void check_epoch(const State& state, int i);
  bool is_lost(const Component& component) const;

  // participant.cpp: the thread of a component
  void step_component(const State& from, int i);
  void wait(const State& from, int i);
  void notice(State state, int i);
  void release(State state, int i);
  void adopt(State state, int i);
  void vote(State state, int i);
  void close(State state, int i);
  void close_if_idle(State state, int i);
  void look(State state, int i);
  void take(State state, int i);
  void clear(State state, int i);
  void raise(State state, int i);
  void execute(State state, int i);
  void park(State state, int i);
  void call_off(State state, int i);
  void come_back(State state, int i);
  Step after_decision() const;
  bool has_job_at(const State& state, int i, int frontier) const;
  void take_parts(State& state, int i, int change);

  // requester.cpp
  void step_requester(const State& from, int change);
  void await(State state, int change);
  void lock(State state, int change);
  void post(State state, int change);
  void notify(State state, int change);
  void vote_for(State state, int change);
  void decide(const State& from, int change);
  void retract(State state, int change);
  void wake(State state, int change);
  void pass_for(State state, int change);
  void pass(State state, int change);
  void time_out(State state, int change);
  void go_to_next(State& state, int change) const;

  // world.cpp: real time, commands, the watchdog
  void step_world(const State& from);

  template <typename Call>
  auto call_cut(State& state, int change, Call call) {
    return model::call_cut(options_.twin, state.changes[change].word, call);
  }
  bool is(Twin twin) const { return options_.twin == twin; }
  bool takes_part(int change, int i) const;
  bool waits_for_events(int i) const { return options_.event && i == options_.components - 1; }
  int next_instant(int i, int from) const;
  int epoch(const Change& change) const { return change.instant() + 1; }
  bool slots_are_empty(const State& state, int change) const;
  void emit(const State& state) { next_.push_back(state); }
  void go(State& state, int i, Step step) {
    state.components[i].step = step;
    emit(state);
  }

  Options options_;
  std::vector<State> next_;
  std::string violation_;
};

}  // namespace mauve::model
