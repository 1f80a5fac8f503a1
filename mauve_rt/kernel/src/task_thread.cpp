// SPDX-License-Identifier: LGPL-3.0-or-later
// What a component's own thread does. Everything between a start and a park is real-time code.
#include <sys/prctl.h>
#include <unistd.h>

#include <csignal>
#include <cstring>

#include "mauve_rt/error.hpp"
#include "mauve_rt/futex.hpp"
#include "mauve_rt/pi_mutex.hpp"
#include "mauve_rt/task.hpp"

namespace mauve {

namespace {

constexpr std::size_t kPrefaultedStackBytes = std::size_t{128} * 1024;
constexpr int kMaxDeferrals = 3;

/// Touches the stack's pages so that none faults later; at most half of what is left of it.
[[gnu::noinline]] void prefault_stack() noexcept {
  pthread_attr_t attributes;
  if (pthread_getattr_np(pthread_self(), &attributes) != 0) return;
  void* lowest = nullptr;
  std::size_t stack_bytes = 0;
  pthread_attr_getstack(&attributes, &lowest, &stack_bytes);
  pthread_attr_destroy(&attributes);
  const auto left =
      static_cast<std::size_t>(static_cast<char*>(__builtin_frame_address(0)) - static_cast<char*>(lowest));
  constexpr std::size_t kPage = 4096;
  const std::size_t size = std::min(kPrefaultedStackBytes, left / 2);
  auto* pages = static_cast<volatile char*>(__builtin_alloca(size));
  for (std::size_t offset = 0; offset < size; offset += kPage) pages[offset] = 0;
}

/// What happened to a commit, as recorded in the trace.
enum ReconfigurationPhase : std::int64_t { kAdopt = 1, kTake = 2 };

struct ThreadAttributes {
  pthread_attr_t value;
  ThreadAttributes() { pthread_attr_init(&value); }
  ~ThreadAttributes() { pthread_attr_destroy(&value); }
  ThreadAttributes(const ThreadAttributes&) = delete;
  ThreadAttributes& operator=(const ThreadAttributes&) = delete;
};

}  // namespace

void Task::create_thread(pthread_barrier_t& barrier, bool require_realtime, bool trace) {
  const std::lock_guard lock(command_mutex_);
  barrier_ = &barrier;
  active_ring_ = trace ? ring_.get() : nullptr;
  parked_.store(1, std::memory_order_relaxed);  // relaxed: the thread does not exist yet
  ended_.store(0, std::memory_order_relaxed);

  ThreadAttributes attributes;
  pthread_attr_setstacksize(&attributes.value, settings_.stack_bytes);
  if (!settings_.cpus.empty()) {
    cpu_set_t cpus;
    CPU_ZERO(&cpus);
    for (const int cpu : settings_.cpus) CPU_SET(static_cast<std::size_t>(cpu), &cpus);
    pthread_attr_setaffinity_np(&attributes.value, sizeof(cpus), &cpus);
  }
  sigset_t all_signals;
  sigset_t callers_signals;
  sigfillset(&all_signals);
  pthread_sigmask(SIG_SETMASK, &all_signals, &callers_signals);  // the new thread inherits it

  const sched_param scheduling{.sched_priority = settings_.priority};
  pthread_attr_setinheritsched(&attributes.value, PTHREAD_EXPLICIT_SCHED);
  pthread_attr_setschedpolicy(&attributes.value, SCHED_FIFO);
  pthread_attr_setschedparam(&attributes.value, &scheduling);
  int result = pthread_create(&thread_, &attributes.value, &Task::thread_entry, this);
  if (result == EPERM && !require_realtime) {
    const sched_param ordinary{};
    pthread_attr_setschedpolicy(&attributes.value, SCHED_OTHER);
    pthread_attr_setschedparam(&attributes.value, &ordinary);
    result = pthread_create(&thread_, &attributes.value, &Task::thread_entry, this);
  }
  pthread_sigmask(SIG_SETMASK, &callers_signals, nullptr);
  if (result == EPERM) {
    throw Error(ErrorCode::realtime_denied, "the system refuses a SCHED_FIFO thread",
                {.component = name_,
                 .expected = "the right to priority " + std::to_string(settings_.priority),
                 .remedy = "raise the rtprio limit, or do not require real time"});
  }
  if (result != 0) {
    throw Error(ErrorCode::invalid_argument,
                std::string("the system refuses the thread: ") + std::strerror(result),
                {.component = name_, .remedy = "check priority, cpus and stack_bytes"});
  }
  has_thread_ = true;
}

void* Task::thread_entry(void* self) noexcept {
  static_cast<Task*>(self)->thread_main();
  return nullptr;
}

void Task::thread_main() noexcept {
  pthread_setname_np(pthread_self(), name_.substr(0, 15).c_str());
  prefault_stack();
  TraceRing::set_for_this_thread(active_ring_);
  read_back_thread();
  if (facts_.policy != "SCHED_FIFO") prctl(PR_SET_TIMERSLACK, 1UL);
  pthread_barrier_wait(barrier_);
  while (wait_for_start()) {
    try {
      run_machine();
    } catch (const std::exception& failure) {
      park_faulted(failure.what());
    } catch (...) {
      park_faulted("an exception that is no std::exception");
    }
  }
  ended_.store(1, std::memory_order_release);
  futex_wake_all(ended_);
}

void Task::read_back_thread() {
  int policy = 0;
  sched_param scheduling{};
  pthread_getschedparam(pthread_self(), &policy, &scheduling);
  facts_ = {.policy = policy == SCHED_FIFO ? "SCHED_FIFO" : "SCHED_OTHER",
            .priority = scheduling.sched_priority,
            .cpus = {}};
  cpu_set_t cpus;
  CPU_ZERO(&cpus);
  pthread_getaffinity_np(pthread_self(), sizeof(cpus), &cpus);
  for (int cpu = 0; cpu < CPU_SETSIZE; ++cpu) {
    if (CPU_ISSET(static_cast<std::size_t>(cpu), &cpus)) facts_.cpus.push_back(cpu);
  }
}

bool Task::wait_for_start() noexcept {
  for (;;) {
    const std::uint32_t control = control_.load(std::memory_order_acquire);
    if ((control & kExit) != 0) return false;
    if ((control & kCommit) != 0) {  // posted just before the park, too late for park() to see
      refuse_pending_commit();
      continue;
    }
    if ((control & kStart) != 0) {
      control_.fetch_and(~kStart, std::memory_order_acq_rel);
      parked_.store(0, std::memory_order_release);
      return true;
    }
    futex_wait_until(control_, control, kForever);
  }
}

void Task::run_machine() {
  const State* const initial = &fsm_->initial();
  const State* state = initial;
  set_clock_ns(start_at_ns_);
  current_.store(initial, std::memory_order_relaxed);
  publish_state(ComponentState::running);
  trace(TraceKind::deployment, 0, grid_.reference_ns - settings_.offset_ns, settings_.offset_ns,
        context_.period_ns);
  trace(TraceKind::start, 0, start_at_ns_);
  if (!sleep_until_clock(*initial)) return park_stopped();

  for (;;) {
    if ((control_.load(std::memory_order_acquire) & kStop) != 0) return park_stopped();
    if (state == initial) context_.instant_ns.store(clock_ns(), std::memory_order_relaxed);
    current_.store(state, std::memory_order_relaxed);
    if (state->is_wait) {
      if (!wait(*state)) return park_stopped();
      state = state->next;
    } else {
      state = execute(*state);
      if (state == nullptr) {
        wait_condemned();
        return park(ComponentState::faulted);
      }
    }
  }
}

const State* Task::execute(const State& state) {
  trace_at(boundary_ns_, TraceKind::state_begin, state.trace_id);
  // release: who sees the beginning sees which state it is of
  if (state.max_execution_ns != 0) execution_began_ns_.store(boundary_ns_, std::memory_order_release);
  const auto& methods = fsm_->methods();
  methods[state.action].run(*core_);
  const State* next = state.next;
  for (const Transition& transition : state.transitions) {
    if (methods[transition.guard].test(*core_)) {
      next = transition.to;
      break;
    }
  }
  execution_began_ns_.store(0, std::memory_order_release);
  boundary_ns_ = clock_.now_ns();
  trace_at(boundary_ns_, TraceKind::state_end, state.trace_id);
  if (PiMutex::held_by_this_thread() != 0)
    throw std::logic_error("a lock is still held at the end of the state");
  return condemned_.load(std::memory_order_acquire) == 0 ? next : nullptr;
}

bool Task::wait(const State& state) {
  set_clock_ns(clock_ns() + state.duration_ns);
  trace_at(boundary_ns_, TraceKind::wait, state.trace_id, clock_ns());
  if (boundary_ns_ > clock_ns()) handle_overrun(state, boundary_ns_);
  return sleep_until_clock(state);
}

void Task::handle_overrun(const State& state, time_ns_t now_ns) {
  const time_ns_t missed = clock_ns();
  const time_ns_t period = context_.period_ns;
  statistics_.overruns.fetch_add(1, std::memory_order_relaxed);
  std::int64_t skipped = 0;
  if (settings_.overrun == OverrunPolicy::skip) {
    skipped = (now_ns - missed + period - 1) / period;
    set_clock_ns(missed + skipped * period);
    statistics_.skipped.fetch_add(static_cast<std::uint64_t>(skipped), std::memory_order_relaxed);
  }
  trace(TraceKind::overrun, state.trace_id, missed, now_ns, skipped);
  if (settings_.overrun == OverrunPolicy::fault) throw std::runtime_error("overrun, and its policy is fault");
  if (settings_.overrun == OverrunPolicy::catch_up &&
      (now_ns - missed) / period + 1 > settings_.max_backlog) {
    throw std::runtime_error("overrun: more instants are owed than max_backlog allows");
  }
}

bool Task::sleep_until_clock(const State& state) {
  for (;;) {
    const std::uint32_t control = control_.load(std::memory_order_acquire);
    if ((control & kStop) != 0) return false;
    if ((control & kCommit) != 0 && may_commit_now()) {
      commit_pending(state);
      const time_ns_t now = clock_.now_ns();
      if (now > clock_ns()) handle_overrun(state, now);
      continue;
    }
    // A commit put off leaves its bit in the word; any other command changes the word and ends the sleep.
    if (clock_.sleep_until(clock_ns(), control_, control)) break;
  }
  release(state, clock_.now_ns());
  return true;
}

/// With less time left than the change may take, it is better made after the release that is due; but not put
/// off for ever.
bool Task::may_commit_now() noexcept {
  const time_ns_t left = clock_ns() - clock_.now_ns();
  return left > commit_budget_ns_.load(std::memory_order_relaxed) || deferrals_ >= kMaxDeferrals;
}

void Task::release(const State& state, time_ns_t actual_ns) noexcept {
  statistics_.releases.fetch_add(1, std::memory_order_relaxed);
  statistics_.wakeup.record(actual_ns - clock_ns());
  boundary_ns_ = actual_ns;
  trace_at(actual_ns, TraceKind::release, state.trace_id, clock_ns(), actual_ns);
  if ((control_.load(std::memory_order_relaxed) & kCommit) != 0) ++deferrals_;
  if (awaiting_release_.load(std::memory_order_relaxed) == nullptr) return;
  if (Commit* commit = awaiting_release_.exchange(nullptr, std::memory_order_acq_rel)) {
    commit->release_nominal_ns = clock_ns();
    commit->release_actual_ns = actual_ns;
    commit->released.store(Commit::kReleased, std::memory_order_release);
    futex_wake_all(commit->released);
  }
}

void Task::commit_pending(const State& state) noexcept {
  deferrals_ = 0;
  // The bit goes before the slot is emptied: a commit posted in between sets it again and is not lost.
  control_.fetch_and(~kCommit, std::memory_order_acq_rel);
  if (Commit* commit = commit_.exchange(nullptr, std::memory_order_acq_rel)) carry_out(*commit, &state);
}

/// With a state: on the component's thread, in that wait. Without: on the requester's, the component parked.
void Task::carry_out(Commit& commit, const State* state) noexcept {
  const bool in_flight = state != nullptr;
  const time_ns_t parked = clock_.now_ns();
  commit.parked_ns = parked;
  if (in_flight) {
    commit.pending_ns = clock_ns();
    if (active_ring_ != nullptr)
      active_ring_->push_at(parked, TraceKind::parked, state->trace_id, clock_ns());
    state_.store(static_cast<std::uint32_t>(ComponentState::held), std::memory_order_release);
    write_outputs(true);
  }
  try {
    commit.committed = commit.action.adopt();
  } catch (...) {
    commit.refusal = std::current_exception();
  }
  const time_ns_t adopted = clock_.now_ns();
  if (commit.committed) commit.action.take();
  const time_ns_t taken = clock_.now_ns();
  commit.adopt_ns = adopted - parked;
  commit.take_ns = taken - adopted;
  if (in_flight) {
    state_.store(static_cast<std::uint32_t>(ComponentState::running), std::memory_order_release);
    trace(TraceKind::reconfiguration, commit.action.trace_id(), kAdopt, commit.adopt_ns);
    if (commit.committed) {
      trace(TraceKind::reconfiguration, commit.action.trace_id(), kTake, commit.take_ns);
      if (Commit* earlier = awaiting_release_.exchange(&commit, std::memory_order_acq_rel)) {
        earlier->released.store(Commit::kSuperseded, std::memory_order_release);
        futex_wake_all(earlier->released);
      }
    }
    commit.armed_ns = clock_.now_ns();
    trace_at(commit.armed_ns, TraceKind::armed, state->trace_id, clock_ns(), commit.committed ? 1 : 0);
  } else {
    commit.armed_ns = parked;  // a parked component has no blackout
  }
  commit.done.store(1, std::memory_order_release);
  futex_wake_all(commit.done);
}

void Task::refuse_pending_commit() noexcept {
  control_.fetch_and(~kCommit, std::memory_order_acq_rel);
  Commit* commit = commit_.exchange(nullptr, std::memory_order_acq_rel);
  if (commit == nullptr) return;
  commit->not_running = true;
  commit->done.store(1, std::memory_order_release);
  futex_wake_all(commit->done);
}

void Task::write_outputs(bool commit) noexcept {
  for (const auto& port : shell_->ports()) {
    const OutputOptions output = port->output();
    if ((commit ? output.on_commit : output.on_stop) == OutputPolicy::set_zero) port->write_zero();
  }
}

void Task::park_stopped() noexcept {
  const State* state = current_.load(std::memory_order_relaxed);
  write_outputs(false);
  trace(TraceKind::stop, state->trace_id, clock_ns());
  park(ComponentState::stopped);
}

void Task::park_faulted(const char* what) noexcept {
  const State* state = current_.load(std::memory_order_relaxed);
  const time_ns_t now = clock_.now_ns();
  execution_began_ns_.store(0, std::memory_order_release);
  std::uint32_t nobody = 0;
  if (condemned_.compare_exchange_strong(nobody, 1, std::memory_order_acq_rel)) {
    fault_ = {.what = what, .where = state->name, .when_ns = now};
  } else {
    wait_condemned();
  }
  trace(TraceKind::fault, state->trace_id, clock_ns());
  park(ComponentState::faulted);
}

/// The watchdog was first: it has written, or is writing, the fault and then says FAULTED.
void Task::wait_condemned() const noexcept {
  constexpr auto kFaulted = static_cast<std::uint32_t>(ComponentState::faulted);
  for (;;) {
    const std::uint32_t state = state_.load(std::memory_order_acquire);
    if (state == kFaulted) return;
    futex_wait_until(state_, state, kForever);
  }
}

void Task::park(ComponentState state) noexcept {
  if (state == ComponentState::faulted) write_outputs(false);
  deferrals_ = 0;
  control_.fetch_and(~kStop, std::memory_order_acq_rel);
  parked_.store(1, std::memory_order_release);
  publish_state(state);
  refuse_pending_commit();  // last: who is refused finds the state that tells why
}

void Task::publish_state(ComponentState state) noexcept {
  state_.store(static_cast<std::uint32_t>(state), std::memory_order_release);
  futex_wake_all(state_);
  changes_.bump();
}

}  // namespace mauve
