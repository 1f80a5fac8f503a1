// SPDX-License-Identifier: LGPL-3.0-or-later
// Transactions over five running 1 kHz components: three get another core, two are wired to another resource;
// three more on the same CPUs are not touched.
//   bench_transaction [--count 100] [--priority 80] [--cpus 2] [--work-us 20] [--seed 1]
// After each a transaction that replaces one core alone.
// Prints {"blackout_ns": [...]}, of each transaction the longest of its components', {"blackout_of_one_ns": [...]} of those
// over one component, and of the releases in the
// trace how many "touched_missed" and "untouched_missed" (and of these two "..._in_stalls" of the machine),
// of "touched_releases" and "untouched_releases".
#include <memory>

#include "support/components.hpp"
#include "support/options.hpp"
#include "support/random_pause.hpp"
#include "support/values.hpp"
#include "support/witness.hpp"

namespace {

constexpr std::int64_t kPeriodUs = 1000;
constexpr int kRecored = 3, kTouched = 5, kComponents = 8;

struct WiredShell : bench::WorkerShell {
  mauve::ReadPort<bench::Small>& input = read_port<bench::Small>("input");
};

struct WiredWorker : bench::Worker {
  void work() override {
    static_cast<WiredShell&>(shell()).input.read();
    bench::Worker::work();
  }
};

std::string name_of(int number) { return "worker_" + std::to_string(number); }

/// The next transaction: back and forth between the two resources.
mauve::Transaction make_transaction(std::int64_t number) {
  const std::string resource = number % 2 == 0 ? "second" : "first";
  mauve::Transaction transaction;
  for (int i = 0; i < kRecored; ++i)
    transaction.replace_core(name_of(i), std::unique_ptr<mauve::CoreBase>(std::make_unique<WiredWorker>()));
  for (int i = kRecored; i < kTouched; ++i)
    transaction.disconnect(name_of(i), "input").connect(name_of(i), "input", resource, "read");
  return transaction;
}

void measure(const bench::Options& options) {
  const auto cpus = static_cast<int>(options.number("cpus", 2));
  mauve::Architecture architecture;
  for (const char* name : {"first", "second"})
    architecture.add_resource<mauve::SharedData<bench::Small>>(name);
  for (int i = 0; i < kComponents; ++i) {
    mauve::Component& component = architecture.add_component<WiredShell, WiredWorker, bench::WorkerFsm>(
        name_of(i), mauve::TaskSettings{.priority = options.priority(), .cpus = {i % cpus}});
    component.set_property("period_us", kPeriodUs);
    component.set_property("work_us", options.number("work-us", 20));
    architecture.connect(name_of(i), "input", "first", "read");
  }
  architecture.configure();
  mauve::Deployer deployer(architecture);
  deployer.deploy();
  std::vector<std::unique_ptr<bench::Witness>> witnesses;
  for (int cpu = 0; cpu < cpus; ++cpu) witnesses.push_back(std::make_unique<bench::Witness>(cpu));
  bench::RandomPause pause(options.seed(), {0, 2 * kPeriodUs});

  std::vector<std::int64_t> blackouts;
  std::vector<std::int64_t> of_one;
  std::vector<std::vector<mauve::TraceRecord>> releases(kComponents);
  const auto collect = [&] {
    const mauve::TraceDrain drain = deployer.drain_trace();
    for (std::uint16_t i = 0; i < kComponents; ++i)
      bench::append_records(releases[i], drain, mauve::TraceKind::release, i);
  };
  const mauve::TransactionOptions patient{.timeouts = {.commit_ns = mauve::s_to_ns(10), .phase_ns = 0}};
  const std::int64_t count = options.number("count", 100);
  for (std::int64_t i = 0; i < count; ++i) {
    pause();
    blackouts.push_back(deployer.commit(make_transaction(i), patient).blackout_ns);
    collect();
    pause();
    mauve::Transaction one;
    one.replace_core(name_of(0), std::unique_ptr<mauve::CoreBase>(std::make_unique<WiredWorker>()));
    of_one.push_back(deployer.commit(std::move(one), patient).blackout_ns);
    collect();
  }
  deployer.shutdown();
  collect();

  bench::Missed touched;
  bench::Missed untouched;
  std::int64_t touched_releases = 0;
  std::int64_t untouched_releases = 0;
  for (int i = 0; i < kComponents; ++i) {
    const auto& found = releases[static_cast<std::size_t>(i)];
    const auto& stalls = witnesses[static_cast<std::size_t>(i % cpus)]->end();
    const bench::Missed missed =
        bench::count_missed(bench::nominal_instants(found), mauve::us_to_ns(kPeriodUs), stalls);
    (i < kTouched ? touched : untouched) += missed;
    (i < kTouched ? touched_releases : untouched_releases) += static_cast<std::int64_t>(found.size());
  }
  bench::JsonLine()
      .add("blackout_ns", blackouts)
      .add("blackout_of_one_ns", of_one)
      .add("touched_missed", touched.ours)
      .add("touched_missed_in_stalls", touched.machines)
      .add("touched_releases", touched_releases)
      .add("untouched_missed", untouched.ours)
      .add("untouched_missed_in_stalls", untouched.machines)
      .add("untouched_releases", untouched_releases)
      .print();
}

}  // namespace

int main(int count, char** words) { return bench::run_program(count, words, measure); }
