// SPDX-License-Identifier: LGPL-3.0-or-later
// Stopping a component in the midst of an execution, 20 ms before its end, beside a bare thread that tells by
// futex that its work is done.
//   bench_stop_busy [--who component|bare] [--count 20] [--priority 80] [--cpu 0] [--left-ms 20]
//                   [--wait-ms 5000]
// Prints {"late_ns": [...], "left_ns": [...]}: from the end of the work to the return of stop() (of the bare
// thread: to the first instruction of who waited for it); and what was left of the work when it was asked.
#include <thread>

#include "mauve_rt/base/seam/futex.hpp"

#include "support/components.hpp"
#include "support/options.hpp"

namespace {

using mauve::time_ns_t;

constexpr time_ns_t kBefore = mauve::ms_to_ns(10);  // of the work, until it is asked to stop

struct Settings {
  explicit Settings(const bench::Options& options)
      : count(options.number("count", 20)),
        priority(options.priority()),
        cpu(options.cpu()),
        left_ns(mauve::ms_to_ns(options.number("left-ms", 20))),
        wait_ms(options.number("wait-ms", 5000)) {}

  std::int64_t count;
  int priority;
  int cpu;
  time_ns_t left_ns;
  std::int64_t wait_ms;
};

/// When the work under way ends; release/acquire, 0: none is under way.
using EndOfWork = std::atomic<time_ns_t>;

/// Works until `left_ns` after the asker is due.
time_ns_t work(EndOfWork& end_of_work, time_ns_t left_ns) {
  const time_ns_t end = mauve::monotonic_now_ns() + kBefore + left_ns;
  end_of_work.store(end, std::memory_order_release);
  bench::spin_until(end);
  return end;
}

time_ns_t await_work(const EndOfWork& end_of_work) {
  for (;;) {
    if (const time_ns_t end = end_of_work.load(std::memory_order_acquire); end != 0) return end;
    std::this_thread::sleep_for(std::chrono::microseconds(200));
  }
}

struct LongWorker : bench::Worker {
  LongWorker(EndOfWork& end_of_work, time_ns_t left) : end(end_of_work), left_ns(left) {}
  void work() override { ::work(end, left_ns); }

  EndOfWork& end;
  time_ns_t left_ns;
};

void measure_component(const Settings& settings) {
  EndOfWork end_of_work{0};
  mauve::Architecture architecture;
  mauve::Component& component = architecture.add_component(
      "worker", std::make_unique<bench::WorkerShell>(),
      std::make_unique<LongWorker>(end_of_work, settings.left_ns), std::make_unique<bench::WorkerFsm>(),
      mauve::TaskSettings{.priority = settings.priority, .cpus = {settings.cpu}});
  component.set_property("period_us", settings.wait_ms * 1000);
  architecture.configure();
  mauve::Deployer deployer(architecture);
  deployer.deploy();
  std::vector<std::int64_t> late;
  std::vector<std::int64_t> left;
  for (std::int64_t i = 0; i < settings.count; ++i) {
    if (i > 0) deployer.start("worker", mauve::monotonic_now_ns() + mauve::us_to_ns(500));
    const time_ns_t end = await_work(end_of_work);
    bench::sleep_until(end - settings.left_ns);
    left.push_back(end - mauve::monotonic_now_ns());
    deployer.stop("worker", mauve::s_to_ns(10));
    late.push_back(mauve::monotonic_now_ns() - end);
    end_of_work.store(0, std::memory_order_relaxed);  // relaxed: the worker is parked
  }
  bench::JsonLine().add("late_ns", late).add("left_ns", left).print();
}

void measure_bare(const Settings& settings) {
  mauve::RealtimeProcess process;
  process.acquire(settings.priority, false);
  std::vector<std::int64_t> late;
  std::vector<std::int64_t> left;
  for (std::int64_t i = 0; i < settings.count; ++i) {
    EndOfWork end_of_work{0};
    std::atomic<std::uint32_t> done{0};  // release/acquire: the work has ended
    const bench::RealtimeThread worker(settings.priority, settings.cpu, [&] {
      work(end_of_work, settings.left_ns);
      done.store(1, std::memory_order_release);
      mauve::futex_wake_all(done);
    });
    const time_ns_t end = await_work(end_of_work);
    bench::sleep_until(end - settings.left_ns);
    left.push_back(end - mauve::monotonic_now_ns());
    while (done.load(std::memory_order_acquire) == 0) mauve::futex_wait_until(done, 0, mauve::kForever);
    late.push_back(mauve::monotonic_now_ns() - end);
  }
  bench::JsonLine().add("late_ns", late).add("left_ns", left).print();
}

}  // namespace

int main(int count, char** words) { return bench::run_sides(count, words, measure_component, measure_bare); }
