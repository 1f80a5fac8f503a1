// SPDX-License-Identifier: LGPL-3.0-or-later
// The process's real-time rights: asks for them, and says what was denied and how to grant it.
#pragma once

#include <string>
#include <vector>

namespace mauve {

struct RealtimeStatus {
  bool granted{true};
  std::vector<std::string> missing;  // one line a right: what, what it costs, how to grant it

  /// [non-rt]
  void deny(std::string line);
};

/// Locks memory (MCL_CURRENT | MCL_FUTURE | MCL_ONFAULT) where the limit allows it and holds
/// /dev/cpu_dma_latency at 0 for as long as the object lives.
class RealtimeProcess {
 public:
  RealtimeProcess() = default;
  ~RealtimeProcess();
  RealtimeProcess(const RealtimeProcess&) = delete;
  RealtimeProcess& operator=(const RealtimeProcess&) = delete;

  /// Asks for everything; a second call does nothing. Call before any component thread exists. [setup]
  /// `priority`: the highest one needed. Throws Error (realtime_denied) when `require` and anything is
  /// denied.
  void acquire(int priority, bool require);
  /// [non-rt]
  const RealtimeStatus& status() const noexcept { return status_; }

 private:
  void check_fifo(int priority);
  void lock_memory();
  void hold_cpu_latency();

  RealtimeStatus status_;
  bool acquired_{false};
  bool locked_{false};
  int latency_fd_{-1};
};

}  // namespace mauve
