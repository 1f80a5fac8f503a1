// SPDX-License-Identifier: LGPL-3.0-or-later
// History: the changes that were made, and whether each execution fits to them.
#pragma once

#include <algorithm>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "seed_parts.hpp"

namespace mauve::testing {

/// What a change can set of a component.
enum class Aspect : std::uint8_t { core, gain, input, period };
inline constexpr std::array kAspectNames{"core", "gain", "input", "period"};

/// One aspect of one component, as a change made it.
struct Made {
  int component;
  Aspect aspect;
  double value;  // of a core its number, of an input what the component reads, of a period its length
  time_ns_t instant_ns{kNotMeasured};  // T
  time_ns_t began_ns{0}, ended_ns{0};  // of the request
  bool may_go_back{false};             // on probation
};

/// A component took part in a change that was made.
struct Participation {
  int component;
  time_ns_t instant_ns;  // T of the change
  time_ns_t began_ns, ended_ns;
};

/// A new epoch: all grids count from it.
struct Epoch {
  time_ns_t epoch_ns;
  time_ns_t instant_ns{0}, began_ns{0}, ended_ns{0};
};

/// What the kernel said at last of a core on probation.
struct Verdict {
  ProbationVerdict verdict;
  time_ns_t seen_ns;
};

/// Cores from this number on are fallbacks: they may execute after any fault.
inline constexpr int kFirstFallback = 100'000;

class History {
 public:
  explicit History(seeds::Findings& findings) : findings_(findings) {}

  void note(const Made& made) { made_.push_back(made); }
  void note(const Epoch& epoch) { epochs_.push_back(epoch); }
  void note(const Participation& participation) {
    if (participation.instant_ns != kNotMeasured && participation.instant_ns != 0)
      participations_.push_back(participation);
  }
  void note_sporadic(int component) { sporadic_.insert(component); }
  void note_verdict(int core, ProbationVerdict verdict) {
    const auto [first, is_new] =
        verdicts_.try_emplace(core, Verdict{.verdict = verdict, .seen_ns = seeds::now_ns()});
    findings_.expect(first->second.verdict == verdict, "core " + std::to_string(core) + " has the verdict " +
                                                           to_string(verdict) + ", and had the verdict " +
                                                           to_string(first->second.verdict));
  }

  /// Before T the old parts, from T on the new ones; each release on the grid and none twice; no state is lost or taken twice.
  void check(const Shared& shared) {
    took_from_ = shared.took_from;
    took_count_ = shared.took_count;
    copied_ = shared.copied;
    hung_ = shared.hung_components;
    for (const Execution& execution : shared.executions) {
      check_state(execution);
      if (execution.is_in_shadow) continue;
      check_instants(execution);
      check_visits(execution, shared);
      if (sporadic_.contains(execution.component)) check_event(execution, shared);
      check_order(execution);
      check_aspect(execution, Aspect::core, execution.core);
      check_aspect(execution, Aspect::gain, execution.gain);
      if (execution.input != kUnconnected && execution.input != 0.0)  // 0: what a stopped component writes
        check_aspect(execution, Aspect::input, execution.input);
      check_grid(execution);
      last_[execution.component] = &execution;
    }
    check_participations();
  }

 private:
  static std::string where(const Execution& execution) {
    return "component " + std::to_string(execution.component) + " at clock " +
           std::to_string(execution.clock_ns) + ", executing at " + std::to_string(execution.at_ns) +
           " (core " + std::to_string(execution.core) + ")";
  }

  /// Each core goes on from the state of the core that it took over from.
  void check_state(const Execution& execution) {
    if (is_copied_before(execution)) {
      check_copy(execution);
    } else {
      check_count(execution);
    }
    last_counts_[execution.core] = execution.count;
    counts_[execution.component].insert(execution.count);
    if (!execution.is_in_shadow) lived_.insert(execution.core);
  }
  /// A candidate gets copies where its shadow begins, and where it is promoted.
  bool is_copied_before(const Execution& execution) const {
    if (!copied_.contains(execution.core)) return false;
    const bool is_promoted = !execution.is_in_shadow && !lived_.contains(execution.core);
    return is_promoted || !last_counts_.contains(execution.core);
  }
  /// The copied state is that of a core of the component; of a promoted candidate that of the core that executed last, unless other
  /// changes came between.
  void check_copy(const Execution& execution) {
    const std::int64_t copied = execution.count - 1;
    const auto& counts = counts_[execution.component];
    findings_.expect(copied == 0 || counts.contains(copied), where(execution) + " has the count " +
                                                                 std::to_string(copied) +
                                                                 ", which no core of the component had");
    findings_.count("copies of state");
    const auto last = last_.find(execution.component);
    if (execution.is_in_shadow || last == last_.end()) return;
    const auto swaps = std::ranges::count_if(made_, [&](const Made& made) {
      return made.component == execution.component && made.aspect == Aspect::core &&
             made.began_ns <= execution.at_ns && made.ended_ns >= last->second->at_ns;
    });
    if (swaps != 1) return;
    findings_.count("copies of state at a promotion");
    findings_.expect(copied == last->second->count, where(execution) + " was promoted with the count " +
                                                        std::to_string(copied) + ", expected " +
                                                        std::to_string(last->second->count));
  }
  void check_count(const Execution& execution) {
    const std::int64_t expected = count_of(execution.core) + 1;
    findings_.expect(execution.count == expected, where(execution) + " knows of " +
                                                      std::to_string(execution.count) +
                                                      " executions, expected " + std::to_string(expected));
  }
  std::int64_t count_of(int core) const {
    if (const auto last = last_counts_.find(core); last != last_counts_.end()) return last->second;
    if (const auto taken = took_count_.find(core); taken != took_count_.end()) return taken->second;
    const auto before = took_from_.find(core);
    return before != took_from_.end() ? count_of(before->second) : 0;
  }

  /// An adopt that lasts a period beyond a release misses it: the next one is not in the past.
  void check_visits(const Execution& execution, const Shared& shared) {
    const auto place = last_.find(execution.component);
    if (place == last_.end() || sporadic_.contains(execution.component)) return;
    const Execution& last = *place->second;
    const bool has_new_epoch = std::ranges::any_of(epochs_, [&](const Epoch& epoch) {
      return epoch.began_ns <= execution.at_ns && epoch.ended_ns >= last.at_ns;
    });
    if (has_new_epoch) return;  // it moves the instant that is due
    for (const Visit& visit : shared.visits) {
      if (visit.component != execution.component || visit.from_ns < last.at_ns ||
          visit.to_ns > execution.at_ns)
        continue;
      const std::vector<double> periods = possible(last, Aspect::period);
      if (periods.size() != 1) continue;
      const auto period_ns = static_cast<time_ns_t>(periods.front());
      const time_ns_t due_ns = last.clock_ns + period_ns;
      if (visit.from_ns >= due_ns || visit.to_ns < due_ns + period_ns) continue;
      // Of another period the first instant after the visit's pending one may be this one, late by less than a period.
      const std::vector<double> now = possible(execution, Aspect::period);
      if (now.size() != 1) continue;
      const time_ns_t late_ns = now != periods ? static_cast<time_ns_t>(now.front()) - 1 : 0;
      findings_.count("visits that missed a release");
      findings_.expect(execution.clock_ns + late_ns >= visit.to_ns,
                       where(execution) + " was due in an adopt or take, which lasted from " +
                           std::to_string(visit.from_ns) + " to " + std::to_string(visit.to_ns));
    }
  }
  /// T of a change comes after each clock at which a participant has executed before.
  void check_instants(const Execution& execution) {
    for (const Participation& change : participations_) {
      findings_.expect(
          change.component != execution.component || execution.at_ns >= change.began_ns ||
              execution.clock_ns < change.instant_ns,
          where(execution) + " was before a change with the earlier T " + std::to_string(change.instant_ns));
    }
  }
  /// T of a change comes after T of each earlier change of the same component.
  void check_participations() {
    for (const Participation& later : participations_) {
      for (const Participation& earlier : participations_) {
        if (earlier.component != later.component || earlier.ended_ns >= later.began_ns) continue;
        findings_.expect(earlier.instant_ns < later.instant_ns,
                         "component " + std::to_string(later.component) + " has a change with T " +
                             std::to_string(later.instant_ns) + " after one with the later T " +
                             std::to_string(earlier.instant_ns));
      }
    }
  }

  /// Releases of a sporadic component: each has its distance from the last one, and none comes at its timeout although there was an
  /// event.
  void check_event(const Execution& execution, const Shared& shared) {
    const auto place = last_.find(execution.component);
    if (place == last_.end() || place->second->interventions != execution.interventions) return;
    const Execution& last = *place->second;
    const time_ns_t waited_ns = execution.clock_ns - last.clock_ns;
    if (last.core != execution.core) return;  // a fallback starts anew
    findings_.expect(waited_ns >= EventFsm::kApart,
                     where(execution) + " comes " + std::to_string(waited_ns) + " ns after the last release");
    findings_.count("event waits");
    // One that hung writes late, with the time of its own release.
    const bool is_excused = !hung_.empty() || execution.excuses_ns != last.excuses_ns;
    const time_ns_t late_ns = execution.at_ns - std::max(execution.clock_ns, last.at_ns);
    findings_.expect(is_excused || late_ns <= kLate, where(execution) + " is late");
    if (waited_ns < EventFsm::kTimeout || last.input != execution.input) return;
    findings_.count("event waits that timed out");
    const auto writes = shared.writes.find(static_cast<int>(execution.input - written_by(0)));
    if (execution.input < written_by(0) || writes == shared.writes.end()) return;
    for (const time_ns_t at_ns : writes->second) {
      if (is_missed_in_visit(execution, shared, writes->second, at_ns)) continue;
      findings_.expect(at_ns <= last.at_ns + kUnclear || at_ns >= execution.clock_ns - kUnclear,
                       where(execution) + " was released by its timeout; the event at " +
                           std::to_string(at_ns) + " was lost");
    }
  }

  /// An adopt or take that lasted beyond the timeout that counts from its first event: the wait ends with it, and later events are one
  /// with the first.
  template <typename Times>
  static bool is_missed_in_visit(const Execution& execution, const Shared& shared, const Times& events,
                                 time_ns_t event_ns) {
    return std::ranges::any_of(shared.visits, [&](const Visit& visit) {
      return visit.component == execution.component && visit.from_ns <= event_ns &&
             visit.to_ns <= execution.clock_ns && std::ranges::any_of(events, [&](time_ns_t first_ns) {
               return first_ns >= visit.from_ns && first_ns <= event_ns &&
                      visit.to_ns >= first_ns + EventFsm::kTimeout - kUnclear;
             });
    });
  }

  void check_order(const Execution& execution) {
    const auto [last, is_first] = last_clocks_.try_emplace(execution.component, execution.clock_ns);
    findings_.expect(
        is_first || execution.clock_ns > last->second,
        where(execution) + " executes not later than before, at clock " + std::to_string(last->second));
    last->second = execution.clock_ns;
  }

  /// Whether an execution comes after a change: yes, no, or either where the change has no instant.
  template <typename Change>
  static bool may_be_before(const Execution& execution, const Change& made) {
    if (made.instant_ns != kNotMeasured) return execution.clock_ns < made.instant_ns;
    return execution.at_ns <= made.ended_ns;
  }
  template <typename Change>
  static bool may_be_after(const Execution& execution, const Change& made) {
    if (made.instant_ns != kNotMeasured) return execution.clock_ns >= made.instant_ns;
    return execution.at_ns >= made.began_ns;
  }

  std::vector<double> possible(const Execution& execution, Aspect aspect) {
    std::vector<double> values;
    for (const Made& made : made_) {
      if (made.component != execution.component || made.aspect != aspect) continue;
      if (!may_be_after(execution, made)) continue;
      if (!may_be_before(execution, made) && !stays_possible(execution, made)) values.clear();
      values.push_back(made.value);
    }
    return values;
  }
  /// Whether the old core may still execute: the new one is on probation.
  bool stays_possible(const Execution& execution, const Made& made) {
    if (!made.may_go_back) return false;
    const auto verdict = verdicts_.find(static_cast<int>(made.value));
    if (verdict == verdicts_.end()) return true;
    const bool stays = verdict->second.verdict != ProbationVerdict::reverted;
    return !stays || execution.at_ns < verdict->second.seen_ns;
  }

  void check_aspect(const Execution& execution, Aspect aspect, double found) {
    if (aspect == Aspect::core && found >= kFirstFallback) return;
    const std::vector<double> values = possible(execution, aspect);
    std::string expected;
    for (const double value : values) expected += " " + std::to_string(value);
    findings_.expect(std::ranges::find(values, found) != values.end(),
                     where(execution) + " has " + kAspectNames[static_cast<std::size_t>(aspect)] + " " +
                         std::to_string(found) + ", expected one of" + expected);
    if (aspect != Aspect::core) return;
    const auto verdict = verdicts_.find(execution.core);
    findings_.expect(verdict == verdicts_.end() || verdict->second.verdict != ProbationVerdict::reverted ||
                         execution.at_ns <= verdict->second.seen_ns,
                     where(execution) + " was reverted before that");
  }

  void check_grid(const Execution& execution) {
    std::vector<time_ns_t> epochs;
    for (const Epoch& epoch : epochs_) {
      if (!may_be_after(execution, epoch)) continue;
      if (!may_be_before(execution, epoch)) epochs.clear();
      epochs.push_back(epoch.epoch_ns);
    }
    for (const double period : possible(execution, Aspect::period)) {
      if (period == 0.0) return;  // it has none
      for (const time_ns_t epoch_ns : epochs) {
        if ((execution.clock_ns - epoch_ns) % static_cast<time_ns_t>(period) == 0) return;
      }
    }
    findings_.expect(false, where(execution) + " is not on its grid");
  }

  static constexpr time_ns_t kLate = ms_to_ns(60);    // a wake-up was lost: the wait lasts to its timeout
  static constexpr time_ns_t kUnclear = ms_to_ns(3);  // an event may be before the wait, or after it

  seeds::Findings& findings_;
  std::vector<Participation> participations_;
  std::set<int> sporadic_;
  std::set<int> hung_;                    // components
  std::map<int, const Execution*> last_;  // by component
  std::vector<Made> made_;
  std::vector<Epoch> epochs_;
  std::map<int, Verdict> verdicts_;
  std::map<int, int> took_from_;
  std::map<int, std::int64_t> took_count_;
  std::set<int> copied_;                          // candidates
  std::set<int> lived_;                           // cores that have executed in their component
  std::map<int, std::set<std::int64_t>> counts_;  // by component
  std::map<int, std::int64_t> last_counts_;       // by core
  std::map<int, time_ns_t> last_clocks_;          // by component
};

}  // namespace mauve::testing
