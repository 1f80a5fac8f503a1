// SPDX-License-Identifier: LGPL-3.0-or-later
// Changes that stay open while a participant is late, hung, stopped, removed or not started yet, as a model.
//
// The cut is the kernel's own (mauve::Cut); the other model explores its steps, here each call is one step. This model
// explores the rest of the protocol: claims, versions, the table and its fold, owners of writers' ends, retirement,
// stops, removals and the shutdown. A made change is not in the table yet: the next thread that looks at the table puts
// it in first, as CommitGate::Look does. Each thread may look at any time.
//
// One step is one atomic operation, or one critical section without user code. A thread may stall between any two
// steps, for any time: the explorer just does not choose it. A release may come at any time. Retirement is done as soon
// as the references allow: the worst case.
//
// The model leaves out:
// - memory orders,
// - fallbacks, shadows and listeners,
// - room (places of readers, listeners) and errors of allocation,
// - grids: restarts, epochs and `resynchronise`, and virtual time,
// - a name that is given again while its former bearer leaves,
// - `configure` and `promote`, which act on parts before the decision.
#pragma once

#include <string>
#include <vector>

#include "cut_call.hpp"
#include "open_change/scenarios.hpp"
#include "open_change/state.hpp"
#include "search.hpp"

namespace mauve::model::open_change {

class Model {
 public:
  using State = open_change::State;

  explicit Model(const Options& options) : options_(options), scenario_(options.scenario) {}

  State initial() const;
  /// Every state that one step leads to. Checks the state, and the invariants of the steps.
  const std::vector<State>& successors(const State& from);
  /// Checks a state in which no step is left.
  void check_end(const State& state);
  Decisions decisions(const State& state) const;

  /// The first invariant that does not hold; empty: all hold so far.
  const std::string& violation() const { return violation_; }
  std::string describe(const State& state) const;

 private:
  // invariants.cpp
  void require(bool holds, const char* invariant);
  void check_state(const State& state);
  void check_thread(const State& state, int i);
  void check_exclusion(const State& state, int k);
  void check_begin(const State& state, int i);
  void check_adopt(const State& state, int i);
  void check_closed(const State& state, int k);
  void check_table(const State& state);
  void check_end_of_change(const State& state, int k);
  void check_end_of_component(const State& state, int i);
  void check_end_of_resource(const State& state, int r);

  // participant.cpp: the thread of a component
  void step_component(const State& from, int i);
  void rest_unstarted(State state, int i);
  void wait(State state, int i);
  void stop_in_wait(State state, int i);
  void execute(State state, int i);
  void come_back(State state, int i);
  void come_back_from_hook(State state, int i, Step hook);
  void adopt(State state, int i);
  void vote(State state, int i);
  void close(State state, int i);
  void take(State state, int i);
  void rest_parked(State state, int i);
  void rest_removed(State state, int i);
  void start(State state, int i);
  void look(State state, int i);
  void begin_execution(State& state, int i);
  void begin_take(State& state, int i, After after);
  void end_take(State& state, int i);
  void put_in(State& state, int i, int k);
  void go_on_after_take(State& state, int i, int k);
  void go_on(State& state, int i);
  void park(State& state, int i);
  void call_off_and_leave(State& state, int i);

  // requester.cpp
  void step_requester(const State& from, int k);
  void draft(State state, int k);
  void install(State state, int k);
  bool calls_off_for_urgent(State state, int k);
  bool presses_once(State state, int k);
  bool empties_slot(State state, int k);
  bool waits_for_open(const State& state, int k) const;
  void wait_for_late(State state, int k);
  void post(State state, int k);
  bool post_to(State& state, int k, int i);
  void claim(State& state, int k, int i);
  void decide_for(State state, int k);
  void abandon_claimed(State& state, int k);
  void retract(State state, int k);
  void answer(State& state, int k, Answer answer);
  int since(const State& state, int k) const;
  bool can_claim(const State& state, int k, int i) const;

  // table.cpp: what is done under the gate, and by the keeper
  bool look_at_table(State& state);
  void publish(State& state, int k);
  void publish_part(State& state, int k, int i);
  void close_cut(State& state, int k);
  void number_owners(State& state, int k);
  bool is_valid(const State& state, int k) const;
  bool is_connectable(const State& state, int k, int r, const Ends* ends, bool exists) const;
  bool is_current(const State& state, int k) const;
  void note_versions(State& state, int k) const;
  bool has_claims(const State& state, int k) const;
  bool conflicts(const State& state, int j, int k) const;
  bool moves_writer(const State& state, int k, int r) const;
  bool moves_any_end(const State& state, int k, Ends ends) const;
  bool is_leaving(const State& state, int i) const;
  bool is_listed(const State& state, int i) const;
  void write(State& state, int i, int r, int stamp, bool is_safe, int owner);
  void write_safe(State& state, int i, int stamp);
  void keep(State& state);
  static void forget(State& state);
  bool is_held(const State& state, int k) const;
  bool is_in_use(const State& state, int r) const;
  void retire_old_cores(State& state) const;

  // world.cpp: commands, the watchdog, the shutdown
  void step_world(const State& from);
  void stop_by_name(State state, int i);
  void force_stop(State state, int i);
  void start_by_name(State state, int i);
  void revert(State state, int i);
  void shut_down(State state);
  void shut_down_changes(State state);
  void shut_down_threads(State state);
  void list_threads(State& state) const;
  bool is_at_rest(const Component& component) const;
  bool can_condemn(const Component& component) const;
  void condemn(State& state, int i);
  void write_condemned(State& state, int i, int r);

  template <typename Call>
  auto call_cut(State& state, int k, Call call) {
    return call_on<Cut>(state.changes[k].word, call);
  }
  void call_off(State& state, int k) {
    call_cut(state, k, [](Cut& cut) { return cut.call_off(); });
  }
  bool is(Twin twin) const { return options_.twin == twin; }
  bool exists(int k) const { return scenario_.plans[k].exists; }
  const Part& part(int k, int i) const { return scenario_.plans[k].parts[i]; }
  bool takes_part(int k, int i) const { return exists(k) && part(k, i).takes_part; }
  bool removes_resource(int k, int r) const { return scenario_.plans[k].removes_resource[r]; }
  /// The change gives the writer's end to the component, which does not have it yet.
  bool gains(int k, int i, int r, Ends has_now) const {
    return part(k, i).rewires && (part(k, i).ends & writes(r)) != 0 && (has_now & writes(r)) == 0;
  }
  bool publishes_late() const { return is(Twin::kPublishedWhenAllPassed) || is(Twin::kPublishedByRequester); }
  static bool is_gate_closed(const State& state) { return state.shutdown >= Shutdown::kGateClosed; }
  static bool is_posted(const Component& component) { return component.slot == Slot::kPosted; }
  static void leave_slot(Component& component) {
    component.slot = Slot::kEmpty, component.slot_change = 0, component.voted = false;
  }
  /// Retirement needs no step of its own: it is done as soon as it may be.
  void emit(State state) {
    keep(state);
    forget(state);
    next_.push_back(state);
  }
  void go(State& state, int i, Step step) {
    state.components[i].step = step;
    emit(state);
  }

  Options options_;
  Scenario scenario_;
  std::vector<State> next_;
  std::string violation_;
};

}  // namespace mauve::model::open_change
