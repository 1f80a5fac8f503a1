// SPDX-License-Identifier: LGPL-3.0-or-later
// A shadow's life; how it executes its candidate is in shadow_execution.cpp.
#include "mauve_rt/run/shadow.hpp"

#include <typeinfo>

#include "mauve_rt/base/contract.hpp"
#include "mauve_rt/base/error.hpp"
#include "mauve_rt/base/seam/sleep.hpp"
#include "mauve_rt/run/component.hpp"
#include "mauve_rt/run/shadow_thread.hpp"

#include "run/still_clock.hpp"

namespace mauve {

namespace {

/// How often a requester looks whether the candidate's state has ended.
constexpr time_ns_t kShadowLook = us_to_ns(500);

std::string name_of(const CoreBase& core) {
  return core.implementation().empty() ? "(an object)" : core.implementation();
}

void require_same_class(Component& component, const Shell& shell) {
  const Shell& live = component.shell();
  const auto same_port = [](const auto& one, const auto& other) {
    return one->name() == other->name() && one->kind() == other->kind() && one->type() == other->type();
  };
  const bool is_same = typeid(live) == typeid(shell) && live.bytes() == shell.bytes() &&
                       std::equal(live.ports().begin(), live.ports().end(), shell.ports().begin(),
                                  shell.ports().end(), same_port);
  if (is_same) return;
  throw Error(ErrorCode::type_mismatch, "the shadow's shell is of another class than the component's",
              {.component = component.name(),
               .element = shell.description(),
               .expected = "another instance of " + live.description(),
               .remedy = "give the step a shell of the component's own class"});
}

}  // namespace

const char* to_string(ShadowVerdict verdict) noexcept {
  switch (verdict) {
    case ShadowVerdict::running:
      return "running";
    case ShadowVerdict::ended:
      return "ended";
    case ShadowVerdict::faulted:
      return "faulted";
    case ShadowVerdict::promoted:
      return "promoted";
    case ShadowVerdict::hung:
      return "hung";
  }
  return "ended";
}

Shadow::Shadow(Component& component, ShadowParts parts, ShadowOptions options)
    : component_(component.name()),
      live_core_(component.core_implementation()),
      core_(name_of(*parts.core)),
      options_(options),
      settings_(component.task().settings()),
      capture_(component.shell(), component.name()),
      parts_(std::move(parts)),
      clock_(std::make_unique<StillClock>()) {
  if (options_.budget_ns <= 0) {
    throw Error(ErrorCode::invalid_argument, "a shadow needs a budget",
                {.component = component_,
                 .element = "budget_ns",
                 .expected = "more than 0 ns per release",
                 .found = std::to_string(options_.budget_ns)});
  }
  require_same_class(component, *parts_.shell);
  const LogSource& live = component.task().log_source();
  machine_.context().log.set_up(live.queue(), live.component(), TraceNames::intern("shadow"));
  machine_.context().log.set_level(live.level());
  for (const ShownProperty& shown : component.shown().properties) {
    PropertyBase* own = parts_.shell->find_property(shown.name);
    PropertyValue value = own->checked(shown.value);
    own->swap(value);
  }
  const auto& ports = component.shell().ports();
  for (std::size_t place = 0; place < ports.size(); ++place) {
    if (ports[place]->kind() == PortKind::write)
      comparisons_.emplace_back(place, OutputComparison(*ports[place]));
  }
}

Shadow::~Shadow() {
  capture_.detach();
  clean_up();
}

void Shadow::prepare(CoreBase& live) {
  try {
    connect_cells();
    bind();
    if (options_.is_fresh) return;
    handover_ = std::make_unique<Handover>(live, *parts_.core);
    capture_.make_room_for_state(handover_->bytes());
  } catch (const Error& error) {
    ErrorDetail detail = error.detail();
    if (detail.component.empty()) detail.component = component_;
    if (detail.element.empty()) detail.element = "shadow " + core_;
    throw Error(ErrorCode::prepare_failed, error.statement(), detail);
  }
}

/// Each port leads to a cell of its own; events lead nowhere.
void Shadow::connect_cells() {
  parts_.shell->set_context(&machine_.context());
  for (const auto& port : parts_.shell->ports()) {
    cells_.push_back(port->kind() == PortKind::event ? nullptr : port->make_cell());
    if (cells_.back() != nullptr) port->connect(cells_.back()->service(), "shadow");
  }
}

void Shadow::bind() {
  CoreBase& core = *parts_.core;
  FsmBase& fsm = *parts_.fsm;
  if (!fsm.bind_shell(*parts_.shell)) {
    throw Error(ErrorCode::type_mismatch, "the fsm was written for another shell",
                {.element = fsm.description(), .expected = "an fsm for " + parts_.shell->description()});
  }
  fsm.declare_states(settings_.states);
  parts_.shell->configure();
  fsm.configure();
  if (fsm.is_sporadic()) {
    throw Error(ErrorCode::bad_fsm, "a component that waits for events has no shadow",
                {.element = fsm.description(),
                 .expected = "an fsm without event waits",
                 .remedy = "try the core on probation instead"});
  }
  if (!core.bind_shell(*parts_.shell)) {
    throw Error(ErrorCode::type_mismatch, "the core was written for another shell",
                {.element = core.description(), .expected = "a core for " + parts_.shell->description()});
  }
  core.set_context(&machine_.context());
  binding_ = fsm.bind_core(core);
  binding_.core = &core;
  if (!binding_.is_bound()) {
    throw Error(ErrorCode::type_mismatch, "the core is not of the type that the fsm runs",
                {.element = core.description(), .expected = "a core for " + fsm.description()});
  }
  core.configure();
  machine_.set_clock(*clock_);
  machine_.set_parts(fsm, &binding_, settings_.period_ns != 0 ? settings_.period_ns : fsm.period_ns());
}

// ---- the component's thread, or who acts for a parked component

void Shadow::begin(const State* wait, const CoreBase* live, time_ns_t now_ns) noexcept {
  begin_ns_ = now_ns;
  if (handover_ != nullptr && live != nullptr && handover_->is_from(*live)) handover_->copy();
  std::uint32_t expected = kPrepared;
  // release: who finds it running finds its begin
  if (!phase_.compare_exchange_strong(expected, kRunning, std::memory_order_acq_rel)) return;
  capture_.attach(wait != nullptr ? static_cast<std::int64_t>(wait->index) : ShadowCapture::kStart);
}

void Shadow::start() noexcept {
  capture_.start();
  end_measurement();  // what follows is no step of the swap
}

bool Shadow::end_release(time_ns_t instant_ns, const State* next_wait, const CoreBase* live) noexcept {
  if (measures_outputs()) [[unlikely]]
    return measure_steps(instant_ns) && !is_holding();
  if (is_holding()) [[unlikely]] {
    capture_.forget_release();
    return false;
  }
  if (phase_.load(std::memory_order_acquire) != kRunning) return false;
  const std::int64_t from =
      next_wait != nullptr ? static_cast<std::int64_t>(next_wait->index) : ShadowCapture::kStart;
  const bool is_captured = capture_.end_release(instant_ns, from);
  if (follows_.load(std::memory_order_relaxed) && live != nullptr && handover_->is_from(*live))
    handover_->save(capture_.next_state());
  if (!is_captured) return false;
  if (signal_ != nullptr) {
    signal_->bump();
  } else {
    MAUVE_RT_TRUSTED(run_pending());  // in virtual time, where nothing is real-time
  }
  return false;
}

bool Shadow::await_outputs() noexcept {
  if (steps_ == nullptr) return false;
  steps_->note_last([this](std::size_t port) MAUVE_RT { return capture_.present(port); });
  capture_.forget_release();
  awaits_outputs_.store(true, std::memory_order_release);
  measures_outputs_.store(true, std::memory_order_release);
  return true;
}

bool Shadow::measure_steps(time_ns_t instant_ns) noexcept {
  steps_->note_new(instant_ns, [this](std::size_t port) MAUVE_RT {
    return capture_.is_noted(port) ? capture_.present(port) : nullptr;
  });
  capture_.forget_release();
  if (!steps_->are_known()) return false;
  awaits_outputs_.store(false, std::memory_order_release);  // a report waits for the steps alone
  return steps_->is_complete();
}

void Shadow::hand_over(std::unique_ptr<CoreBase>& to) noexcept {
  MAUVE_EXPECTS(to == nullptr);
  if (!MAUVE_RT_TRUSTED(run_mutex_.try_lock())) return;  // it waits for no thread
  if (phase_.load(std::memory_order_acquire) < kEnding) MAUVE_RT_TRUSTED(to.swap(parts_.core));
  MAUVE_RT_TRUSTED(run_mutex_.unlock());
}

void Shadow::conclude_if_hung(time_ns_t longest_ns) noexcept {
  if (signal_ == nullptr) return;  // in virtual time this thread would be the one that hangs
  const time_ns_t since_ns = executing_since_ns_.load(std::memory_order_relaxed);
  const time_ns_t now_ns = monotonic_now_ns();
  if (since_ns != 0 && now_ns - since_ns > longest_ns) conclude(ShadowCause::hung, now_ns);
}

void Shadow::conclude(ShadowCause why, time_ns_t now_ns) noexcept {
  std::uint32_t seen = phase_.load(std::memory_order_acquire);
  do {
    if (seen >= kEnding) return end_measurement();
    // acq_rel: one of all that would end it does
  } while (!phase_.compare_exchange_weak(seen, kEnding, std::memory_order_acq_rel));
  MAUVE_EXPECTS(why != ShadowCause::none);
  cause_ = why;
  ended_ns_ = now_ns;
  phase_.store(kEnded, std::memory_order_release);
  if (signal_ != nullptr) signal_->bump();  // its thread retires it
}

// ---- changes

std::unique_lock<Mutex> Shadow::lock_core(time_ns_t timeout_ns) {
  const time_ns_t until = later_by(monotonic_now_ns(), timeout_ns);
  std::unique_lock run(run_mutex_, std::defer_lock);
  while (!run.try_lock()) {
    if (monotonic_now_ns() >= until) {
      throw Error(
          ErrorCode::timeout, "the candidate still executes",
          {.component = component_,
           .element = "state " + TraceNames::word(machine_.state_name()),
           .expected = "the end of the state within " + std::to_string(timeout_ns / ms_to_ns(1)) + " ms",
           .remedy = "try again, or end the shadow"});
    }
    sleep_for(kShadowLook);
  }
  if (phase_.load(std::memory_order_acquire) < kEnding && parts_.core != nullptr) return run;
  throw Error(ErrorCode::not_running, "the shadow has ended",
              {.component = component_,
               .element = "shadow " + core_,
               .found = record().reason,
               .remedy = "give the component a new shadow, or replace its core"});
}

std::unique_ptr<CoreBase> Shadow::suspend(time_ns_t timeout_ns) {
  const auto run = lock_core(timeout_ns);
  return std::move(parts_.core);
}

void Shadow::with_core(time_ns_t timeout_ns, const std::function<void(CoreBase&)>& use) {
  const auto run = lock_core(timeout_ns);
  use(*parts_.core);
}

void Shadow::await_near(const BumplessOptions& options, bool is_fresh, Component& component) {
  auto steps = std::make_unique<OutputSteps>(component.shell(), component_, options.outputs);
  const auto run = lock_core(kStateEnd);
  std::unique_ptr<Blend> blend = options.blend_ns != 0 ? make_blend(options.blend_ns, component) : nullptr;
  near_.store(kNeverNear, std::memory_order_release);
  follows_.store(!is_fresh && handover_ != nullptr, std::memory_order_relaxed);
  const LockGuard lock(figures_mutex_);
  steps_ = std::move(steps);
  blend_ = std::move(blend);
  awaiting_.set(component.task());
}

/// The old core is bound to the fsm that the candidate executes now: that changes neither.
std::unique_ptr<Blend> Shadow::make_blend(time_ns_t duration_ns, Component& component) {
  CoreBase& old = component.core();
  if (old.is_dynamic() || parts_.core->is_dynamic()) {
    const std::string& found = old.is_dynamic() ? live_core_ : core_;
    throw Error(ErrorCode::type_mismatch, "the outputs of a core in Python do not go over",
                {.component = component_,
                 .element = "blend_s",
                 .expected = "two cores in C++",
                 .found = found + " in Python",
                 .remedy = "leave out blend_s"});
  }
  if (component.task().has_fallen_back()) {  // it is made ready anew for the next fault
    throw Error(ErrorCode::invalid_argument, "the outputs of a fallback core do not go over",
                {.component = component_,
                 .element = "blend_s",
                 .expected = "a component that does not run its fallback core",
                 .found = "fallback " + component.core_implementation(),
                 .remedy = "leave out blend_s"});
  }
  auto blend = std::make_unique<Blend>(component.shell(), duration_ns);
  blend->binding = parts_.fsm->bind_core(old);
  blend->binding.core = &old;
  return blend;
}

void Shadow::resume(std::unique_ptr<CoreBase> core) noexcept {
  if (core == nullptr || !core->is_configured() || !core->bind_shell(*parts_.shell)) {
    const bool is_virtual = signal_ == nullptr;
    return conclude(ShadowCause::lost, is_virtual ? clock_->now_ns() : monotonic_now_ns());
  }
  core->set_context(&machine_.context());
  {
    const LockGuard run(run_mutex_);  // it executes nothing without its core
    if (is_retired_) return core->cleanup();
    parts_.core = std::move(core);
  }
  if (signal_ != nullptr) signal_->bump();
}

void Shadow::set_property(const std::string& name, const PropertyValue& value) {
  const LockGuard lock(figures_mutex_);
  if (has_ended()) return;
  set_properties_.clear();
  properties_.emplace_back(name, value);
}

ShadowRecord Shadow::record() const {
  const std::uint32_t phase = phase_.load(std::memory_order_acquire);
  ShadowRecord record{.component = component_,
                      .core = core_,
                      .live_core = live_core_,
                      .begin_ns = begin_ns_,
                      .releases = static_cast<std::int64_t>(capture_.captured()),
                      .skipped_late = static_cast<std::int64_t>(capture_.skipped()),
                      .budget_ns = options_.budget_ns};
  const LockGuard lock(figures_mutex_);
  if (phase == kEnded) {
    record.verdict = has_blended_.load(std::memory_order_relaxed) ? ShadowVerdict::promoted
                     : cause_ == ShadowCause::fault               ? ShadowVerdict::faulted
                     : cause_ == ShadowCause::promotion           ? ShadowVerdict::promoted
                     : cause_ == ShadowCause::hung                ? ShadowVerdict::hung
                                                                  : ShadowVerdict::ended;
    record.end_ns = ended_ns_;
    record.reason = reason();
  }
  record.compared = figures_.compared;
  record.skipped_budget = static_cast<std::int64_t>(skipped_budget_.load(std::memory_order_relaxed));
  record.idle = figures_.idle;
  record.over_budget = figures_.over_budget;
  record.largest_execution_ns = figures_.largest_execution_ns;
  for (const auto& [place, comparison] : comparisons_) record.outputs.push_back(comparison.difference());
  if (steps_ == nullptr) return record;
  record.steps = steps_->shown();
  record.curves = steps_->curves();
  return record;
}

std::string Shadow::reason() const {
  if (has_blended_.load(std::memory_order_relaxed) && cause_ != ShadowCause::promotion) {
    return "the candidate is the component's core now; the blend ended early: " +
           (cause_ == ShadowCause::fault ? "fault of the old core: " + blend_->fault : words_of_cause());
  }
  return words_of_cause();
}

std::string Shadow::words_of_cause() const {
  switch (cause_) {
    case ShadowCause::none:
      return {};
    case ShadowCause::fault:
      return fault_;
    case ShadowCause::request:
      return "a step end_shadow";
    case ShadowCause::changed:
      return "the component's parts or wiring were changed";
    case ShadowCause::closed:
      return "the component was cleaned up or removed, or its host was shut down";
    case ShadowCause::promotion:
      return "the candidate is the component's core now";
    case ShadowCause::hung:
      return "hung: state " + TraceNames::word(machine_.state_name()) + " of the candidate did not end";
    case ShadowCause::lost:
      return "the change was refused, and the candidate was cleaned up";
    case ShadowCause::overrun:
      return "an overrun of the component";
    case ShadowCause::stop:
      return "a stop of the component";
    case ShadowCause::live_fault:
      return "a fault of the new core";
    case ShadowCause::reverted:
      return "the old core is the component's core again";
  }
  return {};
}

void Shadow::retire() noexcept {
  const std::unique_lock run(run_mutex_, std::try_to_lock);  // else its own thread retires it
  if (!run.owns_lock() || !has_ended()) return;
  if (blend_ == nullptr) return clean_up();
  const std::unique_lock blend(blend_->mutex, std::try_to_lock);  // else a state of the old core does not end
  if (blend.owns_lock()) clean_up();
}

/// run_mutex_ held, or no other thread there. A core that was suspended is another's.
void Shadow::clean_up() noexcept {
  if (is_retired_) return;
  is_retired_ = true;
  if (parts_.core != nullptr) parts_.core->cleanup();
  if (blend_ != nullptr && blend_->core != nullptr) blend_->core->cleanup();
  parts_.fsm->cleanup();
  for (const auto& port : parts_.shell->ports()) port->disconnect();
  parts_.shell->cleanup();
}

}  // namespace mauve
