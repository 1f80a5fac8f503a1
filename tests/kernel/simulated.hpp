// SPDX-License-Identifier: LGPL-3.0-or-later
// Test components in virtual time: semantics to the nanosecond, whatever the machine does.
#pragma once

#include "fixtures.hpp"

namespace mauve::testing {

/// A component of one execution state, which takes as long as its bound says, and one wait.
struct BudgetFsm : Fsm<TestShell, TestCore> {
  void define() override {
    const time_ns_t time_ns = us_to_ns(static_cast<std::int64_t>(shell().gain.value() * 1000));
    State& run = execution("Run", "act", &TestCore::act, time_ns);
    run.simulated_execution_ns = time_ns;
    State& pause = wait("Pause", ms_to_ns(shell().period_ms.value()));
    set_initial(run);
    next(run, pause);
    next(pause, run);
  }
};

/// An architecture in a simulation. A component's execution takes `gain` milliseconds of virtual time.
class Simulated : public ::testing::Test {
 protected:
  Component& add(const std::string& name, std::int64_t period_ms = 1, double execution_ms = 0.0,
                 const TaskSettings& settings = {}) {
    Component& component = architecture.add_component<TestShell, TestCore, BudgetFsm>(name, settings);
    component.set_property("period_ms", period_ms);
    component.set_property("gain", execution_ms);
    core(component).instants.reserve(10'000);
    return component;
  }
  static TestCore& core(Component& component) { return component.core_as<TestCore>(); }
  void deploy() {
    architecture.configure();
    host_ = &simulation.add(architecture);
    simulation.deploy();
  }
  /// Once deployed.
  SimulatedHost& host() const { return *host_; }
  /// Lets this much time pass after the epoch, all in all.
  void run_to(time_ns_t after_epoch_ns) { simulation.run_until(simulation.epoch_ns() + after_epoch_ns); }
  /// A component's activations: its logical clock at each, in ms after the epoch.
  std::vector<double> instants_ms(Component& component) const {
    std::vector<double> all;
    for (const time_ns_t instant : core(component).instants)
      all.push_back(static_cast<double>(instant - simulation.epoch_ns()) / 1e6);
    return all;
  }

  Architecture architecture;
  Simulation simulation;

 private:
  SimulatedHost* host_{nullptr};
};

}  // namespace mauve::testing
