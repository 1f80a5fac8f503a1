// SPDX-License-Identifier: LGPL-3.0-or-later
// Empties the rings of an architecture's trace often, for somebody who takes what came less often.
#pragma once

#include "mauve_rt/architecture/architecture.hpp"
#include "mauve_rt/base/seam/condition_variable.hpp"
#include "mauve_rt/base/seam/thread.hpp"
#include "mauve_rt/deploy/job_watch.hpp"

namespace mauve {

/// A thread of its own: SCHED_FIFO 1, after all components, where the system grants that, so that neither a busy
/// machine nor a disk nor an interpreter keeps it from its work for as long as a ring has room.
class TraceCollector {
 public:
  /// When so many records wait to be taken the rings are left alone, which count what they lose: 64 MiB.
  static constexpr std::size_t kMostRecords = (64UL << 20U) / sizeof(TraceRecord);

  /// Starts the thread. `watch` gets all records, too; without `keeps` no other taker does. [non-rt]
  TraceCollector(Architecture& architecture, time_ns_t period_ns, JobWatch* watch = nullptr,
                 bool keeps = true);
  /// Ends the thread; what was not taken is gone. [non-rt]
  ~TraceCollector();
  TraceCollector(const TraceCollector&) = delete;
  TraceCollector& operator=(const TraceCollector&) = delete;

  /// Everything up to now. [non-rt]
  TraceDrain take();

 private:
  void run();
  void collect() MAUVE_REQUIRES(mutex_);
  TraceDrain drain() MAUVE_REQUIRES(mutex_);

  Architecture& architecture_;
  time_ns_t period_ns_;
  JobWatch* watch_;
  bool keeps_;
  Mutex mutex_;
  ConditionVariable end_;
  bool ending_ MAUVE_GUARDED_BY(mutex_){false};
  std::vector<TraceRecord> collected_ MAUVE_GUARDED_BY(mutex_);
  Thread thread_;  // last: it uses all others
};

}  // namespace mauve
