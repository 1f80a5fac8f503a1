// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/component.hpp"

#include <algorithm>

#include "mauve_rt/error.hpp"
#include "mauve_rt/futex.hpp"

namespace mauve {

namespace {

constexpr time_ns_t kShortestUndeclaredPeriod = us_to_ns(100);

/// Puts a prepared core in the old one's place.
class CoreSwap final : public CommitAction {
 public:
  CoreSwap(std::unique_ptr<CoreBase>& place, CoreBinding& binding, std::unique_ptr<CoreBase>& fresh,
           CoreBinding& fresh_binding)
      : place_(place),
        binding_(binding),
        fresh_(fresh),
        fresh_binding_(fresh_binding),
        trace_id_(TraceNames::intern("replace_core " + fresh->implementation())) {}

  bool adopt() override { return fresh_->adopt(*place_); }
  void take() noexcept override {
    fresh_->take(*place_);
    std::swap(place_, fresh_);
    std::swap(binding_, fresh_binding_);
  }
  time_ns_t budget_ns() const noexcept override { return fresh_->budget_ns(); }
  std::uint32_t trace_id() const noexcept override { return trace_id_; }

 private:
  std::unique_ptr<CoreBase>& place_;
  CoreBinding& binding_;
  std::unique_ptr<CoreBase>& fresh_;
  CoreBinding& fresh_binding_;
  std::uint32_t trace_id_;
};

class PropertySwap final : public CommitAction {
 public:
  PropertySwap(PropertyBase& property, PropertyValue& value)
      : property_(property),
        value_(value),
        trace_id_(TraceNames::intern("set_property " + property.name())) {}
  void take() noexcept override { property_.swap(value_); }
  std::uint32_t trace_id() const noexcept override { return trace_id_; }

 private:
  PropertyBase& property_;
  PropertyValue& value_;
  std::uint32_t trace_id_;
};

}  // namespace

Component::Component(std::string name, std::uint16_t number, ChangeSignal& changes)
    : name_(std::move(name)), task_(name_, number, changes) {}

Component::~Component() {
  task_.end_thread(kForever);  // before what it runs is taken away
  cleanup();
}

void Component::set_parts(std::unique_ptr<Shell> shell, std::unique_ptr<CoreBase> core,
                          std::unique_ptr<FsmBase> fsm) {
  shell_ = std::move(shell);
  core_ = std::move(core);
  fsm_ = std::move(fsm);
  shell_->set_context(&task_.context());
  declared_core_ = core_->implementation();
  for (const auto& property : shell_->properties()) shown_properties_.push_back(property->boxed());
  show_core();
}

std::string Component::core_implementation() const {
  const std::lock_guard lock(shown_mutex_);
  return shown_core_;
}

std::vector<PropertyValue> Component::property_values() const {
  const std::lock_guard lock(shown_mutex_);
  return shown_properties_;
}

void Component::show_core() {
  const std::lock_guard lock(shown_mutex_);
  shown_core_ = core_->implementation();
}

void Component::show_property(const PropertyBase& property, PropertyValue value) {
  const auto& all = shell_->properties();
  const auto place =
      std::find_if(all.begin(), all.end(), [&](const auto& each) { return each.get() == &property; });
  const std::lock_guard lock(shown_mutex_);
  shown_properties_[static_cast<std::size_t>(place - all.begin())] = std::move(value);
}

void Component::set_settings(const TaskSettings& settings) {
  constexpr int kHighest = 98;
  if (settings.priority < 1 || settings.priority > kHighest) {
    throw Error(ErrorCode::out_of_range, "the priority is out of range",
                {.component = name_,
                 .element = "priority",
                 .expected = "1 to 98 (99 is kept for the conductor of transactions)",
                 .found = std::to_string(settings.priority),
                 .remedy = "choose another priority"});
  }
  if (settings.period_ns < 0 || settings.max_backlog < 1 || settings.stack_bytes < std::size_t{64} * 1024) {
    throw Error(ErrorCode::out_of_range, "a setting of the task is out of range",
                {.component = name_, .expected = "period_ns >= 0, max_backlog >= 1, stack_bytes >= 65536"});
  }
  task_.set_settings(settings);
}

void Component::allow(std::vector<std::string> alternatives, bool reconfigurable) {
  alternatives_ = std::move(alternatives);
  reconfigurable_ = reconfigurable;
}

void Component::check_allowed(const std::string& core_implementation) const {
  if (!reconfigurable_) {
    throw Error(ErrorCode::not_reconfigurable, "the component is protected (reconfigurable: false)",
                {.component = name_, .remedy = "allow it in the architecture file"});
  }
  if (core_implementation == declared_core_ ||
      std::find(alternatives_.begin(), alternatives_.end(), core_implementation) != alternatives_.end()) {
    return;
  }
  std::vector<std::string> allowed{declared_core_};
  allowed.insert(allowed.end(), alternatives_.begin(), alternatives_.end());
  throw Error(ErrorCode::undeclared_core, "the core is not one that the component declares",
              {.component = name_,
               .element = "core",
               .expected = "one of " + join(allowed),
               .found = core_implementation,
               .remedy = "name it among the component's alternatives"});
}

PropertyBase& Component::require_property(const std::string& name) {
  if (PropertyBase* property = shell_->find_property(name)) return *property;
  std::vector<std::string> known;
  for (const auto& property : shell_->properties()) known.push_back(property->name());
  throw Error(ErrorCode::unknown_property, "the shell has no such property",
              {.component = name_,
               .element = "property " + name,
               .expected = "one of " + join(known),
               .found = name});
}

StepReport Component::set_property(const std::string& name, const PropertyValue& value,
                                   const CommitTimeouts& timeouts) {
  const time_ns_t began = monotonic_now_ns();
  PropertyBase& property = require_property(name);
  PropertyValue checked = property.checked(value);
  if (is_configured() && !reconfigurable_) check_allowed(core_->implementation());
  const PropertyValue shown = checked;
  PropertySwap swap(property, checked);
  const time_ns_t prepared = monotonic_now_ns();
  StepReport report = run_commit(swap, timeouts, [&] { show_property(property, shown); });
  report.step = "set_property " + name + " " + to_string(shown);
  report.prepare_ns = prepared - began;
  return report;
}

void Component::require_parked(const std::string& what) const {
  if (task_.is_parked()) return;
  throw Error(ErrorCode::already_running, what + " needs a stopped component",
              {.component = name_,
               .expected = "STOPPED",
               .found = std::string(to_string(task_.state())),
               .remedy = "stop it first, or replace the core in flight"});
}

void Component::cleanup_core() {
  require_parked("cleanup_core");
  core_->cleanup();
}

void Component::replace_core(std::unique_ptr<CoreBase> core) {
  require_parked("replace_core");
  core_->cleanup();
  std::swap(core_, core);
  show_core();
}

void Component::configure_core() {
  require_parked("configure_core");
  prepare(*core_, binding_);
}

void Component::prepare(CoreBase& core, CoreBinding& binding) {
  if (!core.bind_shell(*shell_)) {
    throw Error(ErrorCode::type_mismatch, "the core was written for another shell",
                {.component = name_,
                 .element = core.description(),
                 .expected = "a core for " + shell_->description()});
  }
  core.set_context(&task_.context());
  binding = fsm_->bind_core(core);
  if (binding.object == nullptr && binding.dynamic == nullptr) {
    throw Error(
        ErrorCode::type_mismatch, "the core is not of the type that the fsm runs",
        {.component = name_, .element = core.description(), .expected = "a core for " + fsm_->description()});
  }
  core.configure();
}

StepReport Component::swap_core(std::unique_ptr<CoreBase> core, const CommitTimeouts& timeouts,
                                const std::function<void()>& committed) {
  if (!is_configured()) {
    throw Error(ErrorCode::not_configured, "the component is not configured", {.component = name_});
  }
  const time_ns_t began = monotonic_now_ns();
  CoreBinding binding;
  const std::string from = core_->implementation();
  const std::string to = core->implementation();
  try {
    prepare(*core, binding);
  } catch (const std::exception& failure) {
    throw Error(ErrorCode::prepare_failed, failure.what(),
                {.component = name_, .element = core->description(), .remedy = "the old core goes on"});
  }
  const time_ns_t prepared = monotonic_now_ns();
  CoreSwap swap(core_, binding_, core, binding);
  StepReport report;
  try {
    report = run_commit(swap, timeouts, [&] {
      show_core();
      if (committed) committed();
    });
  } catch (...) {
    core->cleanup();
    throw;
  }
  core->cleanup();  // the old one by now: retire
  report.step = "replace_core " + to;
  report.from_core = from;
  report.to_core = to;
  report.prepare_ns = prepared - began;
  return report;
}

StepReport Component::run_commit(CommitAction& action, const CommitTimeouts& timeouts,
                                 const std::function<void()>& committed) {
  Commit commit(action);
  bool made = false;
  try {
    made = task_.commit(commit, timeouts.commit_ns);
  } catch (const Error&) {
    throw;
  } catch (const std::exception& refusal) {
    throw Error(ErrorCode::adopt_refused, std::string("adopt refused: ") + refusal.what(),
                {.component = name_, .remedy = "the old core goes on"});
  }
  if (!made) {
    throw Error(ErrorCode::adopt_refused, "adopt refused the old core's state",
                {.component = name_, .remedy = "the old core goes on"});
  }
  committed();
  task_.signal_change();
  StepReport report;
  report.component = name_;
  report.blackout_ns = commit.armed_ns - commit.parked_ns;
  if (commit.pending_ns == 0) return report;
  report.phase_nominal_ns = task_.grid().phase_error(commit.pending_ns);
  if (task_.wait_release(commit, monotonic_now_ns() + timeouts.phase_ns)) {
    report.phase_nominal_ns = task_.grid().phase_error(commit.release_nominal_ns);
    report.phase_actual_ns = report.phase_nominal_ns + commit.release_actual_ns - commit.release_nominal_ns;
    report.missed_releases = (commit.release_nominal_ns - commit.pending_ns) / task_.grid().period_ns;
  }
  return report;
}

void Component::settle_period() {
  const time_ns_t declared = task_.settings().period_ns;
  const time_ns_t found = fsm_->period_ns();
  if (declared != 0 && found % declared != 0) {
    throw Error(ErrorCode::bad_period, "the fsm has a cycle that is no multiple of the declared period",
                {.component = name_,
                 .element = "period_ns",
                 .expected = "a divisor of " + std::to_string(found) + " ns",
                 .found = std::to_string(declared),
                 .remedy = "declare a divisor, or change the waits"});
  }
  if (declared == 0 && found < kShortestUndeclaredPeriod) {
    throw Error(ErrorCode::bad_period, "the fsm's cycles have a very short common period",
                {.component = name_,
                 .element = "period",
                 .expected = "at least 100 us",
                 .found = std::to_string(found) + " ns",
                 .remedy = "declare period_ns if it is meant, or make the waits multiples of a longer one"});
  }
  task_.context().period_ns = declared != 0 ? declared : found;
}

bool Component::configure_hook() {
  require_parked("configure");
  if (!fsm_->bind_shell(*shell_)) {
    throw Error(ErrorCode::type_mismatch, "the fsm was written for another shell",
                {.component = name_,
                 .element = fsm_->description(),
                 .expected = "an fsm for " + shell_->description()});
  }
  try {
    shell_->configure();
    fsm_->configure();
    settle_period();
    prepare(*core_, binding_);
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
  for (const auto& port : shell_->ports()) port->reopen();
  task_.clear_fault();
  task_.set_machine(*shell_, *fsm_, &binding_);
  task_.set_state(ComponentState::stopped);
  return true;
}

void Component::check_cleanup() const { require_parked("cleanup"); }

void Component::cleanup_hook() {
  core_->cleanup();
  fsm_->cleanup();
  shell_->cleanup();
  task_.set_state(ComponentState::unconfigured);
}

}  // namespace mauve
