// SPDX-License-Identifier: LGPL-3.0-or-later
// Stopping a component inside a long wait, beside waking a bare thread that sleeps on a futex.
//   bench_stop [--who component|bare] [--count 100] [--priority 80] [--cpu 0] [--wait-ms 5000] [--seed 1]
// Prints {"durations_ns": [...]}: of the call of stop(); of the bare thread from before the wake to its first
// instruction.
#include <chrono>
#include <thread>

#include "mauve_rt/base/seam/futex.hpp"

#include "support/components.hpp"
#include "support/options.hpp"
#include "support/random_pause.hpp"

namespace {

using mauve::time_ns_t;

struct Settings {
  explicit Settings(const bench::Options& options)
      : count(options.number("count", 100)),
        priority(options.priority()),
        cpu(options.cpu()),
        wait_ms(options.number("wait-ms", 5000)),
        seed(options.seed()) {}

  std::int64_t count;
  int priority;
  int cpu;
  std::int64_t wait_ms;
  std::uint64_t seed;
};

/// The sleeper is deep in its wait by then.
constexpr bench::RangeUs kDeepUs{1'000, 10'000};

void measure_component(const Settings& settings) {
  mauve::Architecture architecture;
  mauve::Component& component =
      bench::add_worker(architecture, "worker", settings.priority, settings.cpu, settings.wait_ms * 1000, 0);
  architecture.configure();
  mauve::Deployer deployer(architecture);
  deployer.deploy();
  bench::RandomPause pause(settings.seed, kDeepUs);
  std::vector<std::int64_t> durations;
  for (std::int64_t i = 0; i < settings.count; ++i) {
    const std::uint64_t releases = component.task().statistics().releases;
    if (i > 0) deployer.start("worker", mauve::monotonic_now_ns() + mauve::us_to_ns(500));
    while (component.task().statistics().releases == releases)
      std::this_thread::sleep_for(std::chrono::microseconds(100));
    pause();
    const time_ns_t before = mauve::monotonic_now_ns();
    deployer.stop("worker", mauve::s_to_ns(10));
    durations.push_back(mauve::monotonic_now_ns() - before);
  }
  bench::JsonLine().add("durations_ns", durations).print();
}

void measure_bare(const Settings& settings) {
  mauve::RealtimeProcess process;
  process.acquire(settings.priority, false);
  std::atomic<std::uint32_t> word{0};  // release/acquire: says go on; the sleeper answers with 0
  std::atomic<time_ns_t> woken_ns{0};  // release/acquire: 0 until the sleeper ran
  std::atomic<bool> ending{false};     // relaxed: word orders it
  std::vector<std::int64_t> durations;
  {
    const bench::RealtimeThread sleeper(settings.priority, settings.cpu, [&] {
      for (;;) {
        while (word.load(std::memory_order_acquire) == 0) {
          mauve::futex_wait_until(word, 0, mauve::monotonic_now_ns() + mauve::ms_to_ns(settings.wait_ms));
        }
        const time_ns_t now = mauve::monotonic_now_ns();
        if (ending.load(std::memory_order_relaxed)) return;
        word.store(0, std::memory_order_relaxed);  // before woken_ns, whose release orders it
        woken_ns.store(now, std::memory_order_release);
      }
    });
    bench::RandomPause pause(settings.seed, kDeepUs);
    const auto wake = [&] {
      word.store(1, std::memory_order_release);
      mauve::futex_wake_all(word);
    };
    for (std::int64_t i = 0; i < settings.count; ++i) {
      pause();
      const time_ns_t before = mauve::monotonic_now_ns();
      wake();
      while (woken_ns.load(std::memory_order_acquire) == 0)
        std::this_thread::sleep_for(std::chrono::microseconds(100));
      durations.push_back(woken_ns.exchange(0, std::memory_order_acquire) - before);
    }
    ending.store(true, std::memory_order_relaxed);
    wake();
  }
  bench::JsonLine().add("durations_ns", durations).print();
}

}  // namespace

int main(int count, char** words) { return bench::run_sides(count, words, measure_component, measure_bare); }
