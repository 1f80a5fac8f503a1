// SPDX-License-Identifier: LGPL-3.0-or-later
// The phase of a component after stops and starts at random instants, mid-execution too.
//   bench_restart [--count 100] [--priority 80] [--cpu 0] [--work-us 100] [--seed 1]
// Prints {"nominal_phase_ns": [...], "actual_phase_ns": [...]}: of the first release after each start,
// against the grid that deployment recorded.
#include "support/components.hpp"
#include "support/options.hpp"
#include "support/random_pause.hpp"

namespace {

constexpr std::int64_t kPeriodUs = 1000;

void measure(const bench::Options& options) {
  mauve::Architecture architecture;
  bench::add_worker(architecture, "worker", options.priority(), options.cpu(), kPeriodUs,
                    options.number("work-us", 100));
  architecture.configure();
  mauve::Deployer deployer(architecture);
  bench::RandomPause pause(options.seed(), {0, 3 * kPeriodUs});

  std::vector<mauve::TraceRecord> records;
  deployer.deploy();
  bench::sleep_until(deployer.epoch_ns() + mauve::us_to_ns(kPeriodUs));
  const std::int64_t restarts = options.number("count", 100);
  for (std::int64_t i = 0; i < restarts; ++i) {
    pause();
    deployer.stop("worker", mauve::s_to_ns(10));
    pause();
    deployer.start("worker");
    const mauve::TraceDrain drain = deployer.drain_trace();
    records.insert(records.end(), drain.records.begin(), drain.records.end());
  }
  bench::sleep_until(mauve::monotonic_now_ns() + mauve::us_to_ns(3 * kPeriodUs));
  deployer.shutdown();
  const mauve::TraceDrain drain = deployer.drain_trace();
  records.insert(records.end(), drain.records.begin(), drain.records.end());

  // The reader's own arithmetic, from what the first deployment record says.
  std::vector<std::int64_t> nominal;
  std::vector<std::int64_t> actual;
  mauve::Grid grid;
  bool starting = false;
  for (const mauve::TraceRecord& record : records) {
    const auto kind = static_cast<mauve::TraceKind>(record.kind);
    if (kind == mauve::TraceKind::deployment && grid.period_ns == 0) {
      grid = {.reference_ns = record.a + record.b, .period_ns = record.c};
    } else if (kind == mauve::TraceKind::start) {
      starting = true;
    } else if (kind == mauve::TraceKind::release && starting) {
      starting = false;
      nominal.push_back(grid.phase_error(record.a));
      actual.push_back(record.b - record.a + nominal.back());
    }
  }
  bench::JsonLine().add("nominal_phase_ns", nominal).add("actual_phase_ns", actual).print();
}

}  // namespace

int main(int count, char** words) { return bench::run_program(count, words, measure); }
