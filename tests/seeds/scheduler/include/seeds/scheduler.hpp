// SPDX-License-Identifier: LGPL-3.0-or-later
// The seeded scheduler: runs the threads of the process one at a time, in virtual time. For tests alone.
#pragma once

#include <pthread.h>

#include <cstddef>
#include <cstdint>
#include <string>

#include "mauve_rt/base/seam/clocks.hpp"

/// Each thread is a thread of the system that waits for the baton on a semaphore of its own; the holder of the baton runs.
/// The baton changes hands inside calls of the seam and at atomic operations (Atomic). The seed decides who is next, what a call costs in virtual time, how
/// late a sleeper wakes, and when the whole computer stalls. Nothing depends on an address, on a hash or on the real clock.
///
/// A thread that waits for another one by neither would keep the baton for ever.
namespace mauve::seeds {

/// A call of the seam, as the trace has it; an atomic operation only where threads may have switched.
enum class Call : std::uint8_t {
  begin,
  clock,
  sleep,
  yield,
  futex_wait,
  futex_wake,
  futex_lock,
  futex_unlock,
  lock,
  try_lock,
  unlock,
  lock_shared,
  condition_wait,
  condition_notify,
  barrier,
  thread_start,
  thread_join,
  thread_end,
  signal_wait,
  stall,
  atomic,
  compute,
};
const char* to_string(Call call) noexcept;

struct Options {
  std::uint64_t seed{0};
  time_ns_t longest_ns{900'000'000'000};  // of virtual time: a longer run is a livelock
  std::uint64_t most_calls{30'000'000};   // of the seam: likewise
  bool keeps_trace{false};                // for write_trace()
};

/// Everything that two runs of one seed have in common, bit for bit.
struct Outcome {
  std::uint64_t hash{0};  // of every call: which thread, which call, at which instant
  std::uint64_t calls{0};
  std::uint64_t switches{0};
  time_ns_t passed_ns{0};
  time_ns_t stalled_ns{0};  // of that, the computer stood still
  int alive{0};             // threads that have not ended
  bool operator==(const Outcome&) const = default;
};

/// What the first stack trace and the first exception of a process load is loaded here, not in each forked process.
void prepare_forks() noexcept;
/// Begins a run, with the calling thread as the first one. Once in a process, before the seam makes any thread.
void begin(const Options& options);
Outcome outcome() noexcept;
/// The threads that have not ended, each with what it waits for.
std::string alive();
/// Of the thread that runs, as the kernel named it.
const char* running() noexcept;
/// One line a call: instant, thread, call.
void write_trace(const std::string& path);

/// In this run threads switch at many atomic operations: for a scenario of few milliseconds.
void switch_often() noexcept;
/// The calling thread uses the processor for so long: for a scenario, which would loop over many readings of a clock otherwise.
void compute(time_ns_t length_ns) noexcept;

// ---- for the seam

struct Thread;

struct NewThread {
  const char* name{"thread"};
  int priority{0};  // SCHED_FIFO; 0: an ordinary thread, below all others
  std::size_t stack_bytes{0};
  void* (*entry)(void*){nullptr};
  void* argument{nullptr};
};

/// The calling thread. Ends the process where the seam did not make it.
Thread& self() noexcept;
/// A call begins: it costs time, and another thread may run first.
void step(Call call) noexcept;
/// Waits for wake() of that address; false: at the instant. `by_chance`: it may wake without a cause, too.
bool block(Call call, const void* address, time_ns_t until_ns, bool by_chance) noexcept;
void wake_all(const void* address) noexcept;
/// Any one.
void wake_one(const void* address) noexcept;
time_ns_t now_ns() noexcept;
time_ns_t cpu_ns() noexcept;
/// Of any thread.
time_ns_t cpu_ns(const Thread& thread) noexcept;
/// Of the calling thread: it could run, and others ran.
time_ns_t kept_ns() noexcept;

/// Null where the system refuses the thread; `error` says why.
Thread* start(const NewThread& thread, int& error);
void join(Thread& thread) noexcept;
pthread_t handle(const Thread& thread) noexcept;
int priority(const Thread& thread) noexcept;

/// A lock; by its flags a mutex, a recursive one, or one with priority inheritance.
class Lock {
 public:
  constexpr Lock(bool is_recursive, bool inherits) noexcept
      : is_recursive_(is_recursive), inherits_(inherits) {}
  /// False where the caller holds it, and it is not recursive.
  bool lock() noexcept { return lock_until(INT64_MAX); }
  bool try_lock() noexcept;
  /// False at the instant, too.
  bool lock_until(time_ns_t until_ns) noexcept;
  void unlock() noexcept;
  /// Without a possible switch, for a wait on a condition.
  void release() noexcept;
  bool is_held_here() const noexcept;

 private:
  bool take() noexcept;

  Thread* holder_{nullptr};
  int depth_{0};
  bool is_recursive_;
  bool inherits_;
};

/// As std::shared_mutex.
class SharedLock {
 public:
  SharedLock() = default;
  SharedLock(const SharedLock&) = delete;
  SharedLock& operator=(const SharedLock&) = delete;

  void lock() noexcept;
  bool try_lock() noexcept;
  void unlock() noexcept;
  void lock_shared() noexcept;
  bool try_lock_shared() noexcept;
  void unlock_shared() noexcept;

 private:
  void take() noexcept;

  bool is_written_{false};
  int readers_{0};
};

/// Ends the process with the seed, and with what each thread waits for.
[[noreturn]] void fail(const std::string& what) noexcept;

}  // namespace mauve::seeds
