// SPDX-License-Identifier: LGPL-3.0-or-later
// What both programs need: to wait for something, to look at a value, and to prove from the trace that the control
// loop never noticed.
#pragma once

#include <chrono>
#include <cstdio>
#include <stdexcept>
#include <string>
#include <thread>

#include "mauve_rt/mauve_rt.hpp"

namespace reconfigurations {

/// Room for all that a 1 kHz component records in these programs.
inline constexpr std::size_t kTraceRecords = std::size_t{1} << 17U;

/// Waits until the condition holds. Throws std::runtime_error after ten seconds.
template <typename Condition>
void wait_for(const char* what, Condition&& condition) {
  const mauve::time_ns_t until_ns = mauve::monotonic_now_ns() + mauve::s_to_ns(10);
  while (!condition()) {
    if (mauve::monotonic_now_ns() > until_ns)
      throw std::runtime_error(std::string("waited in vain for ") + what);
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
}

template <typename T>
T newest(mauve::SharedData<T>& resource) {
  T value{};
  mauve::time_ns_t time_ns = 0;
  mauve::ReaderState reader;
  resource.read.read(value, time_ns, reader);
  return value;
}

inline void print_report(const char* what, const mauve::TransactionReport& report,
                         const std::string& consumer) {
  std::printf("%s: %zu steps, prepared in %.1f ms, blackout %.1f us\n", what, report.steps.size(),
              static_cast<double>(report.prepare_ns) * 1e-6, static_cast<double>(report.blackout_ns) * 1e-3);
  for (const mauve::StepReport& step : report.steps) {
    std::printf("  %s", step.step.c_str());
    if (step.component == consumer)
      std::printf("  [%lld releases missed]", static_cast<long long>(step.missed_releases));
    std::printf("\n");
  }
}

/// Counts what became of a component's releases: each has to come one period after the last.
///
/// An overrun record names those that were late for another reason, e.g. a machine that stalled: they are counted apart.
struct ControlWatch {
  int releases{0};
  int gaps{0};
  std::int64_t lost_to_overruns{0};

  ControlWatch(const mauve::TraceDrain& trace, const mauve::Task& control) {
    const mauve::time_ns_t period_ns = control.grid().period_ns;
    mauve::time_ns_t due_ns = control.grid().reference_ns;
    for (const mauve::TraceRecord& record : trace.records) {
      if (record.component != control.number()) continue;
      const auto kind = static_cast<mauve::TraceKind>(record.kind);
      if (kind == mauve::TraceKind::overrun) {
        lost_to_overruns += record.c;
        due_ns = record.a + record.c * period_ns;
      } else if (kind == mauve::TraceKind::release) {
        ++releases;
        if (record.a != due_ns) ++gaps;
        due_ns = record.a + period_ns;
      }
    }
    if (trace.dropped[control.number()] != 0)
      throw std::runtime_error("the trace has lost records: it proves nothing");
  }
  /// Says it, and returns the program's exit status.
  int verdict() const {
    std::printf("control: %d releases, %d gaps, %lld instants lost to overruns\n", releases, gaps,
                static_cast<long long>(lost_to_overruns));
    return gaps == 0 && releases > 0 ? 0 : 1;
  }
};

}  // namespace reconfigurations
