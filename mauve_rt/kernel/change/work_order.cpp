// SPDX-License-Identifier: LGPL-3.0-or-later
// A change among others: those that it waits for, those that it lets go on, and what is left of it while a component is late.
#include <algorithm>

#include "mauve_rt/architecture/runner.hpp"
#include "mauve_rt/base/contract.hpp"
#include "mauve_rt/base/running_hook.hpp"

#include "change/work.hpp"

namespace mauve {

/// The changes of what this one is about: those under way, and those that a late component has not taken yet.
EarlierChange TransactionCommit::Work::look_at_earlier() const {
  const auto& steps = transaction_.steps();
  const bool is_for_all =
      std::any_of(steps.begin(), steps.end(), [](const auto& step) { return step->is_for_all(); });
  const auto is_named = [&steps](const Component& component) {
    return std::any_of(steps.begin(), steps.end(), [&component](const auto& step) {
      return step->is_for_all() || step->component() == component.name();
    });
  };
  const auto components = architecture_.components();
  const bool is_structural = this->is_structural();
  const CommitGate::Look table(architecture_.commit_gate());
  const ArchitectureClaims& claims = architecture_.claims();
  if ((claims.structure && is_structural) || (claims.revision && options_.expected_revision != 0))
    return EarlierChange::under_way;
  EarlierChange found = EarlierChange::none;
  for (const auto& component : components) {
    const ChangeMark& mark = component->change_mark();
    if ((!mark.is_claimed() && !mark.is_unsettled()) || !is_named(*component)) continue;
    if (mark.is_claimed()) return EarlierChange::under_way;
    // One that hangs is removed as it is, and a new epoch leaves out those that are late.
    if (!component->task().is_left_behind() && !is_for_all) found = EarlierChange::late;
  }
  return found;
}

bool TransactionCommit::Work::is_structural() const noexcept {
  const auto& steps = transaction_.steps();
  return std::any_of(steps.begin(), steps.end(), [](const auto& step) { return step->is_structural(); });
}

void TransactionCommit::Work::claim_whole() noexcept {
  const ArchitectureClaims wanted{.structure = is_structural(), .revision = options_.expected_revision != 0};
  const CommitGate::Look table(architecture_.commit_gate());
  MAUVE_AUDIT(!(wanted.structure && architecture_.claims().structure));
  MAUVE_AUDIT(!(wanted.revision && architecture_.claims().revision));
  claimed_ = wanted;
  architecture_.claims().structure |= claimed_.structure;
  architecture_.claims().revision |= claimed_.revision;
}

void TransactionCommit::Work::release_whole() noexcept {
  const CommitGate::Look table(architecture_.commit_gate());
  if (claimed_.structure) architecture_.claims().structure = false;
  if (claimed_.revision) architecture_.claims().revision = false;
  claimed_ = {};
}

/// Others go on while this change prepares its parts and waits for its components. Not where no component is awaited.
std::unique_ptr<ChangeLock::Pause> TransactionCommit::Work::let_others_in() {
  numbers_after_ = architecture_.numbers();
  if (!deployed_ || is_simulated_) return nullptr;
  return std::make_unique<ChangeLock::Pause>(architecture_.change_lock());
}

bool TransactionCommit::Work::wait_passed(time_ns_t until_ns) const noexcept {
  return commit_->wait_passed(until_ns);
}

// ---- what it makes of the architecture's table

void TransactionCommit::Work::prepare_publication() {
  is_structural_ = draft_->is_structural();
  resynchronises_ = draft_->resynchronise_step() != 0;
  const bool is_plain = std::all_of(changes_.begin(), changes_.end(), [](const Change& change) {
    return change.parts == nullptr && change.retreat == nullptr && !change.draft->is_added;
  });
  is_run_only_ = is_plain && !is_structural_ && !changes_.empty() && actions_.empty() && repairs_.empty() &&
                 configured_anew_.empty();
  elements_.clear();
  wires_.clear();
  added_.clear();
  services_.clear();
  frames_.clear();
  for (const auto& [resource, frames] : draft_->frames())
    frames_.emplace_back(&resource->frame_guard(), keep_frames(frames));
  const auto note = [this](DraftComponent& component, const Wires& wires) {
    const bool has_place = std::any_of(changes_.begin(), changes_.end(),
                                       [&](const Change& change) { return change.draft == &component; });
    if (component.is_added)
      added_.push_back(component.component.get());
    else
      elements_.push_back(
          {.component = component.component.get(), .changes = component.changes, .has_place = has_place});
    if (!component.is_added && component.shell_step == 0 && wires == component.wires_before) return;
    wires_.emplace_back(component.component.get(), std::make_shared<const Wires>(wires));
    for (const Wires* each : std::initializer_list<const Wires*>{&wires, &component.wires_before}) {
      for (const auto& [port, wire] : *each) services_.push_back(wire.service);
    }
  };
  for (DraftComponent& component : draft_->components()) note(component, component.wires);
  for (DraftComponent& component : draft_->removed_components()) note(component, {});
  for (const auto& resource : draft_->removed_resources())
    services_.insert(services_.end(), resource->services().begin(), resource->services().end());
  if (is_structural_) prepare_lists();
}

void TransactionCommit::Work::prepare_lists() {
  lists_ = architecture_.lists();
  const auto& removed = draft_->removed_components();
  std::erase_if(lists_.components, [&](const auto& component) {
    return std::any_of(removed.begin(), removed.end(),
                       [&](const DraftComponent& gone) { return gone.component == component; });
  });
  const auto& gone = draft_->removed_resources();
  std::erase_if(lists_.resources, [&](const auto& resource) {
    return std::find(gone.begin(), gone.end(), resource) != gone.end();
  });
  for (const DraftComponent& component : draft_->components()) {
    if (component.is_added) lists_.components.push_back(component.component);
  }
  for (const DraftResource& resource : draft_->resources()) lists_.resources.push_back(resource.resource);
}

time_ns_t TransactionCommit::Work::since_ns() const noexcept {
  MAUVE_AUDIT(architecture_.commit_gate().is_looked_at_here());
  // A new epoch lies ahead of now, also where all components are late, or there is none.
  time_ns_t latest_ns = resynchronises_ ? MAUVE_RT_TRUSTED(host_->clock().now_ns()) : 0;
  for (const Element& element : elements_)
    latest_ns = std::max(latest_ns, element.component->change_mark().since_ns());
  for (const ServiceBase* service : services_) latest_ns = std::max(latest_ns, service->since_ns());
  return latest_ns;
}

bool TransactionCommit::Work::is_current() const noexcept {
  MAUVE_AUDIT(architecture_.commit_gate().is_looked_at_here());
  if (is_structural_ && architecture_.commit_gate().structure() != structure_) return false;
  return is_run_only_ || std::all_of(elements_.begin(), elements_.end(), [](const Element& element) {
           return element.component->change_mark().changes() == element.changes;
         });
}

void TransactionCommit::Work::publish(time_ns_t instant_ns) noexcept {
  MAUVE_AUDIT(architecture_.commit_gate().is_looked_at_here());
  if (is_structural_) architecture_.swap_lists(lists_);
  for (auto& [component, wires] : wires_) component->swap_wires(wires);
  for (const auto& [guard, frames] : frames_) guard->expect(frames);
  for (ServiceBase* service : services_) service->set_since_ns(instant_ns);
  if (draft_->forget_claims()) {
    for (const auto& component : draft_->claimed()) component->change_mark().release();
  }
  for (const Element& element : elements_) {
    ChangeMark& mark = element.component->change_mark();
    if (!is_run_only_) mark.set_changed();
    if (element.has_place) mark.unsettle();
    mark.set_since_ns(instant_ns);
  }
  for (Component* component : added_) component->enter(architecture_);
  if (is_structural_) architecture_.commit_gate().restructured();
  MAUVE_RT_TRUSTED(advance(Phase::made));  // a store: only a broken contract throws
  architecture_.note_open();               // last: who settles takes the hint back, then looks at the phase
  architecture_.changes().bump();
}

// ---- what is left of it when it is decided

bool TransactionCommit::Work::settle() noexcept {
  const Phase phase = phase_.load(std::memory_order_acquire);
  if (phase == Phase::being_made) return false;
  host_ = architecture_.host();  // the one that it was made by may be gone
  deployed_ = host_ != nullptr && host_->is_deployed();
  if (phase == Phase::off) {
    if (is_prepared_ || !commit_->is_left()) return false;
    discard_rest();
  }
  if (phase == Phase::made) {
    note_made();
    architecture_.drop_stale_prepared();  // they refer to what goes now
    bool is_all = true;
    for (Change& change : changes_) is_all &= settle_if_over(change);
    if (!is_all || !commit_->is_left()) return false;
    end_settlement();
  }
  advance(Phase::settled);
  return true;
}

void TransactionCommit::Work::note_made() noexcept {
  if (is_noted_.exchange(true, std::memory_order_relaxed)) return;  // relaxed: the notes have a mutex
  architecture_.note_authors(transaction_);
}

/// What a change that is under way looks at stays as it is.
bool TransactionCommit::Work::settle_if_over(Change& change) noexcept {
  if (change.is_settled) return true;
  if (!Commit::is_over(*change.place)) return false;
  ChangeMark& mark = change.draft->component->change_mark();
  if (!change.draft->is_added) {
    const CommitGate::Look table(architecture_.commit_gate());
    if (mark.is_claimed()) return false;
  }
  try {
    settle_place(change);
  } catch (...) {  // what cannot be retired stays; the change is in
    failure_ = std::current_exception();
  }
  change.is_settled = true;
  if (change.draft->is_added) return true;
  {
    const CommitGate::Look table(architecture_.commit_gate());
    mark.settle();
  }
  architecture_.changes().bump();  // the description shows it only now
  return true;
}

void TransactionCommit::Work::settle_place(Change& change) {
  DraftComponent& draft = *change.draft;
  Component& component = *draft.component;
  const bool has_taken = change.place->has_passed();  // else its thread hung, and has ended
  if (has_taken) note_handover(change);
  // One that takes the epoch only may hang still: nothing else of it is looked at.
  if (has_taken && change.retreat == nullptr && !draft.only_epoch) {
    component.show();
    for (ListenerChange* listener : change.listeners) listener->hand_over();
    if (component.is_configured()) component.update_listening();
    settle_shadow(draft);
  }
  if (has_taken && change.parts != nullptr) {
    component.settle_probation();  // the take has ended it
    const bool has_probation = change.parts->has_probation();
    if (!component.fallback_implementation().empty()) renew_fallback(change);
    if (has_probation) component.keep_probation(std::move(change.parts));
  }
  dispose(change);
  const auto is_its = [&](const auto& action) { return action->task == &component.task(); };
  change.listeners.clear();
  std::erase_if(actions_, is_its);
  std::erase_if(repairs_, is_its);
  draft.wires.clear();  // they keep resources in use
  draft.wires_before.clear();
  if (change.retreat != nullptr) retire_removed(draft.component);
}

/// Cleans up the parts that are out: the old ones, or new ones that were not taken.
void TransactionCommit::Work::dispose(Change& change) {
  if (change.parts == nullptr) return;
  std::shared_ptr<PartsChange> parts = std::move(change.parts);
  architecture_.dispose(
      "cleanup of parts of " + change.draft->component->description(),
      [component = change.draft->component, parts = std::move(parts)]() mutable { parts.reset(); },
      change.draft->component.get(), is_called_off_ ? Keeper::Place::next : Keeper::Place::last);
}

void TransactionCommit::Work::note_handover(const Change& change) {
  const Handover* handover = change.parts != nullptr ? change.parts->handover() : nullptr;
  if (handover == nullptr || handover->is_whole()) return;
  const LockGuard lock(reports_mutex_);
  reports_[static_cast<std::size_t>(change.draft->core_step - 1)].left.emplace_back(
      "a field of the old core could not be read at the change: its value is that of the preparation");
}

void TransactionCommit::Work::retire_removed(const std::shared_ptr<Component>& component) {
  component->leave_architecture();
  let_go(component, true);
}

void TransactionCommit::Work::end_settlement() noexcept {
  auto gone = draft_->removed_resources();
  keep_for_report();
  architecture_.retire(std::move(gone));
}

const Task* TransactionCommit::Work::find_late() const noexcept {
  if (phase_.load(std::memory_order_acquire) != Phase::made) return nullptr;
  for (const Change& change : changes_) {
    if (!change.is_settled && !change.place->has_passed()) return change.place->task;
  }
  return nullptr;
}

// ---- who calls it off while it is prepared

bool TransactionCommit::Work::is_about(const std::string& target) const noexcept {
  const auto& steps = transaction_.steps();
  return std::any_of(steps.begin(), steps.end(),
                     [&target](const auto& step) { return step->target == target; });
}

bool TransactionCommit::Work::is_overdue() const {
  if (!is_preparing_.load(std::memory_order_relaxed)) return false;
  const time_ns_t since_ns = RunningHook::of(thread_.load(std::memory_order_relaxed)).since_ns;
  return since_ns != 0 && monotonic_now_ns() - since_ns >= options_.timeouts.prepare_ns;
}

/// Its thread stays at its hook meanwhile, and looks at no component afterwards: it finds out as it leaves the hook. Until then the
/// hook may use the parts that were in.
bool TransactionCommit::Work::call_off_preparation() {
  return RunningHook::call_off(thread_.load(std::memory_order_relaxed), [this] {
    if (!is_preparing_.load(std::memory_order_relaxed) || is_called_off_.load(std::memory_order_relaxed))
      return false;
    if (acts_on_present_parts()) return false;
    for (const auto& component : draft_->claimed()) architecture_.hold_parts(*component);
    is_called_off_.store(true, std::memory_order_relaxed);
    draft_->release();
    release_whole();
    preparation_.changed.notify_all();
    return true;
  });
}

bool TransactionCommit::Work::acts_on_present_parts() const noexcept {
  const auto& components = draft_->components();
  if (std::any_of(components.begin(), components.end(),
                  [](const DraftComponent& component) { return component.is_candidate_out; }))
    return true;
  const auto& claimed = draft_->claimed();
  const CommitGate::Look table(architecture_.commit_gate());
  return std::any_of(claimed.begin(), claimed.end(),
                     [](const auto& component) { return component->change_mark().is_held(); });
}

void TransactionCommit::Work::throw_called_off() const {
  throw Error(ErrorCode::wrong_revision, RunningHook::kCalledOff,
              {.expected = "hooks that end within " +
                           std::to_string(options_.timeouts.prepare_ns / ms_to_ns(1)) + " ms",
               .remedy = "find out why its hook lasts, then ask again"});
}

// ---- what it reports

bool TransactionCommit::Work::is_under_way() const noexcept {
  if (is_armed_.load(std::memory_order_acquire)) return false;
  return !is_prepared_ || phase_.load(std::memory_order_acquire) != Phase::off;
}

void TransactionCommit::Work::tell(std::vector<OpenChangeFacts>& all) const {
  if (is_armed_.load(std::memory_order_acquire)) return;
  const Phase phase = phase_.load(std::memory_order_acquire);
  if (phase == Phase::off || phase == Phase::settled) return;
  OpenChangeFacts facts{.author = transaction_.author(),
                        .steps = step_texts_,
                        .begun_ns = begun_ns_.load(std::memory_order_relaxed)};  // relaxed: is_armed_
  const LockGuard lock(facts_mutex_);
  if (commit_ == nullptr) {
    RunningHook::Facts running = RunningHook::of(thread_.load(std::memory_order_relaxed));
    facts.hook = std::move(running.hook);
    if (running.is_off) facts.hook += " (called off)";
    if (running.since_ns != 0) facts.hook_age_ns = monotonic_now_ns() - running.since_ns;
  }
  const CutWord cut = commit_ != nullptr ? commit_->look() : CutWord{};
  if (commit_ != nullptr && !cut.is_off()) {
    const bool is_made = cut.is_closed();
    facts.phase = is_made ? OpenChangePhase::made : OpenChangePhase::waiting;
    if (is_made) facts.instant_ns = cut.instant_ns();
    for (const Participant& place : commit_->participants()) {
      // relaxed: of interest by itself
      if (is_made ? place.has_passed() : place.has_agreed.load(std::memory_order_relaxed)) continue;
      const Task& task = *place.task;
      facts.late.push_back(
          {.name = task.name(), .state = task.state_age(), .left_behind = task.is_left_behind()});
    }
  }
  all.push_back(std::move(facts));
}

std::size_t TransactionCommit::Work::awaited_place(const std::string& component) const {
  if (commit_ == nullptr || !commit_->look().is_closed()) return touched_.size();
  for (std::size_t i = 0; i < touched_.size(); ++i) {
    if (touched_[i]->name() == component && !commit_->participants()[i].has_passed()) return i;
  }
  return touched_.size();
}

std::shared_ptr<Component> TransactionCommit::Work::find_awaited(const std::string& component) const {
  const LockGuard lock(facts_mutex_);
  const std::size_t place = awaited_place(component);
  return place != touched_.size() ? touched_[place] : nullptr;
}

bool TransactionCommit::Work::awaits_parts(const std::string& component) const {
  const LockGuard lock(facts_mutex_);
  const std::size_t place = awaited_place(component);
  return place != touched_.size() && commit_->participants()[place].replaces_parts;
}

const char* to_string(OpenChangePhase phase) noexcept {
  switch (phase) {
    case OpenChangePhase::preparing:
      return "preparing";
    case OpenChangePhase::waiting:
      return "waiting";
    case OpenChangePhase::made:
      return "made";
  }
  return "unknown";
}

}  // namespace mauve
