// SPDX-License-Identifier: LGPL-3.0-or-later
// The reference of wake-up latency: a bare absolute clock_nanosleep loop.
//   bench_wakeup [--priority 80] [--cpu 0] [--interval-us 1000] [--duration-ms 1000]
// Prints {"latencies_ns": [...]}, each the time from the instant slept for to the first instruction after.
#include "mauve_rt/realtime.hpp"

#include "support/json_line.hpp"
#include "support/options.hpp"
#include "support/realtime_thread.hpp"

namespace {

void measure(bench::Options& options) {
  const auto priority = static_cast<int>(options.number("priority", 80));
  const auto cpu = static_cast<int>(options.number("cpu", 0));
  const mauve::time_ns_t interval_ns = mauve::us_to_ns(options.number("interval-us", 1000));
  const mauve::time_ns_t duration_ns = mauve::ms_to_ns(options.number("duration-ms", 1000));

  mauve::RealtimeProcess process;  // locks memory and holds /dev/cpu_dma_latency, as an executor does
  process.acquire(priority, false);
  std::vector<std::int64_t> latencies(static_cast<std::size_t>(duration_ns / interval_ns + 1),
                                      -1);  // pages touched
  std::size_t taken = 0;
  {
    const bench::RealtimeThread loop(priority, cpu, [&] {
      mauve::time_ns_t next = mauve::monotonic_now_ns() + interval_ns;
      const mauve::time_ns_t end = next + duration_ns;
      while (next < end) {
        bench::sleep_until(next);
        const mauve::time_ns_t now = mauve::monotonic_now_ns();
        latencies[taken++] = now - next;
        next += interval_ns;
        // What was missed is skipped, as components do: catching up would count one stall many times.
        if (now > next) next += (now - next + interval_ns - 1) / interval_ns * interval_ns;
      }
    });
  }
  latencies.resize(taken);
  bench::JsonLine().add("latencies_ns", latencies).print();
}

}  // namespace

int main(int count, char** words) { return bench::run_program(count, words, measure); }
