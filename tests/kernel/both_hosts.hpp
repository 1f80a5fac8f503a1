// SPDX-License-Identifier: LGPL-3.0-or-later
// One test body for both hosts: threads, and virtual time.
#pragma once

#include "free_fsm.hpp"

namespace mauve::testing {

/// Threads: time passes by itself.
class OnThreads {
 public:
  void deploy(Architecture& architecture) {
    deployer_ = std::make_unique<Deployer>(architecture);
    deployer_->deploy();
  }
  Host& operator*() { return *deployer_; }
  template <typename Condition>
  void until(Condition&& condition, const char* what) {
    wait_until(condition, what);
  }
  void shutdown() {
    if (deployer_ != nullptr) deployer_->shutdown();
  }

 private:
  std::unique_ptr<Deployer> deployer_;
};

/// Virtual time: passes while the test waits.
class InVirtualTime {
 public:
  void deploy(Architecture& architecture) {
    host_ = &simulation_.add(architecture);
    host_->deploy();
  }
  Host& operator*() { return *host_; }
  template <typename Condition>
  void until(Condition&& condition, const char* what) {
    const time_ns_t latest = simulation_.now_ns() + s_to_ns(60);
    while (!condition()) {
      ASSERT_LT(simulation_.now_ns(), latest) << "gave up waiting for: " << what;
      simulation_.run_until(simulation_.now_ns() + us_to_ns(100));
    }
  }
  void shutdown() { simulation_.shutdown(); }

 private:
  SimulatedHost* host_{nullptr};
  Simulation simulation_;
};

/// What the tests ask of a host of either kind.
template <typename Made>
class AnyHost : public Made {
 public:
  void start(const std::string& name, std::optional<time_ns_t> clock_ns = {}) {
    (**this).start(name, clock_ns);
  }
  void stop(const std::string& name, time_ns_t timeout_ns = s_to_ns(10)) { (**this).stop(name, timeout_ns); }
  TransactionReport commit(Transaction transaction) {
    return (**this).commit(std::move(transaction),
                           {.timeouts = {.commit_ns = s_to_ns(30), .phase_ns = s_to_ns(30)}});
  }
  time_ns_t now_ns() { return (**this).now_ns(); }
};

/// An architecture on a host of either kind.
template <typename Made>
class OnBothHosts : public ::testing::Test {
 protected:
  ~OnBothHosts() override { host.shutdown(); }
  Component& add(const std::string& name, std::int64_t period_ms = 1, const TaskSettings& settings = {}) {
    Component& component = architecture.add_component<TestShell, TestCore, TestFsm>(name, settings);
    component.set_property("period_ms", period_ms);
    core(component).instants.reserve(10'000);
    return component;
  }
  static TestCore& core(Component& component) { return component.core_as<TestCore>(); }
  void deploy() {
    architecture.configure();
    host.deploy(architecture);
  }
  void wait_runs(Component& component, int runs) {
    host.until([&] { return core(component).runs.load() >= runs; }, "the component to run");
  }
  void wait_state(Component& component, ComponentState state) {
    host.until([&] { return settled(component.task().state()) == state; }, "the component's state");
  }
  /// The code of the error that the action throws; a failure when it throws none.
  template <typename Action>
  static ErrorCode code_of(Action&& action, std::string* text = nullptr) {
    try {
      action();
    } catch (const Error& error) {
      if (text != nullptr) *text = error.what();
      return error.code();
    }
    ADD_FAILURE() << "it was not refused";
    return ErrorCode::internal;
  }

  AwayFromComponents away;
  Architecture architecture;
  AnyHost<Made> host;
};

using BothHosts = ::testing::Types<OnThreads, InVirtualTime>;

}  // namespace mauve::testing
