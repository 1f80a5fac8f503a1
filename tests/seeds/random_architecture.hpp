// SPDX-License-Identifier: LGPL-3.0-or-later
// A scenario of the seeds: an architecture of 1 to 12 components, random requests of two clients, and what must hold whatever the
// interleaving.
#pragma once

#include <array>
#include <string>

#include "mauve_rt/base/seam/ordinary_thread.hpp"
#include "mauve_rt/base/seam/sleep.hpp"

#include "scenario/changes.hpp"

namespace mauve::testing {

class RandomArchitecture : private Changes {
 public:
  RandomArchitecture(std::uint64_t seed, seeds::Findings& findings) : Changes(seed, findings) {}

  void run() {
    bool leaves_nothing = false;
    {
      Architecture architecture;
      architecture_ = &architecture;
      declare();
      Deployer deployer(architecture);
      deployer_ = &deployer;
      deployer.deploy();
      history_.note(Epoch{.epoch_ns = deployer.epoch_ns(), .instant_ns = 0});
      operate_both();
      expect_safe_all();
      sleep_for(ms_to_ns(20));  // what runs on although it was shut down is seen
      shared_->hung_may_go_on = true;
      if (dice_.once_in(
              2)) {  // else an architecture that ends leaves behind what a hook uses that was called off
        sleep_for(ms_to_ns(20));
        leaves_nothing = true;
      }
    }
    settle(leaves_nothing);
    history_.check(*shared_);
    findings_.count("executions", static_cast<int>(shared_->executions.size()));
  }

 private:
  /// From the first request of both clients to the end of the shutdown.
  void operate_both() {
    OrdinaryThread other([this] { operate_second(); });
    for (int requests = 3 + dice_.below(25); requests > 0; --requests) {
      sleep_for(dice_.between(0, ms_to_ns(dice_.once_in(4) ? 40 : 4)));
      if (dice_.once_in(4)) {
        command(dice_);
      } else {
        change(dice_, two_change_ ? Owner::first : Owner::only);
      }
    }
    if (dice_.once_in(12)) {
      other.join();
      shut_down_during_change();
    } else if (dice_.once_in(2)) {
      shut_down("shutdown");
      other.join();
    } else {
      other.join();
      if (dice_.once_in(4)) expect_alive();
      shut_down("shutdown");
    }
  }

  /// The second client: commands at any moment, and the shutdown in some seeds.
  void operate_second() {
    Dice dice(seed_ + 77);
    for (int commands = dice.below(25); commands > 0; --commands) {
      sleep_for(dice.between(0, ms_to_ns(20)));
      if (two_change_ && dice.once_in(2)) {
        change(dice, Owner::second);
      } else {
        command(dice);
      }
    }
    if (shuts_down_) shut_down("shutdown of the second client");
  }

  void shut_down(const std::string& what) {
    const Intervention here(*this);
    shared_->is_shut_down = true;
    timed(what, kShutdown, kShutdown, [&] { deployer_->shutdown(); });
    shared_->has_shut_down = true;
  }

  // ---- commands

  void command(Dice& dice) {
    const auto index = static_cast<std::size_t>(any(dice));
    const std::string& name = parts_[index].name;
    switch (dice.below(14)) {
      case 0:
      case 1:
        return start(index);
      case 2:
      case 3:
      case 4:
      case 5:
        return stop(dice, index);
      case 6:
        return intervene("abandon " + name, kSlack, [&] { deployer_->abandon(name); });
      case 7: {
        const time_ns_t patience_ns = dice.between(0, ms_to_ns(60));
        const Intervention here(*this);
        Scene::command(
            "revert " + name, patience_ns + s_to_ns(1) + kSlack,
            [&] { deployer_->revert_probation(name, "as the seed wants", patience_ns); }, nullptr,
            kPrompt + kLook);
        return;
      }
      case 8:
        Scene::command("settle", s_to_ns(1) + kSlack, [&] { deployer_->settle_probations(); });
        return expect_right_verdicts();
      case 9:
        return repair(index);
      case 10:
        ++shared_->let_go;
        return;
      case 11:
        hold_output(dice, index);
        return expect_safe_faulted();
      case 12:
        return expect_safe_faulted();
      default:
        look();
    }
  }

  template <typename Request>
  void intervene(const std::string& what, time_ns_t longest_ns, Request&& request) {
    const Intervention here(*this);
    Scene::command(what, longest_ns, request);
  }

  void look() {
    Scene::command("describe", kSlack, [&] { deployer_->describe(); });
    Scene::command("open changes", kSlack, [&] { deployer_->open_changes(); });
    Scene::command("drain the trace", kSlack, [&] { deployer_->drain_trace(); });
    Scene::command("shadows", kSlack, [&] { deployer_->shadows(); });
  }

  /// A component that was started runs, until a request or a fault ends that.
  void start(std::size_t index) {
    const Intervention here(*this);
    shared_->stopped.erase(static_cast<int>(index));
    const std::string& name = parts_[index].name;
    if (!Scene::command("start " + name, s_to_ns(2) + kSlack, [&] { deployer_->start(name); })) return;
    sleep_for(us_to_ns(500));
    const ComponentState state = state_of(index);
    expect(!here.is_sole() || state == ComponentState::running || state == ComponentState::faulted,
           name + " was started, and is " + std::string(to_string(state)));
  }

  /// A component that was stopped has safe outputs, executes no more, and may be cleaned up.
  void stop(Dice& dice, std::size_t index) {
    constexpr std::array kPatience{time_ns_t{0}, ms_to_ns(20), ms_to_ns(60), s_to_ns(2)};
    const StopOptions options{.timeout_ns = dice.one_of(kPatience), .force = dice.once_in(2)};
    const std::string& name = parts_[index].name;
    const bool cleans_up = dice.once_in(2);
    const Intervention here(*this);
    // One that another client starts again before this one looks waits for its timeout.
    const bool is_stopped =
        Scene::command((options.force ? "forced stop " : "stop ") + name, options.timeout_ns + kSlack,
                       [&] {
                         deployer_->stop(name, options);
                         if (cleans_up && here.is_sole() && state_of(index) == ComponentState::stopped)
                           configure_anew(index, &here);
                       },
                       &here);
    expect_just_faults();
    const ComponentState state = state_of(index);
    if (!is_stopped && state == ComponentState::faulted && dice.once_in(2)) return repair(index);
    const double output = output_value(index);
    if (!is_stopped || state != ComponentState::stopped || !here.is_sole()) return;
    expect_zero(index, output, "after a stop");
    shared_->stopped.insert(static_cast<int>(index));
  }

  /// Of a component that is stopped or FAULTED.
  void configure_anew(std::size_t index, const Intervention* alone) {
    const std::string& name = parts_[index].name;
    const auto component = architecture_->find_component(name);
    if (component == nullptr) return;
    const ComponentState state = state_of(index);
    const auto configured = shared_->configured.insert(static_cast<int>(index));
    Scene::command("cleanup and configure " + name, s_to_ns(2) + kSlack, [&] {
      try {
        component->cleanup();
        component->configure();
        findings_.count(std::string("configured anew when ") + std::string(to_string(state)));
      } catch (const Error& error) {
        expect(alone == nullptr || !alone->is_sole() || state != ComponentState::stopped ||
                   error.code() != ErrorCode::already_running,
               name + " was stopped, and is refused: " + error.what());
        throw;
      }
    });
    shared_->configured.erase(configured);
  }

  /// Configures a component that does not run anew, and starts it.
  void repair(std::size_t index) {
    const ComponentState state = state_of(index);
    if (state != ComponentState::faulted && state != ComponentState::stopped) return;
    {
      const Intervention here(*this);
      configure_anew(index, nullptr);
    }
    start(index);
  }

  /// Another writer of the output has the lock for a while.
  void hold_output(Dice& dice, std::size_t index) {
    auto* const output = dynamic_cast<LatestValue<Number>*>(&architecture_->resource(output_of(index)));
    const time_ns_t length_ns = dice.between(0, ms_to_ns(4));
    const BiasedMutex::Hold hold(output->write.mutex(), nullptr);
    shared_->slow_ns += 2 * length_ns;
    seeds::compute(length_ns);
    if (dice.once_in(2))
      intervene("forced stop of the locked " + parts_[index].name, kSlack,
                [&] { deployer_->stop(parts_[index].name, StopOptions{.timeout_ns = 0, .force = true}); });
    seeds::compute(length_ns);
  }

  /// A change that a shutdown overtakes ends with it, even where an adopt of a stopped component hangs.
  void shut_down_during_change() {
    const auto index = static_cast<std::size_t>(any(dice_));
    const std::string& name = parts_[index].name;
    Scene::command("stop " + name, kSlack, [&] { deployer_->stop(name, ms_to_ns(60)); });
    OrdinaryThread overtaken([this, &name, index] {
      Transaction transaction;
      transaction.replace_core(name, core(next_core_++, static_cast<int>(index),
                                          Manner{.hook = Hook::adopt, .deed = Deed::hangs}));
      try {
        deployer_->commit(std::move(transaction), {.timeouts = {.commit_ns = s_to_ns(3)}});
      } catch (const Error& error) {
        findings_.note(std::string("overtaken: ") + error.what());
      }
    });
    sleep_for(dice_.between(0, dice_.once_in(2) ? us_to_ns(200) : ms_to_ns(2)));
    const time_ns_t began_ns = seeds::now_ns();
    const time_ns_t excused_ns = excuses_ns();
    shut_down("shutdown during a change");
    overtaken.join();
    const time_ns_t took_ns = seeds::now_ns() - began_ns - (excuses_ns() - excused_ns);
    findings_.count("changes overtaken by a shutdown");
    expect(took_ns <= kShutdown + kPatience,
           "a change that a shutdown has overtaken took " + std::to_string(took_ns / 1000) + " us more");
  }
};

inline void random_architecture(std::uint64_t seed, seeds::Findings& findings) {
  RandomArchitecture(seed, findings).run();
}

}  // namespace mauve::testing
