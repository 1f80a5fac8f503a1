// SPDX-License-Identifier: LGPL-3.0-or-later
// History: the changes that were made, and whether each execution fits to them.
#pragma once

#include <algorithm>
#include <map>
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
  void note_verdict(int core, ProbationVerdict verdict) {
    verdicts_.try_emplace(core, Verdict{.verdict = verdict, .seen_ns = seeds::now_ns()});
  }

  /// Before T the old parts, from T on the new ones; each release on the grid and none twice; no state is lost or taken twice.
  void check(const Shared& shared) {
    took_from_ = shared.took_from;
    for (const Execution& execution : shared.executions) {
      check_state(execution);
      if (execution.is_in_shadow) continue;
      check_order(execution);
      check_aspect(execution, Aspect::core, execution.core);
      check_aspect(execution, Aspect::gain, execution.gain);
      if (execution.input != kUnconnected && execution.input != 0.0)  // 0: what a stopped component writes
        check_aspect(execution, Aspect::input, execution.input);
      check_grid(execution);
    }
  }

 private:
  static std::string where(const Execution& execution) {
    return "component " + std::to_string(execution.component) + " at clock " +
           std::to_string(execution.clock_ns) + ", executing at " + std::to_string(execution.at_ns) +
           " (core " + std::to_string(execution.core) + ")";
  }

  /// Each core goes on from the state of the core that it took over from.
  void check_state(const Execution& execution) {
    const std::int64_t expected = count_of(execution.core) + 1;
    findings_.expect(execution.count == expected, where(execution) + " knows of " +
                                                      std::to_string(execution.count) +
                                                      " executions, expected " + std::to_string(expected));
    last_counts_[execution.core] = execution.count;
  }
  std::int64_t count_of(int core) const {
    if (const auto last = last_counts_.find(core); last != last_counts_.end()) return last->second;
    const auto before = took_from_.find(core);
    return before != took_from_.end() ? count_of(before->second) : 0;
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

  seeds::Findings& findings_;
  std::vector<Made> made_;
  std::vector<Epoch> epochs_;
  std::map<int, Verdict> verdicts_;
  std::map<int, int> took_from_;
  std::map<int, std::int64_t> last_counts_;  // by core
  std::map<int, time_ns_t> last_clocks_;     // by component
};

}  // namespace mauve::testing
