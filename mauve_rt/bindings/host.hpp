// SPDX-License-Identifier: LGPL-3.0-or-later
// What runs an architecture, as Python holds it.
#pragma once

#include "mauve_rt/base/seam/futex.hpp"
#include "mauve_rt/deploy/host.hpp"
#include "mauve_rt/deploy/job_watch.hpp"
#include "mauve_rt/deploy/trace_collector.hpp"

#include "translate.hpp"

namespace mauve::bindings {

/// As GoalEvent.
struct PyGoalEvent {
  std::uint64_t goal;  // as ask_goal() returned it
  GoalState state;
  GoalReason reason;
  std::optional<py::bytes> feedback{};
  std::optional<py::bytes> result{};
};

/// A host with what its waits have seen, so that Python needs to carry nothing from call to call. In virtual time
/// nothing happens while the caller waits: waits return at once.
class PyHost {
 public:
  using PublishedSample = std::tuple<std::string, std::vector<std::byte>, time_ns_t>;

  explicit PyHost(PyArchitecture& architecture)
      : registry_(architecture.registry),
        architecture_(architecture.architecture),
        watch_(architecture.architecture) {}
  virtual ~PyHost() = default;
  PyHost(const PyHost&) = delete;
  PyHost& operator=(const PyHost&) = delete;

  virtual Host& host() const noexcept = 0;
  const PluginRegistry& registry() const noexcept { return registry_; }

  std::vector<PublishedSample> wait_published(time_ns_t timeout_ns);
  bool wait_change(time_ns_t timeout_ns);
  void wake() noexcept;
  bool write_resource(const std::string& name, const py::bytes& data);
  ReadMessage read_resource(const std::string& name);
  /// As a client of the action does, without ROS: one thread at a time.
  std::pair<std::uint64_t, GoalReason> ask_goal(const std::string& name, const py::bytes& data);
  bool cancel_goal(const std::string& name, std::uint64_t goal);
  std::optional<PyGoalEvent> next_event(const std::string& name);
  std::vector<std::string> trace_components() const { return host().trace_components(); }
  /// In virtual time whoever drives it drains in time, without a thread.
  void collect_trace(time_ns_t period_ns);
  TraceDrain drain_trace();
  /// As JobWatch::watch(), for jobs from now on. On threads the records are taken from then on, and lost to drain_trace()
  /// unless collect_trace() asks for them; in virtual time whoever drives it drains.
  bool watch_jobs(const std::vector<JobBound>& bounds, std::uint64_t revision);
  void end_job_watch();
  const JobWatch& job_watch() const noexcept { return watch_; }
  std::vector<BoundViolation> take_violations() { return watch_.take_violations(); }

 private:
  void renew_collector();

  bool woken() const noexcept { return woken_.load(std::memory_order_acquire); }

  const PluginRegistry& registry_;
  Architecture& architecture_;
  JobWatch watch_;
  std::mutex collector_mutex_;
  bool is_watched_{false};       // under collector_mutex_
  time_ns_t keep_period_ns_{0};  // under collector_mutex_; 0: what is collected is for the watch alone
  std::unique_ptr<TraceCollector> collector_;  // under collector_mutex_
  std::atomic<bool> woken_{false};             // release/acquire: set once, for good
  std::uint64_t goals_asked_{0};               // of the one thread that asks for goals
  std::uint32_t seen_change_{0};               // of the one thread that waits for changes
};

}  // namespace mauve::bindings
