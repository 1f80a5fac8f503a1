// SPDX-License-Identifier: LGPL-3.0-or-later
// How often the threads of a deployed architecture wake up while all its components wait and none declares a bound.
//   bench_idle [--components 8] [--priority 80] [--duration-ms 1000]
// Prints {"wakeups": of all threads but the main one, "duration_ns": in so long}.
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "support/components.hpp"
#include "support/options.hpp"

namespace {

/// Switches of all threads but the calling one, from sleep and for others.
std::int64_t switches() {
  std::int64_t sum = 0;
  for (const auto& thread : std::filesystem::directory_iterator("/proc/self/task")) {
    if (thread.path().filename() == std::to_string(gettid())) continue;
    std::ifstream file(thread.path() / "status");
    std::string line;
    while (std::getline(file, line)) {
      if (line.starts_with("voluntary_ctxt_switches:")) sum += std::stoll(line.substr(line.find(':') + 1));
    }
  }
  return sum;
}

void measure(const bench::Options& options) {
  mauve::Architecture architecture;
  const std::int64_t components = options.number("components", 8);
  constexpr std::int64_t kPeriodUs = 60'000'000;  // nobody is released while it is measured
  for (std::int64_t i = 0; i < components; ++i)
    bench::add_worker(architecture, "worker_" + std::to_string(i), options.priority(), 0, kPeriodUs, 0);
  architecture.configure();
  mauve::Deployer deployer(architecture);
  deployer.deploy();
  bench::sleep_until(deployer.epoch_ns() + mauve::ms_to_ns(100));
  const mauve::time_ns_t began = mauve::monotonic_now_ns();
  const std::int64_t before = switches();
  bench::sleep_until(began + mauve::ms_to_ns(options.number("duration-ms", 1000)));
  const std::int64_t wakeups = switches() - before;
  bench::JsonLine().add("wakeups", wakeups).add("duration_ns", mauve::monotonic_now_ns() - began).print();
}

}  // namespace

int main(int count, char** words) { return bench::run_program(count, words, measure); }
