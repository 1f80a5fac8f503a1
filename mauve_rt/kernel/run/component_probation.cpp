// SPDX-License-Identifier: LGPL-3.0-or-later
// What ordinary threads do with a component's core on probation (probation.hpp).
#include <algorithm>

#include "mauve_rt/run/component.hpp"

namespace mauve {

namespace {

/// How often a requester looks whether the component has parked: no thread tells it.
constexpr time_ns_t kParkedLook = ms_to_ns(20);

}  // namespace

std::shared_ptr<Probation> Component::present_probation() const {
  const LockGuard lock(shown_mutex_);
  // Under this mutex the change that has it does not let go of it.
  Probation* const next = next_probation_.load(std::memory_order_acquire);
  return next != nullptr ? next->weak_from_this().lock() : probation_;
}

std::vector<ProbationRecord> Component::probations() const {
  const LockGuard lock(shown_mutex_);
  std::vector<ProbationRecord> records;
  if (last_probation_) records.push_back(*last_probation_);
  if (probation_ != nullptr) records.push_back(probation_->record());
  if (const Probation* next = next_probation_.load(std::memory_order_acquire))
    records.push_back(next->record());
  return records;
}

void Component::keep_probation(std::unique_ptr<PartsChange> parts) {
  auto probation = parts->release_probation();
  probation->keep(std::move(parts));
  const LockGuard lock(shown_mutex_);
  next_probation_.store(nullptr, std::memory_order_relaxed);  // relaxed: under the mutex
  probation_ = std::move(probation);
}

bool Component::is_probation_over() const noexcept {
  const auto probation = present_probation();
  return probation != nullptr && probation->conclude_if_over();
}

bool Component::is_probation_reverted() const noexcept {
  const auto probation = present_probation();
  return probation != nullptr && probation->is_reverted();
}

void Component::conclude_probation() noexcept {
  if (const auto probation = present_probation()) probation->conclude(ProbationCause::ended);
}

void Component::settle_probation(bool at_once) noexcept {
  std::shared_ptr<Probation> probation;
  {
    const LockGuard lock(shown_mutex_);
    probation = probation_;
  }
  if (probation == nullptr || !probation->has_ended()) return;
  task_.forget_probation(*probation);
  if (std::shared_ptr<PartsChange> parts = probation->release_parts()) {
    const bool is_fsm_back = probation->is_reverted() && parts->replaces_fsm();
    if (is_fsm_back) show();  // other states, and other times
    dispose(std::move(parts), is_fsm_back, at_once);
  }
  ProbationRecord record = probation->record();
  const LockGuard lock(shown_mutex_);
  last_probation_ = std::move(record);
  probation_.reset();
}

bool Component::revert_probation(const std::string& reason, time_ns_t timeout_ns) {
  const auto probation = present_probation();
  if (probation == nullptr) return false;
  const time_ns_t until = later_by(monotonic_now_ns(), timeout_ns);
  probation->request(reason);
  for (;;) {
    task_.notify_revert();
    if (!probation->has_ended() && task_.is_parked()) put_back_parked(*probation);
    if (probation->has_ended()) return probation->is_reverted();
    if (task_.is_called_from_own_state()) return true;
    const time_ns_t now = monotonic_now_ns();
    if (now >= until || task_.is_simulated()) break;
    if (probation->wait_ended(std::min(until, now + kParkedLook))) return probation->is_reverted();
  }
  task_.throw_state_running("the old core is not back yet; the request stays pending", timeout_ns,
                            "the old core goes in when the state ends");
}

}  // namespace mauve
