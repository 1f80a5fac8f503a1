// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/parts/fsm.hpp"

#include <algorithm>
#include <map>
#include <numeric>

#include "mauve_rt/base/error.hpp"

#include "base/names.hpp"

namespace mauve {

namespace {

/// Of an event wait. Without events it is what an undeclared period is to the waits of other fsms.
constexpr time_ns_t kShortestTimeout = us_to_ns(100);
constexpr const char* kDeclareRemedy = "declare it in define()";

bool is_endless(const State& state) noexcept {
  return state.is_wait && state.event == nullptr && state.duration_ns == kForever;
}

std::vector<const State*> successors(const State& state) {
  std::vector<const State*> all;
  if (is_endless(state)) return all;  // nothing comes after it
  all.reserve(state.transitions.size() + 1);
  for (const Transition& transition : state.transitions) all.push_back(transition.to);
  all.push_back(state.next);
  return all;
}

/// Refuses a loop of execution states: it would never let time pass.
class LoopFinder {
 public:
  void search(const State& state) {
    visited_[&state] = true;
    path_.push_back(&state);
    for (const State* next : successors(state)) {
      if (next->is_wait) continue;
      const auto on_path = std::find(path_.begin(), path_.end(), next);
      if (on_path != path_.end()) refuse(on_path, *next);
      if (!visited_[next]) search(*next);
    }
    path_.pop_back();
  }
  bool visited(const State& state) { return visited_[&state]; }

 private:
  void refuse(std::vector<const State*>::iterator from, const State& closing) const {
    std::string loop;
    for (auto state = from; state != path_.end(); ++state) loop += (*state)->name + " -> ";
    throw Error(ErrorCode::loop_without_wait, "the states form a loop without a wait: " + loop + closing.name,
                {.expected = "a wait state in every loop", .remedy = "put a wait state between two of them"});
  }

  std::map<const State*, bool> visited_;
  std::vector<const State*> path_;
};

/// Tarjan's strongly connected components with potentials along the tree edges.
class CycleLengths {
 public:
  time_ns_t gcd_from(const State& initial) {
    visit(initial, 0);
    time_ns_t gcd = 0;
    for (const auto& [state, node] : nodes_) {
      for (const State* next : successors(*state)) {
        const Node& to = nodes_.at(next);
        if (to.component != node.component) continue;
        gcd = std::gcd(gcd, node.potential_ns + length_of(*state) - to.potential_ns);
      }
    }
    return gcd;
  }
  /// See wait_ends_ns(); after gcd_from().
  std::map<const State*, time_ns_t> ends_in_cycle_of(const State& initial) const {
    std::map<const State*, time_ns_t> ends;
    for (const auto& [state, node] : nodes_) {
      if (state->is_wait && node.component == nodes_.at(&initial).component)
        ends.emplace(state, node.potential_ns + length_of(*state));
    }
    return ends;
  }

 private:
  /// An event wait has none that a period could be made of.
  static time_ns_t length_of(const State& state) noexcept {
    return state.event != nullptr ? 0 : state.duration_ns;
  }

  struct Node {
    time_ns_t potential_ns;
    int index;
    int low;
    int component{-1};
  };

  void visit(const State& state, time_ns_t potential_ns) {
    const int index = static_cast<int>(nodes_.size());
    nodes_[&state] = {potential_ns, index, index, -1};
    stack_.push_back(&state);
    for (const State* next : successors(state)) {
      const auto known = nodes_.find(next);
      if (known == nodes_.end()) {
        visit(*next, potential_ns + length_of(state));
        nodes_[&state].low = std::min(nodes_[&state].low, nodes_[next].low);
      } else if (known->second.component < 0) {
        nodes_[&state].low = std::min(nodes_[&state].low, known->second.index);
      }
    }
    if (nodes_[&state].low != index) return;
    const State* member = nullptr;
    do {
      member = stack_.back();
      stack_.pop_back();
      nodes_[member].component = index;
    } while (member != &state);
  }

  std::map<const State*, Node> nodes_;
  std::vector<const State*> stack_;
};

/// All waits together bound the length of every path, so that sums of them do not overflow.
void check_lengths(const std::vector<const State*>& reachable) {
  time_ns_t all = 0;
  const State* longest = nullptr;
  for (const State* state : reachable) {
    if (!state->is_wait || state->duration_ns == kForever) continue;
    all = later_by(all, state->duration_ns);
    if (longest == nullptr || longest->duration_ns < state->duration_ns) longest = state;
  }
  if (all <= kLongest) return;
  throw Error(ErrorCode::bad_fsm, "the waits are too long",
              {.element = "state " + longest->name,
               .expected = "at most " + std::to_string(kLongest) + " ns, all waits together",
               .found = std::to_string(longest->duration_ns) + " ns in this one",
               .remedy = "wait for kForever where only a stop is to end the wait"});
}

/// As "50", or "5 * unit_ms, which is 50".
std::string in_words(const Duration& duration) {
  return (duration.text.empty() ? "" : duration.text + ", which is ") + std::to_string(duration.ns);
}

/// See FsmBase::initial_interarrival_ns().
time_ns_t interarrival_before(const State& initial, const std::vector<std::unique_ptr<State>>& states) {
  if (initial.is_wait) return 0;
  time_ns_t leading = kForever;
  time_ns_t any = kForever;
  for (const auto& state : states) {
    if (state->event == nullptr) continue;
    any = std::min(any, state->min_interarrival_ns);
    const auto all = successors(*state);
    if (std::find(all.begin(), all.end(), &initial) != all.end())
      leading = std::min(leading, state->min_interarrival_ns);
  }
  if (any == kForever) return 0;
  return leading != kForever ? leading : any;
}

}  // namespace

time_ns_t cycle_gcd_ns(const State& initial) {
  LoopFinder loops;
  std::vector<const State*> reachable{&initial};
  for (std::size_t i = 0; i < reachable.size(); ++i) {
    for (const State* next : successors(*reachable[i])) {
      if (std::find(reachable.begin(), reachable.end(), next) == reachable.end()) reachable.push_back(next);
    }
  }
  for (const State* state : reachable) {
    if (!state->is_wait && !loops.visited(*state)) loops.search(*state);
  }
  check_lengths(reachable);
  return CycleLengths().gcd_from(initial);
}

std::map<const State*, time_ns_t> wait_ends_ns(const State& initial) {
  CycleLengths cycles;
  cycles.gcd_from(initial);
  return cycles.ends_in_cycle_of(initial);
}

State& FsmBase::add_state(std::string name) {
  check_name("state", name);
  for (const auto& state : states_) {
    if (state->name == name) {
      throw Error(ErrorCode::duplicate_name, "the state is declared twice", {.element = "state " + name});
    }
  }
  states_.push_back(std::make_unique<State>());
  states_.back()->trace_id = TraceNames::intern(name);
  states_.back()->name = std::move(name);
  states_.back()->index = states_.size() - 1;
  return *states_.back();
}

State& FsmBase::add_execution(std::string name) {
  State& state = add_state(std::move(name));
  state.execution_time = &times_->emplace_back(state.name).time;
  return state;
}

State& FsmBase::wait(std::string name, const Duration& duration) {
  if (duration.ns <= 0) {
    throw Error(ErrorCode::bad_fsm, "a wait has no length",
                {.element = "state " + name, .expected = "a duration > 0 ns", .found = in_words(duration)});
  }
  State& state = add_state(std::move(name));
  state.is_wait = true;
  state.duration_ns = duration.ns;
  state.duration_text = duration.text;
  return state;
}

State& FsmBase::wait_event(std::string name, PortBase& port, const Duration& timeout,
                           const Duration& min_interarrival) {
  if (port.kind() != PortKind::read) {
    throw Error(ErrorCode::bad_fsm, "an event wait needs a port that reads",
                {.element = "state " + name,
                 .expected = "a read port",
                 .found = "the " + std::string(to_string(port.kind())) + " port " + port.name()});
  }
  if (min_interarrival.ns <= 0 || timeout.ns < min_interarrival.ns) {
    throw Error(
        ErrorCode::bad_fsm, "an event wait's times do not fit",
        {.element = "state " + name,
         .expected = "0 < min_interarrival_ns <= timeout_ns",
         .found = "min_interarrival_ns " + in_words(min_interarrival) + ", timeout_ns " + in_words(timeout)});
  }
  if (timeout.ns < kShortestTimeout) {
    throw Error(ErrorCode::bad_fsm,
                "the timeout of an event wait is so short that the component would never rest",
                {.element = "state " + name,
                 .expected = "timeout_ns of at least " + std::to_string(kShortestTimeout),
                 .found = in_words(timeout),
                 .remedy = "give a longer timeout, or wait for a length of time instead"});
  }
  if (min_interarrival.ns > kLongest) {
    throw Error(ErrorCode::bad_fsm, "the minimal interarrival of an event wait is too long",
                {.element = "state " + name,
                 .expected = "min_interarrival_ns of at most " + std::to_string(kLongest),
                 .found = in_words(min_interarrival),
                 .remedy = "give the least time between two releases"});
  }
  State& state = wait(std::move(name), timeout);
  state.event = std::make_unique<EventInput>(port);
  state.min_interarrival_ns = min_interarrival.ns;
  state.min_interarrival_text = min_interarrival.text;
  return state;
}

std::size_t FsmBase::add_method(Method method) {
  methods_.push_back(std::move(method));
  return methods_.size() - 1;
}

CoreBinding FsmBase::bind_dynamic(DynamicCore& core) const {
  CoreBinding binding{.object = nullptr, .dynamic = &core, .method_slots = {}};
  for (const Method& method : methods_) {
    const int slot = core.find_method(method.name());
    if (slot < 0) {
      throw Error(ErrorCode::type_mismatch, "the core lacks a method that the fsm calls",
                  {.element = core.description(),
                   .expected = "a method '" + method.name() + "' for " + description(),
                   .remedy = "add the method to the core"});
    }
    binding.method_slots.push_back(slot);
  }
  return binding;
}

bool FsmBase::configure_hook() {
  cleanup_hook();
  define();
  take_declared_times();
  if (initial_ == nullptr) {
    throw Error(ErrorCode::bad_fsm, "the machine has no initial state",
                {.element = description(), .expected = "set_initial(state)", .remedy = kDeclareRemedy});
  }
  for (const auto& state : states_) {
    if (is_endless(*state) && !state->transitions.empty()) {
      throw Error(ErrorCode::bad_fsm, "a guard would never be asked",
                  {.element = "state " + state->name,
                   .expected = "no transition from a wait that only a stop ends",
                   .found = "a transition to " + state->transitions.front().to->name,
                   .remedy = "give the wait a length, or leave the transition out"});
    }
    if (state->next == nullptr && !is_endless(*state)) {
      throw Error(
          ErrorCode::bad_fsm, "the state leads nowhere when no guard holds",
          {.element = "state " + state->name, .expected = "next(state, ...)", .remedy = kDeclareRemedy});
    }
  }
  sporadic_ =
      std::any_of(states_.begin(), states_.end(), [](const auto& state) { return state->event != nullptr; });
  initial_interarrival_ns_ = interarrival_before(*initial_, states_);
  for (const auto& state : states_) {
    const time_ns_t bound = state->max_execution_ns;
    if (bound != 0 && (smallest_bound_ns_ == 0 || bound < smallest_bound_ns_)) smallest_bound_ns_ = bound;
  }
  const time_ns_t cycles_ns = cycle_gcd_ns(*initial_);  // also refuses loops without a wait
  period_ns_ = sporadic_ ? 0 : std::gcd(cycles_ns, divisor_ns_);
  return true;
}

std::vector<DescribedState> FsmBase::describe_states() const {
  std::vector<DescribedState> all;
  for (const auto& state : states_) {
    all.push_back({.name = state->name,
                   .is_initial = state.get() == initial_,
                   .is_wait = state->is_wait,
                   .is_event_wait = state->event != nullptr,
                   .duration_ns = state->duration_ns,
                   .min_interarrival_ns = state->min_interarrival_ns,
                   .max_execution_ns = state->max_execution_ns,
                   .simulated_execution_ns = state->simulated_execution_ns,
                   .successors = {},
                   .wcet_ns = state->wcet_ns,
                   .duration_text = state->duration_text,
                   .min_interarrival_text = state->min_interarrival_text,
                   .action = state->is_wait ? "" : methods_[state->action].name(),
                   .guards = {},
                   .event_port = state->event != nullptr ? state->event->port().name() : "",
                   .wcet_core = {},
                   .methods_without_wcet = {},
                   .wcet_enforced = false});
    for (const State* next : successors(*state)) all.back().successors.push_back(next->name);
    for (const Transition& transition : state->transitions)
      all.back().guards.push_back(methods_[transition.guard].name());
  }
  return all;
}

void add_core_times(std::vector<DescribedState>& states, const std::string& core, const CoreTimes& times) {
  if (times.empty()) return;
  for (DescribedState& state : states) {
    if (state.wcet_ns != 0 || (state.is_wait && state.guards.empty())) continue;
    time_ns_t all_ns = 0;
    const auto add = [&](const std::string& method) {
      const auto found = times.find(method);
      if (found == times.end()) {
        state.methods_without_wcet.push_back(method);
      } else {
        all_ns = later_by(all_ns, found->second);
      }
    };
    if (!state.is_wait) add(state.action);
    for (const std::string& guard : state.guards) add(guard);
    state.wcet_core = core;
    if (state.methods_without_wcet.empty()) state.wcet_ns = all_ns;
  }
}

void FsmBase::take_declared_times() {
  for (const DeclaredState& declared : declared_states_) {
    for (const auto& state : states_) {
      if (state->name != declared.name) continue;
      state->wcet_ns = declared.wcet_ns.value_or(state->wcet_ns);
      if (state->is_wait) continue;
      state->max_execution_ns = declared.max_execution_ns.value_or(state->max_execution_ns);
      state->simulated_execution_ns = declared.simulated_execution_ns.value_or(state->simulated_execution_ns);
    }
  }
  for (const auto& state : states_) check_wcet(state->name, state->wcet_ns, state->max_execution_ns);
}

void FsmBase::cleanup_hook() {
  states_.clear();
  methods_.clear();
  times_ = std::make_shared<StateTimes>();
  initial_ = nullptr;
  period_ns_ = divisor_ns_ = smallest_bound_ns_ = initial_interarrival_ns_ = 0;
  sporadic_ = false;
}

void FsmBase::require_same_generation(const CoreBase& core) const {
  if (generation() == core.generation()) return;
  throw Error(ErrorCode::type_mismatch, "the fsm was compiled for another build of the core's class",
              {.element = description(),
               .expected = core.description() + " of generation " + std::to_string(generation()),
               .found = "generation " + std::to_string(core.generation()),
               .remedy = "build and reload both, or write the fsm for a base class of the core"});
}

}  // namespace mauve
