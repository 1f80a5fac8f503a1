// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/base/biased_mutex.hpp"

#include "mauve_rt/base/contract.hpp"
#include "mauve_rt/base/seam/futex.hpp"
#include "mauve_rt/base/seam/mutex.hpp"
#include "mauve_rt/base/seam/sleep.hpp"

namespace mauve {

/// The user has left, and somebody has taken the bias away: unlocks the futex, if that one has locked it on our behalf.
void BiasedMutex::Seat::hand_over() noexcept {
  inside_.store(0, std::memory_order_seq_cst);  // once more: before the look at the futex, for all
  const std::uint32_t id = id_.load(std::memory_order_relaxed);
  std::uint32_t mine = id;
  if (handover_.compare_exchange_strong(mine, 0, std::memory_order_seq_cst)) return;
  if ((mine & kFutexHolder) == id) futex_unlock_pi(handover_);
}

/// Until the user has left, which inherits the caller's priority. One thread at a time.
void BiasedMutex::Seat::await_leave() noexcept {
  constexpr time_ns_t kBetweenLooks = us_to_ns(20);
  for (;;) {
    std::uint32_t user = inside_.load(std::memory_order_acquire);
    if (user == 0) return;
    std::uint32_t unlocked = 0;
    handover_.compare_exchange_strong(unlocked, user, std::memory_order_seq_cst);
    if (inside_.load(std::memory_order_seq_cst) == 0) {
      handover_.compare_exchange_strong(user, 0, std::memory_order_seq_cst);
      continue;
    }
    if (futex_lock_pi(handover_)) {
      futex_unlock_pi(handover_);
    } else {  // a thread of another process id namespace, or one that has ended
      handover_.store(0, std::memory_order_seq_cst);
      sleep_for(kBetweenLooks);
    }
  }
}

/// Afterwards the user of the bias is not inside, and enters by the mutex.
void BiasedMutex::revoke(Seat& granted) noexcept {
  MAUVE_AUDIT(mutex_.is_held_here());
  owner_.store(nullptr, std::memory_order_relaxed);
  process_barrier();
  granted.await_leave();
}

void BiasedMutex::lock() noexcept {
  mutex_.lock();
  if (Seat* const granted = granted_.load(std::memory_order_relaxed)) revoke(*granted);
}

/// As lock(); the bias of this seat itself needs no revocation: its user is the caller.
void BiasedMutex::lock_with(Seat& seat) noexcept {
  mutex_.lock();
  Seat* const granted = granted_.load(std::memory_order_relaxed);
  if (granted != nullptr && granted != &seat) revoke(*granted);
}

bool BiasedMutex::try_lock() noexcept {
  if (!mutex_.try_lock()) return false;
  const Seat* const granted = granted_.load(std::memory_order_relaxed);
  if (granted == nullptr) return true;
  owner_.store(nullptr, std::memory_order_relaxed);
  process_barrier();
  if (granted->inside_.load(std::memory_order_acquire) == 0) return true;
  unlock();
  return false;
}

void BiasedMutex::unlock() noexcept {
  MAUVE_AUDIT(mutex_.is_held_here());
  owner_.store(granted_.load(std::memory_order_relaxed), std::memory_order_release);
  mutex_.unlock();
}

/// unlock() carries it out.
void BiasedMutex::grant() noexcept {
  MAUVE_AUDIT(mutex_.is_held_here());
  const bool is_alone = first_ != nullptr && first_->next_ == nullptr;
  const bool is_biased = is_alone && !is_shared_ && has_process_barrier();
  granted_.store(is_biased ? first_ : nullptr, std::memory_order_relaxed);
}

void BiasedMutex::add(Seat& seat) noexcept {
  const LockGuard lock(*this);
  seat.next_ = first_;
  first_ = &seat;
  grant();
}

void BiasedMutex::remove(Seat& seat) noexcept {
  lock_with(seat);
  for (Seat** place = &first_; *place != nullptr; place = &(*place)->next_) {
    if (*place != &seat) continue;
    *place = seat.next_;
    break;
  }
  seat.next_ = nullptr;
  grant();
  unlock();
}

void BiasedMutex::share() noexcept {
  const LockGuard lock(*this);
  is_shared_ = true;
  grant();
}

}  // namespace mauve
