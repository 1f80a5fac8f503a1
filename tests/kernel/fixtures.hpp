// SPDX-License-Identifier: LGPL-3.0-or-later
// Small components for the kernel's tests: one execution state that calls a function, one wait.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sched.h>

#include <atomic>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

#include "mauve_rt/base/seam/sleep.hpp"
#include "mauve_rt/mauve_rt.hpp"

namespace mauve::testing {

struct Number {
  double value{};
};

}  // namespace mauve::testing

MAUVE_TYPE(mauve::testing::Number, "std_msgs/msg/Float64", value)

namespace mauve::testing {

struct TestShell : Shell {
  Property<double>& gain =
      property("gain", 1.0, {.unit = "1", .description = "a factor", .minimum = 0.0, .maximum = 10.0});
  Property<std::int64_t>& period_ms = property("period_ms", 1, {.structural = ReadBy::fsm});
  ReadPort<Number>& input = read_port<Number>("input", Number{7.0}).optional();
  WritePort<Number>& output = write_port<Number>("output").optional();
  WritePort<Number>& held =
      write_port<Number>("held", {.on_commit = OutputPolicy::hold, .on_stop = OutputPolicy::hold}).optional();
};

/// Calls `work` at every activation.
struct TestCore : Core<TestShell> {
  std::function<void()> work = [] {};
  std::atomic<int> runs{0};
  std::atomic<bool> condition{false};
  std::vector<time_ns_t> instants;  // logical clock of each activation; reserve before the start

  virtual void act() {
    runs.fetch_add(1, std::memory_order_relaxed);
    if (instants.size() < instants.capacity()) instants.push_back(clock_ns());
    work();
  }
  bool is_set() const { return condition.load(std::memory_order_relaxed); }
  TestShell& exposed_shell() { return shell(); }
  std::string description() const override { return "core test"; }
};

/// act -> wait(period_ms) -> act
struct TestFsm : Fsm<TestShell, TestCore> {
  void define() override {
    State& run = execution("Run", "act", &TestCore::act);
    State& pause = wait("Pause", ms_to_ns(shell().period_ms.value()));
    set_initial(run);
    next(run, pause);
    next(pause, run);
  }
};

/// Spins until the condition holds; tests fail after a minute of it, which no busy machine needs.
template <typename Condition>
void wait_until(Condition&& condition, const char* what) {
  const time_ns_t until = monotonic_now_ns() + s_to_ns(60);
  while (!condition()) {
    ASSERT_LT(monotonic_now_ns(), until) << "gave up waiting for: " << what;
    sleep_for(us_to_ns(200));
  }
}

/// Called in a loop that waits for another thread: spins at first, then sleeps. A yield would give a whole time slice to
/// whatever else wants the CPU, at every turn.
class Backoff {
 public:
  void operator()() {
    if (++turns_ > kSpins) sleep_for(us_to_ns(20));
  }

 private:
  static constexpr int kSpins = 200;
  int turns_{0};
};

inline bool may_use_fifo() {
  RealtimeProcess process;
  process.acquire(50, false);
  for (const std::string& line : process.status().missing) {
    if (line.starts_with("SCHED_FIFO")) return false;
  }
  return true;
}

/// All records of a kind, of one component.
inline std::vector<TraceRecord> records_of(const TraceDrain& drain, TraceKind kind, int component = 0) {
  std::vector<TraceRecord> found;
  for (const TraceRecord& record : drain.records) {
    if (record.kind == static_cast<std::uint16_t>(kind) && record.component == component)
      found.push_back(record);
  }
  return found;
}

/// The component, which is stopped, was released at each instant but those that a busy machine made it skip; the last ones may
/// have no release after them.
inline void expect_released_at_each_instant(const std::vector<time_ns_t>& instants,
                                            const Component& component, time_ns_t period_ns) {
  ASSERT_GE(instants.size(), 2U);
  const time_ns_t missing =
      (instants.back() - instants.front()) / period_ns - (static_cast<time_ns_t>(instants.size()) - 1);
  EXPECT_GE(missing, 0);
  EXPECT_LE(missing, static_cast<time_ns_t>(component.task().statistics().skipped.load()));
}

/// Declared after variables of a test that its components use: ends the components before those go.
struct ComponentsEndFirst {
  explicit ComponentsEndFirst(Deployer& whose) : deployer(whose) {}
  ~ComponentsEndFirst() { deployer.shutdown(); }
  ComponentsEndFirst(const ComponentsEndFirst&) = delete;
  ComponentsEndFirst& operator=(const ComponentsEndFirst&) = delete;
  Deployer& deployer;
};

/// Lets components run on for some periods when a test is over: AddressSanitizer then finds what they use of the test's
/// own variables, which are gone by now.
inline void run_on_where_sanitized() {
#ifdef __SANITIZE_ADDRESS__
  sleep_for(ms_to_ns(30));
#endif
}

/// The CPU of the components that a test pins.
inline constexpr int kComponentsCpu = 0;

/// Keeps the test's own threads off that CPU for as long as it lives, where there is another: a component that spins at
/// a real-time priority would keep them from running, since a busy scheduler moves them away late or not at all.
class AwayFromComponents {
 public:
  AwayFromComponents() {
    sched_getaffinity(0, sizeof(before_), &before_);
    cpu_set_t others = before_;
    CPU_CLR(kComponentsCpu, &others);
    if (CPU_COUNT(&others) > 0) sched_setaffinity(0, sizeof(others), &others);
  }
  ~AwayFromComponents() { sched_setaffinity(0, sizeof(before_), &before_); }
  AwayFromComponents(const AwayFromComponents&) = delete;
  AwayFromComponents& operator=(const AwayFromComponents&) = delete;

 private:
  cpu_set_t before_{};
};

/// An architecture of test components, deployed and shut down with the fixture.
class Deployed : public ::testing::Test {
 protected:
  ~Deployed() override { run_on_where_sanitized(); }
  Component& add(const std::string& name, std::int64_t period_ms = 1, TaskSettings settings = {}) {
    if (settings.cpus.empty()) settings.cpus = {kComponentsCpu};
    Component& component = architecture.add_component<TestShell, TestCore, TestFsm>(name, settings);
    component.set_property("period_ms", period_ms);
    return component;
  }
  static TestCore& core(Component& component) { return component.core_as<TestCore>(); }
  void deploy() {
    architecture.configure();
    deployer.deploy();
  }
  static void wait_runs(Component& component, int runs) {
    TestCore& counted = core(component);
    wait_until([&] { return counted.runs.load() >= runs; }, "the component to run");
  }

  AwayFromComponents away;
  Architecture architecture;
  Deployer deployer{architecture};
};

}  // namespace mauve::testing
