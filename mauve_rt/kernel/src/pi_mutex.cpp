// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/pi_mutex.hpp"

#include <unistd.h>

#include "mauve_rt/error.hpp"
#include "mauve_rt/trace.hpp"

namespace mauve {

namespace {

/// What a lock needs of its thread, in static thread-local storage: no call to find it.
struct ThisThread {
  std::int32_t id{0};  // 0: not asked for yet
  std::atomic<int> held{
      0};  // relaxed: written by its thread alone; others ask whether it may hold one at all
};
__attribute__((tls_model("initial-exec"))) constinit thread_local ThisThread this_thread;

}  // namespace

PiMutex::PiMutex() {
  pthread_mutexattr_t attributes;
  pthread_mutexattr_init(&attributes);
  pthread_mutexattr_setprotocol(&attributes, PTHREAD_PRIO_INHERIT);
  const int result = pthread_mutex_init(&mutex_, &attributes);
  pthread_mutexattr_destroy(&attributes);
  if (result != 0) throw Error(ErrorCode::internal, "the system has no priority-inheritance mutexes");
}

PiMutex::~PiMutex() { pthread_mutex_destroy(&mutex_); }

inline void PiMutex::note_holder() noexcept {
  if (this_thread.id == 0) this_thread.id = gettid();
  holder_.store(this_thread.id, std::memory_order_relaxed);  // relaxed: a hint for the trace
  this_thread.held.store(held_by_this_thread() + 1, std::memory_order_relaxed);
}

void PiMutex::lock() noexcept {
  if (pthread_mutex_trylock(&mutex_) != 0) lock_contended();
  note_holder();
}

void PiMutex::lock_contended() noexcept {
  const std::int32_t holder = holder_.load(std::memory_order_relaxed);
  const time_ns_t began = monotonic_now_ns();
  pthread_mutex_lock(&mutex_);
  if (TraceRing* ring = TraceRing::of_this_thread()) {
    ring->push(TraceKind::contended, trace_id_, holder, monotonic_now_ns() - began);
  }
}

bool PiMutex::try_lock() noexcept {
  if (pthread_mutex_trylock(&mutex_) != 0) return false;
  note_holder();
  return true;
}

void PiMutex::unlock() noexcept {
  this_thread.held.store(held_by_this_thread() - 1, std::memory_order_relaxed);
  pthread_mutex_unlock(&mutex_);
}

int PiMutex::held_by_this_thread() noexcept { return this_thread.held.load(std::memory_order_relaxed); }

const std::atomic<int>& PiMutex::count_of_this_thread() noexcept { return this_thread.held; }

}  // namespace mauve
