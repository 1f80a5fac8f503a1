// SPDX-License-Identifier: LGPL-3.0-or-later
// A change among others: those that it waits for, those that it lets go on, and what is left of it while a component is late.
#include <algorithm>

#include "mauve_rt/architecture/runner.hpp"

#include "change/work.hpp"

namespace mauve {

/// The changes of what this one is about: those under way, and those that a late component has not taken yet.
EarlierChange TransactionCommit::Work::look_at_earlier() const {
  const ArchitectureClaims& claims = architecture_.claims();
  if ((claims.structure && is_structural()) || (claims.revision && options_.expected_revision != 0))
    return EarlierChange::under_way;
  const auto& steps = transaction_.steps();
  const auto is_named = [&steps](const Component& component) {
    return std::any_of(steps.begin(), steps.end(), [&component](const auto& step) {
      return step->is_for_all() || step->component() == component.name();
    });
  };
  const auto components = architecture_.components();
  const std::lock_guard gate(architecture_.commit_gate().mutex);
  EarlierChange found = EarlierChange::none;
  for (const auto& component : components) {
    const ChangeMark& mark = component->change_mark();
    const bool is_late = mark.is_unsettled() && !component->task().is_left_behind();
    if ((!mark.is_claimed() && !is_late) || !is_named(*component)) continue;
    if (mark.is_claimed()) return EarlierChange::under_way;
    found = EarlierChange::late;
  }
  return found;
}

bool TransactionCommit::Work::is_structural() const noexcept {
  const auto& steps = transaction_.steps();
  return std::any_of(steps.begin(), steps.end(), [](const auto& step) { return step->is_structural(); });
}

void TransactionCommit::Work::claim_whole() noexcept {
  claimed_ = {.structure = is_structural(), .revision = options_.expected_revision != 0};
  architecture_.claims().structure |= claimed_.structure;
  architecture_.claims().revision |= claimed_.revision;
}

void TransactionCommit::Work::release_whole() noexcept {
  if (claimed_.structure) architecture_.claims().structure = false;
  if (claimed_.revision) architecture_.claims().revision = false;
  claimed_ = {};
}

/// Others go on while this change prepares its parts and waits for its components. Not where no component is awaited, and
/// not where all components have a part.
std::unique_ptr<ChangeLock::Pause> TransactionCommit::Work::let_others_in() {
  numbers_after_ = architecture_.numbers();
  if (!deployed_ || is_simulated_ || draft_->resynchronise_step() != 0) return nullptr;
  return std::make_unique<ChangeLock::Pause>(architecture_.change_lock());
}

bool TransactionCommit::Work::wait_passed(time_ns_t until_ns) const noexcept {
  return commit_->wait_passed(until_ns);
}

void TransactionCommit::Work::keep_open(std::vector<std::shared_ptr<Component>> unsettled) {
  architecture_.keep_open(std::make_shared<Late>(shared_from_this(), std::move(unsettled)));
}

bool TransactionCommit::Work::Late::settle() noexcept {
  Architecture& architecture = work_->architecture_;
  if (!work_->commit_->has_passed()) return false;
  work_->host_ = architecture.host();  // the one that it was made by may be gone
  work_->deployed_ = work_->host_ != nullptr && work_->host_->is_deployed();
  try {
    work_->finish();
  } catch (...) {  // what cannot be retired stays; the change is in
  }
  const std::lock_guard gate(architecture.commit_gate().mutex);
  for (const auto& component : unsettled_) component->change_mark().settle();
  return true;
}

const Task* TransactionCommit::Work::Late::find_late() const noexcept {
  for (const Participant& place : work_->commit_->participants()) {
    if (!place.has_passed()) return place.task;
  }
  return nullptr;
}

bool TransactionCommit::Work::has_added(const std::string& name) const noexcept {
  const auto& resources = draft_->resources();
  const DraftComponent* component = draft_->find(name);
  return (component != nullptr && component->is_added) ||
         std::any_of(resources.begin(), resources.end(),
                     [&name](const DraftResource& added) { return added.name() == name; });
}

}  // namespace mauve
