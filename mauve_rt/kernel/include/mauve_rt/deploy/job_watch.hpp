// SPDX-License-Identifier: LGPL-3.0-or-later
// Compares the response time of each job with its bound, by the trace: a component's own thread does nothing for it.
#pragma once

#include <string>
#include <vector>

#include "mauve_rt/architecture/architecture.hpp"
#include "mauve_rt/base/seam/mutex.hpp"

namespace mauve {

/// The bound of one kind of job: of all that a component executes from the end of one wait to the next wait.
struct JobBound {
  std::string component;
  std::string after;      // the wait that it follows; of the first job after a start the initial state
  std::string until;      // the wait that it leads to
  time_ns_t bound_ns{0};  // from the job's instant to its wait
};

/// A kind of job, and what was measured of it since its bound is watched.
struct JobFigures {
  JobBound job;
  std::uint64_t jobs{0};
  std::uint64_t violations{0};
  time_ns_t longest_ns{0};
};

/// Jobs of one component that took longer than their bound; the times are those of the worst one.
struct BoundViolation {
  JobBound job;
  time_ns_t instant_ns{0};
  time_ns_t response_ns{0};
  std::uint64_t count{0};
  std::vector<TraceRecord>
      records{};  // of all components, from a while before the instant to the end of the job

  /// [non-rt]
  time_ns_t excess_ns() const noexcept { return response_ns - job.bound_ns; }
};

/// Bounds hold for one revision of the architecture. They are withdrawn with the first drain that shows another revision, or
/// a change under way; no job of that drain, or of the end of the drain before it, is judged. All functions [non-rt], from any
/// thread.
class JobWatch {
 public:
  explicit JobWatch(const Architecture& architecture) : architecture_(architecture) {}

  /// Judges jobs whose instant is not before `since_ns`. False: the architecture has another revision, or a change is open.
  bool watch(const std::vector<JobBound>& bounds, std::uint64_t revision, time_ns_t since_ns);
  /// Judges no job from now on.
  void end();
  /// Takes the next records; each record once.
  void take(const TraceDrain& drain);
  /// Whether jobs are judged: not before watch(), and not after a change.
  bool holds() const;
  /// Of each bound that is watched; none after a change.
  std::vector<JobFigures> figures() const;
  /// Of each component that exceeded a bound since the last call one.
  std::vector<BoundViolation> take_violations();

 private:
  struct Followed {
    std::uint16_t number{0};  // of the component, as trace records have it
    std::uint32_t after{0};
    std::uint32_t until{0};
    JobFigures figures;
  };
  struct Current {
    std::uint64_t next_sequence{0};
    std::uint32_t after{0};
    time_ns_t instant_ns{0};
    bool is_known{false};
  };
  struct Late {
    std::size_t followed{0};
    time_ns_t instant_ns{0};
    time_ns_t end_ns{0};
  };

  void withdraw() MAUVE_REQUIRES(mutex_);
  void follow(const TraceRecord& record) MAUVE_REQUIRES(mutex_);
  void judge(std::uint16_t number, const Current& job, std::uint32_t until, time_ns_t end_ns)
      MAUVE_REQUIRES(mutex_);
  void note(const Late& late) MAUVE_REQUIRES(mutex_);
  void forget_before(time_ns_t time_ns) MAUVE_REQUIRES(mutex_);

  const Architecture& architecture_;
  mutable Mutex mutex_;
  bool holds_ MAUVE_GUARDED_BY(mutex_){false};
  std::uint64_t revision_ MAUVE_GUARDED_BY(mutex_){0};
  time_ns_t since_ns_ MAUVE_GUARDED_BY(mutex_){0};
  time_ns_t longest_bound_ns_ MAUVE_GUARDED_BY(mutex_){0};
  std::vector<Followed> followed_ MAUVE_GUARDED_BY(mutex_);
  std::vector<Current> current_ MAUVE_GUARDED_BY(mutex_);                   // by number of the component
  std::vector<std::vector<TraceRecord>> history_ MAUVE_GUARDED_BY(mutex_);  // a drain each
  std::vector<Late> late_
      MAUVE_GUARDED_BY(mutex_);  // of the last drain: records of others may come with the next one
  std::vector<BoundViolation> violations_ MAUVE_GUARDED_BY(mutex_);
};

}  // namespace mauve
