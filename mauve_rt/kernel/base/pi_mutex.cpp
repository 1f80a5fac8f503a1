// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/base/pi_mutex.hpp"

#include <unistd.h>

#include <utility>

#include "mauve_rt/base/trace.hpp"

namespace mauve {

namespace {

/// What a lock needs of its thread, in static thread-local storage: no call to find it.
struct ThisThread {
  std::int32_t id{0};   // 0: not asked for yet
  Atomic<int> held{0};  // relaxed: written by its thread alone; others ask whether it may hold one at all
  bool misused{false};
  PiMutex* last{nullptr};  // locked, of those held
};
__attribute__((tls_model("initial-exec"))) constinit thread_local ThisThread this_threads_own;

ThisThread& this_thread() MAUVE_RT { return MAUVE_RT_TRUSTED(this_threads_own); }

}  // namespace

PiMutex::~PiMutex() {
  if (held_by_this_thread() > 0 && holder_.load(std::memory_order_relaxed) == this_thread().id) forget_held();
}

/// Taken away while its holder, this thread, holds it.
void PiMutex::forget_held() noexcept {
  for (const PiMutex* held = this_thread().last; held != nullptr; held = held->below_) {
    if (held != this) continue;
    this_thread().misused = true;
    depth_ = 0;
    return unlock();
  }
}

inline void PiMutex::note_holder() noexcept {
  if (this_thread().id == 0) this_thread().id = MAUVE_RT_TRUSTED(gettid());  // the thread's first lock
  holder_.store(this_thread().id, std::memory_order_relaxed);                // relaxed: a hint for the trace
  this_thread().held.store(held_by_this_thread() + 1, std::memory_order_relaxed);
  below_ = this_thread().last;
  this_thread().last = this;
}

// Bounded as long as what its holders do is, which keep their sections to a copy, and inherit who waits' priority.
void PiMutex::lock() noexcept {
  if (mutex_.try_lock() || lock_contended()) return note_holder();
  ++depth_;  // its holder's already
  this_thread().misused = true;
}

/// False when the caller holds it.
bool PiMutex::lock_contended() noexcept {
  const std::int32_t holder = holder_.load(std::memory_order_relaxed);
  const time_ns_t began = monotonic_now_ns();
  if (!mutex_.lock()) return false;
  if (TraceRing* ring = TraceRing::of_this_thread()) {
    ring->push(TraceKind::contended, trace_id_, holder, monotonic_now_ns() - began);
  }
  return true;
}

bool PiMutex::try_lock() noexcept {
  if (!mutex_.try_lock()) return false;
  note_holder();
  return true;
}

bool PiMutex::try_lock_until(time_ns_t until_ns) noexcept {
  if (try_lock()) return true;
  if (until_ns == kForever) {
    const bool is_others = lock_contended();
    if (is_others) note_holder();
    return is_others;
  }
  if (!mutex_.try_lock_until(until_ns)) return false;
  note_holder();
  return true;
}

void PiMutex::unlock() noexcept {
  PiMutex** place = &this_thread().last;
  while (*place != nullptr && *place != this) place = &(*place)->below_;
  if (*place == nullptr) {
    this_thread().misused = true;
  } else if (depth_ > 0) {
    --depth_;
  } else {
    *place = below_;
    this_thread().held.store(held_by_this_thread() - 1, std::memory_order_relaxed);
    mutex_.unlock();
  }
}

void PiMutex::let_go_of_all_but(int held) noexcept {
  while (held_by_this_thread() > held && this_thread().last != nullptr) {
    this_thread().last->depth_ = 0;
    this_thread().last->unlock();
  }
}

bool PiMutex::is_held_here() const noexcept {
  const PiMutex* held = this_thread().last;
  while (held != nullptr && held != this) held = held->below_;
  return held == this;
}

bool PiMutex::was_misused_by_this_thread() noexcept { return std::exchange(this_thread().misused, false); }

int PiMutex::held_by_this_thread() noexcept { return this_thread().held.load(std::memory_order_relaxed); }

const Atomic<int>& PiMutex::count_of_this_thread() noexcept { return this_thread().held; }

}  // namespace mauve
