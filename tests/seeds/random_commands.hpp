// SPDX-License-Identifier: LGPL-3.0-or-later
// A scenario of the seeds: commands, changes and events meet at a few components within microseconds.
#pragma once

#include <algorithm>
#include <array>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "mauve_rt/base/seam/ordinary_thread.hpp"
#include "mauve_rt/base/seam/sleep.hpp"
#include "mauve_rt/mauve_rt.hpp"

#include "fixtures.hpp"
#include "forked_run.hpp"
#include "scenario/command_parts.hpp"
#include "scenario/dice.hpp"

namespace mauve::testing {

class RandomCommands {
 public:
  /// Plain: commands, changes and events alone, which then meet more often.
  RandomCommands(std::uint64_t seed, seeds::Findings& findings, bool is_plain)
      : dice_(seed), findings_(findings), seed_(seed), is_plain_(is_plain) {}

  void run() {
    seeds::switch_often();
    {
      Architecture architecture;
      declare(architecture);
      Deployer deployer(architecture);
      architecture_ = &architecture;
      deployer_ = &deployer;
      deployer.deploy();
      if (!is_plain_) shared_->epochs.push_back({.epoch_ns = deployer.epoch_ns()});
      sleep_for(dice_.between(ms_to_ns(19), ms_to_ns(22)));  // the epoch is 20 ms ahead
      std::array<OrdinaryThread, 3> others{OrdinaryThread([this] { command(0); }),
                                           OrdinaryThread([this] { command(1); }),
                                           OrdinaryThread([this] { write(); })};
      OrdinaryThread beside;
      if (!is_plain_) beside = OrdinaryThread([this] { change_beside(); });
      Dice dice(seed_ + 3);
      for (int changes = 3 + dice.below(8); changes > 0; --changes) {
        pause(dice);
        change(dice);
      }
      if (dice.once_in(3)) shut_down();
      for (OrdinaryThread& other : others) other.join();
      if (beside.joinable()) beside.join();
      if (!is_shut_down_) shut_down();
    }
    if (!is_plain_) check_grids();
    expect(shared_->cores == 0, std::to_string(shared_->cores) + " cores are not cleaned up");
    seeds::expect_threads_end(findings_, ms_to_ns(100));
  }

 private:
  static constexpr time_ns_t kPrompt = ms_to_ns(30);  // of an answer that waits for nothing
  static constexpr time_ns_t kStop = ms_to_ns(20);

  void expect(bool is_true, const std::string& otherwise) { findings_.expect(is_true, otherwise); }
  static std::string name(std::size_t component) { return "c" + std::to_string(component); }

  void declare(Architecture& architecture) {
    shared_->is_plain = is_plain_;
    shared_->has_hangs = !is_plain_ && dice_.once_in(3);
    architecture.add_resource<LatestValue<Number>>("out");
    architecture.add_resource<SharedData<Number>>("written");
    const bool is_sporadic = dice_.once_in(2);
    for (std::size_t i = 0; i < 2; ++i) {
      std::unique_ptr<FsmBase> fsm =
          i == 1 && is_sporadic ? new_part<FsmBase, CommandEventFsm>() : new_part<FsmBase, CommandFsm>();
      Component& component =
          architecture.add_component(name(i), new_part<Shell, TestShell>(), core(i), std::move(fsm),
                                     {.priority = 20 + 10 * dice_.below(2)});
      const std::int64_t period_ms = 1 + dice_.below(2);
      component.set_property("period_ms", period_ms);
      if (i == 0 || !is_sporadic) shared_->components[i].period_ns = ms_to_ns(period_ms);
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
    time_ns_t most_ns = is_shut_down_ ? kPrompt + Runner::kThreadEnd : kPrompt;
    if (shared_->has_hangs) most_ns += kHang;  // a change that is decided waits for its participants
    expect(late_ns <= most_ns,
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
    const bool by_force = shared_->has_hangs ? !dice.once_in(3) : dice.once_in(5);
    bool is_given_up = false;
    const bool is_done = attempt("stop " + name(component), kStop, [&] {
      is_given_up = deployer_->stop(name(component), {.timeout_ns = kStop, .force = by_force});
    });
    if (is_done && !is_given_up && !is_shut_down_) shared_->components[component].is_stopped = true;
    if (is_done && component == 0 && !is_plain_) expect_safe(is_given_up);
  }
  /// The output of a component that was stopped, unless it executes again.
  void expect_safe(bool is_given_up) {
    const CommandShared::Known& known = shared_->components[0];
    const int executions = known.executions;
    ReaderState reader;
    Number found;
    time_ns_t time_ns = 0;
    static_cast<LatestValue<Number>&>(architecture_->resource("out")).read.read(found, time_ns, reader);
    if (known.executions == executions && is_at_rest(0))
      expect(found.value == 0.0, "c0 was stopped, and has the output " + std::to_string(found.value));
    if (is_given_up) findings_.count("given up");
  }
  bool is_at_rest(std::size_t component) const {
    const ComponentState state = architecture_->component(name(component)).task().state();
    return state == ComponentState::stopped || state == ComponentState::faulted;
  }
  void start(std::size_t component, Dice& dice) {
    CommandShared::Known& known = shared_->components[component];
    known.is_stopped = false;
    const int before = known.executions;
    const time_ns_t stalled_ns = seeds::outcome().stalled_ns;
    const bool by_change =
        !is_plain_ && !has_epochs_ && dice.once_in(3);  // which does not wait for the component's thread
    const time_ns_t timeout_ns = by_change ? ms_to_ns(20) : s_to_ns(1);
    const bool is_done = attempt("start " + name(component), timeout_ns, [&] {
      if (!by_change) return deployer_->start(name(component));
      Transaction transaction;
      transaction.start(name(component));
      deployer_->commit(std::move(transaction), {.timeouts = {.commit_ns = ms_to_ns(20), .phase_ns = 0}});
    });
    if (!is_done) return;
    if (dice.once_in(by_change ? 2 : 3)) return stop_at_once(component, before);
    if (dice.once_in(2) || shared_->has_hangs) return;
    const time_ns_t until_ns = seeds::now_ns() + kPrompt;
    while (known.executions == before && !is_shut_down_ && !is_faulted(component) &&
           seeds::now_ns() < until_ns + seeds::outcome().stalled_ns - stalled_ns)
      sleep_for(us_to_ns(100));
    expect(known.executions > before || is_shut_down_ || is_faulted(component),
           name(component) + " was started, and does not execute");
  }

  /// Of one that was started: its thread may not know of that yet.
  void stop_at_once(std::size_t component, int executions) {
    const time_ns_t stalled_ns = seeds::outcome().stalled_ns;
    bool was_faulted = false;  // it may be repaired by now, or be STOPPED while it is
    const bool is_done = attempt("stop at once " + name(component), kStop, [&] {
      try {
        deployer_->stop(name(component), {.timeout_ns = kStop});
      } catch (const Error& error) {
        const std::string words = error.what();
        const bool has_executed = shared_->components[component].executions != executions;
        was_faulted = words.find("found FAULTED") != std::string::npos ||
                      (has_executed && words.find("found STOPPED") != std::string::npos);
        throw;
      }
    });
    const bool has_stalled = seeds::outcome().stalled_ns != stalled_ns;  // it may have timed out
    expect(
        is_done || has_stalled || shared_->has_hangs || is_shut_down_ || was_faulted || is_faulted(component),
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
      shared_->followed_by_older.insert(last_core_);  // by that of a change that waits meanwhile
      deployer_->commit(std::move(transaction), {.timeouts = {.commit_ns = ms_to_ns(20), .phase_ns = 0}});
    });
  }

  void change(Dice& dice) {
    Transaction transaction;
    std::string text = "change";
    for (std::size_t i = 0; i < 2; ++i) {
      if (dice.once_in(3)) continue;
      if (dice.once_in(2)) {
        std::unique_ptr<CoreBase> fresh = core(i);
        if (!is_plain_ && dice.once_in(3)) {
          shared_->followed_by_older.insert(last_core_);
          const time_ns_t duration_ns = dice.between(us_to_ns(500), ms_to_ns(20));
          transaction.replace_core(name(i), std::move(fresh),
                                   ProbationOptions{.duration_ns = duration_ns, .on_overrun = false});
          text += " core on probation of " + name(i);
        } else {
          transaction.replace_core(name(i), std::move(fresh));
          text += " core of " + name(i);
        }
      } else {
        transaction.set_property(name(i), "gain", 0.5 * (1 + dice.below(8)));
        text += " gain of " + name(i);
      }
    }
    const bool resynchronises = has_epochs_ && dice.once_in(3);
    if (resynchronises) transaction.resynchronise();
    if (transaction.steps().empty()) return;
    const time_ns_t patience_ns = dice.once_in(3) ? dice.between(0, us_to_ns(900)) : ms_to_ns(20);
    const time_ns_t began_ns = seeds::now_ns();
    const bool is_prepared = !is_plain_ && !resynchronises && dice.once_in(3);
    const TransactionOptions options{.timeouts = {.commit_ns = patience_ns, .phase_ns = 0}};
    attempt(text + (resynchronises ? " and epoch" : ""), patience_ns, [&] {
      if (is_prepared) {
        const auto prepared = deployer_->prepare(std::move(transaction), options);
        prepared->commit(patience_ns);
        prepared->complete();
        return;
      }
      const TransactionReport report = deployer_->commit(std::move(transaction), options);
      if (resynchronises)
        shared_->epochs.push_back({.epoch_ns = deployer_->epoch_ns(),
                                   .instant_ns = report.instant_ns,
                                   .began_ns = began_ns,
                                   .ended_ns = seeds::now_ns()});
    });
    if (!is_plain_ && dice.once_in(3)) revert(static_cast<std::size_t>(dice.below(2)), dice);
  }
  /// The core before comes back at once, also where the component waits for an event that does not come.
  void revert(std::size_t component, Dice& dice) {
    pause(dice);
    const time_ns_t stalled_ns = seeds::outcome().stalled_ns;
    const int commands = commands_[component];
    const bool runs = architecture_->component(name(component)).task().state() == ComponentState::running;
    bool has_timed_out = false;
    attempt("revert " + name(component), ms_to_ns(20), [&] {
      try {
        deployer_->revert_probation(name(component), "as the seed wants", ms_to_ns(20));
      } catch (const Error& error) {
        has_timed_out = error.code() == ErrorCode::timeout;
        throw;
      }
    });
    const bool has_to = runs && !shared_->has_hangs && commands == commands_[component] && !is_shut_down_ &&
                        !is_faulted(component) && stalled_ns == seeds::outcome().stalled_ns;
    expect(!has_timed_out || !has_to, name(component) + " runs, and its probation cannot be reverted");
  }
  /// Changes that meet those of the first client, and a configuration that waits for all of them.
  void change_beside() {
    Dice dice(seed_ + 5);
    for (int changes = 2 + dice.below(6); changes > 0 && !is_shut_down_; --changes) {
      pause(dice);
      if (!has_epochs_ && dice.once_in(3)) {  // also while a change that replaces the core is decided
        revert(static_cast<std::size_t>(dice.below(2)), dice);
        continue;
      }
      if (dice.once_in(4)) {
        attempt("settle", 0, [&] { deployer_->settle_probations(); });
        continue;
      }
      if (has_epochs_ || dice.once_in(3)) {
        attempt("publish", ms_to_ns(200), [&] { architecture_->publish("written"); });
        continue;
      }
      Transaction transaction;
      for (std::size_t i = 0; i < 2; ++i) {
        if (dice.once_in(2)) transaction.set_property(name(i), "gain", 0.25 * (1 + dice.below(8)));
      }
      if (transaction.steps().empty()) continue;
      attempt("second change", ms_to_ns(20), [&] {
        deployer_->commit(std::move(transaction), {.timeouts = {.commit_ns = ms_to_ns(20), .phase_ns = 0}});
      });
    }
  }

  /// Each release is on the grid of an epoch that was in force, or could be.
  void check_grids() {
    for (const CommandShared::Known& known : shared_->components) {
      if (known.period_ns == 0) continue;
      for (const CommandShared::Release& release : known.releases) {
        std::vector<time_ns_t> epochs;
        for (const CommandShared::Epoch& epoch : shared_->epochs) {
          if (release.clock_ns < epoch.instant_ns) continue;
          const bool is_sure = epoch.instant_ns != kNotMeasured ? release.at_ns > epoch.began_ns
                                                                : release.at_ns > epoch.ended_ns;
          if (is_sure) epochs.clear();
          epochs.push_back(epoch.epoch_ns);
        }
        const bool is_on_grid = std::ranges::any_of(
            epochs, [&](time_ns_t epoch_ns) { return (release.clock_ns - epoch_ns) % known.period_ns == 0; });
        expect(is_on_grid, "c" + std::to_string(&known - shared_->components.data()) +
                               ", a release at clock " + std::to_string(release.clock_ns) +
                               ", executing at " + std::to_string(release.at_ns) + ", is not on its grid");
      }
    }
  }

  void shut_down() {
    is_shut_down_ = true;
    for (CommandShared::Known& known : shared_->components) known.is_stopped = false;
    attempt("shutdown", Deployer::kStopTimeout, [this] { deployer_->shutdown(); });
  }

  /// Writes in bursts; the last write of each is seen.
  void write() {
    Dice dice(seed_ + 4);
    const bool is_slow = !is_plain_ && dice.once_in(3);
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
      const bool has_to = commands == commands_[1] && !is_shut_down_ && !shared_->has_hangs &&
                          architecture_->component("c1").task().state() == ComponentState::running;
      expect(known.input == number || !has_to, "c1 has not seen the last write");
      pause(dice);
      if (is_slow && dice.once_in(3)) sleep_for(dice.between(0, ms_to_ns(90)));
    }
  }

  Dice dice_;
  seeds::Findings& findings_;
  std::uint64_t seed_;
  bool is_plain_;
  std::shared_ptr<CommandShared> shared_{std::make_shared<CommandShared>(findings_)};
  Architecture* architecture_{nullptr};
  Deployer* deployer_{nullptr};
  int last_core_{0};
  // Then one client alone makes changes: a component that is late to one keeps its grid.
  bool has_epochs_{!is_plain_ && dice_.once_in(2)};
  std::array<int, 2> commands_{};  // begun and ended
  bool is_shut_down_{false};       // or about to be
};

inline void random_commands(std::uint64_t seed, seeds::Findings& findings) {
  RandomCommands(seed, findings, true).run();
}
/// With epochs, probations, reverts, hangs and a second client of changes.
inline void random_meetings(std::uint64_t seed, seeds::Findings& findings) {
  RandomCommands(seed, findings, false).run();
}

}  // namespace mauve::testing
