// SPDX-License-Identifier: LGPL-3.0-or-later
// Simulation: architectures in virtual time on one thread, the same every time (rule 13).
#pragma once

#include <algorithm>
#include <exception>
#include <functional>
#include <memory>
#include <set>
#include <vector>

#include "mauve_rt/base/rt.hpp"
#include "mauve_rt/base/seam/futex.hpp"
#include "mauve_rt/deploy/due_queue.hpp"
#include "mauve_rt/deploy/host.hpp"

namespace mauve {

/// Virtual time: stands still but for who advances it. One thread.
class SimulatedClock final : public Clock {
 public:
  explicit SimulatedClock(time_ns_t now_ns) : now_ns_(now_ns) {}
  time_ns_t now_ns() const noexcept override { return now_ns_; }
  /// Nobody sleeps in a simulation: says that the instant was not reached. [rt]
  bool sleep_until(time_ns_t, const Atomic<std::uint32_t>&, std::uint32_t) const noexcept override {
    return false;
  }
  void spend(time_ns_t declared_ns) const noexcept override { now_ns_ = later_by(now_ns_, declared_ns); }
  void due_changed(Task& task) const noexcept override {
    MAUVE_RT_TRUSTED(queue_.update(task, now_ns_));  // nobody's time passes meanwhile
  }
  void leave(Task& task) const noexcept override { MAUVE_RT_TRUSTED(queue_.forget(task)); }
  /// The task that lives by this clock and can begin first; nullptr: none waits for an instant. [non-rt]
  Task* next() const noexcept { return queue_.next(now_ns_); }
  /// Goes forward to the instant, never back. [rt]
  void advance_to(time_ns_t instant_ns) MAUVE_RT { now_ns_ = std::max(now_ns_, instant_ns); }

 private:
  // Mutable, for a clock is const to the task that lives by it.
  mutable time_ns_t now_ns_;
  mutable DueQueue queue_{};
};

struct SimulationOptions {
  bool trace{true};
  time_ns_t begin_ns{s_to_ns(1)};  // the virtual time at which it begins: 1 to kLatestBegin
};

class Simulation;

/// The host of one architecture in virtual time; made by Simulation::add(). Preparing a change takes no virtual time:
/// it is reported as 0, and so is what of a commit comes only when the call has returned. From callbacks, or between
/// two run_until(). The simulating thread only. A bumpless change lets virtual time pass until it is made: other callbacks and the
/// components run meanwhile.
class SimulatedHost final : public Host {
 public:
  SimulatedHost(Simulation& simulation, Architecture& architecture);
  ~SimulatedHost() override;

  void prepare_process() override {}
  /// Deploys the simulation, all hosts that were added: it has one epoch for all. After its own shutdown() it begins
  /// again alone, with an epoch of its own. [setup] Throws Error as Host::deploy().
  void deploy() override;
  void shutdown() noexcept override;

  /// Nothing is granted, for nothing runs in real time.
  const RealtimeStatus& realtime_status() const noexcept override;
  const Clock& clock() const noexcept override { return processor_.clock; }
  bool is_simulated() const noexcept override { return true; }
  bool pass_time(time_ns_t until_ns) noexcept override;

  /// The simulated task itself executes it after each release.
  void run_shadow(const std::shared_ptr<Shadow>& /*shadow*/) override {}

 protected:
  void begin_task(Task& task) override;
  bool end_task(Task& task, time_ns_t until_ns) noexcept override;

 private:
  friend class Simulation;

  struct Processor {
    Architecture* architecture;
    SimulatedClock clock;
  };

  /// Takes the architecture, which has no host. Throws Error: not_configured, already_running; out_of_range (stack).
  void join();
  void begin(time_ns_t epoch_ns);

  Simulation& simulation_;
  Processor processor_;
};

/// Runs architectures without threads, real time or ROS: equal architectures and callbacks, equal traces.
///
/// Every architecture has one virtual processor. On it the task that is due runs to its next wait, without preemption;
/// of several that are due the one of the highest priority, then the one declared first. An execution state takes the
/// time that it declares (State::simulated_execution_ns; default: none). Callbacks come before the tasks of the same instant.
/// Everything on one thread: the caller's. All functions [non-rt].
class Simulation {
 public:
  using Callback = std::function<void()>;

  explicit Simulation(SimulationOptions options = {});
  /// Shuts down.
  ~Simulation();
  Simulation(const Simulation&) = delete;
  Simulation& operator=(const Simulation&) = delete;

  /// Takes in a configured architecture, which outlives the simulation or its shutdown(), and returns its host, which
  /// lives as long as the simulation. Before deploy(). Throws Error: not_configured, already_running (deployed).
  SimulatedHost& add(Architecture& architecture);
  /// Gives all tasks of all architectures one epoch, now + 20 ms, and starts them.
  /// Throws Error: already_running, not_configured (a core).
  void deploy();
  /// Shuts every host down, and forgets the callbacks.
  void shutdown() noexcept;

  /// Calls back once, at the instant or now if that is past.
  void at(time_ns_t instant_ns, Callback callback);
  /// Calls back at first + k * period. Throws Error (invalid_argument): a period <= 0.
  void every(time_ns_t first_ns, time_ns_t period_ns, Callback callback);
  /// Lets virtual time pass up to the instant, that instant included.
  void run_until(time_ns_t instant_ns);

  time_ns_t now_ns() const noexcept { return now_ns_; }
  /// The instant that all grids are counted from; 0 before deploy().
  time_ns_t epoch_ns() const noexcept { return epoch_ns_; }

 private:
  friend class SimulatedHost;

  using Processor = SimulatedHost::Processor;
  struct Timer {
    time_ns_t instant_ns;
    std::uint64_t number;  // of equal instants the one that was set first
    time_ns_t period_ns;   // 0: once
    std::shared_ptr<Callback> callback;
    bool operator<(const Timer& other) const noexcept {
      return std::pair(instant_ns, number) < std::pair(other.instant_ns, other.number);
    }
  };
  struct Next {
    time_ns_t begin_ns{kForever};
    Processor* processor{nullptr};
    Task* task{nullptr};
  };

  static Next next_of(Processor& processor);
  bool step(time_ns_t until_ns);
  bool step_in_change(time_ns_t until_ns) noexcept;
  void run_timer();
  void advance_to(time_ns_t instant_ns);

  SimulationOptions options_;
  time_ns_t now_ns_;
  time_ns_t epoch_ns_{0};
  std::vector<std::unique_ptr<SimulatedHost>> hosts_;  // those that were shut down too
  std::vector<Processor*> processors_;                 // of those that were not
  std::set<Timer> timers_;
  std::uint64_t timers_set_{0};
  std::exception_ptr failure_{};  // of a callback while a change let time pass: run_until() throws it
};

}  // namespace mauve
