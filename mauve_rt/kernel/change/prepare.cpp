// SPDX-License-Identifier: LGPL-3.0-or-later
// What a transaction makes ready before its commit, and throws away when there is none.
#include <algorithm>
#include <system_error>

#include "mauve_rt/architecture/runner.hpp"
#include "mauve_rt/base/contract.hpp"

#include "base/prefault.hpp"
#include "change/steps/step_kind.hpp"
#include "change/work.hpp"
#include "run/preview.hpp"

namespace mauve {

namespace {

/// How often who waits for a preparation looks whether a hook of it is overdue.
constexpr time_ns_t kOverdueLook = ms_to_ns(20);

void connect_all(Shell& shell, const std::map<std::string, Wire>& wires) {
  for (const auto& [name, wire] : wires) {
    PortBase& port = *shell.find_port(name);
    PortConnection connection = port.prepare(*wire.service, wire.resource);
    wire.service->make_room(wire.service->ports() + 1);  // beside the old shell's ports, until the commit
    port.swap(connection);
  }
}

void set_all(Shell& shell, const std::map<std::string, DraftProperty>& properties) {
  for (const auto& [name, property] : properties) {
    PropertyValue value = property.value;
    shell.find_property(name)->swap(value);
  }
}

/// An urgent change may set any of the properties that are in meanwhile: this change is refused then.
void begin_preview(Preview& preview, const Shell& shell, const DraftComponent& draft) {
  if (&shell == &draft.component->shell()) preview.set(shell, draft.component->shown().properties);
  for (const auto& [name, property] : draft.properties) preview.set(shell, name, property.value);
  preview.wire(shell, draft.wires);
}

void restore_state(Component& component, ComponentState before, FaultNote& fault) {
  component.show();  // it was configured with what would have been
  component.update_listening();
  if (component.task().state() != ComponentState::stopped) return;  // somebody has started it
  if (before == ComponentState::unconfigured) return component.cleanup();
  component.task().swap_fault(fault);
  component.task().set_state(before);
}

}  // namespace

template <typename Action>
Action& TransactionCommit::Work::keep(const Component& component, std::unique_ptr<Action> action) {
  Action& kept = *action;
  kept.task = &component.task();
  actions_.push_back(std::move(action));
  return kept;
}

bool TransactionCommit::Work::has_hooks() const noexcept {
  const auto& components = draft_->components();
  return !draft_->resources().empty() ||
         std::any_of(components.begin(), components.end(), [](const DraftComponent& component) {
           return component.is_added || component.has_new_parts() || component.shadow != nullptr ||
                  component.configure_step != 0;
         });
}

/// A thread of its own executes the hooks, which may hang: who asked waits for it until the change is called off.
void TransactionCommit::Work::prepare_beside_others() {
  if (!has_hooks()) return prepare();
  OrdinaryThread preparer;
  try {
    preparer = OrdinaryThread([self = shared_from_this(), presence = architecture_.presence()] {
      self->run_preparation(*presence);
    });
  } catch (const std::system_error&) {  // there are no threads to be had
    return prepare_interruptibly();
  }
  UniqueLock lock(preparation_.mutex);
  while (!preparation_.is_over) {
    preparation_.changed.wait_until(preparation_.mutex, monotonic_now_ns() + kOverdueLook);
    if (preparation_.is_over) break;
    lock.unlock();
    if (is_overdue()) call_off_preparation();
    lock.lock();
    if (preparation_.is_over || !is_called_off_.load(std::memory_order_relaxed)) continue;
    preparation_.is_left = true;
    preparer.detach();
    throw_called_off();
  }
  lock.unlock();
  preparer.join();
  if (preparation_.failure) std::rethrow_exception(preparation_.failure);
}

void TransactionCommit::Work::run_preparation(ArchitecturePresence& presence) {
  std::exception_ptr failure;
  thread_.store(std::this_thread::get_id(), std::memory_order_relaxed);
  {
    const ChangeLock::Inside inside(architecture_.change_lock());
    try {
      prepare_interruptibly();
    } catch (...) {
      failure = std::current_exception();
    }
  }
  {
    const LockGuard lock(preparation_.mutex);
    preparation_.is_over = true;
    preparation_.failure = std::move(failure);
    preparation_.changed.notify_all();
    if (!preparation_.is_left) return;
  }
  end_left_behind(presence);
}

/// The hook has returned at last. Where the architecture has gone meanwhile, it has left behind all that the hook used.
void TransactionCommit::Work::end_left_behind(ArchitecturePresence& presence) {
  const std::shared_lock use(presence.mutex);
  if (presence.architecture == nullptr) return;
  const LockGuard change(architecture_.change_lock());
  std::shared_lock<SharedMutex> host_use;
  host_ = architecture_.use_host(host_use);
  deployed_ = host_ != nullptr && host_->is_deployed();
  advance(Phase::off);
  discard();
  draft_.reset();
}

void TransactionCommit::Work::prepare_interruptibly() {
  struct Preparing {
    explicit Preparing(Atomic<bool>& is_so) : value(is_so) { value.store(true, std::memory_order_relaxed); }
    ~Preparing() { value.store(false, std::memory_order_relaxed); }
    Atomic<bool>& value;
  };
  const Preparing preparing(is_preparing_);
  prepare();
}

void TransactionCommit::Work::prepare() {
  for (DraftResource& resource : draft_->resources())
    at_step(resource.added_step, [&] { prepare_resource(resource); });
  for (DraftComponent& component : draft_->removed_components())
    at_step(component.first_step, [&] { prepare_removed(component); });
  for (DraftComponent& component : draft_->components()) {
    if (component.is_added) {
      at_step(component.first_step, [&] { prepare_added(component); });
    } else if (component.promoted == nullptr) {
      prepare_change(component);
    }
  }
  // Promotes last: from there on the change acts on a core that is in use, and is not called off.
  for (DraftComponent& component : draft_->components()) {
    if (component.promoted != nullptr) prepare_change(component);
  }
  prefault_parts();
}

void TransactionCommit::Work::prefault_parts() {
  const bool has_new_parts =
      std::any_of(changes_.begin(), changes_.end(),
                  [](const Change& change) {
                    return change.parts != nullptr && change.draft->component->task().has_thread();
                  }) ||
      std::any_of(prepared_added_.begin(), prepared_added_.end(),
                  [](const DraftComponent* added) { return added->component->task().has_thread(); });
  if (has_new_parts) prefault_allocated();
}

void TransactionCommit::Work::prepare_resource(DraftResource& added) {
  prepared_resources_.push_back(added.resource);
  if (architecture_.is_configured()) added.resource->configure();
}

void TransactionCommit::Work::prepare_added(DraftComponent& added) {
  Component& component = *added.component;
  prepared_added_.push_back(&added);
  component.set_parts(std::move(added.fresh));
  set_all(component.shell(), added.properties);
  connect_all(component.shell(), added.wires);
  for (const auto& [name, wire] : added.wires) prepare_floor(component, *wire.service);
  component.show();
  if (!architecture_.is_configured()) return;
  component.configure();
  if (!deployed_ || options_.dry_run) return;
  Task& task = component.task();
  task.join(architecture_.deployment_epoch_ns());
  host_->attach(added.component);
  changes_.push_back({.draft = &added});
}

void TransactionCommit::Work::prepare_removed(DraftComponent& removed) {
  Retreat& retreat = keep(*removed.component, std::make_unique<Retreat>(removed.component->shell()));
  changes_.push_back({.draft = &removed, .retreat = &retreat});
}

/// New instances of its parts are configured in the place of those that are in: nothing that is in is touched. Whether they can be
/// made.
bool TransactionCommit::Work::make_anew(DraftComponent& changed) {
  if (!changed.component->is_configured() || changed.core_unready) return false;
  Parts others = changed.component->another();
  Parts& fresh = changed.fresh;
  const bool has_core = fresh.core != nullptr || changed.promoted != nullptr;
  changed.is_made_anew = (fresh.shell != nullptr || others.shell != nullptr) &&
                         (has_core || others.core != nullptr) &&
                         (fresh.fsm != nullptr || others.fsm != nullptr);
  if (!changed.is_made_anew) return false;
  if (fresh.shell == nullptr) {
    fresh.shell = std::move(others.shell);
    changed.shell_step = changed.configure_step;
  }
  if (!has_core) fresh.core = std::move(others.core);
  if (fresh.fsm == nullptr) fresh.fsm = std::move(others.fsm);
  return true;
}

/// The one thing that is done before the commit: what hooks do cannot be taken back, but the state can.
void TransactionCommit::Work::configure_anew(DraftComponent& changed) {
  Component& component = *changed.component;
  if (!architecture_.is_configured() || make_anew(changed) || options_.dry_run) return;
  component.check_renewed();
  architecture_.check_parts_free(component);
  draft_->hold(changed);
  ConfiguredAnew before{.component = &component, .before = changed.state, .fault = {}};
  component.task().swap_fault(before.fault);
  Preview preview;
  begin_preview(preview, component.shell(), changed);
  component.configure_anew();
  configured_anew_.push_back(std::move(before));
  changed.state = ComponentState::stopped;
}

void TransactionCommit::Work::prepare_repair(const DraftComponent& changed) {
  if (!changed.is_repaired()) return;
  repairs_.push_back(std::make_unique<Repair>(*changed.component));
  repairs_.back()->task = &changed.component->task();
}

void TransactionCommit::Work::prepare_change(DraftComponent& changed) {
  if (changed.configure_step != 0) at_step(changed.configure_step, [&] { configure_anew(changed); });
  prepare_repair(changed);
  changes_.push_back({.draft = &changed});
  Change& change = changes_.back();
  for (auto& action : changed.actions) keep(*changed.component, std::move(action));
  if (changed.shadow != nullptr) at_step(changed.shadow_step, [&] { prepare_shadow(changed); });
  if (changed.has_new_parts()) {
    const int step = changed.core_step != 0  ? changed.core_step
                     : changed.fsm_step != 0 ? changed.fsm_step
                                             : changed.shell_step;
    at_step(step, [&] { prepare_parts(change); });
  }
  if (changed.shell_step != 0) return;
  at_step(changed.first_step, [&] {
    prepare_wiring(change);
    prepare_properties(change);
  });
}

void TransactionCommit::Work::prepare_parts(Change& change) {
  DraftComponent& draft = *change.draft;
  Component& component = *draft.component;
  if (draft.awaits_near()) {
    change.parts = std::make_unique<PartsChange>(component, prepare_candidate(draft), draft.is_fresh);
  } else {
    if (draft.promoted != nullptr) {
      draft.fresh.core = draft.promoted->suspend(Shadow::kStateEnd);
      draft.is_candidate_out = true;
    }
    change.parts = std::make_unique<PartsChange>(component, std::move(draft.fresh));
  }
  if (draft.core_unready) change.parts->leave_unready();
  if (draft.shell_step != 0) {
    set_all(change.parts->shell(), draft.properties);
    connect_all(change.parts->shell(), draft.wires);
    for (const auto& [name, wire] : draft.wires) prepare_floor(component, *wire.service);
    // The old ports let go in the commit, before the new ones are used.
    for (const auto& [name, wire] : draft.wires_before)
      keep(component, std::make_unique<WiringChange>(component.require_port(name), PortConnection{}));
  }
  if (draft.is_repaired() || draft.is_made_anew) change.parts->start_afresh();
  if (draft.promoted != nullptr && !draft.awaits_near()) change.parts->promote(draft.is_fresh);
  const time_ns_t blend_ns = draft.bumpless.value_or(BumplessOptions{}).blend_ns;
  if (draft.awaits_near() && blend_ns != 0)  // a fault ends it with the old core
    draft.probation = ProbationOptions{.duration_ns = blend_ns, .is_blend = true};
  if (draft.probation) {
    const auto& candidate = change.parts->candidate();
    const std::string core =
        candidate != nullptr ? candidate->core_name() : change.parts->core()->implementation();
    change.parts->set_probation(std::make_shared<Probation>(component, core, std::move(*draft.probation)));
  }
  Preview preview;
  begin_preview(preview, change.parts->shell(), draft);
  change.parts->prepare();
  note_fields(draft.core_step, change.parts->handover());
}

void TransactionCommit::Work::note_fields(int step, const Handover* handover) {
  if (handover == nullptr) return;
  StepReport& report = reports_[static_cast<std::size_t>(step - 1)];
  report.taken = handover->taken();
  report.left = handover->left();
}

/// Of a bumpless change: it executes in the shadow from the first wait of the component on, unless it does already.
std::shared_ptr<Shadow> TransactionCommit::Work::prepare_candidate(DraftComponent& changed) {
  Component& component = *changed.component;
  const BumplessOptions options = changed.bumpless.value_or(BumplessOptions{});
  std::shared_ptr<Shadow> candidate = changed.promoted;
  if (candidate == nullptr) {
    require_no_shadow(*draft_, changed);
    component.settle_shadow();
    const time_ns_t period_ns = component.task().grid().period_ns;
    const time_ns_t budget_ns =
        options.budget_ns != 0 ? options.budget_ns : std::max<time_ns_t>(period_ns, 1);
    candidate = std::make_shared<Shadow>(component,
                                         ShadowParts{.shell = make_shadow_shell(component),
                                                     .core = std::move(changed.fresh.core),
                                                     .fsm = make_shadow_fsm(component)},
                                         ShadowOptions{.budget_ns = budget_ns});
    changed.candidate = candidate;
    candidate->prepare(component.core());
  }
  candidate->await_near(options, changed.is_fresh, component);
  if (options_.dry_run || changed.promoted != nullptr) return candidate;
  prefault_allocated();
  host_->run_shadow(candidate);
  component.keep_shadow(candidate);
  return candidate;
}

void TransactionCommit::Work::prepare_shadow(const DraftComponent& changed) {
  Component& component = *changed.component;
  changed.shadow->prepare(component.core());
  note_fields(changed.shadow_step, changed.shadow->handover());
  if (options_.dry_run) return;
  if (component.task().has_thread()) prefault_allocated();
  host_->run_shadow(changed.shadow);
  keep(component, std::make_unique<ShadowBegin>(component.task(), changed.shadow));
}

/// A shadow that does not begin is cleaned up. The candidate of a refused promote goes on in its shadow.
void TransactionCommit::Work::give_back_candidates() noexcept {
  if (draft_ == nullptr) return;
  for (DraftComponent& changed : draft_->components()) {
    if (const auto& shadow = changed.shadow; shadow != nullptr) {
      shadow->conclude(ShadowCause::closed, changed.component->task().clock().now_ns());
      changed.component->retire_shadow(shadow);
    }
    if (changed.awaits_near()) give_back_candidate(changed);
    if (!changed.is_candidate_out) continue;
    std::unique_ptr<CoreBase> core = core_not_taken(changed);
    changed.promoted->resume(core != nullptr ? std::move(core) : std::move(changed.fresh.core));
  }
}

/// That was to go into the component; nullptr: it has not come so far.
std::unique_ptr<CoreBase> TransactionCommit::Work::core_not_taken(const DraftComponent& changed) noexcept {
  for (Change& change : changes_) {
    if (change.draft == &changed && change.parts != nullptr && !change.parts->was_taken())
      return change.parts->give_back_core();
  }
  return nullptr;
}

/// Of a bumpless change that is not made: a candidate that was there before goes on.
void TransactionCommit::Work::give_back_candidate(const DraftComponent& changed) noexcept {
  const std::shared_ptr<Shadow>& candidate =
      changed.promoted != nullptr ? changed.promoted : changed.candidate;
  if (candidate == nullptr) return;
  candidate->end_await();
  if (auto core = core_not_taken(changed)) candidate->resume(std::move(core));
  if (candidate == changed.promoted) return;
  Component& component = *changed.component;
  candidate->conclude(ShadowCause::lost, component.task().clock().now_ns());
  component.task().forget_shadow(*candidate);
  candidate->detach();
  component.retire_shadow(candidate);
}

void TransactionCommit::Work::prepare_wiring(Change& change) {
  const DraftComponent& draft = *change.draft;
  Component& component = *draft.component;
  const auto shadow = component.last_shadow();
  if (draft.wires != draft.wires_before && shadow != nullptr && !shadow->has_ended())
    keep(component, std::make_unique<ShadowEnd>(component.task(), ShadowCause::changed));
  for (const auto& [name, before] : draft.wires_before) {
    if (draft.wires.contains(name)) continue;
    PortBase& port = component.require_port(name);
    keep(component, std::make_unique<WiringChange>(port, PortConnection{}));
    prepare_listening(change, port, nullptr);
  }
  for (const auto& [name, wire] : draft.wires) {
    const auto before = draft.wires_before.find(name);
    if (before != draft.wires_before.end() && before->second.service == wire.service) continue;
    PortBase& port = component.require_port(name);
    prepare_floor(component, *wire.service);
    keep(component, std::make_unique<WiringChange>(port, port.prepare(*wire.service, wire.resource)));
    prepare_listening(change, port, wire.service);
  }
}

/// A component that had the end before may be late to let it go, by this change or by an earlier one.
void TransactionCommit::Work::prepare_floor(const Component& component, ServiceBase& service) {
  if (service.kind() == PortKind::write) keep(component, std::make_unique<FloorChange>(service));
}

/// `service`: what the port will be connected to; nullptr: nothing.
void TransactionCommit::Work::prepare_listening(Change& change, const PortBase& port, ServiceBase* service) {
  if (change.parts != nullptr && change.parts->restarts())
    return;  // a new fsm has listened there since its prepare()
  Component& component = *change.draft->component;
  for (const auto& state : component.fsm().states()) {
    if (state->event == nullptr || &state->event->port() != &port) continue;
    if (service == nullptr || service->resource() == nullptr) {
      keep(component, std::make_unique<ListeningEnd>(*state->event));
    } else {
      change.listeners.push_back(
          &keep(component, std::make_unique<ListenerChange>(*service->resource(), *state->event)));
    }
  }
}

void TransactionCommit::Work::prepare_properties(Change& change) {
  Component& component = *change.draft->component;
  for (const auto& [name, property] : change.draft->properties)
    keep(component, std::make_unique<PropertyChange>(component.require_property(name), property.value));
}

/// Takes a component off its thread and its resources. A thread that is kept from ending (by a more urgent one that
/// does not wait) is left to be reaped: what is under way goes on without it.
void TransactionCommit::Work::let_go(const std::shared_ptr<Component>& component, bool was_listed) {
  Task& task = component->task();
  if (task.is_abandoned()) component->stop_listening();
  component->conclude_shadow();
  const time_ns_t now_ns = monotonic_now_ns();
  const bool ended =
      host_ != nullptr ? host_->detach(*component, now_ns + Runner::kThreadEnd) : task.end_thread(now_ns);
  if (task.is_parked()) {
    const auto disconnect = [component] {
      for (const auto& port : component->shell().ports()) port->disconnect();
      if (component->is_configured()) component->update_listening();
    };
    const bool are_held = architecture_.are_parts_held(*component);  // a hook may use its ports
    if (!are_held) disconnect();
    architecture_.dispose(
        "cleanup of " + component->description(),
        [component, disconnect, are_held] {
          if (are_held) disconnect();
          component->cleanup();
        },
        component.get());
  }
  if (!ended) {
    architecture_.keep_until_ended(component, was_listed);
  } else if (was_listed) {
    architecture_.retire_trace(task);
  }
}

/// Before the components of these are cleaned up: the cores stay configured.
void TransactionCommit::Work::give_back_comebacks() noexcept {
  if (draft_ == nullptr) return;
  for (DraftComponent& added : draft_->components()) {
    if (added.comeback_of == nullptr) continue;
    const bool is_prepared = added.fresh.core == nullptr;
    std::unique_ptr<CoreBase> core =
        is_prepared ? added.component->release_core() : std::move(added.fresh.core);
    added.comeback_of->give_back(core);
  }
}

/// Of one that is not made.
void TransactionCommit::Work::discard() noexcept {
  MAUVE_AUDIT(architecture_.change_lock().is_held_here());
  is_prepared_ = false;
  if (commit_ == nullptr || commit_->is_left()) {
    discard_rest();
    architecture_.forget_open(*this);
    advance(Phase::settled);
    return;
  }
  // An adopt does not end, and its thread will come back to the record: others go on.
  draft_->release();
  release_whole();
  architecture_.forget_open(*this);
  architecture_.keep_open(shared_from_this());
}

void TransactionCommit::Work::discard_rest() noexcept {
  give_back_candidates();
  settle_with_host();
  for (Change& change : changes_) dispose(change);
  for (ConfiguredAnew& done : configured_anew_) restore_state(*done.component, done.before, done.fault);
  give_back_comebacks();
  for (DraftComponent* added : prepared_added_) let_go(added->component, false);
  for (const auto& resource : prepared_resources_)
    architecture_.dispose("cleanup of " + resource->description(), [resource] { resource->cleanup(); });
  // Others may have taken numbers since the draft was finished.
  if (numbers_after_ == 0 || architecture_.numbers() == numbers_after_)
    architecture_.give_back_numbers(numbers_before_);
  if (draft_ != nullptr) {
    if (!configured_anew_.empty()) note_configured_anew();
    draft_->release();
  }
  release_whole();
  if (is_called_off_.load(std::memory_order_relaxed)) release_parts();
}

/// What was prepared refers to the parts that were in.
void TransactionCommit::Work::release_parts() noexcept {
  changes_.clear();
  actions_.clear();
  repairs_.clear();
  for (const auto& component : draft_->claimed()) architecture_.release_parts(*component);
}

/// What was configured anew is not what others were prepared for.
void TransactionCommit::Work::note_configured_anew() noexcept {
  const CommitGate::Look table(architecture_.commit_gate());
  for (const ConfiguredAnew& done : configured_anew_) done.component->change_mark().set_changed();
}

}  // namespace mauve
