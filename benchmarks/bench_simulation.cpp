// SPDX-License-Identifier: LGPL-3.0-or-later
// Many components in virtual time: how fast that time passes, and how long one transaction over all components takes.
//   bench_simulation [--measure time|transaction] [--components 1000] [--period-us 100000] [--virtual-s 200] [--spread 0]
//                    [--trace 0]
// --spread 1: every component has an offset of its own, else all are due at one instant.
// Prints for `time` {"virtual_ns": the time that passed, "real_ns": in so long, "releases": of all components};
// for `transaction`, which gives each component a new core, {"real_ns": of the call of commit(), from the preparation to
// the report}. Fails where a component does not run its new core, or missed a release.
#include <memory>
#include <stdexcept>
#include <vector>

#include "mauve_rt/deploy/simulation.hpp"

#include "support/components.hpp"
#include "support/options.hpp"

namespace {

using mauve::time_ns_t;

/// Counts its releases.
struct CountingWorker : bench::Worker {
  void work() override { ++releases; }
  std::int64_t releases{0};
};

std::string name_of(std::int64_t number) { return "worker_" + std::to_string(number); }

/// Workers in a simulation, deployed and past their first releases: all is in the caches.
class Workers {
 public:
  explicit Workers(const bench::Options& options)
      : count_(options.number("components", 1000)),
        period_us_(options.number("period-us", 100'000)),
        simulation_({.trace = options.number("trace", 0) != 0}) {
    const bool is_spread = options.number("spread", 0) != 0;
    for (std::int64_t i = 0; i < count_; ++i) {
      mauve::Component& worker = bench::add_worker(architecture_, name_of(i), 50, 0, period_us_, 0);
      mauve::TaskSettings settings = worker.task().settings();
      settings.offset_ns = is_spread ? mauve::us_to_ns(period_us_ * i / count_) : 0;
      worker.set_settings(settings);
    }
    architecture_.configure();
    host_ = &simulation_.add(architecture_);
    simulation_.deploy();
    simulation_.run_until(simulation_.epoch_ns() + mauve::us_to_ns(2 * period_us_));
  }

  void measure_time(time_ns_t virtual_ns) {
    const time_ns_t began = mauve::monotonic_now_ns();
    simulation_.run_until(simulation_.now_ns() + virtual_ns);
    const time_ns_t real_ns = mauve::monotonic_now_ns() - began;
    bench::JsonLine()
        .add("virtual_ns", virtual_ns)
        .add("real_ns", real_ns)
        .add("releases", releases())
        .print();
  }

  void measure_transaction() {
    std::vector<const CountingWorker*> cores;
    mauve::Transaction transaction;
    for (std::int64_t i = 0; i < count_; ++i) {
      component(i).core_as<bench::Worker>().state = i;
      auto core = std::make_unique<CountingWorker>();
      cores.push_back(core.get());
      transaction.replace_core(name_of(i), std::move(core));
    }
    const std::int64_t releases_before = releases();
    const time_ns_t began = mauve::monotonic_now_ns();
    const std::size_t steps = host_->commit(std::move(transaction)).steps.size();
    const time_ns_t real_ns = mauve::monotonic_now_ns() - began;
    if (steps != cores.size()) throw std::runtime_error("the report does not have every step");
    simulation_.run_until(simulation_.now_ns() + mauve::us_to_ns(period_us_));
    if (releases() != releases_before + count_) throw std::runtime_error("components missed releases");
    for (std::int64_t i = 0; i < count_; ++i) require_new_core(i, *cores[static_cast<std::size_t>(i)]);
    bench::JsonLine().add("real_ns", real_ns).print();
  }

 private:
  mauve::Component& component(std::int64_t number) { return architecture_.component(name_of(number)); }

  std::int64_t releases() const {
    std::int64_t all = 0;
    for (const auto& component : architecture_.components())
      all += static_cast<std::int64_t>(component->task().statistics().releases.load());
    return all;
  }

  /// The component runs the core, which has the state of the core before.
  void require_new_core(std::int64_t number, const CountingWorker& core) {
    if (&component(number).core_as<bench::Worker>() != &core || core.state != number || core.releases != 1)
      throw std::runtime_error(name_of(number) + " does not run its new core");
  }

  std::int64_t count_;
  std::int64_t period_us_;
  mauve::Architecture architecture_;
  mauve::Simulation simulation_;
  mauve::SimulatedHost* host_{nullptr};
};

void measure(const bench::Options& options) {
  const std::string what = options.text("measure", "time");
  if (what != "time" && what != "transaction")
    throw std::invalid_argument("--measure: expected time or transaction, found " + what);
  Workers workers(options);
  if (what == "time")
    workers.measure_time(mauve::s_to_ns(options.number("virtual-s", 200)));
  else
    workers.measure_transaction();
}

}  // namespace

int main(int count, char** words) { return bench::run_program(count, words, measure); }
