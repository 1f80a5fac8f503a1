// SPDX-License-Identifier: LGPL-3.0-or-later
// Many components: how long they take to start, what they cost while they run, what memory they lock.
//   bench_scale [--components 64] [--priority 80] [--period-us 100000] [--duration-ms 500]
// Prints {"start_ns": of the call of deploy(), after which all threads are ready and the epoch is known, "lead_ns": from
// its return to that epoch, "first_ns": from the call to the last of the first releases, "cpu_ns": of
// the process while they ran, "ran_ns": for so long, "locked_bytes": that all the components added to the locked
// pages, "reserved_bytes": to the address space of locked mappings}.
#include <fstream>
#include <sstream>
#include <thread>

#include "support/components.hpp"
#include "support/options.hpp"

namespace {

using mauve::time_ns_t;

/// A figure of a file of /proc, there in KiB.
std::int64_t proc_bytes(const char* path, const std::string& name) {
  std::ifstream file(path);
  std::string line;
  while (std::getline(file, line)) {
    if (!line.starts_with(name + ":")) continue;
    std::istringstream words(line.substr(name.size() + 1));
    std::int64_t kib = 0;
    words >> kib;
    return kib * 1024;
  }
  throw std::runtime_error(std::string(path) + " has no " + name);
}

struct Memory {
  std::int64_t locked_bytes{proc_bytes("/proc/self/smaps_rollup", "Locked")};
  std::int64_t reserved_bytes{proc_bytes("/proc/self/status", "VmLck")};
};

time_ns_t process_cpu_ns() {
  timespec used{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &used);
  return mauve::s_to_ns(used.tv_sec) + used.tv_nsec;
}

void measure(const bench::Options& options) {
  const std::int64_t components = options.number("components", 64);
  const auto cpus = static_cast<std::int64_t>(std::thread::hardware_concurrency());
  mauve::Architecture architecture;
  mauve::Deployer deployer(architecture);
  deployer.prepare_process();  // before all else: what comes later is locked as it comes
  const Memory before;

  for (std::int64_t i = 0; i < components; ++i) {
    bench::add_worker(architecture, "worker_" + std::to_string(i), options.priority(),
                      static_cast<int>(i % cpus), options.number("period-us", 100'000), 0);
  }
  architecture.configure();
  const time_ns_t called = mauve::monotonic_now_ns();
  deployer.deploy();
  const time_ns_t returned = mauve::monotonic_now_ns();
  const time_ns_t began = deployer.epoch_ns() + mauve::ms_to_ns(50);  // past the first releases
  bench::sleep_until(began);
  const time_ns_t cpu_before = process_cpu_ns();
  bench::sleep_until(began + mauve::ms_to_ns(options.number("duration-ms", 500)));
  const time_ns_t cpu_ns = process_cpu_ns() - cpu_before;
  const time_ns_t ran_ns = mauve::monotonic_now_ns() - began;
  const Memory after;
  deployer.shutdown();

  const mauve::TraceDrain drain = deployer.drain_trace();
  time_ns_t last_first = 0;
  for (std::int64_t i = 0; i < components; ++i) {
    std::vector<mauve::TraceRecord> releases;
    bench::append_records(releases, drain, mauve::TraceKind::release, static_cast<std::uint16_t>(i));
    if (releases.empty()) throw std::runtime_error("a component was never released");
    last_first = std::max(last_first, releases.front().b);
  }
  bench::JsonLine()
      .add("start_ns", returned - called)
      .add("lead_ns", deployer.epoch_ns() - returned)
      .add("first_ns", last_first - called)
      .add("cpu_ns", cpu_ns)
      .add("ran_ns", ran_ns)
      .add("locked_bytes", after.locked_bytes - before.locked_bytes)
      .add("reserved_bytes", after.reserved_bytes - before.reserved_bytes)
      .print();
}

}  // namespace

int main(int count, char** words) { return bench::run_program(count, words, measure); }
