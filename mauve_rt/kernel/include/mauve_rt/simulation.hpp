// SPDX-License-Identifier: LGPL-3.0-or-later
// Simulation: architectures in virtual time on one thread, the same every time (rule 13).
#pragma once

#include <algorithm>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "mauve_rt/architecture.hpp"
#include "mauve_rt/futex.hpp"
#include "mauve_rt/transaction_commit.hpp"

namespace mauve {

/// Virtual time: stands still but for who advances it. One thread.
class SimulatedClock final : public Clock {
 public:
  explicit SimulatedClock(time_ns_t now_ns) : now_ns_(now_ns) {}
  time_ns_t now_ns() const noexcept override { return now_ns_; }
  /// Nobody sleeps in a simulation: says that the instant was not reached. [rt]
  bool sleep_until(time_ns_t, const std::atomic<std::uint32_t>&, std::uint32_t) const noexcept override {
    return false;
  }
  void spend(time_ns_t declared_ns) const noexcept override { now_ns_ += declared_ns; }
  /// Goes forward to the instant, never back. [rt]
  void advance_to(time_ns_t instant_ns) noexcept { now_ns_ = std::max(now_ns_, instant_ns); }

 private:
  mutable time_ns_t now_ns_;  // spend() is const, for a clock is const to the task that lives by it
};

struct SimulationOptions {
  bool trace{true};
  time_ns_t begin_ns{s_to_ns(1)};  // the virtual time at which it begins; > 0
};

/// Runs architectures without threads, real time or ROS: equal architectures and callbacks, equal traces.
///
/// Every architecture has one virtual processor. On it the task that is due runs to its next wait, without preemption;
/// of several that are due the one of the highest priority, then the one declared first. An execution state takes the
/// time that it declares as its max_execution (default: none). Callbacks come before the tasks of the same instant.
/// Everything on one thread: the caller's.
class Simulation {
 public:
  using Callback = std::function<void()>;

  explicit Simulation(SimulationOptions options = {});
  /// Shuts down.
  ~Simulation();
  Simulation(const Simulation&) = delete;
  Simulation& operator=(const Simulation&) = delete;

  /// Takes in a configured architecture, which outlives the simulation or its shutdown(). Before deploy(). Throws Error: not_configured, already_running (deployed).
  void add(Architecture& architecture);
  /// Gives all tasks of all architectures one epoch, now + max(20 ms, 1 ms x components), and starts them.
  /// Throws Error (already_running).
  void deploy();
  /// Stops every component, in reverse order, and lets the architectures go.
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

  // As the functions of Deployer, in virtual time; from callbacks or between two run_until().

  void start(Architecture& architecture, const std::string& component,
             std::optional<time_ns_t> clock_ns = std::nullopt);
  void stop(Architecture& architecture, const std::string& component);
  time_ns_t get_time(const Architecture& architecture, const std::string& component) const;
  /// Preparing takes no virtual time: it is reported as 0.
  TransactionReport commit(Architecture& architecture, Transaction transaction,
                           const TransactionOptions& options = {});
  TraceDrain drain_trace(Architecture& architecture);

 private:
  struct Processor {
    Architecture* architecture;
    SimulatedClock clock;
    std::vector<std::shared_ptr<Component>> components;  // as of the last look at the architecture's lists
    std::uint64_t seen_lists{0};
  };
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
  void run_timer();
  void advance_to(time_ns_t instant_ns);
  Processor& require(const Architecture& architecture) const;

  SimulationOptions options_;
  time_ns_t now_ns_;
  time_ns_t epoch_ns_{0};
  std::vector<std::unique_ptr<Processor>> processors_;
  std::set<Timer> timers_;
  std::uint64_t timers_set_{0};
};

}  // namespace mauve
