// SPDX-License-Identifier: LGPL-3.0-or-later
// How fast virtual time passes with many components.
//   bench_simulation [--components 1000] [--period-us 100000] [--virtual-s 200] [--spread 0]
// --spread 1: every component has an offset of its own, else all are due at one instant.
// Prints {"virtual_ns": the time that passed, "real_ns": in so long, "releases": of all components}.
#include "mauve_rt/deploy/simulation.hpp"

#include "support/components.hpp"
#include "support/options.hpp"

namespace {

void measure(const bench::Options& options) {
  const std::int64_t components = options.number("components", 1000);
  const std::int64_t period_us = options.number("period-us", 100'000);
  const bool is_spread = options.number("spread", 0) != 0;
  mauve::Architecture architecture;
  for (std::int64_t i = 0; i < components; ++i) {
    mauve::Component& worker =
        bench::add_worker(architecture, "worker_" + std::to_string(i), 50, 0, period_us, 0);
    mauve::TaskSettings settings = worker.task().settings();
    settings.offset_ns = is_spread ? mauve::us_to_ns(period_us * i / components) : 0;
    worker.set_settings(settings);
  }
  architecture.configure();
  mauve::Simulation simulation({.trace = false});
  simulation.add(architecture);
  simulation.deploy();
  simulation.run_until(simulation.epoch_ns() + mauve::us_to_ns(2 * period_us));  // all is in the caches
  const mauve::time_ns_t virtual_ns = mauve::s_to_ns(options.number("virtual-s", 200));
  const mauve::time_ns_t began = mauve::monotonic_now_ns();
  simulation.run_until(simulation.now_ns() + virtual_ns);
  const mauve::time_ns_t real_ns = mauve::monotonic_now_ns() - began;
  std::int64_t releases = 0;
  for (const auto& component : architecture.components())
    releases += static_cast<std::int64_t>(component->task().statistics().releases.load());
  bench::JsonLine().add("virtual_ns", virtual_ns).add("real_ns", real_ns).add("releases", releases).print();
}

}  // namespace

int main(int count, char** words) { return bench::run_program(count, words, measure); }
