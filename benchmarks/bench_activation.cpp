// SPDX-License-Identifier: LGPL-3.0-or-later
// One activation of a state machine of two states: the kernel's own work, without the sleep.
//   bench_activation [--blocks 41] [--calls 256] [--priority 80] [--cpu 0]
// Prints {"traced_ps": [...], "untraced_ps": [...]}, in picoseconds an activation.
//
// Counted is Task::resume() from the end of one wait to the entry of the next: the look at the commands, two
// readings of CLOCK_MONOTONIC (as many as a component's thread makes), the release with its statistics, the
// call of an execution state that does nothing, its statistics, the advance of the logical clock, and, where
// traced, the four records of an activation. Not counted is the futex system call that a thread sleeps in.
#include "support/components.hpp"
#include "support/micro.hpp"

namespace {

/// Costs what the real clock costs and shows what it was set to, so that every call finds its wait over.
class SetClock final : public mauve::Clock {
 public:
  void set(mauve::time_ns_t instant_ns) noexcept { instant_ns_ = instant_ns; }
  mauve::time_ns_t now_ns() const noexcept override {
    mauve::time_ns_t real_ns = mauve::monotonic_now_ns();
    bench::keep(real_ns);
    return instant_ns_;
  }
  bool sleep_until(mauve::time_ns_t /*instant_ns*/, const std::atomic<std::uint32_t>& /*word*/,
                   std::uint32_t /*expected*/) const noexcept override {
    return true;
  }

 private:
  mauve::time_ns_t instant_ns_{0};
};

/// A component without a thread that is resumed by hand.
class Machine {
 public:
  explicit Machine(bool trace) {
    bench::add_worker(architecture_, "worker", 80, 0, 1000, 0);
    architecture_.configure();
    task().join(0);
    task().simulate(clock_, trace);
    task().start_at(mauve::ms_to_ns(1));
  }
  ~Machine() {
    task().stop();
    task().end_simulation();
  }
  Machine(const Machine&) = delete;
  Machine& operator=(const Machine&) = delete;

  void activate(std::int64_t times) {
    mauve::Task& resumed = task();
    for (std::int64_t i = 0; i < times; ++i) {
      clock_.set(resumed.due_ns());
      resumed.resume();
    }
  }
  std::int64_t releases() { return static_cast<std::int64_t>(task().statistics().releases); }
  void drain() {
    records_.clear();
    task().ring()->drain(records_);
    if (task().ring()->dropped() != 0) throw std::runtime_error("trace records were lost");
  }

 private:
  mauve::Task& task() { return architecture_.component("worker").task(); }

  SetClock clock_;
  mauve::Architecture architecture_;
  std::vector<mauve::TraceRecord> records_;
};

void measure(const bench::Options& options) {
  bench::Micro micro(options);
  micro.calls = options.number("calls", 256);  // their records fit into a ring
  Machine traced(true);
  Machine untraced(false);
  bench::JsonLine line;
  micro.compare(line,
                {{"traced", [&](std::int64_t calls) { traced.activate(calls); }, [&] { traced.drain(); }},
                 {"untraced", [&](std::int64_t calls) { untraced.activate(calls); }}});
  if (traced.releases() != (micro.blocks + 1) * micro.calls || untraced.releases() != traced.releases())
    throw std::runtime_error("not every call was an activation");
  line.print();
}

}  // namespace

int main(int count, char** words) { return bench::run_program(count, words, measure); }
