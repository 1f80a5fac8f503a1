// SPDX-License-Identifier: LGPL-3.0-or-later
// Changes to a component: new parts, and property values.
#include <string>
#include <string_view>

#include "mauve_rt/base/error.hpp"
#include "mauve_rt/run/component.hpp"

#include "change/kept_waits.hpp"

namespace mauve {

namespace {

std::string change_name(const Parts& parts) {
  if (parts.shell != nullptr) return "replace_shell " + parts.shell->implementation();
  if (parts.fsm != nullptr) return "replace_fsm " + parts.fsm->implementation();
  return "replace_core " + parts.core->implementation();
}

/// Takes over what fits: a property that the new shell has not, or has in another type or range, keeps its default.
void copy_properties(const std::vector<ShownProperty>& from, Shell& to) {
  for (const ShownProperty& property : from) {
    PropertyBase* same = to.find_property(property.name);
    if (same == nullptr) continue;
    try {
      PropertyValue value = same->checked(property.value);
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

PartsChange::PartsChange(Component& component, Parts fresh)
    : component_(component),
      parts_(std::move(fresh)),
      new_shell_(parts_.shell.get()),
      fsm_before_(&component.fsm()),
      restarts_(parts_.shell != nullptr || parts_.fsm != nullptr),
      trace_id_(TraceNames::intern(change_name(parts_))) {
  task = &component.task();
  if (parts_.core != nullptr) shown_core_ = component.keep_shown(*parts_.core);
  if (parts_.shell == nullptr) return;
  parts_.shell->set_context(&component_.task().context());
  copy_properties(component_.shown().properties, *parts_.shell);
  if (parts_.fsm != nullptr) return;
  parts_.fsm = fsm_before_->another();
  if (parts_.fsm == nullptr) {
    throw Error(ErrorCode::prepare_failed,
                "a new shell needs a new instance of the fsm, and none can be made",
                {.component = component_.name(),
                 .element = fsm_before_->description(),
                 .remedy = "replace the fsm in the same transaction"});
  }
}

PartsChange::PartsChange(Component& component, std::shared_ptr<Shadow> candidate, bool is_fresh)
    : component_(component),
      new_shell_(nullptr),
      fsm_before_(&component.fsm()),
      restarts_(false),
      candidate_(std::move(candidate)),
      afresh_(is_fresh),
      promotes_(true),
      trace_id_(TraceNames::intern("replace_core " + candidate_->core_name())) {
  task = &component.task();
  candidate_->with_core(Shadow::kStateEnd, [this](CoreBase& core) {
    shown_core_ = component_.keep_shown(core);
    budget_ns_ = core.budget_ns();
  });
}

PartsChange::~PartsChange() { retire(); }

Shell& PartsChange::shell() noexcept { return new_shell_ != nullptr ? *new_shell_ : component_.shell(); }

const FsmBase& PartsChange::fsm() const noexcept {
  return parts_.fsm != nullptr ? *parts_.fsm : *fsm_before_;
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
  if (has_probation() && replaces_fsm()) prepare_way_back();
  if (candidate_ != nullptr) {
    prepare_candidate();
  } else if (parts_.core != nullptr) {
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
  kept_waits_ = kept_waits(*fsm_before_, *parts_.fsm, period_ns_);
}

/// It executes in the shadow still: it is bound to the component's shell when it goes in.
void PartsChange::prepare_candidate() {
  what_ = "core " + candidate_->core_name();
  candidate_->with_core(Shadow::kStateEnd, [this](CoreBase& core) {
    binding_ = component_.require_binding(core, component_.fsm());
    if (!afresh_) handover_ = std::make_unique<Handover>(component_.core(), core);
  });
}

void PartsChange::prepare_way_back() {
  const time_ns_t period_before_ns = component_.settled_period_ns(*fsm_before_);
  require_places_kept(*fsm_before_, period_before_ns, *parts_.fsm, period_ns_);
  waits_back_ = kept_waits(*parts_.fsm, *fsm_before_, period_before_ns);
}

bool PartsChange::is_ready(bool is_last) noexcept {
  if (candidate_ == nullptr || parts_.core != nullptr || candidate_->has_ended()) return true;
  if (!candidate_->has_begun()) {
    component_.task_.set_shadow(*candidate_);
    return false;
  }
  if (is_last && candidate_->is_near()) candidate_->hand_over(parts_.core);
  return parts_.core != nullptr;
}

bool PartsChange::adopt() {
  if (component_.parts_.fsm.get() != fsm_before_)
    return false;  // that of one on probation, which has gone out
  if (candidate_ != nullptr) {
    if (parts_.core == nullptr || !parts_.core->bind_shell(component_.shell())) return false;
    parts_.core->set_context(&component_.task_.context());
  }
  if (afresh_ || unready_) return true;
  if (promotes_) return handover_->is_from(*component_.parts_.core);
  // Else a fallback took the place of the core meanwhile.
  if (parts_.core != nullptr) return handover_->is_from(*component_.parts_.core) && handover_->adopt();
  return kept_core_ == component_.parts_.core.get();
}

bool PartsChange::has_probation() const noexcept {
  return probation_ != nullptr && (!taken_ || probation_->has_begun());
}

bool PartsChange::take_old_core() noexcept {
  if (parts_.core != nullptr) return true;
  if (candidate_ == nullptr || !candidate_->give_back_old(parts_.core, component_.task_.clock().now_ns()))
    return false;
  parts_.core->bind_shell(*component_.parts_.shell);  // that it had before
  parts_.core->set_context(&component_.task_.context());
  return true;
}

void PartsChange::exchange_core() noexcept {
  std::swap(parts_.core, component_.parts_.core);
  component_.present_core_.store(component_.parts_.core.get(), std::memory_order_release);
  const bool had_fallen_back = component_.task_.has_fallen_back();
  component_.task_.set_fallen_back(fallen_back_);
  fallen_back_ = had_fallen_back;
  // release: a reader of the pointer sees the ShownCore
  shown_core_ = component_.shown_core_.exchange(shown_core_, std::memory_order_acq_rel);
  if (component_.task_.has_fallen_back())
    component_.faulted_core_.store(shown_core_, std::memory_order_release);
}

void PartsChange::exchange_fsm() noexcept {
  std::swap(parts_.fsm, component_.parts_.fsm);
  component_.present_fsm_.store(component_.parts_.fsm.get(), std::memory_order_release);
}

void PartsChange::put_back() noexcept {
  component_.task_.end_shadow(ShadowCause::changed);
  exchange_core();
  if (replaces_fsm()) {
    component_.task_.set_fallback(nullptr);  // made ready for the fsm that goes out; who settles renews it
    exchange_fsm();
    // Who settles may retire the other fsm as soon as the probation has ended: no state of it is referred to any more.
    if (!component_.task_.keep_place(waits_back_, period_ns_))
      component_.task_.give_up_place_for(component_.parts_.fsm->initial());
  }
  MAUVE_RT_TRUSTED(std::swap(binding_, component_.binding_));  // moves: nothing is allocated, nothing freed
  component_.has_ready_core_.store(true, std::memory_order_relaxed);
  component_.task_.set_machine(*component_.parts_.shell, *component_.parts_.fsm, &component_.binding_,
                               period_ns_);
}

void PartsChange::take() noexcept {
  component_.task_.end_probation(is_fallback_ ? ProbationCause::fell_back : ProbationCause::replaced);
  const bool may_blend =
      candidate_ != nullptr && parts_.core != nullptr && candidate_->may_blend(*component_.parts_.core);
  const ShadowCause why = promotes_ ? ShadowCause::promotion : ShadowCause::changed;
  if (!may_blend) component_.task_.end_shadow(why);
  if (parts_.core != nullptr) {
    if (!afresh_ && !unready_) promotes_ ? handover_->copy() : handover_->take();
    exchange_core();
    if (may_blend && !component_.task_.begin_blend(*candidate_, parts_.core, instant_ns))
      component_.task_.end_shadow(why);
  } else if (parts_.shell != nullptr) {
    component_.parts_.core->bind_shell(*parts_.shell);
  }
  // Made ready for parts that go out this moment; renew_fallback() arms it anew.
  if (restarts_) component_.task_.set_fallback(nullptr);
  if (parts_.shell != nullptr) {
    std::swap(parts_.shell, component_.parts_.shell);
    component_.present_shell_.store(component_.parts_.shell.get(), std::memory_order_release);
  }
  if (replaces_fsm()) exchange_fsm();
  std::swap(binding_, component_.binding_);
  component_.has_ready_core_.store(!unready_, std::memory_order_relaxed);
  taken_ = true;
  if (unready_) return;
  if (parts_.fsm != nullptr)
    take_over_events(*parts_.fsm, component_.task_.keep_place(kept_waits_, period_ns_));
  component_.task_.set_machine(*component_.parts_.shell, *component_.parts_.fsm, &component_.binding_,
                               period_ns_);
  const bool blends = may_blend && parts_.core == nullptr;
  if (probation_ != nullptr && (blends || !probation_->is_of_blend())) probation_->begin(*this);
}

bool PartsChange::make_safe(bool may_wait, time_ns_t time_ns) noexcept {
  bool all_written = true;
  if (new_shell_ == nullptr) return true;
  for (const auto& port : new_shell_->ports()) port->close();
  for (const auto& port : new_shell_->ports()) {
    if (port->kind() == PortKind::write && port->is_connected()) port->service()->raise_floor(time_ns);
    all_written &= port->make_safe(may_wait, time_ns);
  }
  return all_written;
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
  if (candidate_ != nullptr) return budget_ns_;
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
