// SPDX-License-Identifier: LGPL-3.0-or-later
// The parts of random_commands, and what they share.
#pragma once

#include <array>
#include <memory>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include "mauve_rt/mauve_rt.hpp"

#include "../forked_run.hpp"
#include "dice.hpp"
#include "fixtures.hpp"

namespace mauve::testing {

inline constexpr time_ns_t kHang = ms_to_ns(90);

/// What all parts of a run share. One thread runs at a time: nothing needs a lock.
struct CommandShared {
  explicit CommandShared(seeds::Findings& all) : findings(all) {}
  struct Release {
    time_ns_t clock_ns, at_ns;
  };
  struct Known {
    bool is_stopped{false};  // a stop has ended, and no start has begun since
    int executions{0};
    int core{0};  // the newest that has executed
    double input{0.0};
    time_ns_t period_ns{0};  // 0: it has none
    std::vector<Release> releases{};
  };
  /// All grids count from it. The first one is there from the beginning.
  struct Epoch {
    time_ns_t epoch_ns;
    time_ns_t instant_ns{0}, began_ns{0}, ended_ns{0};
  };
  seeds::Findings& findings;
  std::array<Known, 2> components{};
  std::vector<Epoch> epochs{};
  bool is_plain{false};
  bool has_hangs{false};  // states that take up to kHang: then nothing is expected to come promptly
  std::set<int> followed_by_older{};  // cores that are, or were, on probation, and those of repairs
  int cores{0};                       // that are configured
};

class CommandCore : public Core<TestShell> {
 public:
  CommandCore(std::shared_ptr<CommandShared> shared, std::size_t component, int number, std::uint64_t seed)
      : shared_(std::move(shared)), component_(component), number_(number), dice_(seed) {}
  ~CommandCore() override { expect(!is_ready_, "is destroyed before it is cleaned up"); }

  void act() {
    CommandShared::Known& known = shared_->components[component_];
    expect(is_ready_, "executes and is not configured");
    expect(!known.is_stopped, "executes after a stop");
    expect(number_ >= known.core || shared_->followed_by_older.contains(known.core),
           "executes after core " + std::to_string(known.core));
    known.core = number_;
    ++known.executions;
    if (!shared_->is_plain) known.releases.push_back({.clock_ns = clock_ns(), .at_ns = seeds::now_ns()});
    known.input = shell().input.read().value.value;
    shell().output.write(Number{1.0});
    seeds::compute(dice_.between(0, us_to_ns(20)));
    if (shared_->has_hangs && dice_.once_in(3)) sleep_for(dice_.between(ms_to_ns(1), kHang));
    expect(is_ready_, "is cleaned up while it executes");
    if (dice_.once_in(30)) throw std::runtime_error("as the seed wants");
  }
  bool configure_hook() override {
    ++shared_->cores;
    return is_ready_ = true;
  }
  void cleanup_hook() override {
    expect(is_ready_, "is cleaned up twice");
    --shared_->cores;
    is_ready_ = false;
  }
  bool adopt(const CoreBase& old) override {
    adopted_ = static_cast<const CommandCore&>(old).number_;
    return true;
  }
  void take(CoreBase& old) noexcept override {
    const int before = static_cast<CommandCore&>(old).number_;
    expect(before == adopted_, "takes over from core " + std::to_string(before) + ", and has adopted core " +
                                   std::to_string(adopted_));
  }
  std::string description() const override { return "core " + std::to_string(number_); }

 private:
  void expect(bool is_true, const std::string& what) const {
    if (!is_true)
      shared_->findings.expect(false, description() + " of c" + std::to_string(component_) + " " + what);
  }

  std::shared_ptr<CommandShared> shared_;
  std::size_t component_;
  int number_;
  int adopted_{0};  // the core whose successor it is to be
  Dice dice_;
  bool is_ready_{false};
};

struct CommandFsm : Fsm<TestShell, CommandCore> {
  void define() override {
    State& run = execution("Run", "act", &CommandCore::act);
    State& pause = wait("Pause", ms_to_ns(shell().period_ms.value()));
    set_initial(run);
    next(run, pause);
    next(pause, run);
  }
};
/// act -> wait for a write to what `input` reads -> act
struct CommandEventFsm : Fsm<TestShell, CommandCore> {
  static constexpr time_ns_t kTimeout = ms_to_ns(200);
  void define() override {
    State& run = execution("Run", "act", &CommandCore::act);
    State& pause = wait_event("Pause", shell().input, kTimeout, us_to_ns(100));
    set_initial(run);
    next(run, pause);
    next(pause, run);
  }
};

}  // namespace mauve::testing
