// SPDX-License-Identifier: LGPL-3.0-or-later
// A scenario of the seeds: commands, changes and events meet at a few components within microseconds.
#pragma once

#include <algorithm>
#include <array>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>

#include "mauve_rt/base/seam/ordinary_thread.hpp"
#include "mauve_rt/base/seam/sleep.hpp"
#include "mauve_rt/mauve_rt.hpp"

#include "fixtures.hpp"
#include "forked_run.hpp"
#include "scenario/dice.hpp"

namespace mauve::testing {

/// What all parts of a run share. One thread runs at a time: nothing needs a lock.
struct CommandShared {
  explicit CommandShared(seeds::Findings& all) : findings(all) {}
  struct Known {
    bool is_stopped{false};  // a stop has ended, and no start has begun since
    int executions{0};
    int core{0};  // the newest that has executed
    double input{0.0};
  };
  seeds::Findings& findings;
  std::array<Known, 2> components{};
  int cores{0};  // that are configured
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
    expect(number_ >= known.core, "executes after core " + std::to_string(known.core));
    known.core = number_;
    ++known.executions;
    known.input = shell().input.read().value.value;
    shell().output.write(Number{1.0});
    seeds::compute(dice_.between(0, us_to_ns(20)));
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
  bool adopt(const CoreBase& /*old*/) override { return true; }
  std::string description() const override { return "core " + std::to_string(number_); }

 private:
  void expect(bool is_true, const std::string& what) const {
    if (!is_true)
      shared_->findings.expect(false, description() + " of c" + std::to_string(component_) + " " + what);
  }

  std::shared_ptr<CommandShared> shared_;
  std::size_t component_;
  int number_;
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

class RandomCommands {
 public:
  RandomCommands(std::uint64_t seed, seeds::Findings& findings)
      : dice_(seed), findings_(findings), seed_(seed) {}

  void run() {
    seeds::switch_often();
    {
      Architecture architecture;
      declare(architecture);
      Deployer deployer(architecture);
      architecture_ = &architecture;
      deployer_ = &deployer;
      deployer.deploy();
      sleep_for(dice_.between(ms_to_ns(19), ms_to_ns(22)));  // the epoch is 20 ms ahead
      std::array<OrdinaryThread, 3> others{OrdinaryThread([this] { command(0); }),
                                           OrdinaryThread([this] { command(1); }),
                                           OrdinaryThread([this] { write(); })};
      Dice dice(seed_ + 3);
      for (int changes = 3 + dice.below(8); changes > 0; --changes) {
        pause(dice);
        change(dice);
      }
      if (dice.once_in(3)) shut_down();
      for (OrdinaryThread& other : others) other.join();
      if (!is_shut_down_) shut_down();
    }
    expect(shared_->cores == 0, std::to_string(shared_->cores) + " cores are not cleaned up");
    seeds::expect_threads_end(findings_, ms_to_ns(100));
  }

 private:
  static constexpr time_ns_t kPrompt = ms_to_ns(30);  // of an answer that waits for nothing
  static constexpr time_ns_t kStop = ms_to_ns(20);

  void expect(bool is_true, const std::string& otherwise) { findings_.expect(is_true, otherwise); }
  static std::string name(std::size_t component) { return "c" + std::to_string(component); }

  void declare(Architecture& architecture) {
    architecture.add_resource<LatestValue<Number>>("out");
    architecture.add_resource<SharedData<Number>>("written");
    const bool is_sporadic = dice_.once_in(2);
    for (std::size_t i = 0; i < 2; ++i) {
      std::unique_ptr<FsmBase> fsm =
          i == 1 && is_sporadic ? new_part<FsmBase, CommandEventFsm>() : new_part<FsmBase, CommandFsm>();
      Component& component =
          architecture.add_component(name(i), new_part<Shell, TestShell>(), core(i), std::move(fsm),
                                     {.priority = 20 + 10 * dice_.below(2)});
      component.set_property("period_ms", std::int64_t{1 + dice_.below(2)});
      architecture.connect(name(i), "input", "written", "read");
    }
    architecture.connect("c0", "output", "out", "write");
    architecture.configure();
  }
  std::unique_ptr<CoreBase> core(std::size_t component) {
    const int number = ++last_core_;
    return std::make_unique<CommandCore>(shared_, component, number,
                                         seed_ * 1000 + static_cast<std::uint64_t>(number));
  }

  /// So that requests often meet a release, another request, or one another's ends.
  static void pause(Dice& dice) {
    if (dice.once_in(3)) return;
    sleep_for(dice.between(0, dice.once_in(2) ? us_to_ns(40) : us_to_ns(1'500)));
  }

  /// Whether the request was carried out. It is answered in time, and only what has timed out says so.
  template <typename Request>
  bool attempt(const std::string& what, time_ns_t timeout_ns, Request&& request) {
    const time_ns_t began_ns = seeds::now_ns();
    const time_ns_t stalled_ns = seeds::outcome().stalled_ns;
    const auto took_ns = [&] { return seeds::now_ns() - began_ns; };
    bool is_done = false;
    findings_.note(what);
    try {
      request();
      is_done = true;
      findings_.note("end of " + what);
      findings_.count(what.substr(0, what.find(' ')));
    } catch (const Error& error) {
      findings_.note(what + ": refused: " + error.what());
      findings_.count(what.substr(0, what.find(' ')) + " refused");
      expect(error.code() != ErrorCode::internal, what + ": internal error: " + error.what());
      const bool is_stopping = std::string(error.what()).find("STOPPING") !=
                               std::string::npos;  // refused at once, with the same code
      expect(error.code() != ErrorCode::timeout || is_stopping || took_ns() >= timeout_ns,
             what + ": timed out before its time: " + error.what());
    }
    const time_ns_t late_ns = took_ns() - (seeds::outcome().stalled_ns - stalled_ns) - timeout_ns;
    expect(late_ns <= kPrompt,
           what + " was answered " + std::to_string(late_ns / 1000) + " us after its time");
    return is_done;
  }

  // ---- the clients: one for the commands of each component, one for changes

  void command(std::size_t component) {
    Dice dice(seed_ + 1 + component);
    for (int commands = 4 + dice.below(10); commands > 0 && !is_shut_down_; --commands) {
      pause(dice);
      ++commands_[component];
      switch (architecture_->component(name(component)).task().state()) {
        case ComponentState::running:
          stop(component, dice);
          break;
        case ComponentState::faulted:
          repair(component);
          break;
        default:
          start(component, dice);
      }
      ++commands_[component];
    }
  }
  void stop(std::size_t component, Dice& dice) {
    const bool by_force = dice.once_in(5);
    bool is_given_up = false;
    const bool is_done = attempt("stop " + name(component), kStop, [&] {
      is_given_up = deployer_->stop(name(component), {.timeout_ns = kStop, .force = by_force});
    });
    if (is_done && !is_given_up && !is_shut_down_) shared_->components[component].is_stopped = true;
  }
  void start(std::size_t component, Dice& dice) {
    CommandShared::Known& known = shared_->components[component];
    known.is_stopped = false;
    const int before = known.executions;
    const time_ns_t stalled_ns = seeds::outcome().stalled_ns;
    if (!attempt("start " + name(component), ms_to_ns(1'000), [&] { deployer_->start(name(component)); }))
      return;
    if (dice.once_in(3)) return stop_at_once(component);
    if (dice.once_in(2)) return;
    const time_ns_t until_ns = seeds::now_ns() + kPrompt;
    while (known.executions == before && !is_shut_down_ && !is_faulted(component) &&
           seeds::now_ns() < until_ns + seeds::outcome().stalled_ns - stalled_ns)
      sleep_for(us_to_ns(100));
    expect(known.executions > before || is_shut_down_ || is_faulted(component),
           name(component) + " was started, and does not execute");
  }

  /// Of one that was started: its thread may not know of that yet.
  void stop_at_once(std::size_t component) {
    const time_ns_t stalled_ns = seeds::outcome().stalled_ns;
    const bool is_done = attempt("stop at once " + name(component), kStop,
                                 [&] { deployer_->stop(name(component), {.timeout_ns = kStop}); });
    const bool has_stalled = seeds::outcome().stalled_ns != stalled_ns;  // it may have timed out
    expect(is_done || has_stalled || is_shut_down_ || is_faulted(component),
           name(component) + " was started, and cannot be stopped");
    if (is_done && !is_shut_down_) shared_->components[component].is_stopped = true;
  }
  bool is_faulted(std::size_t component) const {
    return architecture_->component(name(component)).task().state() == ComponentState::faulted;
  }
  void repair(std::size_t component) {
    attempt("repair " + name(component), ms_to_ns(20), [&] {
      Transaction transaction;
      transaction.replace_core(name(component), core(component));
      deployer_->commit(std::move(transaction), {.timeouts = {.commit_ns = ms_to_ns(20), .phase_ns = 0}});
    });
  }

  void change(Dice& dice) {
    Transaction transaction;
    std::string text = "change";
    for (std::size_t i = 0; i < 2; ++i) {
      if (dice.once_in(3)) continue;
      if (dice.once_in(2)) {
        transaction.replace_core(name(i), core(i));
        text += " core of " + name(i);
      } else {
        transaction.set_property(name(i), "gain", 0.5 * (1 + dice.below(8)));
        text += " gain of " + name(i);
      }
    }
    if (transaction.steps().empty()) return;
    const time_ns_t patience_ns = dice.once_in(3) ? dice.between(0, us_to_ns(900)) : ms_to_ns(20);
    attempt(text, patience_ns, [&] {
      deployer_->commit(std::move(transaction), {.timeouts = {.commit_ns = patience_ns, .phase_ns = 0}});
    });
  }

  void shut_down() {
    is_shut_down_ = true;
    for (CommandShared::Known& known : shared_->components) known.is_stopped = false;
    attempt("shutdown", Deployer::kStopTimeout, [this] { deployer_->shutdown(); });
  }

  /// Writes in bursts; the last write of each is seen.
  void write() {
    Dice dice(seed_ + 4);
    auto& written = static_cast<SharedData<Number>&>(architecture_->resource("written"));
    for (double number = 100.0; number < 130.0 && !is_shut_down_;) {
      for (int writes = 1 + dice.below(4); writes > 0; --writes) {
        written.write.write(Number{++number}, monotonic_now_ns());
        if (dice.once_in(2)) sleep_for(dice.between(0, us_to_ns(300)));
      }
      const int commands = commands_[1];
      const time_ns_t stalled_ns = seeds::outcome().stalled_ns;
      const time_ns_t until_ns = seeds::now_ns() + kPrompt;
      const CommandShared::Known& known = shared_->components[1];
      const auto is_over = [&] {
        return seeds::now_ns() >= until_ns + seeds::outcome().stalled_ns - stalled_ns;
      };
      while (known.input != number && !is_over() && commands == commands_[1] && !is_shut_down_)
        sleep_for(us_to_ns(200));
      const bool has_to = commands == commands_[1] && !is_shut_down_ &&
                          architecture_->component("c1").task().state() == ComponentState::running;
      expect(known.input == number || !has_to, "c1 has not seen the last write");
      pause(dice);
    }
  }

  Dice dice_;
  seeds::Findings& findings_;
  std::uint64_t seed_;
  std::shared_ptr<CommandShared> shared_{std::make_shared<CommandShared>(findings_)};
  Architecture* architecture_{nullptr};
  Deployer* deployer_{nullptr};
  int last_core_{0};
  std::array<int, 2> commands_{};  // begun and ended
  bool is_shut_down_{false};       // or about to be
};

inline void random_commands(std::uint64_t seed, seeds::Findings& findings) {
  RandomCommands(seed, findings).run();
}

}  // namespace mauve::testing
