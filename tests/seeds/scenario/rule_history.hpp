// SPDX-License-Identifier: LGPL-3.0-or-later
// What the rules of random_rules have decided, and what must hold of it.
#pragma once

#include <algorithm>
#include <iterator>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "mauve_rt/rules/rule_runner.hpp"

#include "../forked_run.hpp"

namespace mauve::testing {

/// A rule as the scenario knows it.
struct KnownRule {
  rules::Rule rule{};
  rules::RuleActions actions{};
  std::string beat{};  // the resource whose value its condition asks for
  double above{0.0};
  bool is_negated{false};
  bool is_good{false};  // none of its parts behaves badly

  bool holds(double value) const { return (value > above) != is_negated; }
  bool contends(const KnownRule& other) const { return rule.about == other.rule.about; }
};

/// A value of a beat, from a write on.
struct Beat {
  double value;
  time_ns_t began_ns;
};

/// Checks all decisions of one runner, in the order of their numbers.
class RuleHistory {
 public:
  static constexpr time_ns_t kLongestAction = ms_to_ns(300);
  static constexpr time_ns_t kSeen = ms_to_ns(40);  // from a write to the decision that it leads to

  static constexpr time_ns_t kStep =
      ms_to_ns(1);  // the instant of a decision is read before the conditions are

  /// `rest_ns`: when the runner ended whose rules go on; kForever: none.
  RuleHistory(const std::vector<KnownRule>& rules, std::map<std::string, std::vector<Beat>>& beats,
              time_ns_t rest_ns, seeds::Findings& findings)
      : rules_(rules), beats_(beats), rest_ns_(rest_ns), findings_(findings) {}

  void add(std::vector<rules::Told> told) { std::ranges::move(told, std::back_inserter(all_)); }
  /// `lost`: of the runner, which was stopped at that instant.
  void check(std::uint64_t lost, time_ns_t stopped_ns) {
    std::ranges::stable_sort(all_, {}, &rules::Told::number);
    for (std::size_t i = 1; i < all_.size(); ++i) {
      expect(all_[i].number != all_[i - 1].number,
             "decision " + std::to_string(all_[i].number) + " is told twice");
      expect(lost != 0 || all_[i].number <= all_[i - 1].number + 1,
             "no decision " + std::to_string(all_[i - 1].number + 1) + " is told");
    }
    std::vector<Life> lives(rules_.size());
    for (const rules::Told& told : all_) follow(told, lives);
    for (std::size_t i = 0; i < lives.size(); ++i)
      expect(!lives[i].under_way || stopped_ns - lives[i].begun_ns < kLongestAction,
             rules_[i].rule.name + " has begun an action that has no outcome");
    findings_.count("decisions", static_cast<int>(all_.size()));
  }

 private:
  struct Life {
    std::optional<rules::Act> under_way{};  // do or undo
    bool is_in_reserve{false};
    bool is_armed{false};
    bool is_adopted{true};    // it may have been active before
    bool was_adopted{false};  // it was at work before
    bool wants{false};        // what it does: as far as it has said so
    time_ns_t armed_ns{0};    // since when its condition is looked at
    time_ns_t stamp_ns{0};
    time_ns_t begun_ns{0};
  };

  void expect(bool is_true, const std::string& otherwise) { findings_.expect(is_true, otherwise); }

  void follow(const rules::Told& told, std::vector<Life>& lives) {
    using rules::Act;
    using rules::Decided;
    const rules::Decision& decision = told.decision;
    const auto index = static_cast<std::size_t>(decision.rule);
    if (index >= rules_.size()) return;  // of the set before, which is undone
    const KnownRule& known = rules_[index];
    Life& life = lives[index];
    const std::string what = known.rule.name + ", decision " + std::to_string(told.number) + " (" +
                             std::string(rules::name_of(decision.decided)) + "): ";
    findings_.note(what + std::to_string(decision.stamp_ns / 1000 - 1'000'000'000) + " us, act " +
                   std::to_string(static_cast<int>(decision.act)) + ", why " +
                   std::string(rules::words_of(decision.why)));
    findings_.count("decided " + std::string(rules::name_of(decision.decided)));
    expect(decision.stamp_ns >= life.stamp_ns, what + "is made before the one before it");
    life.stamp_ns = decision.stamp_ns;
    switch (decision.decided) {
      case Decided::armed:
      case Decided::disarmed:
        expect(life.is_armed != (decision.decided == Decided::armed), what + "it was so before");
        life.is_armed = decision.decided == Decided::armed;
        life.armed_ns = decision.stamp_ns;
        break;
      case Decided::do_:
      case Decided::undo:
        expect(!life.under_way, what + "an action is under way");
        for (std::size_t k = 0; k < lives.size(); ++k)
          expect(k == index || !rules_[k].contends(known) || !lives[k].under_way,
                 what + "the action of " + rules_[k].rule.name + " about the same is under way");
        life.under_way = decision.act;
        life.begun_ns = decision.stamp_ns;
        if (!life.is_adopted && !ends_what_was(decision, life)) check_cause(decision, known, life, what);
        life.wants = decision.act == Act::do_;
        if (decision.act == Act::undo) life.is_adopted = false;
        break;
      case Decided::suppressed:
        if (decision.why == rules::Why::outranked || decision.why == rules::Why::already)
          life.wants = decision.act == Act::do_;
        break;
      case Decided::adopted:
        life.was_adopted = true;
        break;
      case Decided::condition_true:
        life.is_adopted = false;
        break;
      case Decided::otherwise:
        life.is_in_reserve = true;
        break;
      case Decided::done:
      case Decided::failed:
        if (decision.act == Act::otherwise) {
          expect(life.is_in_reserve, what + "it was not begun");
          life.is_in_reserve = false;
          break;
        }
        expect(life.under_way == decision.act, what + "it was not begun");
        expect((decision.decided == Decided::done) == told.action.report.has_value() ||
                   (decision.decided == Decided::done && !told.action.failure.empty()),
               what + "its report says otherwise: " + told.action.failure);
        life.under_way.reset();
        break;
      default:
        break;
    }
  }

  /// What was in effect before, and no longer wanted, ends whatever the condition is: no turn of it is the cause.
  static bool ends_what_was(const rules::Decision& decision, const Life& life) {
    return life.was_adopted && decision.act == rules::Act::undo && decision.cause_ns == 0;
  }

  /// What begins has had its condition for long enough. What was so before the rule was armed is looked at from then on: of a rule that wants it still, and what came while no set
  /// was at work.
  void check_cause(const rules::Decision& decision, const KnownRule& known, const Life& life,
                   const std::string& what) {
    const bool does = decision.decided == rules::Decided::do_;
    const time_ns_t dwell_ns = does ? known.rule.for_ns : known.rule.undo_for_ns;
    expect(decision.cause_ns == 0 || decision.stamp_ns - decision.cause_ns >= dwell_ns,
           what + "after " + std::to_string(decision.stamp_ns - decision.cause_ns) + " ns, expected " +
               std::to_string(dwell_ns));
    const std::vector<Beat>& beats = beats_[known.beat];
    // It is wanted for so long after its condition has ended, whenever it becomes ready.
    const time_ns_t still_wanted_ns = does ? known.rule.undo_for_ns : known.rule.for_ns;
    const time_ns_t slack_ns = kSeen + seeds::outcome().stalled_ns + still_wanted_ns + known.rule.cooldown_ns;
    bool was_so = false;
    for (std::size_t i = 0; i < beats.size(); ++i) {
      time_ns_t end_ns = i + 1 < beats.size() ? beats[i + 1].began_ns : kForever - slack_ns;
      if (life.wants || end_ns >= rest_ns_ - kSeen) end_ns = std::max(end_ns, life.armed_ns);
      was_so =
          was_so || (known.holds(beats[i].value) == does && beats[i].began_ns <= decision.stamp_ns + kStep &&
                     decision.stamp_ns <= end_ns + slack_ns);
    }
    expect(was_so, what + "its condition was not so, stamp " +
                       std::to_string(decision.stamp_ns / 1000 - 1'000'000'000));
  }

  const std::vector<KnownRule>& rules_;
  std::map<std::string, std::vector<Beat>>& beats_;
  time_ns_t rest_ns_;
  seeds::Findings& findings_;
  std::vector<rules::Told> all_;
};

}  // namespace mauve::testing
