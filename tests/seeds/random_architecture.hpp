// SPDX-License-Identifier: LGPL-3.0-or-later
// A scenario of the seeds: an architecture of 1 to 5 components, random requests, and what must hold whatever the interleaving.
#pragma once

#include <array>
#include <map>
#include <memory>
#include <optional>
#include <random>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "mauve_rt/base/seam/ordinary_thread.hpp"
#include "mauve_rt/base/seam/sleep.hpp"

#include "fixtures.hpp"
#include "forked_run.hpp"

namespace mauve::testing {

/// Draws the same numbers from the same seed on every computer.
class Dice {
 public:
  explicit Dice(std::uint64_t seed) : random_(seed) {}
  int below(int bound) { return static_cast<int>(random_() % static_cast<std::uint64_t>(bound)); }
  bool once_in(int times) { return below(times) == 0; }
  time_ns_t between(time_ns_t least_ns, time_ns_t most_ns) {
    return least_ns + static_cast<time_ns_t>(random_() % static_cast<std::uint64_t>(most_ns - least_ns + 1));
  }

 private:
  std::mt19937_64 random_;
};

struct Execution {
  int component;
  time_ns_t clock_ns;
  time_ns_t at_ns;
  int core;
  double gain;
};

/// What all cores of a run share. One thread runs at a time: nothing needs a lock.
struct Shared {
  std::vector<Execution> executions{};
  bool hung_may_go_on{false};
  int hung{0}, thrown{0};
};

enum class Manner : std::uint8_t { good, slow, throws, hangs, refuses, throws_in_adopt, slow_in_adopt };
inline constexpr std::array kMannerNames{
    "good", "slow", "throws", "hangs", "refuses", "throws_in_adopt", "slow_in_adopt"};

/// Notes each of its executions, and behaves badly after some.
class SeedCore : public TestCore {
 public:
  SeedCore(std::shared_ptr<Shared> shared, int component, int number, Manner manner, std::uint64_t seed)
      : number_(number), shared_(std::move(shared)), component_(component), manner_(manner), dice_(seed) {}

  void act() override {
    TestCore::act();
    shared_->executions.push_back({.component = component_,
                                   .clock_ns = clock_ns(),
                                   .at_ns = seeds::now_ns(),
                                   .core = number_,
                                   .gain = exposed_shell().gain.value()});
    const bool is_bad = ++runs_here_ > 3 && dice_.once_in(4);
    if (manner_ == Manner::throws && is_bad) fail();
    if (manner_ == Manner::hangs && is_bad) hang();
    compute(manner_ == Manner::slow ? us_to_ns(900) : us_to_ns(60));
  }
  bool adopt(const CoreBase& /*old*/) override {
    if (manner_ == Manner::throws_in_adopt) throw std::runtime_error("as the seed wants");
    if (manner_ == Manner::slow_in_adopt) sleep_for(dice_.between(us_to_ns(100), ms_to_ns(8)));
    compute(us_to_ns(20));
    return manner_ != Manner::refuses;
  }
  void take(CoreBase& /*old*/) noexcept override { compute(us_to_ns(20)); }
  std::string description() const override { return "core " + std::to_string(number_); }

 private:
  void compute(time_ns_t most_ns) noexcept {
    const time_ns_t until_ns = monotonic_now_ns() + dice_.between(0, most_ns);
    while (monotonic_now_ns() < until_ns) {
    }
  }
  void fail() const {
    ++shared_->thrown;
    throw std::runtime_error("as the seed wants");
  }
  void hang() noexcept {
    ++shared_->hung;
    while (!shared_->hung_may_go_on) sleep_for(ms_to_ns(1));
  }

  int number_;
  int runs_here_{0};
  std::shared_ptr<Shared> shared_;
  int component_;
  Manner manner_;
  Dice dice_;
};

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
      epoch_ns_ = deployer.epoch_ns();
      OrdinaryThread other([this] { operate(); });
      for (int requests = 3 + dice_.below(25); requests > 0; --requests) {
        sleep_for(dice_.between(0, ms_to_ns(dice_.once_in(4) ? 40 : 4)));
        request();
      }
      if (dice_.once_in(2)) {
        timed("shutdown", kShutdown, [&] { deployer.shutdown(); });
        other.join();
      } else {
        other.join();
        timed("shutdown", kShutdown, [&] { deployer.shutdown(); });
      }
      shared_->hung_may_go_on = true;
    }
    check_executions();
    findings_.count("executions", static_cast<int>(shared_->executions.size()));
    findings_.count("hung cores", shared_->hung);
    findings_.count("thrown exceptions", shared_->thrown);
    for (int tries = 0; tries < 1000 && seeds::outcome().alive > 1; ++tries) sleep_for(ms_to_ns(1));
    expect(seeds::outcome().alive == 1, "threads are left:\n" + seeds::alive());
  }

 private:
  struct Part {
    std::string name;
    time_ns_t period_ns;
    double gain{1.0};
    int core{0};
  };
  /// A change that was made, as one component sees it.
  struct Made {
    int component;
    time_ns_t instant_ns;  // T, where it is known
    time_ns_t began_ns, ended_ns;
    double gain;
    int core;
    int removed{
        kAbsent};  // the core that a removal is about: T may be before executions of an earlier component of that name
  };

  /// Which client changes a component: the only one, or each of two every other.
  enum class Owner : std::uint8_t { only, first, second };
  static bool owns(Owner owner, std::size_t component) {
    return owner == Owner::only || component % 2 == (owner == Owner::first ? 0U : 1U);
  }

  static constexpr int kExtra = -1, kAbsent = -1;  // a component, a core
  static constexpr time_ns_t kExtraPeriod = ms_to_ns(3);
  static constexpr time_ns_t kSlack = ms_to_ns(150);
  static constexpr time_ns_t kShutdown = Deployer::kStopTimeout + ms_to_ns(500) + kSlack;

  void expect(bool is_true, const std::string& otherwise) { findings_.expect(is_true, otherwise); }

  /// A request is answered in time, but for the stalls of the computer.
  template <typename Request>
  void timed(const std::string& what, time_ns_t longest_ns, Request&& request) {
    const time_ns_t began_ns = seeds::now_ns();
    const time_ns_t stalled_ns = seeds::outcome().stalled_ns;
    findings_.note(what);
    request();
    findings_.note("end of " + what);
    const time_ns_t took_ns = seeds::now_ns() - began_ns - (seeds::outcome().stalled_ns - stalled_ns);
    expect(took_ns <= longest_ns, what + " took " + std::to_string(took_ns / 1000) +
                                      " us, expected at most " + std::to_string(longest_ns / 1000) + " us");
  }

  void declare() {
    const int count = 1 + dice_.below(5);
    for (int i = 0; i < count; ++i) {
      const std::int64_t period_ms = 2 + dice_.below(9);
      parts_.push_back(
          {.name = "c" + std::to_string(i), .period_ns = ms_to_ns(period_ms), .core = next_core_});
      Component& component = architecture_->add_component(parts_.back().name, std::make_unique<TestShell>(),
                                                          core(i, Manner::good), std::make_unique<TestFsm>(),
                                                          {.priority = 10 + 10 * dice_.below(4)});
      component.set_property("period_ms", period_ms);
    }
    architecture_->configure();
  }

  std::unique_ptr<CoreBase> core(int component, Manner manner) {
    const int number = next_core_++;
    return std::make_unique<SeedCore>(shared_, component, number, manner,
                                      seed_ * 1000 + static_cast<std::uint64_t>(number));
  }
  static Manner any_manner(Dice& dice) {
    if (dice.once_in(2)) return Manner::good;
    return static_cast<Manner>(dice.below(static_cast<int>(kMannerNames.size())));
  }
  int any(Dice& dice) const { return dice.below(static_cast<int>(parts_.size())); }

  void request() {
    if (!dice_.once_in(4)) return change(dice_, two_change_ ? Owner::first : Owner::only);
    command(dice_);
  }

  /// A start, a stop, a look.
  void command(Dice& dice) {
    const std::string& name = parts_[static_cast<std::size_t>(any(dice))].name;
    const time_ns_t patience_ns = dice.between(0, ms_to_ns(60));
    try {
      switch (dice.below(6)) {
        case 0:
          return timed("start " + name, s_to_ns(1) + kSlack, [&] { deployer_->start(name); });
        case 1:
        case 2:
          return timed("stop " + name, patience_ns + kSlack, [&] { deployer_->stop(name, patience_ns); });
        case 3:
          return timed("forced stop " + name, patience_ns + kSlack,
                       [&] { deployer_->stop(name, StopOptions{.timeout_ns = patience_ns, .force = true}); });
        case 4:
          return timed("abandon " + name, kSlack, [&] { deployer_->abandon(name); });
        default:
          timed("describe", kSlack, [&] { deployer_->describe(); });
          timed("drain the trace", kSlack, [&] { deployer_->drain_trace(); });
      }
    } catch (const Error& error) {
      findings_.count("commands refused");
      expect(error.code() != ErrorCode::internal, std::string("internal error: ") + error.what());
    }
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
    if (shuts_down_) timed("shutdown of the second client", kShutdown, [&] { deployer_->shutdown(); });
  }

  /// By the description each component has its gain. One that is late to a change that was made, or was given up there, may show
  /// the old one.
  void expect_gains(const std::string& after_what, Owner owner) {
    for (const ComponentFacts& facts : architecture_->describe().components) {
      const auto part = std::ranges::find(parts_, facts.name, &Part::name);
      if (part == parts_.end()) continue;
      if (!owns(owner, static_cast<std::size_t>(part - parts_.begin()))) continue;
      const auto component = architecture_->find_component(facts.name);
      if (architecture_->find_awaited(facts.name) != nullptr || component->task().is_left_behind()) continue;
      for (const ShownProperty& property : facts.parts.properties) {
        if (property.name != "gain") continue;
        const double found = std::get<double>(property.value);
        expect(found == part->gain, after_what + ": found gain " + std::to_string(found) + " of " +
                                        facts.name + ", expected " + std::to_string(part->gain));
      }
    }
  }

  void change(Dice& dice, Owner owner) {
    Transaction transaction;
    std::vector<Part> after = parts_;
    std::string text = "change:";
    next_gain_ = next_gain_ > 9.0 ? 0.125 : next_gain_ + 0.125;
    for (std::size_t i = 0; i < parts_.size(); ++i) {
      if (!owns(owner, i) || dice.once_in(2)) continue;
      const std::string& name = parts_[i].name;
      if (dice.once_in(2)) {
        transaction.set_property(name, "gain", after[i].gain = next_gain_);
        text += " gain " + name;
      }
      if (dice.once_in(2)) {
        const Manner manner = any_manner(dice);
        after[i].core = next_core_;
        transaction.replace_core(name, core(static_cast<int>(i), manner));
        text += std::string(" core ") + kMannerNames[static_cast<std::size_t>(manner)] + " " + name;
      }
      if (dice.once_in(6)) {
        transaction.replace_fsm(name, std::make_unique<TestFsm>());  // keeps its place
        text += " fsm " + name;
      }
      if (dice.once_in(12)) transaction.stop(name);
      if (dice.once_in(6)) transaction.start(name);
    }
    const bool changes_extra = owner != Owner::second && dice.once_in(3);
    int extra = extra_;
    if (changes_extra) {
      extra = extra_ == kAbsent ? next_core_ : kAbsent;
      text += extra_ == kAbsent ? " add extra" : " remove extra";
      enter_extra(transaction, dice);
    }
    if (transaction.steps().empty()) return;
    constexpr std::array kPatience{ms_to_ns(5), ms_to_ns(40), s_to_ns(1)};
    const TransactionOptions options{
        .timeouts = {.commit_ns = kPatience[static_cast<std::size_t>(dice.below(3))],
                     .phase_ns = dice.once_in(2) ? 0 : ms_to_ns(30)},
        .force = dice.once_in(6)};
    const std::uint64_t revision = architecture_->revision();
    const time_ns_t began_ns = seeds::now_ns();
    std::optional<TransactionReport> report;
    std::string refusal;
    time_ns_t longest_ns = 2 * options.timeouts.commit_ns + options.timeouts.phase_ns + kSlack;
    // A change that a shutdown overtakes waits for the thread of each of its components, one after the other.
    if (two_change_) longest_ns *= 2;  // it waits for the other one's
    if (shuts_down_ || owner == Owner::second)
      longest_ns += static_cast<time_ns_t>(parts_.size()) * ms_to_ns(500);
    timed(text, longest_ns, [&] {
      try {
        report = deployer_->commit(std::move(transaction), options);
      } catch (const Error& error) {
        refusal = error.what();
        expect(error.code() != ErrorCode::internal, "internal error: " + refusal);
      }
    });
    if (report) note_made(*report, after, began_ns, owner);
    if (report && changes_extra) {
      const int removed = std::exchange(extra_, extra);
      made_.push_back({.component = kExtra,
                       .instant_ns = instant_of(*report, "extra"),
                       .began_ns = began_ns,
                       .ended_ns = seeds::now_ns(),
                       .gain = 1.0,
                       .core = extra,
                       .removed = removed});
      findings_.count(extra == kAbsent ? "components removed" : "components added");
    }
    if (owner != Owner::second) {
      const bool is_listed = architecture_->find_component("extra") != nullptr;
      expect(is_listed == (extra_ != kAbsent), text + (report ? ": made" : ": refused: " + refusal) +
                                                   ": the list " + (is_listed ? "has" : "has not") +
                                                   " the extra component");
    }
    findings_.count(report ? "changes made" : "changes refused");
    findings_.note(
        (report ? "made, T " + std::to_string(report->instant_ns) : "refused: " + refusal) +
        (changes_extra && report ? ", of extra " + std::to_string(instant_of(*report, "extra")) : ""));
    // Commands and faults count, too.
    const std::uint64_t least = revision + (report ? 1 : 0);
    expect(architecture_->revision() >= least, text + ": revision " +
                                                   std::to_string(architecture_->revision()) +
                                                   ", expected at least " + std::to_string(least));
    expect_gains(text + (report ? ": made" : ": refused: " + refusal), owner);
  }

  /// Adds the extra component, or removes it.
  void enter_extra(Transaction& transaction, Dice& dice) {
    if (extra_ != kAbsent) {
      transaction.remove_component("extra");
      return;
    }
    ComponentParts rest{.settings = {.priority = 10 + 10 * dice.below(4)}};
    rest.properties["period_ms"] = std::int64_t{kExtraPeriod / ms_to_ns(1)};
    transaction.add_component("extra",
                              Parts{.shell = new_part<Shell, TestShell>(),
                                    .core = core(kExtra, Manner::good),
                                    .fsm = new_part<FsmBase, TestFsm>()},
                              rest);
    transaction.start("extra");
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
    const time_ns_t ended_ns = seeds::now_ns();
    for (std::size_t i = 0; i < parts_.size(); ++i) {
      if (!owns(owner, i) || (after[i].gain == parts_[i].gain && after[i].core == parts_[i].core)) continue;
      const time_ns_t instant_ns = instant_of(report, parts_[i].name);
      expect(instant_ns == kNotMeasured || instant_ns == report.instant_ns,
             parts_[i].name + " has another instant than the change");
      made_.push_back({.component = static_cast<int>(i),
                       .instant_ns = instant_ns,
                       .began_ns = began_ns,
                       .ended_ns = ended_ns,
                       .gain = after[i].gain,
                       .core = after[i].core});
      parts_[i] = after[i];
    }
  }

  /// Whether an execution comes after a change: yes, no, or either where the change has no instant.
  static bool may_be_before(const Execution& execution, const Made& made) {
    if (made.instant_ns != kNotMeasured) return execution.clock_ns < made.instant_ns;
    return execution.at_ns <= made.ended_ns;
  }
  static bool may_be_after(const Execution& execution, const Made& made) {
    if (made.instant_ns != kNotMeasured) return execution.clock_ns >= made.instant_ns;
    return execution.at_ns >= made.began_ns;
  }

  /// Before T the old core and the old gain, from T on the new ones; each release on the grid, none twice.
  void check_executions() {
    std::map<int, time_ns_t> last_clocks;
    for (const Execution& execution : shared_->executions) {
      const Part part = execution.component == kExtra ? Part{.name = "extra", .period_ns = kExtraPeriod}
                                                      : parts_[static_cast<std::size_t>(execution.component)];
      const std::string where = part.name + " at clock " + std::to_string(execution.clock_ns) + " (core " +
                                std::to_string(execution.core) + ", gain " + std::to_string(execution.gain) +
                                ")";
      const auto [last, is_first] = last_clocks.try_emplace(execution.component, execution.clock_ns);
      expect(is_first || execution.clock_ns > last->second,
             where + " executes not later than before, at " + std::to_string(last->second));
      last->second = execution.clock_ns;
      expect((execution.clock_ns - epoch_ns_) % part.period_ns == 0, where + " is not on its grid");
      std::vector<std::pair<double, int>> possible{
          {1.0, execution.component}};  // at first the extra one is absent
      for (const Made& made : made_) {
        if (made.component != execution.component || !may_be_after(execution, made)) continue;
        if (made.removed != kAbsent && made.removed != execution.core) continue;
        if (!may_be_before(execution, made)) possible.clear();
        possible.emplace_back(made.gain, made.core);
      }
      const bool is_known =
          std::ranges::find(possible, std::pair(execution.gain, execution.core)) != possible.end();
      std::string expected;
      for (const auto& [gain, core] : possible)
        expected += " (core " + std::to_string(core) + ", gain " + std::to_string(gain) + ")";
      expect(is_known, where + " executes at " + std::to_string(execution.at_ns) +
                           " with parts of another side of a change; expected one of" + expected);
    }
  }

  Dice dice_;
  seeds::Findings& findings_;
  std::uint64_t seed_;
  bool shuts_down_;  // the second client, at any moment
  bool two_change_;  // the second client, too
  std::shared_ptr<Shared> shared_{std::make_shared<Shared>()};
  Architecture* architecture_{nullptr};
  Deployer* deployer_{nullptr};
  time_ns_t epoch_ns_{0};
  std::vector<Part> parts_;
  std::vector<Made> made_;
  int next_core_{0};
  int extra_{kAbsent};  // the core of the component that is added and removed
  double next_gain_{1.0};
};

inline void random_architecture(std::uint64_t seed, seeds::Findings& findings) {
  RandomArchitecture(seed, findings).run();
}

}  // namespace mauve::testing
