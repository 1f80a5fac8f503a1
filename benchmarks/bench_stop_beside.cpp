// SPDX-License-Identifier: LGPL-3.0-or-later
// Stopping a 1 kHz component: alone, while a transaction over it and a component in a long state waits, and while a new
// core for it takes long to prepare.
//   bench_stop_beside [--beside nothing|commit|preparation] [--count 20] [--priority 80] [--cpu 0] [--state-ms 100]
// Prints {"durations_ns": [...]}, of the call of stop().
#include <thread>

#include "support/long_worker.hpp"
#include "support/options.hpp"

namespace {

using mauve::time_ns_t;

/// Takes its time to be configured.
struct SlowToConfigure : bench::Worker {
  explicit SlowToConfigure(time_ns_t duration) : duration_ns(duration) {}
  bool configure_hook() override {
    std::this_thread::sleep_for(std::chrono::nanoseconds(duration_ns));
    return true;
  }
  time_ns_t duration_ns;
};

class StopBeside {
 public:
  explicit StopBeside(const bench::Options& options)
      : beside_(options.text("beside", "nothing")), state_ms_(options.number("state-ms", 100)) {
    bench::add_worker(architecture_, "stopped", options.priority(), options.cpu(), 1000, 0);
    bench::add_long_worker(architecture_, "slow", options.priority() - 10, options.cpu(), end_, state_ms_,
                           state_ms_ + 50);
    architecture_.configure();
    deployer_.deploy();
    bench::sleep_until(deployer_.epoch_ns() + mauve::ms_to_ns(5));
  }

  std::int64_t stop_once() {
    bench::await_state(end_, mauve::ms_to_ns(state_ms_ * 3 / 4));
    std::thread requester;
    if (beside_ != "nothing") requester = std::thread([this] { change(); });
    std::this_thread::sleep_for(std::chrono::milliseconds(10));  // the change waits by then
    const time_ns_t before = mauve::monotonic_now_ns();
    deployer_.stop("stopped", mauve::s_to_ns(10));
    const time_ns_t took = mauve::monotonic_now_ns() - before;
    if (requester.joinable()) requester.join();
    deployer_.start("stopped");
    return took;
  }

 private:
  void change() {
    mauve::Transaction transaction;
    if (beside_ == "commit") {
      transaction.replace_core("stopped", std::make_unique<bench::Worker>());
      transaction.replace_core("slow", std::make_unique<bench::LongWorker>(end_, mauve::ms_to_ns(state_ms_)));
    } else {
      transaction.replace_core("stopped", std::make_unique<SlowToConfigure>(mauve::ms_to_ns(state_ms_)));
    }
    try {
      deployer_.commit(std::move(transaction),
                       {.timeouts = {.commit_ns = mauve::s_to_ns(10), .phase_ns = 0}});
    } catch (const mauve::Error&) {  // the stop withdrew it
    }
  }

  std::string beside_;
  std::int64_t state_ms_;
  bench::EndOfState end_{0};
  mauve::Architecture architecture_;
  mauve::Deployer deployer_{architecture_};
};

void measure(const bench::Options& options) {
  StopBeside beside(options);
  std::vector<std::int64_t> durations;
  const std::int64_t count = options.number("count", 20);
  for (std::int64_t i = 0; i < count; ++i) durations.push_back(beside.stop_once());
  bench::JsonLine().add("durations_ns", durations).print();
}

}  // namespace

int main(int count, char** words) { return bench::run_program(count, words, measure); }
