// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/run/commit_gate.hpp"

#include <algorithm>

#include "mauve_rt/base/contract.hpp"
#include "mauve_rt/run/commit.hpp"

namespace mauve {

namespace {

template <typename Item>
void unlink(Item*& first, const Item& item) MAUVE_RT {
  Item** place = &first;
  for (; *place != &item; place = &(*place)->next) MAUVE_EXPECTS(*place != nullptr);
  *place = item.next;
}

bool is_in_the_way(const Commit& commit, const UrgentCommit& urgent) MAUVE_RT {
  if (commit.is_structural() && urgent.is_structural) return true;
  return std::any_of(urgent.tasks.begin(), urgent.tasks.end(),
                     [&commit](const Task* task) { return commit.is_about(*task); });
}

}  // namespace

/// Takes the commits that are decided off the list; those that are made are in the table then.
void CommitGate::take_in() noexcept {
  MAUVE_AUDIT(is_looked_at_here());
  for (Commit** place = &under_way_; *place != nullptr;) {
    Commit& commit = **place;
    const CutWord seen = commit.look();
    if (seen.is_open()) {
      place = &commit.next;
      continue;
    }
    *place = commit.next;
    if (seen.is_closed()) commit.publish();
  }
}

bool CommitGate::begin(Commit& commit) noexcept {
  const Look look(*this);
  MAUVE_AUDIT(!commit.is_structural() || structural.is_held_here());
  if (!commit.prepare_install()) return false;
  commit.next = under_way_;
  under_way_ = &commit;
  call_off_if_unwanted(commit);
  return true;
}

void CommitGate::look_again(Commit& commit) noexcept {
  const Look look(*this);
  if (commit.look().is_open()) call_off_if_unwanted(commit);
}

bool CommitGate::has_open_about(const Task& task) const noexcept {
  MAUVE_AUDIT(is_looked_at_here());
  for (const Commit* commit = under_way_; commit != nullptr; commit = commit->next) {
    if (commit->look().is_open() && commit->is_about(task)) return true;
  }
  return false;
}

bool CommitGate::abandon(const Task& task) noexcept {
  const Look look(*this);
  bool is_one_off = false;
  for (Commit* commit = under_way_; commit != nullptr; commit = commit->next) {
    if (commit->look().is_open() && commit->is_about(task))
      is_one_off |= commit->call_off(Commit::Off::abandoned, &task);
  }
  return is_one_off;
}

void CommitGate::press(UrgentCommit& urgent) noexcept {
  const Look look(*this);
  urgent.next = urgent_;
  urgent_ = &urgent;
  for (Commit* commit = under_way_; commit != nullptr; commit = commit->next) call_off_if_unwanted(*commit);
}

void CommitGate::relax(UrgentCommit& urgent) noexcept {
  const Look look(*this);
  unlink(urgent_, urgent);
}

void CommitGate::open() noexcept {
  const Look look(*this);
  is_open_ = true;
}

void CommitGate::close() noexcept {
  const Look look(*this);
  is_open_ = false;
  for (Commit* commit = under_way_; commit != nullptr; commit = commit->next) call_off_if_unwanted(*commit);
}

void CommitGate::call_off_if_unwanted(Commit& commit) noexcept {
  MAUVE_AUDIT(is_looked_at_here());
  if (!is_open_ && commit.has_own()) commit.call_off(Commit::Off::shut_down);
  if (!commit.yields()) return;
  for (const UrgentCommit* urgent = urgent_; urgent != nullptr; urgent = urgent->next) {
    if (is_in_the_way(commit, *urgent)) commit.call_off(Commit::Off::preempted);
  }
}

}  // namespace mauve
