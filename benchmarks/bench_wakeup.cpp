// SPDX-License-Identifier: LGPL-3.0-or-later
// Wake-up latency of a component that does nothing, beside a bare absolute clock_nanosleep loop.
//   bench_wakeup [--who component|bare] [--priority 80] [--cpu 0] [--interval-us 1000] [--duration-ms 1000]
// Prints {"latencies_ns": [...]}, each the time from the instant slept for to the first instruction after.
#include "support/components.hpp"
#include "support/options.hpp"

namespace {

using mauve::time_ns_t;

struct Settings {
  explicit Settings(const bench::Options& options)
      : priority(options.priority()),
        cpu(options.cpu()),
        interval_us(options.number("interval-us", 1000)),
        duration_ns(mauve::ms_to_ns(options.number("duration-ms", 1000))) {}

  int priority;
  int cpu;
  std::int64_t interval_us;
  time_ns_t duration_ns;
};

void measure_component(const Settings& settings) {
  mauve::Architecture architecture;
  bench::add_worker(architecture, "worker", settings.priority, settings.cpu, settings.interval_us, 0);
  architecture.configure();
  mauve::Deployer deployer(architecture);
  std::vector<mauve::TraceRecord> releases;
  deployer.deploy();
  const time_ns_t end = deployer.epoch_ns() + settings.duration_ns;
  for (time_ns_t next = deployer.epoch_ns(); next < end; next += mauve::ms_to_ns(50)) {
    bench::sleep_until(std::min(next, end));
    bench::append_records(releases, deployer.drain_trace(), mauve::TraceKind::release);
  }
  deployer.shutdown();
  bench::append_records(releases, deployer.drain_trace(), mauve::TraceKind::release);
  std::vector<std::int64_t> latencies;
  latencies.reserve(releases.size());
  for (const mauve::TraceRecord& release : releases) latencies.push_back(release.b - release.a);
  bench::JsonLine().add("latencies_ns", latencies).print();
}

void measure_bare(const Settings& settings) {
  const time_ns_t interval_ns = mauve::us_to_ns(settings.interval_us);
  mauve::RealtimeProcess process;  // locks memory and holds /dev/cpu_dma_latency, as an executor does
  process.acquire(settings.priority, false);
  std::vector<std::int64_t> latencies(static_cast<std::size_t>(settings.duration_ns / interval_ns + 1),
                                      -1);  // pages touched
  std::size_t taken = 0;
  {
    const bench::RealtimeThread loop(settings.priority, settings.cpu, [&] {
      time_ns_t next = mauve::monotonic_now_ns() + interval_ns;
      const time_ns_t end = next + settings.duration_ns;
      while (next < end) {
        bench::sleep_until(next);
        const time_ns_t now = mauve::monotonic_now_ns();
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

int main(int count, char** words) { return bench::run_sides(count, words, measure_component, measure_bare); }
