// SPDX-License-Identifier: LGPL-3.0-or-later
// ShadowThreads: ordinary threads, below all components, that execute the shadows of a host.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "mauve_rt/base/rt.hpp"
#include "mauve_rt/base/seam/atomic.hpp"
#include "mauve_rt/base/seam/futex.hpp"
#include "mauve_rt/base/seam/thread.hpp"

namespace mauve {

class Shadow;

/// Wakes the shadow thread. The sleeper's flag saves the component's thread a system call while the shadow thread is awake.
///
/// | member       | written by         | read by         | order                                                          |
/// | ------------ | ------------------ | --------------- | -------------------------------------------------------------- |
/// | word (futex) | who has news       | the sleeper     | seq_cst with is_asleep: one of the two sees the other's        |
/// | is_asleep    | the sleeper        | who has news    | seq_cst: as above                                              |
struct ShadowSignal {
  Atomic<std::uint32_t> word{0};
  Atomic<bool> is_asleep{false};

  /// [rt]
  void bump() MAUVE_RT {
    word.fetch_add(1, std::memory_order_seq_cst);
    if (is_asleep.load(std::memory_order_seq_cst)) futex_wake_all(word);
  }
};

/// One for each shadow: a candidate that hangs keeps no other from executing. They are SCHED_OTHER at nice 19, not SCHED_IDLE: such a
/// thread gets nearly no time on a busy machine, and may hold a shadow's mutex meanwhile. All functions [non-rt], one thread at a
/// time.
class ShadowThreads {
 public:
  ShadowThreads();
  ~ShadowThreads();
  ShadowThreads(const ShadowThreads&) = delete;
  ShadowThreads& operator=(const ShadowThreads&) = delete;

  /// Executes the shadow's releases until it has ended. Throws Error (internal): no thread.
  void add(const std::shared_ptr<Shadow>& shadow);
  /// Ends the threads, after their shadows have ended. A candidate whose state does not end by the instant keeps its thread, which
  /// then ends with the state.
  void end(time_ns_t until_ns) noexcept;

 private:
  class One;

  std::vector<std::unique_ptr<One>> threads_;
};

}  // namespace mauve
