// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/pi_mutex.hpp"

#include <unistd.h>

#include "mauve_rt/error.hpp"
#include "mauve_rt/trace.hpp"

namespace mauve {

namespace {

thread_local int held_count = 0;

std::int32_t this_thread_id() noexcept {
  thread_local const std::int32_t id = gettid();
  return id;
}

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

void PiMutex::lock() noexcept {
  if (pthread_mutex_trylock(&mutex_) != 0) lock_contended();
  holder_.store(this_thread_id(), std::memory_order_relaxed);  // relaxed: a hint for the trace
  ++held_count;
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
  holder_.store(this_thread_id(), std::memory_order_relaxed);
  ++held_count;
  return true;
}

void PiMutex::unlock() noexcept {
  --held_count;
  pthread_mutex_unlock(&mutex_);
}

int PiMutex::held_by_this_thread() noexcept { return held_count; }

}  // namespace mauve
