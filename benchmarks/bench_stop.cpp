// SPDX-License-Identifier: LGPL-3.0-or-later
// Stopping a component inside a long wait, beside waking a bare thread that sleeps on a futex.
//   bench_stop [--who component|bare] [--count 100] [--priority 80] [--cpu 0] [--wait-ms 5000] [--seed 1]
// Prints {"durations_ns": [...]}: of the call of stop(); of the bare thread from before the wake to its first
// instruction.
#include <chrono>
#include <random>
#include <thread>

#include "mauve_rt/futex.hpp"

#include "support/components.hpp"
#include "support/options.hpp"

namespace {

using mauve::time_ns_t;

struct Settings {
  std::int64_t count;
  int priority;
  int cpu;
  std::int64_t wait_ms;
  std::uint64_t seed;
};

/// Sleeps 1 to 10 ms: the sleeper is deep in its wait by then.
class RandomPause {
 public:
  explicit RandomPause(std::uint64_t seed) : random_(seed) {}
  void operator()() { std::this_thread::sleep_for(std::chrono::microseconds(pause_us_(random_))); }

 private:
  std::mt19937_64 random_;
  std::uniform_int_distribution<std::int64_t> pause_us_{1'000, 10'000};
};

void measure_component(const Settings& settings) {
  mauve::Architecture architecture;
  mauve::Component& component =
      bench::add_worker(architecture, "worker", settings.priority, settings.cpu, settings.wait_ms * 1000, 0);
  architecture.configure();
  mauve::Deployer deployer(architecture);
  deployer.deploy();
  RandomPause pause(settings.seed);
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
    RandomPause pause(settings.seed);
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

void measure(bench::Options& options) {
  const Settings settings{.count = options.number("count", 100),
                          .priority = static_cast<int>(options.number("priority", 80)),
                          .cpu = static_cast<int>(options.number("cpu", 0)),
                          .wait_ms = options.number("wait-ms", 5000),
                          .seed = static_cast<std::uint64_t>(options.number("seed", 1))};
  if (options.who() == bench::Who::component) {
    measure_component(settings);
  } else {
    measure_bare(settings);
  }
}

}  // namespace

int main(int count, char** words) { return bench::run_program(count, words, measure); }
