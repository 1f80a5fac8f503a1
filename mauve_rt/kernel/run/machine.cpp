// SPDX-License-Identifier: LGPL-3.0-or-later
// The steps of a machine. Everything between a start and a park is real-time code.
#include "mauve_rt/run/machine.hpp"

#include <algorithm>
#include <stdexcept>

#include "mauve_rt/base/contract.hpp"
#include "mauve_rt/base/pi_mutex.hpp"

namespace mauve {

namespace {

/// A component that waits holds no lock, and none was taken twice on the way. Lets go of the lock first: others may wait.
void check_locks(int held_before) {
  if (PiMutex::was_misused_by_this_thread())
    throw std::logic_error("a lock was taken twice by its holder, or let go by who did not hold it");
  if (PiMutex::held_by_this_thread() <= held_before) return;
  PiMutex::let_go_of_all_but(held_before);
  throw std::logic_error("a lock is still held at the end of the state");
}

/// Of all bounds and budgets; 0: there is none.
time_ns_t smallest_bound_ns(const FsmBase& fsm, const CoreBinding* core) noexcept {
  time_ns_t smallest_ns = fsm.smallest_bound_ns();
  if (core == nullptr) return smallest_ns;
  for (const time_ns_t budget_ns : core->budgets_ns) {
    if (budget_ns != 0 && (smallest_ns == 0 || budget_ns < smallest_ns)) smallest_ns = budget_ns;
  }
  return smallest_ns;
}

}  // namespace

void Machine::set_parts(const FsmBase& fsm, CoreBinding* core, time_ns_t period_ns) noexcept {
  fsm_ = &fsm;
  core_ = core;
  period_ns_.store(period_ns, std::memory_order_relaxed);
  context_.period_ns.store(period_ns, std::memory_order_relaxed);  // relaxed: a lone number
  // After a wait for an event nothing can be foreseen: the thread wakes the watchdog itself.
  wait_bound_ns_.store(fsm.is_sporadic() ? 0 : smallest_bound_ns(fsm, core), std::memory_order_relaxed);
}

time_ns_t Machine::join(time_ns_t epoch_ns) noexcept {
  const time_ns_t first_ns = later_by(epoch_ns, settings_.offset_ns);
  set_deployment(epoch_ns);
  count_from(first_ns);
  return first_ns;
}

void Machine::set_deployment(time_ns_t epoch_ns) noexcept {
  deployment_ns_.store(later_by(epoch_ns, settings_.offset_ns), std::memory_order_relaxed);
}

void Machine::count_from(std::optional<time_ns_t> reference_ns) noexcept {
  reference_ns_.store(reference_ns.value_or(deployment_ns_.load(std::memory_order_relaxed)),
                      std::memory_order_relaxed);
}

void Machine::start(time_ns_t instant_ns) noexcept {
  MAUVE_EXPECTS(fsm_ != nullptr && core_ != nullptr);
  leave_event_to(fsm_->initial());
  if (const time_ns_t least = fsm_->initial_interarrival_ns(); least != 0)
    instant_ns = std::max(instant_ns, later_by(active_ns_, least));
  execution_.enter();
  waiting_ = next_ = &fsm_->initial();
  is_cold_ = true;
  event_settled_ = true;
  set_clock_ns(instant_ns);
  grid_place_ns_ = 0;
  current_.store(waiting_->trace_id, std::memory_order_relaxed);
  tell_wait();
}

void Machine::start_in(const State& wait, time_ns_t instant_ns) noexcept {
  execution_.enter();
  waiting_ = &wait;
  next_ = nullptr;
  is_cold_ = false;
  event_settled_ = true;
  set_clock_ns(instant_ns);
  grid_place_ns_ = 0;
  current_.store(wait.trace_id, std::memory_order_relaxed);
  tell_wait();
}

void Machine::leave_event_to(const State& initial) noexcept {
  if (waiting_ == nullptr || waiting_->event == nullptr) return;
  if (!initial.is_wait) {
    waiting_->event->consume();
  } else if (event_ns_ != kNever) {
    waiting_->event->keep(event_ns_);
  }
  event_ns_ = kNever;
}

bool Machine::keep_place(std::span<const KeptWait> waits, time_ns_t period_ns) noexcept {
  if (waiting_ == nullptr || next_ != nullptr) return false;  // parked, or before its first release
  const auto kept = std::find_if(waits.begin(), waits.end(),
                                 [this](const KeptWait& wait) { return wait.before == waiting_; });
  if (kept == waits.end()) return false;
  const Grid grid{.reference_ns = reference_ns_.load(std::memory_order_relaxed), .period_ns = period_ns};
  if (event_settled_ && period_ns != 0 && grid.phase_error(clock_ns() - kept->place_ns) != 0) return false;
  waiting_ = kept->now;
  grid_place_ns_ = kept->place_ns;
  current_.store(waiting_->trace_id, std::memory_order_relaxed);
  return true;
}

void Machine::park() noexcept {
  if (waiting_ != nullptr && event_ns_ != kNever && fsm_->initial().is_wait)
    waiting_->event->keep(event_ns_);  // for the next start
  event_ns_ = kNever;
  waiting_ = next_ = nullptr;
  present_.tell({.name = state_name()});
}

time_ns_t Machine::due_ns() const noexcept {
  if (waiting_ == nullptr) return kForever;
  return event_settled_ ? clock_ns() : std::max(later_by(wait_from_ns_, waiting_->duration_ns), earliest_ns_);
}

void Machine::release(time_ns_t actual_ns) noexcept {
  MAUVE_AUDIT(is_started());
  if (!event_settled_) set_clock_ns(due_ns());  // the time is up, and no event has come
  event_settled_ = true;
  event_ns_ = kNever;
  entered_ns_.store(std::max(entered_ns(), clock_ns()),
                    std::memory_order_relaxed);  // relaxed: read when it has parked
  if (next_ == nullptr || !next_->is_wait) active_ns_ = clock_ns();
  statistics_.releases.fetch_add(1, std::memory_order_relaxed);
  statistics_.wakeup.record(actual_ns - clock_ns());
  released_ns_.store(actual_ns, std::memory_order_relaxed);
  if (listening_.is_late(actual_ns - clock_ns())) tell_late_wakeup(actual_ns);
  boundary_ns_ = actual_ns;
  trace_at(actual_ns, TraceKind::release, waiting_->trace_id, clock_ns(), actual_ns, grid_place_ns_);
}

Machine::Entered Machine::enter_next() {
  MAUVE_AUDIT(next_ != nullptr);
  const State& state = *next_;
  if (&state == &fsm_->initial()) context_.instant_ns.store(clock_ns(), std::memory_order_relaxed);
  current_.store(state.trace_id, std::memory_order_relaxed);
  if (!state.is_wait) return execute(state) ? Entered::execution : Entered::timed_out;
  enter_wait(state);
  return Entered::wait;
}

/// False when it timed out before it began or ended.
bool Machine::execute(const State& state) {
  const time_ns_t began = boundary_ns_;
  const time_ns_t budget_ns = core_->budget_ns(state.index);
  const bool is_watched = state.max_execution_ns != 0 || budget_ns != 0;
  const time_ns_t limit_ns = state.max_execution_ns != 0 ? state.max_execution_ns : kForever;
  if (is_watched && !begin_execution(began, limit_ns, budget_ns)) return false;
  present_.tell({.since_ns = began, .bound_ns = state.max_execution_ns, .name = state.trace_id});
  trace_at(began, TraceKind::state_begin, state.trace_id);
  const auto& methods = fsm_->methods();
  MAUVE_AUDIT(state.action < methods.size());
  const auto held_before = PiMutex::held_by_this_thread();  // not 0 where a simulated neighbour kept a lock
  const time_ns_t cpu_began_ns = budget_ns != 0 ? begin_budget(budget_ns) : 0;
  methods[state.action].run(*core_);
  next_ = successor(state);
  clock_->spend(state.simulated_execution_ns);
  const time_ns_t cpu_ns = budget_ns != 0 ? clock_->cpu_now_ns() - cpu_began_ns : 0;
  boundary_ns_ = clock_->now_ns();
  const bool had_timed_out = is_watched && !end_execution();
  trace_at(boundary_ns_, TraceKind::state_end, state.trace_id);
  state.execution_time->record(boundary_ns_ - began);
  check_locks(held_before);
  if (had_timed_out) return false;
  if (cpu_ns > budget_ns) throw OverBound(budget_ns, cpu_ns);
  if (state.max_execution_ns != 0 && boundary_ns_ - began > state.max_execution_ns)
    throw OverBound(state.max_execution_ns);
  return true;
}

/// The last of what comes before the state itself: the kernel's work for it is not the state's. Returns the CPU time so far.
time_ns_t Machine::begin_budget(time_ns_t budget_ns) noexcept {
  const time_ns_t began_ns = clock_->cpu_now_ns();
  execution_.set_cpu_end(later_by(began_ns, budget_ns));
  return began_ns;
}

/// Where the state leads: where its first transition does whose guard holds.
const State* Machine::successor(const State& state) const {
  const auto& methods = fsm_->methods();
  for (const Transition& transition : state.transitions) {
    MAUVE_AUDIT(transition.guard < methods.size());
    if (methods[transition.guard].test(*core_)) return transition.to;
  }
  return state.next;
}

void Machine::leave_wait() {
  MAUVE_AUDIT(is_started());
  if (next_ != nullptr) return;  // just started: it goes on in the initial state itself
  if (waiting_->transitions.empty()) {
    next_ = waiting_->next;
    return;
  }
  present_.tell({.since_ns = boundary_ns_, .name = waiting_->trace_id});
  const auto held_before = PiMutex::held_by_this_thread();
  next_ = successor(*waiting_);
  check_locks(held_before);
  boundary_ns_ = clock_->now_ns();
}

void Machine::enter_wait(const State& state) {
  waiting_ = &state;
  next_ = nullptr;
  statistics_.response.record(boundary_ns_ - clock_ns());
  if (listening_.is_late_response(boundary_ns_ - clock_ns())) tell_late_response();
  if (state.event == nullptr) {
    set_clock_ns(later_by(clock_ns(), state.duration_ns));
    if (const time_ns_t period = grid().period_ns; period != 0) {
      grid_place_ns_ += state.duration_ns % period;
      if (grid_place_ns_ >= period) grid_place_ns_ -= period;
      MAUVE_AUDIT(grid_place_ns_ >= 0 && grid_place_ns_ < period);
    }
    trace_at(boundary_ns_, TraceKind::wait, state.trace_id, clock_ns());
    if (boundary_ns_ > clock_ns()) handle_overrun(state, boundary_ns_);
    return tell_wait();
  }
  wait_from_ns_ = clock_ns();
  earliest_ns_ = 0;
  event_settled_ = false;
  trace_at(boundary_ns_, TraceKind::wait, state.trace_id, due_ns());
  take_event();  // one may have come meanwhile
  if (!event_settled_ && boundary_ns_ > due_ns()) {
    set_clock_ns(due_ns());
    event_settled_ = true;
    handle_overrun(state, boundary_ns_);
  }
  tell_wait();
}

void Machine::tell_wait() noexcept {
  present_.tell({.since_ns = due_ns(), .name = waiting_->trace_id, .is_wait = true});
}

/// An event fixes the end of the wait: not before its min_interarrival has passed since the last release, also when that
/// was another fsm's.
void Machine::take_event() noexcept {
  if (event_settled_) return;
  const std::optional<time_ns_t> came = waiting_->event->consume();
  if (!came) return;
  const time_ns_t earliest = later_by(active_ns_, waiting_->min_interarrival_ns);
  set_clock_ns(std::max({wait_from_ns_, earliest, earliest_ns_, *came}));
  event_ns_ = *came;
  event_settled_ = true;
  tell_wait();
}

void Machine::handle_overrun(const State& state, time_ns_t now_ns) {
  const time_ns_t missed = clock_ns();
  const time_ns_t period = grid().period_ns;
  statistics_.overruns.fetch_add(1, std::memory_order_relaxed);
  std::int64_t skipped = 0;
  if (settings_.overrun == OverrunPolicy::skip) {
    if (period == 0) {
      set_clock_ns(now_ns);  // a sporadic component has no grid to keep
    } else {
      skipped = (now_ns - missed + period - 1) / period;
      set_clock_ns(missed + skipped * period);
      MAUVE_AUDIT(skipped > 0 && clock_ns() >= now_ns && clock_ns() - now_ns < period);
    }
    statistics_.skipped.fetch_add(static_cast<std::uint64_t>(skipped), std::memory_order_relaxed);
  }
  trace(TraceKind::overrun, state.trace_id, missed, now_ns, skipped);
  listening_.tell([&](TaskListener& listener) {
    listener.on_overrun(now_ns, statistics_.overruns.load(std::memory_order_relaxed));
  });
  if (settings_.overrun == OverrunPolicy::fault) throw std::runtime_error("overrun, and its policy is fault");
  if (settings_.overrun == OverrunPolicy::catch_up && period != 0 &&
      (now_ns - missed) / period + 1 > settings_.max_backlog) {
    throw std::runtime_error("overrun: more instants are owed than max_backlog allows");
  }
}

void Machine::tell_late_wakeup(time_ns_t now_ns) noexcept {
  listening_.tell([&](TaskListener& listener) { listener.on_late_wakeup(now_ns, now_ns - clock_ns()); });
}

void Machine::tell_late_response() noexcept {
  listening_.tell(
      [&](TaskListener& listener) { listener.on_late_response(boundary_ns_, boundary_ns_ - clock_ns()); });
}

bool Machine::begin_execution(time_ns_t began_ns, time_ns_t limit_ns, time_ns_t budget_ns) noexcept {
  if (!execution_.begin(began_ns, limit_ns, budget_ns)) return false;
  if (watchdog_ != nullptr) watchdog_->expect_end(ExecutionWord::end_ns(began_ns, limit_ns, budget_ns));
  return true;
}

time_ns_t Machine::earliest_excess_ns() const noexcept {
  if (const auto execution = execution_.look()) return execution->end_ns();
  const time_ns_t bound = wait_bound_ns_.load(std::memory_order_relaxed);
  if (bound == 0) return kForever;
  const std::optional<PresentState::Fact> fact = present_.look();
  if (!fact || !fact->is_wait || fact->since_ns == 0) return kForever;
  return ExecutionWord::end_ns(fact->since_ns, bound);
}

/// Of the present wait; at the start and in a wait for a time the shortest one of the fsm. 0: it waits for no event.
time_ns_t Machine::timeout_ns() const noexcept {
  const State* const wait = present_wait();
  if (wait != nullptr && wait->event != nullptr) return wait->duration_ns;
  time_ns_t shortest = 0;
  for (const auto& state : fsm_->states()) {
    if (state->event != nullptr && (shortest == 0 || state->duration_ns < shortest))
      shortest = state->duration_ns;
  }
  return shortest;
}

std::int64_t Machine::skip_lost(time_ns_t since_ns, time_ns_t now_ns) noexcept {
  take_event();  // one that came meanwhile came before the timeout, or in its place
  const bool is_sporadic = grid().period_ns == 0;
  const time_ns_t period = is_sporadic ? timeout_ns() : grid().period_ns;
  const time_ns_t due = due_ns();
  const time_ns_t late = now_ns - due;
  if (period == 0 || late < period || since_ns - due >= period) return 0;
  if (is_sporadic) {
    set_clock_ns(now_ns);  // no grid to keep, as after an overrun
    event_settled_ = true;
    return late / period;
  }
  const std::int64_t lost = (late + period - 1) / period;
  MAUVE_AUDIT(lost > 0);
  set_clock_ns(due + lost * period);
  return lost;
}

void Machine::change_at(time_ns_t instant_ns) noexcept {
  entered_ns_.store(std::max(entered_ns(), instant_ns - 1),
                    std::memory_order_relaxed);  // relaxed: as in release()
  if (waiting_ == nullptr || event_settled_) return;
  earliest_ns_ = instant_ns;
  set_clock_ns(std::max(clock_ns(), instant_ns));  // what it writes on a stop belongs to the new parts
}

void Machine::delay_event_to(time_ns_t instant_ns) noexcept {
  if (event_settled_ && waits_for_event()) set_clock_ns(std::max(clock_ns(), instant_ns));
}

time_ns_t Machine::resynchronise(time_ns_t epoch_ns) noexcept {
  count_from(later_by(epoch_ns, settings_.offset_ns));
  const Grid now = grid();
  if (now.period_ns == 0 || clock_ns() == kForever) return 0;
  const time_ns_t initial_ns =
      clock_ns() - grid_place_ns_;  // the initial state is entered there, or whole periods off
  const time_ns_t shift = now.first_not_before(initial_ns) - initial_ns;
  MAUVE_AUDIT(shift >= 0 && shift < now.period_ns);
  set_clock_ns(clock_ns() + shift);
  return shift;
}

void Machine::trace_deployment() noexcept {
  const Grid now = grid();
  trace(TraceKind::deployment, 0, later_by(now.reference_ns, -settings_.offset_ns), settings_.offset_ns,
        now.period_ns);
}

void Machine::warm_up() noexcept {
  is_cold_ = false;
  const auto fetch = [](const auto* object) {
    constexpr std::size_t kCacheLine = 64;
    const auto* bytes = reinterpret_cast<const std::byte*>(object);
    for (std::size_t at = 0; at < sizeof(*object); at += kCacheLine) __builtin_prefetch(bytes + at, 1);
  };
  fetch(this);
  if (ring_ != nullptr) ring_->warm_up();
  for (const auto& state : fsm_->states()) {
    fetch(state.get());
    if (state->execution_time != nullptr) fetch(state->execution_time);
  }
}

}  // namespace mauve
