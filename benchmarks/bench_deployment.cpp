// SPDX-License-Identifier: LGPL-3.0-or-later
// The spread of the first releases of components deployed together, beside bare threads that meet at a
// barrier and share an epoch.
//   bench_deployment [--who component|bare] [--count 20] [--threads 8] [--cpus 1] [--priority 80]
// Prints {"spreads_ns": [...]}: last minus first actual release at the epoch, of each deployment.
#include <algorithm>
#include <latch>
#include <memory>

#include "mauve_rt/base/seam/futex.hpp"

#include "support/components.hpp"
#include "support/options.hpp"

namespace {

using mauve::time_ns_t;

constexpr std::int64_t kPeriodUs = 1000;
/// So long before its first release a component wakes to fetch what it will use; the bare threads do so too.
constexpr time_ns_t kWarmUp = mauve::us_to_ns(300);

struct Settings {
  explicit Settings(const bench::Options& options)
      : count(options.number("count", 20)),
        threads(options.number("threads", 8)),
        cpus(options.number("cpus", 1)),
        priority(options.priority()) {}

  std::int64_t count;
  std::int64_t threads;
  std::int64_t cpus;
  int priority;

  int cpu_of(std::int64_t thread) const { return static_cast<int>(thread % cpus); }
};

std::int64_t spread(const std::vector<time_ns_t>& instants) {
  const auto [first, last] = std::minmax_element(instants.begin(), instants.end());
  return *last - *first;
}

void measure_component(const Settings& settings) {
  mauve::Architecture architecture;
  for (std::int64_t i = 0; i < settings.threads; ++i) {
    bench::add_worker(architecture, "worker_" + std::to_string(i), settings.priority, settings.cpu_of(i),
                      kPeriodUs, 0);
  }
  architecture.configure();
  mauve::Deployer deployer(architecture);
  std::vector<std::int64_t> spreads;
  for (std::int64_t i = 0; i < settings.count; ++i) {
    deployer.deploy();
    bench::sleep_until(deployer.epoch_ns() +
                       mauve::ms_to_ns(20));  // longer than most of the machine's stalls
    deployer.shutdown();
    const mauve::TraceDrain drain = deployer.drain_trace();
    std::vector<time_ns_t> instants;
    for (std::int64_t component = 0; component < settings.threads; ++component) {
      std::vector<mauve::TraceRecord> releases;
      bench::append_records(releases, drain, mauve::TraceKind::release,
                            static_cast<std::uint16_t>(component));
      if (releases.empty() || releases[0].a != deployer.epoch_ns())
        throw std::runtime_error("no release at the epoch");
      instants.push_back(releases[0].b);
    }
    spreads.push_back(spread(instants));
  }
  bench::JsonLine().add("spreads_ns", spreads).print();
}

/// One deployment of bare threads: all are ready before there is an epoch; then two periods. Their caches are as warm as
/// those of components.
std::int64_t bare_spread(const Settings& settings) {
  std::latch ready(settings.threads);
  std::atomic<std::uint32_t> published{0};  // release/acquire: publishes the epoch
  time_ns_t epoch_ns = 0;
  std::vector<time_ns_t> instants(static_cast<std::size_t>(settings.threads));
  {
    std::vector<std::unique_ptr<bench::RealtimeThread>> threads;
    for (std::int64_t i = 0; i < settings.threads; ++i) {
      time_ns_t& instant = instants[static_cast<std::size_t>(i)];
      threads.push_back(std::make_unique<bench::RealtimeThread>(settings.priority, settings.cpu_of(i), [&] {
        ready.count_down();
        while (published.load(std::memory_order_acquire) == 0)
          mauve::futex_wait_until(published, 0, mauve::kForever);
        bench::sleep_until(epoch_ns - kWarmUp);
        __builtin_prefetch(&instant, 1);
        bench::sleep_until(epoch_ns);
        instant = mauve::monotonic_now_ns();
        bench::sleep_until(epoch_ns + mauve::us_to_ns(kPeriodUs));
      }));
    }
    ready.wait();
    epoch_ns = mauve::monotonic_now_ns() + mauve::ms_to_ns(20);
    published.store(1, std::memory_order_release);
    mauve::futex_wake_all(published);
  }
  return spread(instants);
}

void measure_bare(const Settings& settings) {
  mauve::RealtimeProcess process;
  process.acquire(settings.priority, false);
  std::vector<std::int64_t> spreads;
  for (std::int64_t i = 0; i < settings.count; ++i) spreads.push_back(bare_spread(settings));
  bench::JsonLine().add("spreads_ns", spreads).print();
}

}  // namespace

int main(int count, char** words) { return bench::run_sides(count, words, measure_component, measure_bare); }
