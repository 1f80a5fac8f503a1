// SPDX-License-Identifier: LGPL-3.0-or-later
// The component that is measured: it works for a while, then waits out its period.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "mauve_rt/mauve_rt.hpp"

#include "support/json_line.hpp"
#include "support/realtime_thread.hpp"

namespace bench {

struct WorkerShell : mauve::Shell {
  mauve::Property<std::int64_t>& period_us =
      property("period_us", 1000, {.unit = "us", .structural = mauve::ReadBy::fsm});
  mauve::Property<std::int64_t>& work_us = property("work_us", 0, {.unit = "us"});
};

struct Worker : mauve::Core<WorkerShell> {
  virtual void work() {
    if (shell().work_us > 0) spin_for(mauve::us_to_ns(shell().work_us));
  }
  void take(mauve::CoreBase& old) noexcept override { state = static_cast<Worker&>(old).state; }
  std::string description() const override { return "core bench/Worker"; }

  std::int64_t state{0};  // something to hand over
};

struct WorkerFsm : mauve::Fsm<WorkerShell, Worker> {
  void define() override {
    mauve::State& work = execution("Work", "work", &Worker::work);
    mauve::State& rest = wait("Rest", mauve::us_to_ns(shell().period_us));
    set_initial(work);
    next(work, rest);
    next(rest, work);
  }
};

/// Adds a worker on one CPU.
inline mauve::Component& add_worker(mauve::Architecture& architecture, const std::string& name, int priority,
                                    int cpu, std::int64_t period_us, std::int64_t work_us) {
  mauve::Component& component = architecture.add_component<WorkerShell, Worker, WorkerFsm>(
      name, mauve::TaskSettings{.priority = priority, .cpus = {cpu}});
  component.set_property("period_us", period_us);
  component.set_property("work_us", work_us);
  return component;
}

/// Records of a kind, of one component, appended to what was found before.
/// Throws std::runtime_error when the trace is not whole: what is missing in it would be taken for missed.
inline void append_records(std::vector<mauve::TraceRecord>& into, const mauve::TraceDrain& drain,
                           mauve::TraceKind kind, std::uint16_t component = 0) {
  if (drain.dropped.at(component) != 0) throw std::runtime_error("trace records were lost");
  for (const mauve::TraceRecord& record : drain.records) {
    if (record.kind == static_cast<std::uint16_t>(kind) && record.component == component)
      into.push_back(record);
  }
}

/// Nominal instants of release records.
inline std::vector<mauve::time_ns_t> nominal_instants(const std::vector<mauve::TraceRecord>& releases) {
  std::vector<mauve::time_ns_t> instants;
  instants.reserve(releases.size());
  for (const mauve::TraceRecord& release : releases) instants.push_back(release.a);
  return instants;
}

}  // namespace bench
