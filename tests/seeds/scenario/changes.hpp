// SPDX-License-Identifier: LGPL-3.0-or-later
// Changes: random transactions, each carried out in one of the ways that there are, and what must be so afterwards.
#pragma once

#include <array>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "mauve_rt/base/seam/sleep.hpp"
#include "mauve_rt/base/seam/thread.hpp"

#include "checks.hpp"

namespace mauve::testing {

class Changes : protected Checks {
 protected:
  using Checks::Checks;

  void change(Dice& dice, Owner owner, bool may_prepare = true) {
    Draft draft = drawn(dice, owner);
    if (draft.transaction.steps().empty()) return;
    for (std::size_t i = 0; i < parts_.size(); ++i) {
      if (draft.touched[i]) shared_->stopped.erase(static_cast<int>(i));
    }
    const Intervention here(*this);
    const std::uint64_t revision = architecture_->revision();
    const int prepared = prepared_;
    const bool may_be_preempted = open_prepared_ > 0;
    carry_out(dice, draft, may_prepare, here);
    const std::optional<TransactionReport>& report = draft.report;
    findings_.note(report ? "made, T " + std::to_string(report->instant_ns) : "refused: " + draft.refusal);
    const std::string outcome = draft.text + (report ? ": made" : ": refused: " + draft.refusal);
    findings_.count(report ? "changes made" : draft.options.dry_run ? "dry runs" : "changes refused");
    if (report) note_made(draft, here);
    expect_right_refusal(draft, outcome);
    expect(draft.refusal.find("a prepared change") == std::string::npos || prepared_ != prepared ||
               may_be_preempted,
           outcome + ", and there is no prepared change");
    expect_listed(owner, outcome);
    // Commands and faults count, too.
    const std::uint64_t least = revision + (report ? 1 : 0);
    expect(architecture_->revision() >= least, outcome + ": revision " +
                                                   std::to_string(architecture_->revision()) +
                                                   ", expected at least " + std::to_string(least));
    expect_described(outcome, owner);
    expect_just_faults();
  }

  /// An order to stop what a change has started: its thread may not have taken up the start yet.
  void stop_what_was_started(std::size_t index, const Intervention& here) {
    const std::string& name = parts_[index].name;
    try {
      deployer_->stop(name, ms_to_ns(200));
      findings_.count("stops of pending starts");
    } catch (const Error& error) {
      sleep_for(ms_to_ns(2));
      const ComponentState state = state_of(index);
      expect(error.code() != ErrorCode::not_running || state != ComponentState::running || !here.is_sole(),
             "the stop of " + name + ", which a change has started, was refused: " + error.what());
    }
  }

 private:
  static constexpr std::size_t kNobody = ~std::size_t{0};

  /// A component that one client adds and removes, with a resource that it writes.
  struct Extra {
    std::string name;
    int number{kNone};  // of the component that is there
    std::string output() const { return name + "_out"; }
  };

  /// A transaction, and what becomes of the components if it is made.
  struct Draft {
    Owner owner;
    Transaction transaction{};
    TransactionOptions options{};
    std::string text{"change:"};
    std::vector<Part> before{}, after{};
    std::vector<bool> touched{};
    std::vector<bool> runs{};       // before
    std::vector<bool> only_sets{};  // properties or connections: that repairs nothing
    std::size_t started{kNobody};
    bool changes_extra{false};
    int extra_before{kNone}, extra_after{kNone}, extra_core{kNone};
    bool resynchronises{false};
    time_ns_t began_ns{0};
    std::optional<TransactionReport> report{};
    std::string refusal{};
  };

  /// A prepared change, from before its preparation to after its end.
  class Preparation {
   public:
    explicit Preparation(Changes& changes) : changes_(changes) {
      ++changes_.prepared_;
      ++changes_.open_prepared_;
    }
    ~Preparation() { --changes_.open_prepared_; }
    Preparation(const Preparation&) = delete;
    Preparation& operator=(const Preparation&) = delete;

   private:
    Changes& changes_;
  };

  Extra& extra_of(Owner owner) { return extras_[owner == Owner::second ? 1 : 0]; }

  // ---- what is to be changed

  Draft drawn(Dice& dice, Owner owner) {
    Draft draft{.owner = owner,
                .before = parts_,
                .after = parts_,
                .touched = std::vector<bool>(parts_.size()),
                .runs = std::vector<bool>(parts_.size()),
                .only_sets = std::vector<bool>(parts_.size(), true)};
    next_gain_ = next_gain_ > 9.0 ? 0.125 : next_gain_ + 0.125;
    for (std::size_t i = 0; i < parts_.size(); ++i) {
      if (!owns(owner, i) || dice.once_in(2)) continue;
      const std::size_t steps = draft.transaction.steps().size();
      enter_component(draft, i, dice);
      draft.runs[i] = state_of(i) == ComponentState::running;
      draft.touched[i] = draft.transaction.steps().size() != steps;
    }
    if (dice.once_in(3)) enter_extra(draft, dice);
    if (owner == Owner::only && dice.once_in(12)) {
      draft.resynchronises = true;
      draft.transaction.resynchronise();
      draft.text += " resynchronise";
    }
    constexpr std::array kPatience{ms_to_ns(5), ms_to_ns(40), s_to_ns(1)};
    draft.options = {.timeouts = {.commit_ns = dice.one_of(kPatience),
                                  .phase_ns = dice.once_in(2) ? 0 : ms_to_ns(30),
                                  .prepare_ns = kPrepare},
                     .dry_run = dice.once_in(10),
                     .force = dice.once_in(shared_->hanging > 0 ? 2 : 6)};
    return draft;
  }

  void enter_component(Draft& draft, std::size_t index, Dice& dice) {
    Part& part = draft.after[index];
    part.trial = kNone;
    if (dice.once_in(10)) {
      draft.only_sets[index] = false;
      return enter_shadow(draft, index, dice);
    }
    if (dice.once_in(2)) {
      draft.transaction.set_property(part.name, "gain", part.gain = next_gain_);
      draft.text += " gain " + part.name;
    }
    if (dice.once_in(6)) wire(draft, part, dice);
    const std::size_t settings = draft.transaction.steps().size();
    enter_parts(draft, index, dice);
    enter_command(draft, index, dice);
    draft.only_sets[index] = draft.transaction.steps().size() == settings;
  }

  /// Starts a component that stands, or stops one that runs; now and then the other way round, which is refused.
  void enter_command(Draft& draft, std::size_t index, Dice& dice) {
    const std::string& name = draft.after[index].name;
    if (architecture_->find_component(name) == nullptr || !dice.once_in(4)) return;
    const bool starts = (state_of(index) != ComponentState::running) != dice.once_in(20);
    if (!starts && !dice.once_in(3)) return;
    if (starts) {
      draft.transaction.start(name);
      draft.started = index;
    } else {
      draft.transaction.stop(name);
    }
    draft.text += (starts ? " start " : " stop ") + name;
  }

  void wire(Draft& draft, Part& part, Dice& dice) {
    draft.text += " input " + part.name;
    if (part.input != kUnconnected) draft.transaction.disconnect(part.name, "input");
    part.input = kUnconnected;
    if (!part.is_sporadic && dice.once_in(3)) return;
    const int target = any(dice);
    draft.transaction.connect(part.name, "input", output_of(static_cast<std::size_t>(target)), "read");
    part.input = written_by(target);
  }

  /// Gives a component a shadow; of one that has a shadow promotes or ends it. A fresh candidate keeps its own count.
  void enter_shadow(Draft& draft, std::size_t index, Dice& dice) {
    Part& part = draft.after[index];
    for (const ShadowRecord& shadow : deployer_->shadows()) {
      if (shadow.component != part.name || shadow.verdict != ShadowVerdict::running) continue;
      if (dice.once_in(2)) {
        draft.transaction.promote(part.name, {.is_fresh = !shared_->copied.contains(core_of(shadow.core))});
        part.core = core_of(shadow.core);
        draft.text += " promote " + part.name;
      } else {
        draft.transaction.end_shadow(part.name);
        draft.text += " end of shadow " + part.name;
      }
      return;
    }
    if (part.is_sporadic) return;
    const Manner manner = Manner::any(dice);
    const int number = next_core_++;
    draft.text += " shadow " + std::to_string(number) + " (" + manner.name() + ") " + part.name;
    const bool is_fresh = dice.once_in(2);
    if (!is_fresh) shared_->copied.insert(number);
    draft.transaction.shadow(part.name, core(number, static_cast<int>(index), manner),
                             {.budget_ns = ms_to_ns(1), .is_fresh = is_fresh}, std::make_unique<TestShell>());
  }

  /// New parts of one component: a core, on probation or not, an fsm with the same period or another one, a shell.
  void enter_parts(Draft& draft, std::size_t index, Dice& dice) {
    Part& part = draft.after[index];
    const bool is_on_probation = dice.once_in(2) && enter_core(draft, index, dice);
    if (part.is_sporadic || !dice.once_in(6)) return;
    if (!is_on_probation && dice.once_in(3)) {
      const std::int64_t period_ms = 2 + dice.below(9);
      draft.transaction.set_property(part.name, "period_ms", period_ms);
      part.period_ns = ms_to_ns(period_ms);
      draft.text += " period " + part.name;
    }
    if (!is_on_probation && dice.once_in(3)) {
      draft.transaction.replace_shell(part.name, std::make_unique<TestShell>());
      draft.text += " shell " + part.name;
    }
    draft.transaction.replace_fsm(part.name, new_part<FsmBase, SeedFsm>());
    draft.text += " fsm " + part.name;
  }

  /// Whether it is on probation.
  bool enter_core(Draft& draft, std::size_t index, Dice& dice) {
    Part& part = draft.after[index];
    const Manner manner = Manner::any(dice);
    const bool is_on_probation = !part.is_sporadic && dice.once_in(3);
    part.core = next_core_++;
    draft.text += " core " + std::to_string(part.core) + " (" + manner.name() +
                  (is_on_probation ? ", on probation" : "") + ") " + part.name;
    auto fresh = core(part.core, static_cast<int>(index), manner, is_on_probation);
    if (!is_on_probation) {
      draft.transaction.replace_core(part.name, std::move(fresh));
      return false;
    }
    part.trial = part.core;
    trials_[part.trial] = dice.between(ms_to_ns(2), ms_to_ns(90));
    draft.transaction.replace_core(
        part.name, std::move(fresh),
        ProbationOptions{.duration_ns = trials_[part.trial], .on_overrun = dice.once_in(3)});
    return true;
  }

  /// Adds the extra component and a resource that it writes, or removes both.
  void enter_extra(Draft& draft, Dice& dice) {
    Extra& extra = extra_of(draft.owner);
    draft.changes_extra = true;
    draft.extra_before = extra.number;
    draft.text += (extra.number == kNone ? " add " : " remove ") + extra.name;
    if (extra.number != kNone) {
      if (shared_->hanging_components.contains(extra.number) && dice.once_in(2)) enter_refusal(draft);
      draft.transaction.remove_component(extra.name);
      draft.transaction.remove_resource(extra.output());
      return;
    }
    ComponentParts rest{.settings = {.priority = 10 + 10 * dice.below(4)}};
    rest.properties["period_ms"] = std::int64_t{kExtraPeriod / ms_to_ns(1)};
    draft.extra_core = next_core_++;
    draft.extra_after = next_extra_++;
    const Manner hangs{.hook = Hook::state, .deed = Deed::hangs};
    const Manner manner = dice.once_in(6) ? hangs : dice.once_in(3) ? Manner::any(dice) : Manner{};
    draft.text += " (" + manner.name() + ")";
    draft.transaction.add_resource(extra.output(), std::make_unique<LatestValue<Number>>());
    draft.transaction.add_component(extra.name,
                                    Parts{.shell = new_part<Shell, TestShell>(),
                                          .core = core(draft.extra_core, draft.extra_after, manner),
                                          .fsm = new_part<FsmBase, SeedFsm>()},
                                    rest);
    draft.transaction.connect(extra.name, "output", extra.output(), "write");
    draft.transaction.start(extra.name);
  }

  /// A participant that refuses.
  void enter_refusal(Draft& draft) {
    for (std::size_t i = 0; i < parts_.size(); ++i) {
      if (!owns(draft.owner, i) || draft.touched[i]) continue;
      draft.touched[i] = true;
      draft.only_sets[i] = false;
      draft.after[i].core = next_core_++;
      draft.transaction.replace_core(
          parts_[i].name,
          core(draft.after[i].core, static_cast<int>(i), Manner{.hook = Hook::adopt, .deed = Deed::refuses}));
      draft.text += " refusing " + parts_[i].name;
      return;
    }
  }

  // ---- how it is changed

  /// At once, in two halves, or prepared and committed by a real-time thread.
  void carry_out(Dice& dice, Draft& draft, bool may_prepare, const Intervention& here) {
    const CommitTimeouts timeouts = draft.options.timeouts;
    time_ns_t longest_ns = 2 * timeouts.commit_ns + timeouts.phase_ns + kPrepare + kSlack;
    if (two_change_)
      longest_ns = 2 * longest_ns + (shared_->may_hang ? kCleanup : 0);  // it waits for the other one's
    // A change that a shutdown overtakes waits for the threads of its components.
    if (shuts_down_ || draft.owner == Owner::second) longest_ns += Runner::kThreadEnd;
    int way = draft.options.dry_run || draft.resynchronises ? 0 : dice.below(4);
    if (way == 3 && !may_prepare) way = 0;
    if (way == 3) draft.options.force = false;
    draft.began_ns = seeds::now_ns();
    const time_ns_t prompt_ns = kPrompt + timeouts.phase_ns + (two_change_ ? ms_to_ns(80) : 0);
    timed(draft.text, longest_ns, prompt_ns, [&] {
      try {
        if (way == 3) {
          draft.report = commit_prepared(dice, draft, here);
        } else if (way == 2) {
          const auto made = deployer_->make(std::move(draft.transaction), draft.options);
          draft.report = made->report(timeouts.phase_ns);
        } else {
          draft.report = deployer_->commit(std::move(draft.transaction), draft.options);
        }
      } catch (const Error& error) {
        draft.refusal = error.what();
        expect(error.code() != ErrorCode::internal, "internal error: " + draft.refusal);
      }
    });
    if (draft.options.dry_run) draft.report.reset();
  }

  TransactionReport commit_prepared(Dice& dice, Draft& draft, const Intervention& here) {
    const Preparation open(*this);
    const auto prepared = deployer_->prepare(std::move(draft.transaction), draft.options);
    const time_ns_t between_ns = seeds::now_ns();
    if (dice.once_in(3)) {
      change(dice, draft.owner, false);  // the prepared one is stale then, if both are about one component
    } else {
      sleep_for(dice.between(0, ms_to_ns(3)));
    }
    shared_->slow_ns += seeds::now_ns() - between_ns;
    commit_by_any_thread(dice, *prepared, draft.options.timeouts.commit_ns);
    if (draft.started != kNobody && dice.once_in(2)) stop_what_was_started(draft.started, here);
    findings_.count("prepared changes");
    return prepared->complete();
  }

  static void commit_by_any_thread(Dice& dice, PreparedTransaction& prepared, time_ns_t timeout_ns) {
    if (dice.once_in(3)) {
      prepared.commit(timeout_ns);
      return;
    }
    struct Order {
      PreparedTransaction* prepared;
      time_ns_t timeout_ns;
    } order{.prepared = &prepared, .timeout_ns = timeout_ns};
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

  // ---- what was changed

  static time_ns_t instant_of(const TransactionReport& report, const std::string& component) {
    time_ns_t instant_ns = kNotMeasured;
    for (const StepReport& step : report.steps) {
      if (step.component == component && step.instant_ns != kNotMeasured) instant_ns = step.instant_ns;
    }
    return instant_ns;
  }

  void note_made(const Draft& draft, const Intervention& here) {
    for (std::size_t i = 0; i < parts_.size(); ++i) {
      if (!draft.touched[i]) continue;
      note_component(draft, i);
      expect_fit(draft, i, here);
    }
    if (draft.resynchronises)
      history_.note(Epoch{.epoch_ns = deployer_->epoch_ns(),
                          .instant_ns = draft.report->instant_ns,
                          .began_ns = draft.began_ns,
                          .ended_ns = seeds::now_ns()});
    if (draft.changes_extra) note_extra(draft);
  }

  /// Before the commit a fault calls the change off. One that was parked took no change in flight.
  void expect_fit(const Draft& draft, std::size_t index, const Intervention& here) {
    if (!draft.runs[index] || !draft.only_sets[index]) return;
    const bool is_faulted = state_of(index) == ComponentState::faulted;
    const bool was_in_flight = instant_of(*draft.report, parts_[index].name) != kNotMeasured;
    expect(!is_faulted || was_in_flight || !here.is_sole(),
           draft.text + ": made although " + parts_[index].name + " is FAULTED");
  }

  /// A refusal for want of time comes when the time is over; by force each state that hangs was given up then.
  void expect_right_refusal(const Draft& draft, const std::string& outcome) {
    if (draft.refusal.find("in time; nothing was changed") == std::string::npos) return;
    const time_ns_t took_ns = seeds::now_ns() - draft.began_ns;
    expect(took_ns >= draft.options.timeouts.commit_ns,
           outcome + " after " + std::to_string(took_ns) + " ns");
    if (!draft.options.force) return;
    for (std::size_t i = 0; i < parts_.size(); ++i) {
      const auto hung = shared_->hung_cores.find(draft.before[i].core);
      if (!draft.touched[i] || draft.before[i].core == draft.after[i].core ||
          hung == shared_->hung_cores.end())
        continue;
      const bool has_hung = hung->second.is_in_state && hung->second.from_ns < draft.began_ns &&
                            hung->second.until_ns == kForever;
      expect(!has_hung || state_of(i) != ComponentState::running || was_reverted(draft.before[i].core),
             outcome + ": " + parts_[i].name + " hangs, and was not given up");
    }
  }

  /// A core that hung on probation: the old core goes on in its component.
  bool was_reverted(int core) const {
    return std::ranges::any_of(deployer_->probations(), [core](const ProbationRecord& record) {
      return core_of(record.to_core) == core && record.verdict == ProbationVerdict::reverted;
    });
  }

  void note_component(const Draft& draft, std::size_t index) {
    const TransactionReport& report = *draft.report;
    const time_ns_t instant_ns = instant_of(report, parts_[index].name);
    expect(instant_ns == kNotMeasured || instant_ns == report.instant_ns,
           parts_[index].name + " has another instant than the change");
    history_.note(Participation{.component = static_cast<int>(index),
                                .instant_ns = report.instant_ns,
                                .began_ns = draft.began_ns,
                                .ended_ns = seeds::now_ns()});
    const auto before = aspects_of(draft.before[index]);
    const auto after = aspects_of(draft.after[index]);
    if (before == after) return;
    expect(before == aspects_of(parts_[index]),
           draft.text + ": made although " + parts_[index].name + " was changed after the preparation");
    for (const auto& [aspect, value] : after) {
      if (value == before.at(aspect)) continue;
      history_.note(Made{.component = static_cast<int>(index),
                         .aspect = aspect,
                         .value = value,
                         .instant_ns = instant_ns,
                         .began_ns = draft.began_ns,
                         .ended_ns = seeds::now_ns(),
                         .may_go_back = aspect == Aspect::core && draft.after[index].trial != kNone});
    }
    parts_[index] = draft.after[index];
  }

  void note_extra(const Draft& draft) {
    Extra& extra = extra_of(draft.owner);
    expect(extra.number == draft.extra_before,
           draft.text + ": made although the list was changed after the preparation");
    extra.number = draft.extra_after;
    if (draft.extra_before != kNone) {
      findings_.count("components removed");
      return;
    }
    const Part part{.name = extra.name,
                    .period_ns = kExtraPeriod,
                    .is_sporadic = false,
                    .has_fallback = false,
                    .core = draft.extra_core};
    for (const auto& [aspect, value] : aspects_of(part))
      history_.note(Made{.component = extra.number,
                         .aspect = aspect,
                         .value = value,
                         .instant_ns = instant_of(*draft.report, extra.name),
                         .ended_ns = seeds::now_ns()});
    findings_.count("components added");
  }

  void expect_listed(Owner owner, const std::string& outcome) {
    const Extra& extra = extra_of(owner);
    const bool is_listed = architecture_->find_component(extra.name) != nullptr;
    expect(is_listed == (extra.number != kNone),
           outcome + ": the list " + (is_listed ? "has" : "has not") + " the component " + extra.name);
  }

  std::array<Extra, 2> extras_{Extra{.name = "extra"}, Extra{.name = "second_extra"}};
  int next_extra_{kExtra};
  int prepared_{0}, open_prepared_{0};  // prepared changes: all, and those that have not ended
  double next_gain_{1.0};
};

}  // namespace mauve::testing
