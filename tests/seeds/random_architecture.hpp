// SPDX-License-Identifier: LGPL-3.0-or-later
// A scenario of the seeds: an architecture of 1 to 12 components, random requests, and what must hold whatever the interleaving.
#pragma once

#include <algorithm>
#include <array>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "mauve_rt/base/seam/ordinary_thread.hpp"
#include "mauve_rt/base/seam/sleep.hpp"
#include "mauve_rt/base/seam/thread.hpp"

#include "scenario/history.hpp"
#include "scenario/seed_parts.hpp"

namespace mauve::testing {

class RandomArchitecture {
 public:
  RandomArchitecture(std::uint64_t seed, seeds::Findings& findings)
      : dice_(seed),
        findings_(findings),
        seed_(seed),
        shuts_down_(dice_.once_in(3)),
        two_change_(dice_.once_in(2)) {}

  void run() {
    {
      Architecture architecture;
      architecture_ = &architecture;
      declare();
      Deployer deployer(architecture);
      deployer_ = &deployer;
      deployer.deploy();
      history_.note(Epoch{.epoch_ns = deployer.epoch_ns(), .instant_ns = 0});
      OrdinaryThread other([this] { operate(); });
      for (int requests = 3 + dice_.below(25); requests > 0; --requests) {
        sleep_for(dice_.between(0, ms_to_ns(dice_.once_in(4) ? 40 : 4)));
        request();
      }
      if (dice_.once_in(2)) {
        shut_down("shutdown");
        other.join();
      } else {
        other.join();
        if (dice_.once_in(4)) expect_alive();
        shut_down("shutdown");
      }
      shared_->hung_may_go_on = true;
      if (dice_.once_in(
              2)) {  // else an architecture that ends leaves behind what a hook uses that was called off
        sleep_for(ms_to_ns(20));
        leaves_nothing_ = true;
      }
    }
    settle();
    history_.check(*shared_);
    findings_.count("executions", static_cast<int>(shared_->executions.size()));
  }

 private:
  struct Part {
    std::string name;
    time_ns_t period_ns;
    bool is_sporadic;
    bool has_fallback;
    double gain{1.0};
    int core{0};
    double input{kUnconnected};
    int trial{kNone};  // the core on probation
  };

  /// Which client changes a component: the only one, or each of two every other.
  enum class Owner : std::uint8_t { only, first, second };
  static bool owns(Owner owner, std::size_t component) {
    return owner == Owner::only || component % 2 == (owner == Owner::first ? 0U : 1U);
  }

  static constexpr int kExtra = 1000;  // components that are added, from this number on
  static constexpr time_ns_t kExtraPeriod = ms_to_ns(3);
  static constexpr time_ns_t kSlack = ms_to_ns(150);
  static constexpr time_ns_t kShutdown = Deployer::kStopTimeout + ms_to_ns(500) + kSlack;
  static constexpr time_ns_t kPrepare = ms_to_ns(30);
  static constexpr time_ns_t kCleanup = s_to_ns(1);  // who asked waits so long for the cleanup of what is out

  void expect(bool is_true, const std::string& otherwise) { findings_.expect(is_true, otherwise); }

  /// A request is answered in time, but for the stalls of the computer.
  template <typename Request>
  void timed(const std::string& what, time_ns_t longest_ns, Request&& request) {
    const time_ns_t began_ns = seeds::now_ns();
    const time_ns_t stalled_ns = seeds::outcome().stalled_ns;
    findings_.note(what);
    request();
    findings_.note("end of " + what);
    if (!shared_->hung_cores.empty()) longest_ns += kCleanup;
    const time_ns_t took_ns = seeds::now_ns() - began_ns - (seeds::outcome().stalled_ns - stalled_ns);
    expect(took_ns <= longest_ns, what + " took " + std::to_string(took_ns / 1000) +
                                      " us, expected at most " + std::to_string(longest_ns / 1000) + " us");
  }
  /// A command is carried out, or refused with a reason.
  template <typename Request>
  void command(const std::string& what, time_ns_t longest_ns, Request&& request) {
    timed(what, longest_ns, [&] {
      try {
        request();
      } catch (const Error& error) {
        findings_.count("commands refused");
        findings_.note(what + ": refused: " + error.what());
        expect(error.code() != ErrorCode::internal, what + ": internal error: " + error.what());
      }
    });
  }

  // ---- the architecture

  void declare() {
    const int count = dice_.once_in(4) ? 6 + dice_.below(7) : 1 + dice_.below(5);
    for (int i = 0; i < count; ++i)
      architecture_->add_resource<LatestValue<Number>>("out" + std::to_string(i));
    for (int i = 0; i < count; ++i) {
      const std::int64_t period_ms = (2 + dice_.below(9)) * (1 + count / 5);
      parts_.push_back({.name = "c" + std::to_string(i),
                        .period_ns = ms_to_ns(period_ms),
                        .is_sporadic = dice_.once_in(6),
                        .has_fallback = dice_.once_in(5)});
      Part& part = parts_.back();
      part.core = next_core_;
      const bool is_bounded = dice_.once_in(5);
      auto fsm = part.is_sporadic ? new_part<FsmBase, EventFsm>()
                 : is_bounded     ? new_part<FsmBase, BoundedFsm>()
                                  : new_part<FsmBase, SeedFsm>();
      Component& component = architecture_->add_component(
          part.name, new_part<Shell, TestShell>(), core(i, Manner{}), std::move(fsm),
          {.priority = 10 + 10 * dice_.below(4),
           .overrun = dice_.once_in(6) ? OverrunPolicy::catch_up : OverrunPolicy::skip,
           .max_backlog = 100,
           .hung_after_ns = dice_.once_in(2) ? ms_to_ns(40) : 0});
      component.set_property("period_ms", period_ms);
      architecture_->connect(part.name, "output", "out" + std::to_string(i), "write");
      const int target = dice_.below(count);
      if (part.is_sporadic || dice_.once_in(2)) {
        architecture_->connect(part.name, "input", "out" + std::to_string(target), "read");
        part.input = written_by(target);
      }
      if (part.has_fallback) component.set_fallback(fallback(i));
      for (const auto& [aspect, value] : aspects_of(part))
        history_.note(Made{.component = i, .aspect = aspect, .value = value, .instant_ns = 0});
    }
    architecture_->configure();
  }

  std::unique_ptr<CoreBase> core(int component, Manner manner, bool is_on_probation = false) {
    const int number = next_core_++;
    auto made = std::make_unique<SeedCore>(shared_, component, number, manner,
                                           seed_ * 1000 + static_cast<std::uint64_t>(number));
    if (is_on_probation) made->set_on_probation();
    return made;
  }
  /// Each instance has a number of its own.
  std::unique_ptr<CoreBase> fallback(int component) {
    auto make = [shared = shared_, component, next = next_fallback_,
                 seed = seed_]() -> std::unique_ptr<CoreBase> {
      const int number = (*next)++;
      return std::make_unique<SeedCore>(shared, component, number, Manner{},
                                        seed * 1000 + static_cast<std::uint64_t>(number));
    };
    auto first = make();
    first->set_factory(make);
    return first;
  }

  static std::map<Aspect, double> aspects_of(const Part& part) {
    return {{Aspect::core, part.core},
            {Aspect::gain, part.gain},
            {Aspect::input, part.input},
            {Aspect::period, part.is_sporadic ? 0.0 : static_cast<double>(part.period_ns)}};
  }

  int any(Dice& dice) const { return dice.below(static_cast<int>(parts_.size())); }

  // ---- the clients

  void request() {
    if (!dice_.once_in(4)) return change(dice_, two_change_ ? Owner::first : Owner::only);
    command(dice_);
  }

  /// The second client: commands at any moment, and the shutdown in some seeds.
  void operate() {
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
    shared_->is_shut_down = true;
    timed(what, kShutdown, [&] { deployer_->shutdown(); });
  }

  /// A start, a stop, a look.
  void command(Dice& dice) {
    const auto index = static_cast<std::size_t>(any(dice));
    const std::string& name = parts_[index].name;
    const time_ns_t patience_ns = dice.between(0, ms_to_ns(60));
    switch (dice.below(9)) {
      case 0:
        ++starts_;
        return command("start " + name, s_to_ns(2) + kSlack, [&] { deployer_->start(name); });
      case 1:
      case 2:
        return command("stop " + name, patience_ns + kSlack, [&] {
          const int starts = starts_;
          deployer_->stop(name, patience_ns);
          expect_safe(index, starts);
        });
      case 3:
        return command("forced stop " + name, patience_ns + kSlack, [&] {
          const int starts = starts_;
          deployer_->stop(name, StopOptions{.timeout_ns = patience_ns, .force = true});
          expect_safe(index, starts);
        });
      case 4:
        return command("abandon " + name, kSlack, [&] { deployer_->abandon(name); });
      case 5:
        return command("revert " + name, patience_ns + s_to_ns(1) + kSlack,
                       [&] { deployer_->revert_probation(name, "as the seed wants", patience_ns); });
      case 6:
        command("settle", s_to_ns(1) + kSlack, [&] { deployer_->settle_probations(); });
        return look_at_verdicts();
      default:
        command("describe", kSlack, [&] { deployer_->describe(); });
        command("open changes", kSlack, [&] { deployer_->open_changes(); });
        command("drain the trace", kSlack, [&] { deployer_->drain_trace(); });
        command("shadows", kSlack, [&] { deployer_->shadows(); });
    }
  }

  /// A stop that has ended means safe outputs, unless somebody starts the component.
  void expect_safe(std::size_t index, int starts) {
    const auto component = architecture_->find_component(parts_[index].name);
    if (component == nullptr || starts != starts_ || changes_under_way_ > 0) return;
    Resource& output = architecture_->resource("out" + std::to_string(index));
    double found = 0.0;
    output.read_number(output.find_number("value").value(), found);
    expect(found == 0.0, "stopped " + parts_[index].name + " has output " + std::to_string(found));
    findings_.count("safe outputs after a stop");
  }

  /// No verdict is "passed" for a core that hangs.
  void look_at_verdicts() {
    for (const ProbationRecord& record : deployer_->probations()) {
      if (record.verdict == ProbationVerdict::running) continue;
      const int core = core_of(record.to_core);
      const auto hung = shared_->hung_cores.find(core);
      const time_ns_t end_ns = record.begin_ns + trials_.at(core);
      expect(record.verdict != ProbationVerdict::passed || hung == shared_->hung_cores.end() ||
                 hung->second >= end_ns,
             "core " + std::to_string(core) + " hangs in a release of its probation, and has passed it");
      history_.note_verdict(core, record.verdict);
      findings_.count(std::string("probations ") + to_string(record.verdict));
    }
  }

  // ---- changes

  void change(Dice& dice, Owner owner) {
    Transaction transaction;
    std::vector<Part> after = parts_;
    std::string text = "change:";
    next_gain_ = next_gain_ > 9.0 ? 0.125 : next_gain_ + 0.125;
    for (std::size_t i = 0; i < parts_.size(); ++i) {
      if (!owns(owner, i) || dice.once_in(2)) continue;
      Part& part = after[i];
      part.trial = kNone;
      if (dice.once_in(10)) {
        enter_shadow(transaction, static_cast<int>(i), part, dice, text);
        continue;
      }
      if (dice.once_in(2)) {
        transaction.set_property(part.name, "gain", part.gain = next_gain_);
        text += " gain " + part.name;
      }
      if (dice.once_in(6)) {
        text += " input " + part.name;
        wire(transaction, part, dice);
      }
      enter_parts(transaction, static_cast<int>(i), part, dice, text);
      enter_command(transaction, part, dice, text);
    }
    const bool changes_extra = owner != Owner::second && dice.once_in(3);
    if (changes_extra) {
      text += extra_ == kNone ? " add extra" : " remove extra";
      enter_extra(transaction, dice);
    }
    const bool resynchronises = owner == Owner::only && dice.once_in(12);
    if (resynchronises) {
      transaction.resynchronise();
      text += " resynchronise";
    }
    if (transaction.steps().empty()) return;

    constexpr std::array kPatience{ms_to_ns(5), ms_to_ns(40), s_to_ns(1)};
    TransactionOptions options{.timeouts = {.commit_ns = dice.one_of(kPatience),
                                            .phase_ns = dice.once_in(2) ? 0 : ms_to_ns(30),
                                            .prepare_ns = kPrepare},
                               .dry_run = dice.once_in(10),
                               .force = dice.once_in(6)};
    const std::uint64_t revision = architecture_->revision();
    const time_ns_t began_ns = seeds::now_ns();
    ++starts_;
    ++changes_under_way_;
    std::string refusal;
    const std::optional<TransactionReport> report =
        carry_out(dice, text, std::move(transaction), options, resynchronises, owner, refusal);
    --changes_under_way_;
    findings_.note(report ? "made, T " + std::to_string(report->instant_ns) : "refused: " + refusal);
    const std::string outcome = text + (report ? ": made" : ": refused: " + refusal);
    findings_.count(report ? "changes made" : options.dry_run ? "dry runs" : "changes refused");
    if (report) {
      note_made(*report, after, began_ns, owner);
      if (resynchronises)
        history_.note(Epoch{.epoch_ns = deployer_->epoch_ns(),
                            .instant_ns = report->instant_ns,
                            .began_ns = began_ns,
                            .ended_ns = seeds::now_ns()});
      if (changes_extra) note_extra(*report);
    }
    if (owner != Owner::second) {
      const bool is_listed = architecture_->find_component("extra") != nullptr;
      expect(is_listed == (extra_ != kNone),
             outcome + ": the list " + (is_listed ? "has" : "has not") + " the extra component");
    }
    // Commands and faults count, too.
    const std::uint64_t least = revision + (report ? 1 : 0);
    expect(architecture_->revision() >= least, outcome + ": revision " +
                                                   std::to_string(architecture_->revision()) +
                                                   ", expected at least " + std::to_string(least));
    expect_described(outcome, owner);
  }

  /// Starts a component that stands, or stops one that runs; now and then the other way round, which is refused.
  void enter_command(Transaction& transaction, const Part& part, Dice& dice, std::string& text) {
    const auto component = architecture_->find_component(part.name);
    if (component == nullptr || !dice.once_in(4)) return;
    const bool starts = (component->task().state() != ComponentState::running) != dice.once_in(20);
    if (!starts && !dice.once_in(3)) return;
    if (starts) {
      transaction.start(part.name);
    } else {
      transaction.stop(part.name);
    }
    text += (starts ? " start " : " stop ") + part.name;
  }

  void wire(Transaction& transaction, Part& part, Dice& dice) {
    if (part.input != kUnconnected) transaction.disconnect(part.name, "input");
    part.input = kUnconnected;
    if (!part.is_sporadic && dice.once_in(3)) return;
    const int target = any(dice);
    transaction.connect(part.name, "input", "out" + std::to_string(target), "read");
    part.input = written_by(target);
  }

  /// Gives a component a shadow; of one that has a shadow promotes or ends it.
  void enter_shadow(Transaction& transaction, int index, Part& part, Dice& dice, std::string& text) {
    for (const ShadowRecord& shadow : deployer_->shadows()) {
      if (shadow.component != part.name || shadow.verdict != ShadowVerdict::running) continue;
      if (dice.once_in(2)) {
        transaction.promote(part.name);
        part.core = core_of(shadow.core);
        text += " promote " + part.name;
      } else {
        transaction.end_shadow(part.name);
        text += " end of shadow " + part.name;
      }
      return;
    }
    if (part.is_sporadic) return;
    const Manner manner = Manner::any(dice);
    text += " shadow " + std::to_string(next_core_) + " (" + manner.name() + ") " + part.name;
    transaction.shadow(part.name, core(index, manner), {.budget_ns = ms_to_ns(1)},
                       std::make_unique<TestShell>());
  }
  static int core_of(const std::string& implementation) {
    return std::stoi(implementation.substr(implementation.find("Core") + 4));
  }

  /// New parts of one component: a core, on probation or not, an fsm with the same period or another one, a shell.
  void enter_parts(Transaction& transaction, int index, Part& part, Dice& dice, std::string& text) {
    const Manner manner = Manner::any(dice);
    bool is_on_probation = false;
    if (dice.once_in(2)) {
      is_on_probation = !part.is_sporadic && dice.once_in(3);
      text += " core " + std::to_string(next_core_) + " (" + manner.name() +
              (is_on_probation ? ", on probation" : "") + ") " + part.name;
      part.core = next_core_;
      auto fresh = core(index, manner, is_on_probation);
      if (is_on_probation) {
        part.trial = part.core;
        trials_[part.trial] = dice.between(ms_to_ns(2), ms_to_ns(90));
        transaction.replace_core(
            part.name, std::move(fresh),
            ProbationOptions{.duration_ns = trials_[part.trial], .on_overrun = dice.once_in(3)});
      } else {
        transaction.replace_core(part.name, std::move(fresh));
      }
    }
    if (part.is_sporadic || !dice.once_in(6)) return;
    if (!is_on_probation && dice.once_in(3)) {
      const std::int64_t period_ms = 2 + dice.below(9);
      transaction.set_property(part.name, "period_ms", period_ms);
      part.period_ns = ms_to_ns(period_ms);
      text += " period " + part.name;
    }
    if (!is_on_probation && dice.once_in(3)) {
      transaction.replace_shell(part.name, std::make_unique<TestShell>());
      text += " shell " + part.name;
    }
    transaction.replace_fsm(part.name, new_part<FsmBase, SeedFsm>());
    text += " fsm " + part.name;
  }

  /// Adds the extra component and a resource that it writes, or removes both.
  void enter_extra(Transaction& transaction, Dice& dice) {
    if (extra_ != kNone) {
      transaction.remove_component("extra");
      transaction.remove_resource("extra_out");
      return;
    }
    ComponentParts rest{.settings = {.priority = 10 + 10 * dice.below(4)}};
    rest.properties["period_ms"] = std::int64_t{kExtraPeriod / ms_to_ns(1)};
    next_extra_core_ = next_core_;
    transaction.add_resource("extra_out", std::make_unique<LatestValue<Number>>());
    transaction.add_component("extra",
                              Parts{.shell = new_part<Shell, TestShell>(),
                                    .core = core(kExtra + next_extra_, Manner{}),
                                    .fsm = new_part<FsmBase, SeedFsm>()},
                              rest);
    transaction.connect("extra", "output", "extra_out", "write");
    transaction.start("extra");
  }

  /// In one of the ways that there are: at once, in two halves, or prepared and committed by a real-time thread.
  std::optional<TransactionReport> carry_out(Dice& dice, const std::string& text, Transaction transaction,
                                             TransactionOptions options, bool resynchronises, Owner owner,
                                             std::string& refusal) {
    std::optional<TransactionReport> report;
    time_ns_t longest_ns = 2 * options.timeouts.commit_ns + options.timeouts.phase_ns + kPrepare + kSlack;
    longest_ns += static_cast<time_ns_t>(parts_.size()) * ms_to_ns(16);  // slow hooks, one after the other
    if (two_change_) longest_ns *= 2;                                    // it waits for the other one's
    // A change that a shutdown overtakes waits for the thread of each of its components, one after the other.
    if (shuts_down_ || owner == Owner::second)
      longest_ns += static_cast<time_ns_t>(parts_.size()) * ms_to_ns(500);
    const int way = options.dry_run || resynchronises ? 0 : dice.below(4);
    if (way == 3) options.force = false;
    timed(text, longest_ns, [&] {
      try {
        if (way == 3) {
          report = commit_prepared(dice, std::move(transaction), options);
        } else if (way == 2) {
          const auto made = deployer_->make(std::move(transaction), options);
          report = made->report(options.timeouts.phase_ns);
        } else {
          report = deployer_->commit(std::move(transaction), options);
        }
      } catch (const Error& error) {
        refusal = error.what();
        expect(error.code() != ErrorCode::internal, "internal error: " + refusal);
      }
    });
    if (options.dry_run) report.reset();
    return report;
  }

  TransactionReport commit_prepared(Dice& dice, Transaction transaction, const TransactionOptions& options) {
    const auto prepared = deployer_->prepare(std::move(transaction), options);
    sleep_for(dice.between(0, ms_to_ns(3)));
    if (dice.once_in(3)) {
      prepared->commit(options.timeouts.commit_ns);
    } else {
      struct Order {
        PreparedTransaction* prepared;
        time_ns_t timeout_ns;
      } order{.prepared = prepared.get(), .timeout_ns = options.timeouts.commit_ns};
      Thread thread;
      thread.start(
          {.name = "rule", .priority = 97},
          [](void* given) -> void* {
            const auto& one = *static_cast<Order*>(given);
            one.prepared->commit(one.timeout_ns);
            return nullptr;
          },
          &order);
      thread.join();
    }
    findings_.count("prepared changes");
    return prepared->complete();
  }

  static time_ns_t instant_of(const TransactionReport& report, const std::string& component) {
    time_ns_t instant_ns = kNotMeasured;
    for (const StepReport& step : report.steps) {
      if (step.component == component && step.instant_ns != kNotMeasured) instant_ns = step.instant_ns;
    }
    return instant_ns;
  }

  void note_made(const TransactionReport& report, const std::vector<Part>& after, time_ns_t began_ns,
                 Owner owner) {
    for (std::size_t i = 0; i < parts_.size(); ++i) {
      if (!owns(owner, i)) continue;
      const time_ns_t instant_ns = instant_of(report, parts_[i].name);
      expect(instant_ns == kNotMeasured || instant_ns == report.instant_ns,
             parts_[i].name + " has another instant than the change");
      const auto before = aspects_of(parts_[i]);
      for (const auto& [aspect, value] : aspects_of(after[i])) {
        if (value == before.at(aspect)) continue;
        history_.note(Made{.component = static_cast<int>(i),
                           .aspect = aspect,
                           .value = value,
                           .instant_ns = instant_ns,
                           .began_ns = began_ns,
                           .ended_ns = seeds::now_ns(),
                           .may_go_back = aspect == Aspect::core && after[i].trial != kNone});
      }
      parts_[i] = after[i];
    }
  }

  void note_extra(const TransactionReport& report) {
    if (extra_ != kNone) {
      extra_ = kNone;
      findings_.count("components removed");
      return;
    }
    extra_ = kExtra + next_extra_++;
    const Part part{.name = "extra",
                    .period_ns = kExtraPeriod,
                    .is_sporadic = false,
                    .has_fallback = false,
                    .core = next_extra_core_};
    for (const auto& [aspect, value] : aspects_of(part))
      history_.note(Made{.component = extra_,
                         .aspect = aspect,
                         .value = value,
                         .instant_ns = instant_of(report, "extra"),
                         .ended_ns = seeds::now_ns()});
    findings_.count("components added");
  }

  // ---- what must hold

  /// By the description each component is as the changes made it. One that is late to a change that was made, or was given up there,
  /// may show what was before.
  void expect_described(const std::string& after_what, Owner owner) {
    for (const ComponentFacts& facts : architecture_->describe().components) {
      const auto part = std::ranges::find(parts_, facts.name, &Part::name);
      if (part == parts_.end()) continue;
      const auto index = static_cast<std::size_t>(part - parts_.begin());
      if (!owns(owner, index)) continue;
      const auto component = architecture_->find_component(facts.name);
      if (component == nullptr || architecture_->find_awaited(facts.name) != nullptr ||
          component->task().is_left_behind())
        continue;
      for (const ShownProperty& property : facts.parts.properties) {
        if (property.name != "gain") continue;
        const double found = std::get<double>(property.value);
        expect(found == part->gain, after_what + ": found gain " + std::to_string(found) + " of " +
                                        facts.name + ", expected " + std::to_string(part->gain));
      }
      for (const ShownPort& port : facts.parts.ports) {
        if (port.name != "input") continue;
        const std::string expected =
            part->input == kUnconnected
                ? ""
                : "out" + std::to_string(static_cast<int>(part->input - written_by(0)));
        expect(port.resource == expected, after_what + ": the input of " + facts.name + " is connected to '" +
                                              port.resource + "', expected '" + expected + "'");
      }
    }
  }

  /// Each component that runs is released; nobody has lost a wake-up.
  void expect_alive() {
    constexpr time_ns_t kLongest = ms_to_ns(150);
    std::map<std::string, ComponentState> states;
    for (const auto& component : architecture_->components())
      states[component->name()] = component->task().state();
    const time_ns_t began_ns = seeds::now_ns();
    sleep_for(kLongest + (seeds::outcome().stalled_ns > 0 ? ms_to_ns(60) : 0));
    for (std::size_t i = 0; i < parts_.size(); ++i) {
      const auto component = architecture_->find_component(parts_[i].name);
      if (component == nullptr || states[parts_[i].name] != ComponentState::running ||
          component->task().state() != ComponentState::running ||
          shared_->hung_components.contains(static_cast<int>(i)))
        continue;
      const bool has_run = std::ranges::any_of(shared_->executions, [&](const Execution& execution) {
        return execution.component == static_cast<int>(i) && execution.at_ns > began_ns;
      });
      findings_.count("components alive");
      expect(has_run, parts_[i].name + " is running, and has not executed for " +
                          std::to_string(kLongest / 1'000'000) + " ms");
    }
  }

  /// After the end: no thread and no part is left.
  void settle() {
    for (int tries = 0; tries < 1000 && seeds::outcome().alive > 1; ++tries) sleep_for(ms_to_ns(1));
    expect(seeds::outcome().alive == 1, "threads are left:\n" + seeds::alive());
    if (!leaves_nothing_ && !shared_->hung_cores.empty()) return;
    for (const auto& [number, core] : shared_->cores) expect(false, "is left: " + core);
  }

  Dice dice_;
  seeds::Findings& findings_;
  std::uint64_t seed_;
  bool shuts_down_;  // the second client, at any moment
  bool two_change_;  // the second client, too
  bool leaves_nothing_{false};
  std::shared_ptr<Shared> shared_{std::make_shared<Shared>(findings_)};
  History history_{findings_};
  Architecture* architecture_{nullptr};
  Deployer* deployer_{nullptr};
  std::vector<Part> parts_;
  int next_core_{0};
  std::shared_ptr<int> next_fallback_{std::make_shared<int>(kFirstFallback)};
  int extra_{kNone};  // the number of the component that is there
  int next_extra_{0}, next_extra_core_{0};
  std::map<int, time_ns_t> trials_;  // of each core on probation how long
  int starts_{0}, changes_under_way_{0};
  double next_gain_{1.0};
};

inline void random_architecture(std::uint64_t seed, seeds::Findings& findings) {
  RandomArchitecture(seed, findings).run();
}

}  // namespace mauve::testing
