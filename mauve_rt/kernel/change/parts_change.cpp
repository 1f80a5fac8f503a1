// SPDX-License-Identifier: LGPL-3.0-or-later
// Changes to a component: new parts, and property values.
#include <map>
#include <string>
#include <string_view>

#include "mauve_rt/base/error.hpp"
#include "mauve_rt/run/component.hpp"

namespace mauve {

namespace {

std::string change_name(const Parts& parts) {
  if (parts.shell != nullptr) return "replace_shell " + parts.shell->implementation();
  if (parts.fsm != nullptr) return "replace_fsm " + parts.fsm->implementation();
  return "replace_core " + parts.core->implementation();
}

/// Takes over what fits: a property that the new shell has not, or has in another type or range, keeps its default.
void copy_properties(const Shell& from, Shell& to) {
  for (const auto& property : from.properties()) {
    PropertyBase* same = to.find_property(property->name());
    if (same == nullptr) continue;
    try {
      PropertyValue value = same->checked(property->boxed());
      same->swap(value);
    } catch (const Error&) {
      continue;
    }
  }
}

constexpr std::string_view kOldPartsRunOn = "the old parts run on";

/// Of a part that could not be prepared: component and part are named once, with the failure's own remedy.
ErrorDetail preparation_detail(const Error& failure, const std::string& component, const std::string& what) {
  ErrorDetail detail = failure.detail();
  if (detail.component.empty()) detail.component = component;
  if (detail.element.empty()) detail.element = what;
  detail.remedy += (detail.remedy.empty() ? "" : "; ") + std::string(kOldPartsRunOn);
  return detail;
}

}  // namespace

PartsChange::PartsChange(Component& component, Parts fresh,
                         std::function<std::unique_ptr<FsmBase>()> make_fsm)
    : component_(component),
      parts_(std::move(fresh)),
      make_fsm_(std::move(make_fsm)),
      restarts_(parts_.shell != nullptr || parts_.fsm != nullptr),
      trace_id_(TraceNames::intern(change_name(parts_))) {
  task = &component.task();
  if (parts_.core != nullptr) core_name_ = TraceNames::intern(parts_.core->implementation());
  if (parts_.shell == nullptr) return;
  parts_.shell->set_context(&component_.task().context());
  copy_properties(component_.shell(), *parts_.shell);
  if (parts_.fsm != nullptr) return;
  if (!component_.make_fsm_) {
    throw Error(ErrorCode::prepare_failed,
                "a new shell needs a new instance of the fsm, and none can be made",
                {.component = component_.name(),
                 .element = component_.fsm().description(),
                 .remedy = "replace the fsm in the same transaction"});
  }
  make_fsm_ = component_.make_fsm_;
  parts_.fsm = make_fsm_();
  if (parts_.fsm == nullptr) {
    throw Error(ErrorCode::prepare_failed, "the fsm's factory returned no object",
                {.component = component_.name(),
                 .element = component_.fsm().description(),
                 .expected = "another instance of the fsm",
                 .found = "nullptr",
                 .remedy = "correct the factory that was given with the fsm"});
  }
  parts_.fsm->set_implementation(component_.fsm().implementation());
}

PartsChange::~PartsChange() { retire(); }

Shell& PartsChange::shell() noexcept { return parts_.shell != nullptr ? *parts_.shell : component_.shell(); }

const FsmBase& PartsChange::fsm() const noexcept {
  return parts_.fsm != nullptr ? *parts_.fsm : *component_.parts_.fsm;
}

void PartsChange::prepare() {
  if (unready_) return;
  try {
    prepare_parts();
  } catch (const Error& error) {
    // NOLINTNEXTLINE(performance-unnecessary-copy-initialization): retire() may end what the error is of
    const Error failure = error;
    retire();
    throw Error(ErrorCode::prepare_failed, failure.statement(),
                preparation_detail(failure, component_.name(), what_));
  } catch (...) {
    const std::string failure = caught_text();
    retire();
    throw Error(ErrorCode::prepare_failed, failure,
                {.component = component_.name(), .element = what_, .remedy = std::string(kOldPartsRunOn)});
  }
}

void PartsChange::prepare_parts() {
  Shell& shell = this->shell();
  if (parts_.shell != nullptr) {
    what_ = parts_.shell->description();
    component_.check_stack(shell);
    parts_.shell->configure();
  }
  if (parts_.fsm != nullptr) {
    what_ = parts_.fsm->description();
    component_.bind_fsm(*parts_.fsm, shell);
    parts_.fsm->configure();
  }
  const FsmBase& fsm = this->fsm();
  if (restarts_) component_.check_fallback(shell, fsm);
  period_ns_ = component_.settled_period_ns(fsm);  // not the task's: a fallback is prepared before it has one
  if (parts_.core != nullptr) {
    what_ = parts_.core->description();
    component_.bind_and_configure(*parts_.core, shell, fsm, binding_);
    if (!afresh_) handover_ = std::make_unique<Handover>(component_.core(), *parts_.core);
  } else {
    CoreBase& core = component_.core();
    what_ = core.description();
    if (parts_.shell != nullptr && !core.accepts(shell)) {
      throw Error(ErrorCode::type_mismatch, "the core was written for another shell",
                  {.component = component_.name(),
                   .element = core.description(),
                   .expected = "a core for " + shell.description(),
                   .remedy = "replace the core in the same transaction"});
    }
    binding_ = component_.require_binding(core, fsm);
    kept_core_ = &core;
  }
  if (parts_.fsm == nullptr) return;
  for (const auto& state : parts_.fsm->states()) {
    if (state->event != nullptr) state->event->mute();  // until the commit
  }
  component_.update_listening(*parts_.fsm);
  find_kept_waits();
}

/// By name, of the fsm that goes out: a time wait for a time wait, an event wait for an event wait.
void PartsChange::find_kept_waits() {
  kept_waits_.clear();
  const std::map<const State*, time_ns_t> ends_ns = wait_ends_ns(parts_.fsm->initial());
  for (const auto& before : component_.parts_.fsm->states()) {
    if (!before->is_wait) continue;
    for (const auto& [now, end_ns] : ends_ns) {
      if (now->name != before->name || (now->event == nullptr) != (before->event == nullptr)) continue;
      kept_waits_.push_back({before.get(), now, period_ns_ != 0 ? end_ns % period_ns_ : 0});
    }
  }
}

bool PartsChange::adopt() {
  if (afresh_ || unready_) return true;
  // Else a fallback took the place of the core meanwhile.
  if (parts_.core != nullptr) return handover_->is_from(*component_.parts_.core) && handover_->adopt();
  return kept_core_ == component_.parts_.core.get();
}

void PartsChange::take() noexcept {
  if (parts_.core != nullptr) {
    if (!afresh_ && !unready_) handover_->take();
    std::swap(parts_.core, component_.parts_.core);
    component_.task_.set_fallen_back(is_fallback_);
    component_.core_name_.store(core_name_, std::memory_order_relaxed);
  } else if (parts_.shell != nullptr) {
    component_.parts_.core->bind_shell(*parts_.shell);
  }
  // Made ready for parts that go out this moment; renew_fallback() arms it anew.
  if (restarts_) component_.task_.set_fallback(nullptr);
  if (parts_.shell != nullptr) std::swap(parts_.shell, component_.parts_.shell);
  if (parts_.fsm != nullptr) {
    std::swap(parts_.fsm, component_.parts_.fsm);
    std::swap(make_fsm_, component_.make_fsm_);
  }
  std::swap(binding_, component_.binding_);
  taken_ = true;
  if (unready_) return;
  if (parts_.fsm != nullptr)
    take_over_events(*parts_.fsm, component_.task_.keep_place(kept_waits_, period_ns_));
  component_.task_.set_machine(*component_.parts_.shell, *component_.parts_.fsm, &component_.binding_,
                               period_ns_);
}

/// By the fsm that was just put in; `before` has gone out.
void PartsChange::take_over_events(const FsmBase& before, bool keeps_place) noexcept {
  const FsmBase& now = *component_.parts_.fsm;
  if (!keeps_place) component_.task_.leave_event_to(now.initial());
  for (const auto& state : now.states()) {
    if (state->event != nullptr) state->event->take_over(before.states());
  }
}

time_ns_t PartsChange::declared_ns() const noexcept {
  return parts_.core != nullptr ? parts_.core->budget_ns() : 0;
}

void PartsChange::retire() noexcept {
  if (parts_.core != nullptr) parts_.core->cleanup();
  if (parts_.fsm != nullptr) parts_.fsm->cleanup();
  if (parts_.shell == nullptr) return;
  for (const auto& port : parts_.shell->ports()) port->disconnect();
  parts_.shell->cleanup();
}

PropertyChange::PropertyChange(PropertyBase& property, PropertyValue value)
    : property_(property),
      value_(std::move(value)),
      trace_id_(TraceNames::intern("set_property " + property.name())) {}

}  // namespace mauve
