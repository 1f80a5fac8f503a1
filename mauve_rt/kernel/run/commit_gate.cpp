// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/run/commit_gate.hpp"

#include <mutex>

#include "mauve_rt/run/commit.hpp"

namespace mauve {

void CommitGate::begin(Commit& commit) noexcept {
  const std::lock_guard lock(under_way_mutex_);
  under_way_ = &commit;
  call_off_if_unwanted();
}

void CommitGate::end() noexcept {
  const std::lock_guard lock(under_way_mutex_);
  under_way_ = nullptr;
}

void CommitGate::press() noexcept {
  const std::lock_guard lock(under_way_mutex_);
  ++pressing_;
  call_off_if_unwanted();
}

void CommitGate::relax() noexcept {
  const std::lock_guard lock(under_way_mutex_);
  --pressing_;
}

void CommitGate::open() noexcept {
  const std::lock_guard lock(under_way_mutex_);
  is_open_ = true;
}

void CommitGate::close() noexcept {
  const std::lock_guard lock(under_way_mutex_);
  is_open_ = false;
  call_off_if_unwanted();
}

void CommitGate::call_off_if_unwanted() noexcept {
  if (under_way_ == nullptr) return;
  if (!is_open_ && under_way_->has_own()) {
    under_way_->call_off(Commit::Off::shut_down);
  } else if (pressing_ != 0 && under_way_->yields()) {
    under_way_->call_off(Commit::Off::preempted);
  }
}

}  // namespace mauve
