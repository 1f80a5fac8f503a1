// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/run/commit_gate.hpp"

#include <algorithm>
#include <mutex>

#include "mauve_rt/run/commit.hpp"

namespace mauve {

namespace {

template <typename Item>
void unlink(Item*& first, const Item& item) MAUVE_RT {
  Item** place = &first;
  while (*place != &item) place = &(*place)->next;
  *place = item.next;
}

bool is_in_the_way(const Commit& commit, const UrgentCommit& urgent) MAUVE_RT {
  if (commit.is_structural() && urgent.is_structural) return true;
  return std::any_of(urgent.tasks.begin(), urgent.tasks.end(),
                     [&commit](const Task* task) { return commit.is_about(*task); });
}

}  // namespace

void CommitGate::begin(Commit& commit) noexcept {
  const std::lock_guard lock(under_way_mutex_);
  commit.next = under_way_;
  under_way_ = &commit;
  call_off_if_unwanted(commit);
}

void CommitGate::end(Commit& commit) noexcept {
  const std::lock_guard lock(under_way_mutex_);
  unlink(under_way_, commit);
}

void CommitGate::press(UrgentCommit& urgent) noexcept {
  const std::lock_guard lock(under_way_mutex_);
  urgent.next = urgent_;
  urgent_ = &urgent;
  for (Commit* commit = under_way_; commit != nullptr; commit = commit->next) call_off_if_unwanted(*commit);
}

void CommitGate::relax(UrgentCommit& urgent) noexcept {
  const std::lock_guard lock(under_way_mutex_);
  unlink(urgent_, urgent);
}

void CommitGate::open() noexcept {
  const std::lock_guard lock(under_way_mutex_);
  is_open_ = true;
}

void CommitGate::close() noexcept {
  const std::lock_guard lock(under_way_mutex_);
  is_open_ = false;
  for (Commit* commit = under_way_; commit != nullptr; commit = commit->next) call_off_if_unwanted(*commit);
}

void CommitGate::call_off_if_unwanted(Commit& commit) noexcept {
  if (!is_open_ && commit.has_own()) commit.call_off(Commit::Off::shut_down);
  if (!commit.yields()) return;
  for (const UrgentCommit* urgent = urgent_; urgent != nullptr; urgent = urgent->next) {
    if (is_in_the_way(commit, *urgent)) commit.call_off(Commit::Off::preempted);
  }
}

}  // namespace mauve
