// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/deploy/host.hpp"

#include <algorithm>

#include "mauve_rt/base/error.hpp"
#include "mauve_rt/base/seam/futex.hpp"

namespace mauve {

namespace {

/// For so long, all together, each component is stopped only when the one after it has come to rest.
constexpr time_ns_t kInOrder = ms_to_ns(50);

}  // namespace

const char* to_string(Abandoned abandoned) noexcept {
  switch (abandoned) {
    case Abandoned::called_off:
      return "called_off";
    case Abandoned::faulted:
      return "faulted";
    case Abandoned::stopped:
      return "stopped";
  }
  return "unknown";
}

void Host::require_deployable() const {
  if (is_deployed()) {
    throw Error(ErrorCode::already_running, "the architecture is deployed already",
                {.remedy = "shut it down first, to deploy it again"});
  }
  if (architecture_.is_configured()) return architecture_.require_ready_cores();
  throw Error(ErrorCode::not_configured, "the architecture is not configured",
              {.remedy = "call configure() first"});
}

void Host::require_deployed() const {
  if (is_deployed()) return;
  throw Error(ErrorCode::not_configured, "the architecture is not deployed",
              {.remedy = "call deploy() first"});
}

void Host::start(const std::string& component, std::optional<time_ns_t> clock_ns,
                 std::uint64_t expected_revision) {
  require_deployed();
  architecture_.hold_component(component)->task().start(clock_ns, Task::kStartTimeout, expected_revision);
}

void Host::stop(const std::string& component, time_ns_t timeout_ns) {
  stop(component, StopOptions{.timeout_ns = timeout_ns});
}

bool Host::stop(const std::string& component, const StopOptions& options) {
  require_deployed();
  const time_ns_t timeout_ns = is_simulated() ? 0 : options.timeout_ns;
  const auto present = architecture_.find_component(component);
  // One of that name that was removed, and is late to end: a stop reaches both.
  const auto leaving = find_leaving(component, present.get());
  if (leaving != nullptr && present == nullptr) return leaving->task().stop(timeout_ns, options.force);
  if (leaving != nullptr) {
    try {
      leaving->task().stop(timeout_ns, options.force);
    } catch (const Error&) {  // the error that is reported is that of the listed component
    }
  }
  return architecture_.hold_component(component)->task().stop(timeout_ns, options.force,
                                                              options.expected_revision);
}

std::shared_ptr<Component> Host::find_leaving(const std::string& name, const Component* present) const {
  for (const auto& each : hosted()) {
    const ComponentState state = each->task().state();
    const bool runs = state == ComponentState::running || state == ComponentState::stopping;
    if (runs && each.get() != present && each->name() == name) return each;
  }
  return nullptr;
}

Abandoned Host::abandon(const std::string& component) {
  require_deployed();
  if (architecture_.call_off_preparation(component)) return Abandoned::called_off;
  const auto awaited = architecture_.find_awaited(component);
  const auto held = awaited != nullptr ? awaited : architecture_.hold_component(component);
  Task& task = held->task();
  if (architecture_.commit_gate().abandon(task)) return Abandoned::called_off;
  if (task.is_left_behind()) {
    throw Error(ErrorCode::faulted, "the component was given up before: " + task.fault().what,
                {.component = component, .remedy = Task::kLeftBehindRemedy});
  }
  const StateAge age = task.state_age();
  if (awaited == nullptr && (age.is_wait || !age.is_hung())) {
    throw Error(
        ErrorCode::not_running, "no decided change waits for the component, and no state of it hangs",
        {.component = component,
         .element = age.state,
         .remedy = "look at the open changes: one that is being prepared is called off while it is at a hook "
                   "of a new part; to stop the component whatever it does, stop it by force"});
  }
  return task.stop(0, true) ? Abandoned::faulted : Abandoned::stopped;
}

time_ns_t Host::get_time(const std::string& component) const {
  return architecture_.hold_component(component)->task().get_time();
}

void Host::require_own() const {
  const Runner* present = architecture_.host();
  if (present == nullptr || present == this) return;
  throw Error(ErrorCode::already_running, "another host runs the architecture",
              {.remedy = "ask that one for the change, or shut it down first"});
}

std::unique_ptr<TransactionCommit> Host::make(Transaction transaction, const TransactionOptions& options) {
  require_own();
  return architecture_.make(std::move(transaction), options);
}

std::unique_ptr<PreparedTransaction> Host::prepare(Transaction transaction,
                                                   const TransactionOptions& options) {
  require_own();
  return std::make_unique<PreparedTransaction>(architecture_, *this, std::move(transaction), options);
}

TransactionReport Host::commit(Transaction transaction, const TransactionOptions& options) {
  return make(std::move(transaction), options)->report(options.timeouts.phase_ns);
}

StepReport Host::replace_core(const std::string& component, const std::string& core,
                              const CommitTimeouts& timeouts) {
  require_own();
  return architecture_.commit_one(std::move(Transaction().replace_core(component, core)), timeouts);
}

StepReport Host::set_property(const std::string& component, const std::string& name,
                              const PropertyValue& value, const CommitTimeouts& timeouts) {
  require_own();
  return architecture_.commit_one(std::move(Transaction().set_property(component, name, value)), timeouts);
}

void Host::settle_probations() noexcept { architecture_.settle_probations_if_idle(); }

std::vector<ProbationRecord> Host::probations() const {
  std::vector<ProbationRecord> all;
  for (const auto& component : architecture_.components()) {
    for (ProbationRecord& record : component->probations()) all.push_back(std::move(record));
  }
  return all;
}

bool Host::revert_probation(const std::string& component, const std::string& reason, time_ns_t timeout_ns) {
  return architecture_.hold_component(component)->revert_probation(reason, timeout_ns);
}

std::vector<ShadowRecord> Host::shadows() const {
  std::vector<ShadowRecord> all;
  for (const auto& component : architecture_.components()) {
    if (const auto shadow = component->last_shadow()) all.push_back(shadow->record());
  }
  return all;
}

ArchitectureDescription Host::describe() const {
  architecture_.settle_if_idle();
  return architecture_.describe();
}

TraceDrain Host::drain_trace() {
  TraceDrain drain = architecture_.drain_trace();
  if (is_simulated()) drain.monotonic_ns = drain.realtime_ns = now_ns();
  return drain;
}

std::uint32_t Host::wait_change(std::uint32_t seen, time_ns_t until_ns) noexcept {
  const Atomic<std::uint32_t>& word = architecture_.changes().word;
  while (!is_simulated() && word.load(std::memory_order_acquire) == seen) {
    if (!futex_wait_until(word, seen, until_ns)) break;
  }
  return word.load(std::memory_order_acquire);
}

void Host::start_all(time_ns_t epoch_ns) {
  architecture_.set_deployment_epoch(epoch_ns);
  architecture_.overlays().start_all();
  const ArchitectureDescription description = architecture_.describe();
  for (const auto& component : architecture_.components()) {
    Task& task = component->task();
    const time_ns_t first = task.join(epoch_ns);
    const bool is_to_start = !architecture_.overlays().is_kept_stopped(component->name(), description);
    if (task.state() == ComponentState::stopped && is_to_start) task.start_at(first);
  }
}

void Host::attach(const std::shared_ptr<Component>& component) {
  begin_task(component->task());
  note_hosted(component);
}

bool Host::detach(Component& component, time_ns_t until_ns) noexcept {
  if (!end_task(component.task(), until_ns)) return false;
  const LockGuard lock(hosted_mutex_);
  std::erase_if(hosted_, [&](const auto& each) {
    const auto held = each.lock();
    return held == nullptr || held.get() == &component;
  });
  return true;
}

void Host::note_hosted(const std::shared_ptr<Component>& component) {
  const LockGuard lock(hosted_mutex_);
  const auto is_it = [&](const auto& each) { return each.lock() == component; };
  if (std::none_of(hosted_.begin(), hosted_.end(), is_it)) hosted_.push_back(component);
}

std::vector<std::shared_ptr<Component>> Host::hosted() const {
  const LockGuard lock(hosted_mutex_);
  std::vector<std::shared_ptr<Component>> all;
  for (const auto& each : hosted_) {
    if (auto component = each.lock()) all.push_back(std::move(component));
  }
  return all;
}

void Host::stop_all(time_ns_t until_ns) noexcept {
  const auto components = hosted();
  const auto stop = [](Task& task, time_ns_t by_ns, bool force = false) {
    try {
      task.stop(std::max<time_ns_t>(0, by_ns - monotonic_now_ns()), force);
    } catch (const Error&) {  // still in a state, or faulted by now: ending its thread is the answer
    }
  };
  const time_ns_t in_order_until = std::min(until_ns, monotonic_now_ns() + kInOrder);
  for (auto component = components.rbegin(); component != components.rend(); ++component) {
    Task& task = (*component)->task();
    if (task.state() == ComponentState::running) stop(task, in_order_until);
  }
  for (const auto& component : components) {
    Task& task = component->task();
    // In virtual time no instant comes for another step of an output with a max_slew.
    if (task.state() == ComponentState::stopping) stop(task, until_ns, task.is_simulated());
    component->conclude_probation();
    component->conclude_shadow();
  }
}

void Host::give_up_hung() noexcept {
  for (const auto& component : hosted()) {
    try {
      if (component->task().state() == ComponentState::stopping) component->task().stop(0, true);
    } catch (
        const Error&) {  // it has stopped, or cannot be given up in a wait, whose outputs its thread makes safe
    }
  }
}

}  // namespace mauve
