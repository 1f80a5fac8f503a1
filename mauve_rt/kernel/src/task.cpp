// SPDX-License-Identifier: LGPL-3.0-or-later
// The commands of a task, given by ordinary threads. What its own thread does is in task_thread.cpp.
#include "mauve_rt/task.hpp"

#include <algorithm>
#include <cstring>

#include "mauve_rt/error.hpp"
#include "mauve_rt/futex.hpp"

namespace mauve {

namespace {

constexpr time_ns_t kStartMargin = us_to_ns(200);

}  // namespace

std::string_view to_string(ComponentState state) noexcept {
  switch (state) {
    case ComponentState::unconfigured:
      return "UNCONFIGURED";
    case ComponentState::stopped:
      return "STOPPED";
    case ComponentState::running:
      return "RUNNING";
    case ComponentState::held:
      return "HELD";
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
}

Task::Task(std::string name, std::uint16_t number, ChangeSignal& changes, const Clock& clock)
    : name_(std::move(name)), changes_(changes), clock_(clock), ring_(std::make_unique<TraceRing>(number)) {
  context_.ring = ring_.get();
}

Task::~Task() { end_thread(kForever); }

void Task::set_machine(Shell& shell, const FsmBase& fsm, CoreBinding* core) noexcept {
  shell_ = &shell;
  fsm_ = &fsm;
  core_ = core;
}

void Task::set_grid(const Grid& grid) noexcept { grid_ = grid; }

void Task::set_state(ComponentState state) noexcept { publish_state(state); }

void Task::clear_fault() noexcept {
  fault_ = {};
  condemned_.store(0, std::memory_order_release);
}

std::string Task::current_state() const {
  const State* state = current_.load(std::memory_order_relaxed);
  return state == nullptr ? "" : state->name;
}

bool Task::end_thread(time_ns_t until_ns) noexcept {
  const std::lock_guard lock(command_mutex_);
  if (!has_thread_) return true;
  control_.fetch_or(kStop | kExit, std::memory_order_acq_rel);
  futex_wake_all(control_);
  while (ended_.load(std::memory_order_acquire) == 0) {
    if (!futex_wait_until(ended_, 0, until_ns) && ended_.load(std::memory_order_acquire) == 0) return false;
  }
  pthread_join(thread_, nullptr);
  has_thread_ = false;
  control_.store(0, std::memory_order_relaxed);  // relaxed: no thread is left to race with
  return true;
}

void Task::start_at(time_ns_t instant_ns) {
  const std::lock_guard lock(command_mutex_);
  post_start(instant_ns);
}

void Task::post_start(time_ns_t instant_ns) noexcept {
  start_at_ns_ = instant_ns;
  // A stop bit that came too late for the last run must not end this one: store, not or.
  control_.store(kStart, std::memory_order_release);
  futex_wake_all(control_);
}

void Task::start(std::optional<time_ns_t> clock_ns) {
  const std::lock_guard lock(command_mutex_);
  switch (state()) {
    case ComponentState::stopped:
      break;
    case ComponentState::unconfigured:
      throw Error(ErrorCode::not_configured, "the component is not configured",
                  {.component = name_, .remedy = "configure it first"});
    case ComponentState::faulted:
      throw Error(ErrorCode::faulted, "the component is FAULTED: " + fault_.what,
                  {.component = name_, .remedy = "clean it up and configure it, then start it"});
    default:
      throw Error(ErrorCode::already_running, "the component is running already",
                  {.component = name_, .expected = "STOPPED", .found = std::string(to_string(state()))});
  }
  if (!has_thread_) {
    throw Error(ErrorCode::not_configured, "the component has no thread",
                {.component = name_, .remedy = "deploy the architecture first"});
  }
  const Grid grid{.reference_ns = clock_ns.value_or(grid_.reference_ns), .period_ns = context_.period_ns};
  post_start(grid.first_not_before(clock_.now_ns() + kStartMargin + 1));
  wait_started();
}

void Task::wait_started() noexcept {
  // The thread itself says RUNNING; until then another command would find STOPPED.
  constexpr auto kStopped = static_cast<std::uint32_t>(ComponentState::stopped);
  while (state_.load(std::memory_order_acquire) == kStopped) futex_wait_until(state_, kStopped, kForever);
}

void Task::throw_state_running(const std::string& what, time_ns_t timeout_ns,
                               const std::string& remedy) const {
  throw Error(ErrorCode::timeout, what,
              {.component = name_,
               .element = "state " + current_state(),
               .expected = "the end of the state within " + std::to_string(timeout_ns / ms_to_ns(1)) + " ms",
               .found = "still running",
               .remedy = remedy});
}

void Task::stop(time_ns_t timeout_ns) {
  const std::lock_guard lock(command_mutex_);
  auto seen = static_cast<std::uint32_t>(ComponentState::running);
  // acq_rel: only who turns RUNNING into STOPPING goes on; a fault in between wins
  const bool running = state_.compare_exchange_strong(
      seen, static_cast<std::uint32_t>(ComponentState::stopping), std::memory_order_acq_rel);
  if (!running && static_cast<ComponentState>(seen) != ComponentState::stopping) {
    throw Error(ErrorCode::not_running, "the component is not running",
                {.component = name_,
                 .expected = "RUNNING",
                 .found = std::string(to_string(static_cast<ComponentState>(seen)))});
  }
  changes_.bump();
  control_.fetch_or(kStop, std::memory_order_acq_rel);
  futex_wake_all(control_);
  const time_ns_t until = monotonic_now_ns() + timeout_ns;
  constexpr auto kStopping = static_cast<std::uint32_t>(ComponentState::stopping);
  while (state_.load(std::memory_order_acquire) == kStopping) {
    if (futex_wait_until(state_, kStopping, until)) continue;
    if (state_.load(std::memory_order_acquire) != kStopping) break;
    throw_state_running("the stop stays pending", timeout_ns, "it takes effect when the state ends");
  }
  if (state() == ComponentState::faulted) {
    throw Error(ErrorCode::faulted, "the component faulted while stopping: " + fault_.what,
                {.component = name_});
  }
}

bool Task::commit(Commit& commit, time_ns_t timeout_ns) {
  const std::lock_guard lock(command_mutex_);
  const ComponentState now = state();
  if (now == ComponentState::stopping) {
    throw Error(ErrorCode::timeout, "the component is STOPPING",
                {.component = name_,
                 .element = "state " + current_state(),
                 .remedy = "try again when it has stopped"});
  }
  if (now == ComponentState::faulted) {
    throw Error(ErrorCode::faulted, "the component is FAULTED: " + fault_.what,
                {.component = name_, .remedy = "clean it up and configure it first"});
  }
  if (!has_thread_ || is_parked()) {
    carry_out(commit, nullptr);
  } else {
    commit_budget_ns_.store(commit.action.budget_ns(), std::memory_order_relaxed);
    commit_.store(&commit, std::memory_order_release);
    control_.fetch_or(kCommit, std::memory_order_acq_rel);
    futex_wake_all(control_);
    const time_ns_t until = monotonic_now_ns() + timeout_ns;
    while (commit.done.load(std::memory_order_acquire) == 0) {
      if (futex_wait_until(commit.done, 0, until)) continue;
      Commit* mine = &commit;
      if (commit_.compare_exchange_strong(mine, nullptr, std::memory_order_acq_rel)) {
        throw_state_running("the component did not reach a wait in time; nothing was changed", timeout_ns,
                            "try again, or allow a longer commit timeout");
      }
      // Too late to withdraw: the thread has taken it and is done in no time.
      futex_wait_until(commit.done, 0, kForever);
    }
  }
  if (commit.refusal) std::rethrow_exception(commit.refusal);
  if (commit.not_running) {
    throw Error(ErrorCode::faulted, "the component parked before the change: " + fault_.what,
                {.component = name_});
  }
  return commit.committed;
}

bool Task::wait_release(Commit& commit, time_ns_t until_ns) noexcept {
  while (commit.released.load(std::memory_order_acquire) == 0) {
    if (futex_wait_until(commit.released, 0, until_ns)) continue;
    Commit* mine = &commit;
    // Out of the slot the thread cannot reach it any more; not in the slot, it is writing it this moment.
    if (awaiting_release_.compare_exchange_strong(mine, nullptr, std::memory_order_acq_rel)) return false;
    futex_wait_until(commit.released, 0, kForever);
  }
  return commit.released.load(std::memory_order_acquire) == Commit::kReleased;
}

bool Task::check_execution(time_ns_t now_ns) {
  const time_ns_t began = execution_began_ns_.load(std::memory_order_acquire);
  const State* state = current_.load(std::memory_order_relaxed);
  if (began == 0 || state == nullptr || state->max_execution_ns == 0) return false;
  if (now_ns - began <= state->max_execution_ns) return false;
  if (execution_began_ns_.load(std::memory_order_acquire) != began)
    return false;  // another execution than the state's
  std::uint32_t nobody = 0;
  if (!condemned_.compare_exchange_strong(nobody, 1, std::memory_order_acq_rel)) return false;
  fault_ = {.what = "the state ran longer than its declared " +
                    std::to_string(state->max_execution_ns / 1000) + " us",
            .where = state->name,
            .when_ns = now_ns};
  const sched_param ordinary{};
  pthread_setschedparam(thread_, SCHED_OTHER, &ordinary);
  for (const auto& port : shell_->ports()) port->close();
  write_outputs(false);
  publish_state(ComponentState::faulted);
  return true;
}

}  // namespace mauve
