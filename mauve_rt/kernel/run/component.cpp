// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/run/component.hpp"

#include <algorithm>

#include "mauve_rt/architecture/architecture.hpp"
#include "mauve_rt/base/error.hpp"
#include "mauve_rt/base/seam/futex.hpp"
#include "mauve_rt/change/transaction_commit.hpp"

#include "base/prefault.hpp"
#include "parts/lookup.hpp"

namespace mauve {

namespace {

constexpr time_ns_t kShortestUndeclaredPeriod = us_to_ns(100);
/// How long a command waits for a component that is late to take an earlier change.
constexpr time_ns_t kEarlierChange = s_to_ns(1);

}  // namespace

Component::Component(std::string name, std::uint16_t number, ChangeSignal& changes)
    : name_(std::move(name)), task_(name_, number, changes) {}

Component::~Component() {
  task_.end_thread(kForever);  // before what it runs is taken away
  Configurable::cleanup();
}

void Component::enter(Architecture& architecture) noexcept {
  architecture_.store(&architecture, std::memory_order_release);
  task_.changes().listener.set(architecture.changes());
}

void Component::leave_architecture() noexcept {
  architecture_.store(nullptr, std::memory_order_release);
  task_.changes().set_listener(nullptr);
}

class Component::JoinedChange {
 public:
  JoinedChange(Architecture* architecture, Component& component) {
    if (architecture == nullptr) return;
    lock_ = architecture->change_lock().join();
    if (!lock_.owns_lock()) return;  // a part of a change, which has claimed what it touches
    CommitGate& commits = architecture->commit_gate();
    ChangeMark& mark = component.change_mark_;
    architecture->wait_for_earlier(kEarlierChange, [&] {
      const CommitGate::Look table(commits);
      if (mark.is_claimed() || commits.has_open_about(component.task_) || component.is_renewing())
        return EarlierChange::under_way;
      if (mark.is_unsettled()) return EarlierChange::late;
      mark.claim();
      mark.hold();
      return EarlierChange::none;
    });
    gate_ = &commits;
    mark_ = &mark;
  }
  ~JoinedChange() {
    if (mark_ == nullptr) return;
    const CommitGate::Look table(*gate_);
    mark_->set_changed();
    mark_->release();
  }
  JoinedChange(const JoinedChange&) = delete;
  JoinedChange& operator=(const JoinedChange&) = delete;

 private:
  std::unique_lock<ChangeLock> lock_;
  CommitGate* gate_{nullptr};
  ChangeMark* mark_{nullptr};
};

Component::JoinedChange Component::join_change() {
  return {architecture_.load(std::memory_order_acquire), *this};
}

Architecture& Component::require_listed() const {
  if (Architecture* architecture = architecture_.load(std::memory_order_acquire)) return *architecture;
  throw Error(ErrorCode::unknown_component, "the component was removed", {.component = name_});
}

void Component::put_back_parked(Probation& probation) {
  const auto change = join_change();
  task_.put_back_parked(probation);
}

void Component::dispose(const std::string& what, std::function<void()> work) {
  Architecture* const architecture = architecture_.load(std::memory_order_acquire);
  if (architecture == nullptr) return work();
  architecture->dispose(what + " of " + description(), std::move(work));
}

void Component::configure() {
  const auto change = join_change();
  Configurable::configure();
}

void Component::cleanup() {
  const auto change = join_change();
  // First: a start would run the parts that are being cleaned up.
  while (is_configured() && !task_.unconfigure()) require_parked("cleanup");
  Configurable::cleanup();
}

void Component::set_parts(Parts parts) {
  parts_ = std::move(parts);
  parts_.shell->set_context(&task_.context());
  present_shell_.store(parts_.shell.get(), std::memory_order_release);
  present_core_.store(parts_.core.get(), std::memory_order_release);
  present_fsm_.store(parts_.fsm.get(), std::memory_order_release);
  declared_core_ = parts_.core->implementation();
  shown_core_.store(keep_shown(*parts_.core), std::memory_order_release);
  show();
}

ShownParts Component::shown() const {
  const LockGuard lock(shown_mutex_);
  ShownParts shown = shown_;
  if (const ShownCore* const core = shown_core_.load(std::memory_order_acquire)) shown.core = core->name;
  return shown;
}

std::string Component::faulted_core() const {
  const ShownCore* const core = faulted_core_.load(std::memory_order_acquire);
  return task_.has_fallen_back() && core != nullptr ? core->name : "";
}

std::shared_ptr<const StateTimes> Component::state_times() const {
  const LockGuard lock(shown_mutex_);
  return shown_times_;
}

const ShownCore* Component::keep_shown(const CoreBase& core) {
  const LockGuard lock(shown_mutex_);
  return &*cores_.insert({.name = core.implementation(), .wcet_ns = core.wcet_ns()}).first;
}

std::vector<DescribedState> Component::described_states() const {
  std::vector<DescribedState> states;
  {
    const LockGuard lock(shown_mutex_);
    states = shown_states_;
  }
  // Not in show(): a fallback may take the core's place at any moment.
  if (const ShownCore* const core = shown_core_.load(std::memory_order_acquire))
    add_worst_cases(states, core->name, core->wcet_ns);
  return states;
}

void Component::add_worst_cases(std::vector<DescribedState>& states, const std::string& core,
                                const CoreTimes& times) const {
  add_core_times(states, core, times);
  for (DescribedState& state : states)
    state.wcet_enforced = task_.settings().enforce_wcet && !state.is_wait && state.wcet_ns != 0;
}

std::vector<DescribedState> Component::states_of(const FsmBase& fsm, const CoreBase& core) const {
  std::vector<DescribedState> states = fsm.describe_states();
  add_worst_cases(states, core.implementation(), core.wcet_ns());
  for (const DescribedState& state : states)
    check_wcet(state.name, state.wcet_ns, state.max_execution_ns, name_, state.wcet_core);
  return states;
}

std::vector<DescribedState> Component::previewed_states() const {
  const std::unique_ptr<FsmBase> fsm = this->fsm().another();
  if (fsm == nullptr) return described_states();
  bind_fsm(*fsm, *parts_.shell);
  fsm->configure();
  std::vector<DescribedState> states;
  try {
    states = states_of(*fsm, *parts_.core);
    require_declared_states(*fsm);
  } catch (...) {
    fsm->cleanup();
    throw;
  }
  fsm->cleanup();
  return states;
}

void Component::show() {
  const FsmBase& fsm = this->fsm();  // once: the old fsm of one on probation may take its place
  ShownParts now{.shell = parts_.shell->implementation(),
                 .core = {},  // by name only: a fallback may take its place at any moment
                 .fsm = fsm.implementation(),
                 .ports = {},
                 .properties = {}};
  for (const auto& port : parts_.shell->ports()) {
    const ServiceBase* service = port->service();
    now.ports.push_back({port->name(), port->kind(), port->type(), port->resource_name(),
                         service == nullptr ? "" : service->name(),
                         service == nullptr ? 0 : service->longest_hold_ns(),
                         service == nullptr ? std::vector<std::byte>{} : port->stop_message(),
                         port->frames() == nullptr ? Frames{} : *port->frames()});
  }
  for (const auto& property : parts_.shell->properties())
    now.properties.push_back({property->name(), property->boxed(), property->options()});
  std::vector<DescribedState> states = fsm.describe_states();
  const LockGuard lock(shown_mutex_);
  shown_ = std::move(now);
  shown_states_ = std::move(states);
  shown_times_ = fsm.times();
}

void Component::set_settings(const TaskSettings& settings) {
  check_settings(settings, name_);
  slewed_ = SlewedOutputs(settings.max_slew, name_);
  task_.set_settings(settings);
}

void Component::allow(std::vector<std::string> alternatives, bool reconfigurable) {
  alternatives_ = std::move(alternatives);
  reconfigurable_ = reconfigurable;
}

void Component::check_reconfigurable() const {
  if (reconfigurable_) return;
  throw Error(ErrorCode::not_reconfigurable, "the component is protected (reconfigurable: false)",
              {.component = name_, .remedy = "allow it in the architecture file"});
}

void Component::check_allowed(const std::string& core_implementation) const {
  check_reconfigurable();
  const auto is_it = [&core_implementation](const std::string& name) {
    return name == core_implementation || name == any_core;
  };
  if (is_it(declared_core_) || is_it(fallback_name_) ||
      std::any_of(alternatives_.begin(), alternatives_.end(), is_it)) {
    return;
  }
  std::vector<std::string> allowed{declared_core_};
  if (!fallback_name_.empty()) allowed.push_back(fallback_name_);
  allowed.insert(allowed.end(), alternatives_.begin(), alternatives_.end());
  throw Error(ErrorCode::undeclared_core, "the core is not one that the component declares",
              {.component = name_,
               .element = "core",
               .expected = "one of " + join(allowed),
               .found = core_implementation,
               .remedy = "name it among the component's alternatives"});
}

PropertyBase& Component::require_property(const std::string& name) const {
  return find_property(shell(), name, name_);
}

PortBase& Component::require_port(const std::string& name) const { return find_port(shell(), name, name_); }

void Component::check_structural(const PropertyBase& property, const PropertyValue& value,
                                 ReadBy replaced) const {
  const ReadBy kept = without(property.options().structural, replaced);
  if (kept == ReadBy::none || !is_configured()) return;
  for (const ShownProperty& present : shown().properties) {
    if (present.name == property.name() && present.value == value) return;
  }
  std::string parts;
  for (const std::string& part : names_of(kept)) parts += (parts.empty() ? "the " : " and the ") + part;
  throw Error(ErrorCode::structural_property, "it is structural, read only when the component is configured",
              {.component = name_,
               .element = "property " + property.name(),
               .expected = "a replacement of " + parts + " in the same transaction",
               .found = "none",
               .remedy = "replace " + parts +
                         " beside it, by the same kind if it is to stay, or stop the component, clean it up, "
                         "set it and configure it"});
}

StepReport Component::set_property(const std::string& name, const PropertyValue& value,
                                   const CommitTimeouts& timeouts) {
  return require_listed().commit_one(std::move(Transaction().set_property(name_, name, value)), timeouts);
}

void Component::require_parked(const std::string& what) const {
  if (task_.is_parked()) return;
  throw Error(ErrorCode::already_running, what + " needs a stopped component",
              {.component = name_,
               .expected = "STOPPED",
               .found = std::string(to_string(task_.state())),
               .remedy = "stop it first, or replace the core in flight"});
}

void Component::unbind_core() noexcept {
  has_ready_core_.store(false, std::memory_order_relaxed);
  binding_ = {};
}

void Component::cleanup_core() {
  const auto change = join_change();
  require_parked("cleanup_core");
  unbind_core();
  parts_.core->cleanup();
}

void Component::replace_core(std::unique_ptr<CoreBase> core) {
  require_listed().commit_one(std::move(Transaction().place_core(name_, std::move(core))));
}

void Component::configure_core() {
  const auto change = join_change();
  require_parked("configure_core");
  bind_and_configure(*parts_.core, *parts_.shell, *parts_.fsm, binding_);
  has_ready_core_.store(true, std::memory_order_relaxed);
  if (task_.has_thread()) prefault_allocated();
}

void Component::bind_and_configure(CoreBase& core, Shell& shell, const FsmBase& fsm, CoreBinding& binding) {
  if (!core.bind_shell(shell)) {
    throw Error(
        ErrorCode::type_mismatch, "the core was written for another shell",
        {.component = name_, .element = core.description(), .expected = "a core for " + shell.description()});
  }
  core.set_context(&task_.context());
  CoreBinding bound = require_binding(core, fsm);
  core.configure();
  binding = std::move(bound);
}

CoreBinding Component::require_binding(CoreBase& core, const FsmBase& fsm) const {
  CoreBinding binding = fsm.bind_core(core);
  binding.core = &core;
  if (binding.is_bound()) {
    for (const DescribedState& state : states_of(fsm, core)) {  // checks the core's times
      if (task_.settings().enforce_wcet)
        binding.budgets_ns.push_back(state.wcet_enforced ? state.wcet_ns : 0);
    }
    return binding;
  }
  throw Error(
      ErrorCode::type_mismatch, "the core is not of the type that the fsm runs",
      {.component = name_,
       .element = core.description(),
       .expected = "a core for " + fsm.description(),
       .remedy = "derive the core from the class for which the fsm was written, or replace the fsm, too"});
}

void Component::require_ready_core() const {
  if (!is_configured() || has_ready_core_.load(std::memory_order_relaxed)) return;
  throw Error(ErrorCode::not_configured, "the core is not configured",
              {.component = name_,
               .element = parts_.core->description(),
               .expected = "a core that configure_core() has bound and configured",
               .found = "one that it has not",
               .remedy = "call configure_core() first"});
}

StepReport Component::swap_core(std::unique_ptr<CoreBase> core, const CommitTimeouts& timeouts,
                                const std::function<void()>& committed) {
  const auto made =
      require_listed().make_one(std::move(Transaction().replace_core(name_, std::move(core))), timeouts);
  if (committed) committed();
  return made->report(timeouts.phase_ns).steps.front();
}

namespace {

/// The instants of the grid before the change that lie between the pending one and the release that follows.
std::int64_t missed_releases(const Participant& participant, time_ns_t release_ns) noexcept {
  if (participant.period_ns == 0 || release_ns <= participant.pending_ns) return 0;
  return (release_ns - participant.pending_ns + participant.period_ns - 1) / participant.period_ns;
}

std::string why_missed(const Participant& participant) {
  const auto in_us = [](time_ns_t duration_ns) { return std::to_string(duration_ns / us_to_ns(1)) + " us"; };
  if (participant.start_clock_ns) return "it starts on the clock that was asked for";
  const bool was_to_go_on =
      participant.grid.first_not_before(participant.pending_ns) == participant.pending_ns;
  if (participant.afterwards != Afterwards::restart || was_to_go_on)
    return "adopt and take lasted beyond its pending instant";
  return "the pending instant, of a period of " + in_us(participant.period_ns) +
         ", is none of the new one's: it starts at the first of " + in_us(participant.grid.period_ns) +
         " after it";
}

}  // namespace

StepReport report_of(const Participant& participant, time_ns_t phase_timeout_ns) {
  StepReport report;
  report.component = participant.task->name();
  if (participant.in_flight) report.instant_ns = participant.commit->instant_ns();
  if (!participant.has_passed()) {
    report.remark = "it is late, and takes the change before its next release";
    return report;
  }
  if (participant.in_flight) report.blackout_ns = participant.armed_ns - participant.parked_ns;
  if (!participant.is_followed_by_release()) return report;
  const bool released =
      participant.task->wait_release(participant, later_by(monotonic_now_ns(), phase_timeout_ns));
  const time_ns_t nominal_ns = released ? participant.release_nominal_ns : participant.resumes_ns;
  report.phase_nominal_ns = participant.grid.phase_error(nominal_ns - participant.grid_place_ns);
  if (released) {
    report.phase_actual_ns =
        report.phase_nominal_ns + participant.release_actual_ns - participant.release_nominal_ns;
    report.released_ns = participant.release_actual_ns;
    report.release_ns = participant.release_nominal_ns;
  }
  report.missed_releases = participant.lost + missed_releases(participant, nominal_ns - participant.shift_ns);
  if (report.missed_releases != 0) report.remark = why_missed(participant);
  return report;
}

time_ns_t Component::settled_period_ns(const FsmBase& fsm) const {
  const time_ns_t declared = task_.settings().period_ns;
  const time_ns_t found = fsm.period_ns();
  if (fsm.is_sporadic()) {
    if (declared == 0) return 0;
    throw Error(ErrorCode::bad_period, "an fsm that waits for events has no period",
                {.component = name_,
                 .element = "period_ns",
                 .expected = "none",
                 .found = std::to_string(declared),
                 .remedy = "declare none"});
  }
  if (declared != 0 && found % declared != 0) {
    throw Error(ErrorCode::bad_period, "the fsm has a cycle that is no multiple of the declared period",
                {.component = name_,
                 .element = "period_ns",
                 .expected = "a divisor of " + std::to_string(found) + " ns",
                 .found = std::to_string(declared),
                 .remedy = "declare a divisor, or change the waits"});
  }
  if (declared == 0 && found != 0 && found < kShortestUndeclaredPeriod) {
    throw Error(ErrorCode::bad_period, "the fsm's cycles have a very short common period",
                {.component = name_,
                 .element = "period",
                 .expected = "at least 100 us",
                 .found = std::to_string(found) + " ns",
                 .remedy = "declare period_ns if it is meant, or make the waits multiples of a longer one"});
  }
  return declared != 0 ? declared : found;
}

void Component::bind_fsm(FsmBase& fsm, Shell& shell) const {
  if (!fsm.bind_shell(shell)) {
    throw Error(
        ErrorCode::type_mismatch, "the fsm was written for another shell",
        {.component = name_, .element = fsm.description(), .expected = "an fsm for " + shell.description()});
  }
  fsm.declare_states(task_.settings().states);
}

/// Of the fsm that it starts with; later ones need not have them all.
void Component::require_declared_states(const FsmBase& fsm) const {
  for (const DeclaredState& declared : task_.settings().states) {
    const bool is_worst_case = !declared.max_execution_ns && !declared.simulated_execution_ns;
    std::vector<std::string> suitable;
    for (const auto& state : fsm.states()) {  // a wait executes its guards
      if (!state->is_wait || (is_worst_case && !state->transitions.empty())) suitable.push_back(state->name);
    }
    if (std::ranges::find(suitable, declared.name) != suitable.end()) continue;
    throw Error(
        ErrorCode::bad_fsm, "the fsm has no such execution state",
        {.component = name_,
         .element = fsm.description(),
         .expected = "one of " + join(suitable),
         .found = declared.name,
         .remedy = "declare times of the states that the fsm executes; of a wait with guards wcet_ns"});
  }
}

void Component::check_stack(const Shell& shell) const {
  const LargestMessage largest = largest_message(shell);
  const std::size_t needed = stack_bytes_for(largest);
  if (needed <= task_.settings().stack_bytes) return;
  throw Error(ErrorCode::out_of_range, "a port's messages do not fit on the component's stack",
              {.component = name_,
               .element = "port " + largest.port,
               .expected = "stack_bytes of at least " + std::to_string(needed) + " for " +
                           std::to_string(largest.bytes) + " bytes of " + largest.type,
               .found = "stack_bytes of " + std::to_string(task_.settings().stack_bytes),
               .remedy = "raise the component's stack_bytes, or make the message smaller"});
}

bool Component::configure_hook() {
  require_parked("configure");
  for (const auto& port : parts_.shell->ports()) {
    if (port->is_required() && !port->is_connected()) throw_not_connected(*port, name_);
  }
  check_stack(*parts_.shell);
  bind_fsm(*parts_.fsm, *parts_.shell);
  time_ns_t period_ns = 0;
  try {
    parts_.shell->configure();
    parts_.fsm->configure();
    require_declared_states(*parts_.fsm);
    period_ns = settled_period_ns(*parts_.fsm);
    bind_and_configure(*parts_.core, *parts_.shell, *parts_.fsm, binding_);
    has_ready_core_.store(true, std::memory_order_relaxed);
    prepare_fallback();
  } catch (const Error& failure) {
    cleanup_hook();
    if (!failure.detail().component.empty()) throw;
    ErrorDetail detail = failure.detail();
    detail.component = name_;
    throw Error(failure.code(), failure.statement(), detail);
  } catch (...) {
    cleanup_hook();
    throw;
  }
  for (const auto& port : parts_.shell->ports()) port->reopen();
  task_.clear_fault();
  task_.set_machine(*parts_.shell, *parts_.fsm, &binding_, period_ns);
  update_listening();
  show();
  if (task_.has_thread()) prefault_allocated();
  task_.set_state(ComponentState::stopped);
  return true;
}

void Component::update_listening(const FsmBase& fsm) {
  for (const auto& state : fsm.states()) {
    if (state->event == nullptr) continue;
    state->event->set_waiter(task_);
    state->event->listen();
  }
}

void Component::stop_listening() noexcept {
  for (const auto& state : fsm().states()) {
    if (state->event != nullptr) state->event->stop_listening();
  }
}

/// It may have been taken, and another core have replaced it since: then what it holds is no core to go back to.
bool Component::is_fallback_in() const noexcept {
  return fallback_ != nullptr && fallback_->was_taken() && task_.has_fallen_back();
}

void Component::set_up_ports(Shell& shell) const {
  for (const auto& [port, frames] : frames_) {
    PortBase* const found = shell.find_port(port);
    if (found != nullptr) found->declare_frames(frames);
  }
  slewed_.limit(shell, name_);
}

Parts Component::another() const {
  const CoreBase& declared = is_fallback_in() ? *fallback_->core() : *parts_.core;
  Parts parts{.shell = shell().another(), .core = declared.another(), .fsm = fsm().another()};
  if (parts.shell != nullptr) set_up_ports(*parts.shell);
  return parts;
}

void Component::configure_anew() {
  require_parked("configure");
  cleanup();
  configure();
}

void Component::check_cleanup() const {
  require_parked("cleanup");
  check_renewed();
}

std::unique_ptr<CoreBase> Component::release_core() noexcept {
  unbind_core();
  return std::move(parts_.core);
}

void Component::cleanup_hook() {
  // The old core of one that hung in a probation, where it could not go on in another component.
  if (const auto probation = present_probation()) probation->put_back_taken();
  conclude_probation();
  settle_probation(true);
  conclude_shadow();
  settle_shadow();
  task_.set_fallback(nullptr);
  spare_ = nullptr;
  if (fallback_ != nullptr) {
    // After a fault the declared core is the one that is out: it gets another chance.
    const bool is_in = is_fallback_in();
    const bool is_replaced = fallback_->was_taken() && !is_in;  // the renewal that is to come has it
    fallback_core_ = fallback_->give_back_core();
    if (is_in) std::swap(fallback_core_, parts_.core);
    present_core_.store(parts_.core.get(), std::memory_order_release);
    if (parts_.core != nullptr)  // else release_core()
      shown_core_.store(keep_shown(*parts_.core), std::memory_order_release);
    fallback_.reset();
    fallback_core_->cleanup();
    if (is_replaced) fallback_core_.reset();
  }
  unbind_core();
  if (parts_.core != nullptr) parts_.core->cleanup();  // else release_core()
  parts_.fsm->cleanup();
  parts_.shell->cleanup();
  task_.set_state(ComponentState::unconfigured);
}

}  // namespace mauve
