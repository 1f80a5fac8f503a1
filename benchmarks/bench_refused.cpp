// SPDX-License-Identifier: LGPL-3.0-or-later
// Transactions over a 1 kHz component and one that is in a long state: they run into their commit timeout, and must
// cost the 1 kHz one nothing.
//   bench_refused [--count 10] [--priority 80] [--cpu 0] [--state-ms 150] [--timeout-ms 60]
// Prints {"refused": transactions that were, "releases": of the 1 kHz component, "missed": of them,
// "missed_in_stalls": of the machine}.
#include "support/long_worker.hpp"
#include "support/options.hpp"
#include "support/witness.hpp"

namespace {

constexpr std::int64_t kPeriodUs = 1000;

void measure(const bench::Options& options) {
  const std::int64_t state_ms = options.number("state-ms", 150);
  const mauve::time_ns_t timeout_ns = mauve::ms_to_ns(options.number("timeout-ms", 60));
  bench::EndOfState end{0};
  mauve::Architecture architecture;
  bench::add_worker(architecture, "fast", options.priority(), options.cpu(), kPeriodUs, 100);
  bench::add_long_worker(architecture, "slow", options.priority() - 10, options.cpu(), end, state_ms,
                         state_ms + 50);
  architecture.configure();
  mauve::Deployer deployer(architecture);
  deployer.deploy();
  bench::Witness witness(options.cpu());
  std::vector<mauve::TraceRecord> releases;
  const auto collect = [&] {
    bench::append_records(releases, deployer.drain_trace(), mauve::TraceKind::release);
  };
  std::int64_t refused = 0;
  const std::int64_t count = options.number("count", 10);
  for (std::int64_t i = 0; i < count; ++i) {
    bench::await_state(end, timeout_ns + mauve::ms_to_ns(20));
    mauve::Transaction transaction;
    transaction.replace_core("fast", std::make_unique<bench::Worker>());
    transaction.replace_core("slow", std::make_unique<bench::LongWorker>(end, mauve::ms_to_ns(state_ms)));
    try {
      deployer.commit(std::move(transaction), {.timeouts = {.commit_ns = timeout_ns, .phase_ns = 0}});
    } catch (const mauve::Error& error) {
      if (error.code() != mauve::ErrorCode::timeout) throw;
      ++refused;
    }
    collect();
  }
  deployer.shutdown();
  collect();
  const bench::Missed missed =
      bench::count_missed(bench::nominal_instants(releases), mauve::us_to_ns(kPeriodUs), witness.end());
  bench::JsonLine()
      .add("refused", refused)
      .add("releases", static_cast<std::int64_t>(releases.size()))
      .add("missed", missed.ours)
      .add("missed_in_stalls", missed.machines)
      .print();
}

}  // namespace

int main(int count, char** words) { return bench::run_program(count, words, measure); }
