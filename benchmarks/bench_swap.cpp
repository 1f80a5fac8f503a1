// SPDX-License-Identifier: LGPL-3.0-or-later
// Replacing the core, or the fsm, of a running 1 kHz component that works 100 us, as services and supervisors do it:
// by Deployer::commit. Beside it: handing over between two bare threads.
//   bench_swap [--who component|bare] [--part core|fsm] [--busy-cpus 0] [--count 100] [--priority 80] [--cpu 0]
//              [--work-us 100] [--seed 1]
// With --busy-cpus an ordinary thread never rests on each of these CPUs.
// Prints {"blackout_ns": [...]}; for the component also what its reports and its trace tell of releases missed, and of
// its phase.
#include <array>

#include "mauve_rt/base/seam/futex.hpp"

#include "support/busy.hpp"
#include "support/components.hpp"
#include "support/options.hpp"
#include "support/random_pause.hpp"
#include "support/witness.hpp"

namespace {

using mauve::time_ns_t;

constexpr std::int64_t kPeriodUs = 1000;

struct Settings {
  explicit Settings(const bench::Options& options)
      : part(options.text("part", "core")),
        busy_cpus(static_cast<int>(options.number("busy-cpus", 0))),
        count(options.number("count", 100)),
        priority(options.priority()),
        cpu(options.cpu()),
        work_us(options.number("work-us", 100)),
        seed(options.seed()) {}

  std::string part;
  int busy_cpus;
  std::int64_t count;
  int priority;
  int cpu;
  std::int64_t work_us;
  std::uint64_t seed;
};

mauve::Transaction replacement(const std::string& part) {
  mauve::Transaction transaction;
  if (part == "core")
    transaction.replace_core("worker", std::make_unique<bench::Worker>());
  else
    transaction.replace_fsm("worker", std::make_unique<bench::WorkerFsm>());
  return transaction;
}

void measure_component(const Settings& settings) {
  mauve::Architecture architecture;
  bench::add_worker(architecture, "worker", settings.priority, settings.cpu, kPeriodUs, settings.work_us);
  architecture.configure();
  mauve::Deployer deployer(architecture);
  deployer.deploy();
  const bench::BusyLoops busy(settings.busy_cpus);
  bench::Witness witness(settings.cpu);
  bench::RandomPause pause(settings.seed, {0, 2 * kPeriodUs});  // on every phase
  const mauve::TransactionOptions patient{
      .timeouts = {.commit_ns = mauve::s_to_ns(10), .phase_ns = mauve::s_to_ns(10)}};
  std::vector<std::int64_t> blackouts;
  std::int64_t reported = 0;
  std::vector<mauve::TraceRecord> releases;
  for (std::int64_t i = 0; i < settings.count; ++i) {
    pause();
    const mauve::TransactionReport report = deployer.commit(replacement(settings.part), patient);
    blackouts.push_back(report.blackout_ns);
    reported += report.steps.front().missed_releases;
    bench::append_records(releases, deployer.drain_trace(), mauve::TraceKind::release);
  }
  deployer.shutdown();
  bench::append_records(releases, deployer.drain_trace(), mauve::TraceKind::release);

  const mauve::Grid grid{.reference_ns = deployer.epoch_ns(), .period_ns = mauve::us_to_ns(kPeriodUs)};
  std::int64_t worst_phase = 0;
  for (const mauve::TraceRecord& release : releases) {
    worst_phase = std::max(worst_phase, std::abs(grid.phase_error(release.a)));
  }
  const auto missed = bench::count_missed(bench::nominal_instants(releases), grid.period_ns, witness.end());
  bench::JsonLine()
      .add("blackout_ns", blackouts)
      .add("releases", static_cast<std::int64_t>(releases.size()))
      .add("missed", missed.ours)
      .add("missed_in_stalls", missed.machines)
      .add("reported_missed", reported)
      .add("worst_nominal_phase_ns", worst_phase)
      .print();
}

/// Two threads of which one works on the grid and the other stands by; told to, they change places.
///
/// | member             | written by                       | read by       | order                     |
/// |--------------------|----------------------------------|---------------|---------------------------|
/// | orders_ (futex)    | who gives an order; the thread   | the threads   | release/acquire: hands    |
/// |                    | that takes it resets it          |               | over the members below    |
/// | done_ (futex)      | who took over                    | the requester | release/acquire           |
/// | parked_, armed_,   | the thread that is active        | the other;    | orders_, done_            |
/// | pending_           |                                  | the requester |                           |
class Relay {
 public:
  explicit Relay(const Settings& settings)
      : settings_(settings),
        pending_(mauve::monotonic_now_ns() + mauve::ms_to_ns(20)),
        first_(settings.priority, settings.cpu, [this] { run(0); }),
        second_(settings.priority, settings.cpu, [this] { run(1); }) {
    order(0, kTakeOver);
    await_done();
  }
  ~Relay() {
    order(0, kEnd);
    order(1, kEnd);
  }
  Relay(const Relay&) = delete;
  Relay& operator=(const Relay&) = delete;

  /// From the decision of the one to the readiness of the other.
  std::int64_t hand_over() {
    order(active_, kGiveUp);
    active_ = 1 - active_;
    await_done();
    return armed_ - parked_;
  }

 private:
  static constexpr std::uint32_t kNone = 0, kGiveUp = 1, kTakeOver = 2, kEnd = 3;

  void order(std::size_t whom, std::uint32_t what) {
    orders_[whom].store(what, std::memory_order_release);
    mauve::futex_wake_all(orders_[whom]);
  }
  void await_done() {
    while (done_.load(std::memory_order_acquire) == 0) mauve::futex_wait_until(done_, 0, mauve::kForever);
    done_.store(0, std::memory_order_relaxed);  // relaxed: nobody waits for it to be cleared
  }

  void run(std::size_t self) {
    std::atomic<std::uint32_t>& orders = orders_[self];
    bool active = false;
    for (;;) {
      const std::uint32_t what = orders.load(std::memory_order_acquire);
      if (what == kEnd) return;
      if (what == kGiveUp) {
        parked_ = mauve::monotonic_now_ns();
        orders.store(kNone, std::memory_order_relaxed);  // relaxed: its own word until it gives the order on
        active = false;
        order(1 - self, kTakeOver);
      } else if (what == kTakeOver) {
        orders.store(kNone, std::memory_order_relaxed);  // relaxed: likewise
        active = true;
        armed_ = mauve::monotonic_now_ns();
        done_.store(1, std::memory_order_release);
        mauve::futex_wake_all(done_);
      } else if (mauve::futex_wait_until(orders, kNone, active ? pending_ : mauve::kForever)) {
        continue;
      } else {
        bench::spin_for(mauve::us_to_ns(settings_.work_us));
        pending_ += mauve::us_to_ns(kPeriodUs);
      }
    }
  }

  Settings settings_;
  std::array<std::atomic<std::uint32_t>, 2> orders_{};
  std::atomic<std::uint32_t> done_{0};
  time_ns_t parked_{0};
  time_ns_t armed_{0};
  time_ns_t pending_;
  std::size_t active_{0};  // the requester's
  bench::RealtimeThread first_;
  bench::RealtimeThread second_;
};

void measure_bare(const Settings& settings) {
  mauve::RealtimeProcess process;
  process.acquire(settings.priority, false);
  Relay relay(settings);
  const bench::BusyLoops busy(settings.busy_cpus);
  bench::Witness witness(settings.cpu);                         // as beside the component
  bench::RandomPause pause(settings.seed, {0, 2 * kPeriodUs});  // on every phase
  std::vector<std::int64_t> blackouts;
  for (std::int64_t i = 0; i < settings.count; ++i) {
    pause();
    blackouts.push_back(relay.hand_over());
  }
  bench::JsonLine().add("blackout_ns", blackouts).print();
}

}  // namespace

int main(int count, char** words) { return bench::run_sides(count, words, measure_component, measure_bare); }
