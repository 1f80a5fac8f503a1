// SPDX-License-Identifier: LGPL-3.0-or-later
// Page faults of a running component whose new core owns memory that it uses from its first release on.
//   bench_prefault [--count 10] [--priority 80] [--cpu 0] [--bytes 8388608]
// Prints {"faults": [...]}: on the component's thread, from each commit to some releases after it.
#include <thread>

#include "support/components.hpp"
#include "support/options.hpp"

namespace {

/// Allocates when it is configured, and reads and writes all of it at each release.
struct BigWorker : bench::Worker {
  explicit BigWorker(std::size_t size) : bytes(size) {}
  bool configure_hook() override {
    memory.reset(new std::byte[bytes]);  // not make_unique, which would touch it
    return true;
  }
  void work() override {
    constexpr std::size_t kPage = 4096;
    for (std::size_t at = 0; at < bytes; at += kPage) memory[at] = static_cast<std::byte>(at);
  }

  std::size_t bytes;
  std::unique_ptr<std::byte[]> memory{};
};

void measure(const bench::Options& options) {
  mauve::Architecture architecture;
  mauve::Component& component =
      bench::add_worker(architecture, "worker", options.priority(), options.cpu(), 10'000, 0);
  architecture.configure();
  mauve::Deployer deployer(architecture);
  deployer.deploy();
  const auto bytes = static_cast<std::size_t>(options.number("bytes", std::int64_t{8} * 1024 * 1024));
  const auto run_on = [&] {
    const std::uint64_t until = component.task().statistics().releases + 3;
    while (component.task().statistics().releases < until)
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
  };
  run_on();
  std::vector<std::int64_t> faults;
  const std::int64_t count = options.number("count", 10);
  for (std::int64_t i = 0; i < count; ++i) {
    const std::uint64_t before = component.task().counters().page_faults();
    mauve::Transaction transaction;
    transaction.replace_core("worker", std::make_unique<BigWorker>(bytes));
    deployer.commit(std::move(transaction));
    run_on();
    faults.push_back(static_cast<std::int64_t>(component.task().counters().page_faults() - before));
  }
  deployer.shutdown();
  bench::JsonLine().add("faults", faults).print();
}

}  // namespace

int main(int count, char** words) { return bench::run_program(count, words, measure); }
