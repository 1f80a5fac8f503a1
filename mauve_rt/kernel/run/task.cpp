// SPDX-License-Identifier: LGPL-3.0-or-later
// The commands of a task, given by ordinary threads. What its own thread does is in task_thread.cpp.
#include "mauve_rt/run/task.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstring>

#include "mauve_rt/base/contract.hpp"
#include "mauve_rt/base/error.hpp"
#include "mauve_rt/base/seam/futex.hpp"
#include "mauve_rt/base/seam/sleep.hpp"

namespace mauve {

namespace {

/// An instant that a thread can still be woken for in time.
constexpr time_ns_t kStartMargin = us_to_ns(200);
/// For a lock that a commit may hold for long.
constexpr time_ns_t kBetweenTries = us_to_ns(500);
/// What lasts for so many periods, and so long, is told as hung where no other figure was set.
constexpr std::int64_t kHungPeriods = 10;
constexpr time_ns_t kHungAtLeast = s_to_ns(1);

/// Room for what a component with this period writes while nobody drains: at most 3 MiB.
std::size_t ring_capacity(time_ns_t period_ns) {
  constexpr time_ns_t kUndrained = ms_to_ns(100);
  constexpr time_ns_t kRecordsPerRelease = 16;
  constexpr time_ns_t kMost = 65'536;
  if (period_ns <= 0) return TraceRing::kDefaultCapacity;
  const time_ns_t wanted = kUndrained / period_ns * kRecordsPerRelease;
  return std::max(TraceRing::kDefaultCapacity, static_cast<std::size_t>(std::min(wanted, kMost)));
}

std::string in_ms(time_ns_t time_ns) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.9g ms", static_cast<double>(time_ns) / 1e6);
  return text.data();
}

std::string over_bound(const FaultNote& note) {
  if (note.cpu_ns != 0) return note.over_budget();
  const std::string what = note.is_visit ? "adopt or take of its new part" : "the state";
  const time_ns_t declared_ns = note.is_visit ? note.bound_ns - Commit::kPatience : note.bound_ns;
  return what + " ran longer than its declared " + std::to_string(declared_ns / us_to_ns(1)) + " us";
}

}  // namespace

std::string FaultNote::over_budget() const {
  return "state " + TraceNames::word(where) + " used " + in_ms(cpu_ns) + " of CPU time, and its wcet_ns is " +
         in_ms(bound_ns);
}

std::string_view to_string(ComponentState state) noexcept {
  switch (state) {
    case ComponentState::unconfigured:
      return "UNCONFIGURED";
    case ComponentState::stopped:
      return "STOPPED";
    case ComponentState::running:
      return "RUNNING";
    case ComponentState::stopping:
      return "STOPPING";
    case ComponentState::faulted:
      return "FAULTED";
  }
  return "UNCONFIGURED";
}

void ChangeSignal::bump() noexcept {
  word.fetch_add(1, std::memory_order_release);  // release: who sees the bump sees the change
  futex_wake_all(word);
  if (listener.is_set()) listener.use([](ChangeSignal& other) { other.bump(); });
}

bool ChangeSignal::claim(std::uint32_t seen) noexcept {
  // acq_rel: the caller acts after the changes that `seen` counts, and who sees the claim acts after it
  if (!word.compare_exchange_strong(seen, seen + 1, std::memory_order_acq_rel)) return false;
  futex_wake_all(word);
  return true;
}

Task::Task(std::string name, std::uint16_t number, ChangeSignal& changes)
    : name_(std::move(name)), number_(number), changes_(changes) {}

Task::~Task() { end_thread(kForever); }

void Task::retract_fallback() noexcept {
  fallback_.exchange(nullptr, std::memory_order_acq_rel);
  while (is_falling_back_.load(std::memory_order_acquire)) yield_thread();
}

void Task::set_machine(Shell& shell, const FsmBase& fsm, CoreBinding* core, time_ns_t period_ns) noexcept {
  shell_.store(&shell, std::memory_order_release);
  core_ = core;
  machine_.set_parts(fsm, core, period_ns);
}

void Task::set_state(ComponentState state) noexcept { publish_state(state); }

bool Task::unconfigure() noexcept {
  const LockGuard lock(command_mutex_);  // a start is posted under it
  if (!is_parked()) return false;
  publish_state(ComponentState::unconfigured);
  return true;
}

void Task::swap_fault(FaultNote& note) noexcept {
  const LockGuard lock(fault_mutex_);
  MAUVE_RT_TRUSTED(std::swap(fault_, note));  // moves: nothing is allocated, nothing freed
}

void Task::clear_fault() noexcept {
  MAUVE_AUDIT(is_parked());
  FaultNote none;
  swap_fault(none);
  fallen_back_.store(false, std::memory_order_release);
}

Fault Task::fault() const {
  FaultNote note;
  {
    const LockGuard lock(fault_mutex_);
    note = fault_;
  }
  if (note.when_ns == 0) return {};
  Fault fault{.what = note.what != nullptr ? *note.what : over_bound(note),
              .where = TraceNames::word(note.where),
              .when_ns = note.when_ns};
  if (outputs_.load(std::memory_order_acquire) != kAllWritten)
    fault.what += "; an output is not written yet, for its resource is locked";
  return fault;
}

std::string Task::current_state() const { return TraceNames::word(machine_.state_name()); }

StateAge Task::state_age() const {
  time_ns_t hung_after_ns = settings_.hung_after_ns;
  if (hung_after_ns == 0) {
    const time_ns_t period = machine_.context().period_ns.load(std::memory_order_relaxed);
    hung_after_ns = std::max(kHungAtLeast, kHungPeriods * std::min(period, kForever / kHungPeriods));
  }
  const std::optional<PresentState::Fact> fact = machine_.present().look();
  if (!fact) return {.state = current_state(), .hung_after_ns = hung_after_ns};  // it changes this moment
  return {.state = TraceNames::word(fact->name),
          .age_ns = fact->since_ns == 0 ? 0 : std::max<time_ns_t>(0, clock().now_ns() - fact->since_ns),
          .bound_ns = fact->bound_ns,
          .hung_after_ns = hung_after_ns,
          .is_wait = fact->is_wait};
}

void Task::drain_ring(std::vector<TraceRecord>& into, std::uint64_t& written, std::uint64_t& dropped) {
  const LockGuard lock(ring_mutex_);
  if (ring_ == nullptr) return;
  ring_->drain(into);
  written += ring_->offered();
  dropped += ring_->dropped();
}

std::unique_ptr<TraceRing> Task::release_ring() {
  MAUVE_EXPECTS(has_ended());
  const LockGuard lock(ring_mutex_);
  machine_.set_ring(nullptr);
  return std::move(ring_);
}

void Task::begin_trace(bool trace) {
  MAUVE_EXPECTS(!has_thread());
  const LockGuard lock(ring_mutex_);
  if (!trace) {
    ring_.reset();
  } else if (ring_ == nullptr) {
    const std::size_t wanted = settings_.trace_records;
    ring_ = std::make_unique<TraceRing>(number_, wanted != 0 ? wanted : ring_capacity(grid().period_ns));
    ring_->set_first(first_record_);
  }
  if (ring_ != nullptr) ring_->set_clock(simulated_ ? &clock() : nullptr);
  machine_.set_ring(ring_.get());
}

void Task::begin_log() {
  const std::shared_ptr<LogQueue>& queue = log_source().queue();
  if (queue == nullptr) return;
  if (log_ring_ == nullptr) log_ring_ = queue->make_ring(number_);
  log_ring_->set_up(simulated_ ? &clock() : nullptr, &machine_.present());
}

void Task::simulate(const Clock& clock, bool trace) {
  simulated_ = true;
  machine_.set_clock(clock);
  begin_trace(trace);
  begin_log();
}

void Task::end_simulation() noexcept {
  if (!simulated_) return;
  settle_slot(true);
  release_withdrawn();
  clock().leave(*this);
  simulated_ = false;
  machine_.set_clock(MonotonicClock::instance());
  if (ring_ != nullptr) ring_->set_clock(nullptr);
  if (log_ring_ != nullptr) log_ring_->set_up(nullptr, &machine_.present());
}

bool Task::end_thread(time_ns_t until_ns) noexcept {
  std::unique_lock<PiMutex> lock(command_mutex_, std::defer_lock);
  // Tried again and again: ThreadSanitizer does not know the timed lock of the monotonic clock.
  while (!lock.try_lock()) {
    if (monotonic_now_ns() >= until_ns) return false;
    sleep_for(kBetweenTries);
  }
  if (!has_thread_) return true;
  control_.fetch_or(kStop | kExit, std::memory_order_acq_rel);
  futex_wake_all(control_);
  if (is_abandoned()) until_ns = 0;
  while (ended_.load(std::memory_order_acquire) == 0) {
    if (!futex_wait_until(ended_, 0, until_ns) && ended_.load(std::memory_order_acquire) == 0) return false;
  }
  if (outputs_.load(std::memory_order_acquire) == kWriting) return false;
  thread_.join();
  if (watchdog_ != nullptr) watchdog_->forget(*this);
  machine_.set_watchdog(nullptr);
  watchdog_.reset();
  has_thread_.store(false, std::memory_order_release);
  control_.store(0, std::memory_order_relaxed);  // relaxed: no thread is left to race with
  return true;
}

void Task::detach_thread() noexcept {
  if (has_thread_) thread_.detach();
}

void Task::start_at(time_ns_t instant_ns) {
  const LockGuard lock(command_mutex_);
  post_start(instant_ns);
}

void Task::post_start(time_ns_t instant_ns) noexcept {
  MAUVE_AUDIT(command_mutex_.is_held_here());
  start_at_ns_ = instant_ns;
  started_.store(0, std::memory_order_relaxed);  // relaxed: kStart publishes it
  {
    const LockGuard lock(order_mutex_);
    // A stop bit that came too late for the last run must not end this one: store, not or.
    control_.store(kStart, std::memory_order_release);
  }
  if (simulated_) return resume();
  futex_wake_all(control_);
}

void Task::start(std::optional<time_ns_t> clock_ns, time_ns_t timeout_ns, std::uint64_t expected_revision) {
  if (is_called_from_own_state()) require_startable();  // refused without the lock, as in stop()
  const time_ns_t until = later_by(monotonic_now_ns(), timeout_ns);
  const auto throw_late = [&](const char* what, const char* remedy) {
    throw Error(ErrorCode::timeout, what,
                {.component = name_,
                 .expected = "a start within " + std::to_string(timeout_ns / ms_to_ns(1)) + " ms",
                 .remedy = remedy});
  };
  if (!command_mutex_.try_lock_until(until))
    return throw_late("a commit or another command of the component lasts; it was not started", "try again");
  const LockGuard lock(command_mutex_, std::adopt_lock);
  if (state() == ComponentState::stopped && !simulated_ && !wait_slot(until) &&
      state() == ComponentState::stopped)  // a take that does not end makes it FAULTED
    throw_late("the component has yet to take an earlier change; it was not started", "try again");
  // A change posts a start and goes on: the thread may be taking it up, and reads what the next one would write.
  if (state() == ComponentState::stopped && !is_parked() && !wait_started(until))
    throw_late("the component has yet to take up an earlier start; it was not started again", "try again");
  require_startable();
  claim_revision(expected_revision);
  post_start(start_on(clock_ns));
  if (wait_started(until)) return;
  if (withdraw_start())
    throw_late("the component's thread does not get to run; it was not started",
               "look for a component of equal or higher priority that does not wait");
  wait_started(kForever);  // it takes the start up this moment: another one is posted only when it has
}

void Task::require_startable() const {
  if (removed_.load(std::memory_order_acquire))
    throw Error(ErrorCode::unknown_component, "the component was removed", {.component = name_});
  switch (state()) {
    case ComponentState::stopped:
      break;
    case ComponentState::unconfigured:
      throw Error(ErrorCode::not_configured, "the component is not configured",
                  {.component = name_, .remedy = "configure it first"});
    case ComponentState::faulted:
      throw Error(ErrorCode::faulted, "the component is FAULTED: " + fault().what,
                  {.component = name_, .remedy = is_parked() ? kRepairRemedy : kLeftBehindRemedy});
    default:
      throw Error(ErrorCode::already_running, "the component is running already",
                  {.component = name_, .expected = "STOPPED", .found = std::string(to_string(state()))});
  }
  if (!core_->is_ready()) {
    throw Error(ErrorCode::not_configured, "the core is not configured",
                {.component = name_,
                 .element = core_->core != nullptr ? core_->core->description() : "core",
                 .expected = "a core that configure_core() has bound and configured",
                 .remedy = "call configure_core() first"});
  }
  if (!can_take_up_start()) {
    throw Error(ErrorCode::not_configured, "the component has no thread",
                {.component = name_, .remedy = "deploy the architecture first"});
  }
}

/// A thread that has its order to end takes up none.
bool Task::can_take_up_start() const noexcept {
  return simulated_ || (has_thread() && (control_.load(std::memory_order_acquire) & kExit) == 0);
}

/// Takes the grid that counts from there, or the deployment's, and returns its next instant. It keeps that grid, with
/// whatever period, until another start or a new epoch.
time_ns_t Task::start_on(std::optional<time_ns_t> reference_ns) noexcept {
  machine_.count_from(reference_ns);
  return next_instant();
}

time_ns_t Task::next_instant() const noexcept {
  const Grid own = grid();
  const time_ns_t earliest = clock().now_ns() + kStartMargin + 1;
  return own.first_not_before(std::max(earliest, own.reference_ns));
}

bool Task::wait_started(time_ns_t until_ns) noexcept {
  // The thread itself says RUNNING; until then another command would find STOPPED. By a word of its own: a stop may
  // have come since, and the state be STOPPED again.
  while (started_.load(std::memory_order_acquire) == 0) {
    if (!futex_wait_until(started_, 0, until_ns)) return started_.load(std::memory_order_acquire) != 0;
  }
  return true;
}

void Task::throw_state_running(const std::string& what, time_ns_t timeout_ns,
                               const std::string& remedy) const {
  throw Error(ErrorCode::timeout, what,
              {.component = name_,
               .element = "state " + current_state(),
               .expected = timeout_ns == 0 ? "a state that has ended"
                                           : "the end of the state within " +
                                                 std::to_string(timeout_ns / ms_to_ns(1)) + " ms",
               .found = "still running",
               .remedy = remedy});
}

/// Where an architecture has changed since, nothing is started or stopped; two that expect one revision are not both done.
void Task::claim_revision(std::uint64_t expected) {
  if (expected == 0) return;
  bool is_claimed = false;
  if (changes_.listener.is_set())
    changes_.listener.use(
        [&](ChangeSignal& all) { is_claimed = all.claim(static_cast<std::uint32_t>(expected - 1)); });
  if (is_claimed) return;
  throw Error(ErrorCode::wrong_revision, "the architecture has changed since",
              {.component = name_,
               .element = "revision",
               .expected = std::to_string(expected),
               .remedy = "read it again, then ask again"});
}

/// The state and the bit go together: a stop that is late must not end the run that follows.
/// Returns the number of the run that is to end.
std::uint32_t Task::order_stop(std::uint64_t expected_revision) {
  const LockGuard lock(order_mutex_);
  auto seen = state_.load(std::memory_order_acquire);
  if (const auto found = static_cast<ComponentState>(seen);
      found == ComponentState::running || found == ComponentState::stopping)
    claim_revision(expected_revision);
  while (static_cast<ComponentState>(seen) == ComponentState::running) {
    // acq_rel: a fault in between wins
    if (state_.compare_exchange_weak(seen, static_cast<std::uint32_t>(ComponentState::stopping),
                                     std::memory_order_acq_rel)) {
      seen = static_cast<std::uint32_t>(ComponentState::stopping);
    }
  }
  if (static_cast<ComponentState>(seen) != ComponentState::stopping) {
    throw Error(ErrorCode::not_running, "the component is not running",
                {.component = name_,
                 .expected = "RUNNING",
                 .found = std::string(to_string(static_cast<ComponentState>(seen)))});
  }
  control_.fetch_or(kStop, std::memory_order_acq_rel);
  const std::uint32_t ended = ended_runs_.load(std::memory_order_acquire);
  return state() == ComponentState::stopped ? ended - 1 : ended;  // STOPPED: it has ended since
}

bool Task::is_called_from_own_state() const noexcept {
  return Waiter::of_this_thread() == this || (simulated_ && in_resume_);
}

/// A start that the thread has not taken up yet; false when there is none.
bool Task::withdraw_start() noexcept {
  const LockGuard lock(order_mutex_);
  if (state() != ComponentState::stopped) return false;
  if ((control_.fetch_and(~kStart, std::memory_order_acq_rel) & kStart) == 0) return false;
  end_wait_for_start();
  return true;
}

/// A thread that waits goes on, whether the component has started or not.
void Task::end_wait_for_start() noexcept {
  started_.store(1, std::memory_order_release);
  futex_wake_all(started_);
}

bool Task::stop(time_ns_t timeout_ns, bool force, std::uint64_t expected_revision) {
  const time_ns_t until = later_by(monotonic_now_ns(), timeout_ns);
  if (expected_revision == 0 && withdraw_start()) return false;
  const std::uint32_t run = order_stop(expected_revision);
  if (force) control_.fetch_or(kAtOnce, std::memory_order_acq_rel);
  changes_.bump();
  if (is_called_from_own_state())
    return false;  // it takes effect when the state ends, for which nobody can wait here
  if (simulated_) {
    resume();
    if (is_ramping_.load(std::memory_order_relaxed)) return false;  // relaxed: this thread runs it
  }
  futex_wake_all(control_);
  // RUNNING again is a fallback that came in meanwhile: it finds the stop in its first wait.
  // In another run somebody has started it again since: this stop has had its effect.
  const auto is_going = [&](std::uint32_t found) {
    const auto state = static_cast<ComponentState>(found);
    return state != ComponentState::stopped && state != ComponentState::faulted &&
           ended_runs_.load(std::memory_order_acquire) == run;
  };
  for (auto seen = state_.load(std::memory_order_acquire); is_going(seen);
       seen = state_.load(std::memory_order_acquire)) {
    if (futex_wait_until(state_, seen, until)) continue;
    if (!is_going(state_.load(std::memory_order_acquire))) break;
    if (force && time_out_unless_waiting()) return true;
    if (is_ramping_.load(std::memory_order_relaxed)) {  // relaxed: it words a message
      throw Error(ErrorCode::timeout,
                  "max_slew still moves the outputs to the values of the stop, which stays pending",
                  {.component = name_,
                   .expected = "the end of that within " + std::to_string(timeout_ns / ms_to_ns(1)) + " ms",
                   .remedy = "give the stop more time; a stop by force writes the values at once"});
    }
    throw_state_running("the stop stays pending", timeout_ns,
                        force
                            ? "it takes effect when the component's thread gets to run"
                            : "it takes effect when the state ends; a stop by force does not wait for that");
  }
  if (state() == ComponentState::faulted) {
    throw Error(ErrorCode::faulted, "the component faulted while stopping: " + fault().what,
                {.component = name_});
  }
  return false;
}

}  // namespace mauve
