// SPDX-License-Identifier: LGPL-3.0-or-later
// Engine: decides what the rules of an architecture want done, and when.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "mauve_rt/base/rt.hpp"
#include "mauve_rt/base/seam/atomic.hpp"
#include "mauve_rt/base/time.hpp"
#include "mauve_rt/rules/condition.hpp"
#include "mauve_rt/rules/decision.hpp"
#include "mauve_rt/rules/signal.hpp"

namespace mauve::rules {

/// One rule, without what its transactions are made of.
struct Rule {
  std::string name{};
  When when{};
  time_ns_t for_ns{0};       // the condition must have held so long before `do`
  bool undoes{false};        // else what it did stays
  time_ns_t undo_for_ns{0};  // and not held so long before `undo`
  time_ns_t cooldown_ns{0};  // from the end of an action to the next one of the rule
  std::int64_t priority{0};  // of several that are about the same, the highest decides; then the first
  std::vector<std::string> about{};  // components that it changes
  std::optional<time_ns_t>
      otherwise_after_ns{};  // so long after `do` is due, and not in effect: its reserve action
  bool safety{false};        // above all that are not
  bool latch{false};         // it ends by reset() only
  bool is_released{false};   // it ends at once: its file no longer has it

  bool operator==(const Rule&) const = default;
};

/// What the engine wants done now.
struct PendingAction {
  std::size_t rule{0};
  Act act{Act::do_};
  time_ns_t cause_ns{0};  // since when the condition has been as it is
  double measured{0.0};
};

/// How an action that was begun has ended.
enum class Ended : std::uint8_t { done, refused, stale, withdrawn, timed_out };

/// How one rule fares.
struct RuleStatus {
  bool armed{false};
  Truth truth{Truth::unknown};
  bool active{false};      // what it does is wanted
  bool in_effect{false};   // and done, not undone yet
  bool is_at_work{false};  // active, or something is left to be undone or under way
  time_ns_t since_ns{0};   // the condition has been as it is
  double measured{0.0};
  std::optional<Act> next{};    // what it is going to want if nothing changes
  time_ns_t next_ns{kForever};  // when
  std::optional<Act> failed{};  // the last action, which is to be tried again
  Why why{Why::none};           // it failed

  /// [rt]
  bool holds() const MAUVE_RT { return truth == Truth::yes; }
};

/// The rules of one architecture: no thread in it, no clock, and nothing allocated after it was made.
///
/// A rule is active once its condition has held for `for_ns`, until it has not held for `undo_for_ns`, but no earlier than
/// `cooldown_ns` after its last action. Both times count anew from the end of a time at which the condition is unknown, which
/// changes nothing. What an active rule wants is done (`do`), what one wanted that no longer is is undone: what that comes to
/// besides other rules and persons is found out by who hosts it (Overlays).
///
/// Actions of rules about different components are under way side by side. Of rules about the same component one action at a
/// time is: a rule of higher rank has that of a lower one called off.
///
/// Whoever hosts it calls step() at the instant that the step before returned, and when word() has changed; carries out
/// pending(), then steps again, until nothing is pending; calls off what gives_way(); and tells what it finds of the architecture. All of that on one thread, the "decision thread".
///
/// | member       | written by          | read by             | order                                                     |
/// | ------------ | ------------------- | ------------------- | --------------------------------------------------------- |
/// | signals_     | who feeds them      | decision thread     | their own: signal.hpp                                     |
/// | word_ (futex)| signals, wake()     | decision thread     | release/acquire: who sees it changed sees why; engines    |
/// |              |                     |                     | of which one goes on from the other share it              |
/// | told_, ring_ | decision thread     | who takes decisions | release/acquire: a decision is whole before it is counted |
/// | taken_       | who takes decisions | decision thread     | release/acquire: its place may be written again           |
/// | lost_        | decision thread     | anyone              | relaxed: a lone count                                     |
/// | the rest     | decision thread     | decision thread     | -                                                         |
class Engine {
 public:
  /// `before`: some of whose rules go_on() will let go on. [setup] Throws Error: a rule that cannot be so.
  explicit Engine(std::vector<Rule> rules, const Engine* before = nullptr);
  ~Engine();
  Engine(const Engine&) = delete;
  Engine& operator=(const Engine&) = delete;

  // ---- what it hears

  struct Heard {
    SignalSpec spec;
    Signal* signal;
    std::size_t rule;
  };
  /// One for each condition that listens, in the order of the rules. [non-rt]
  const std::vector<Heard>& signals() const noexcept { return heard_; }
  /// Bumped by what is of interest. [rt]
  const Atomic<std::uint32_t>& word() const MAUVE_RT { return word_->value; }
  /// Lets the decision thread look. Any thread. [rt]
  void wake() MAUVE_RT;

  // ---- one engine after another, neither of which decides at that time

  /// The number of the same rule; nothing: there is none. [non-rt]
  std::optional<std::size_t> find(const Rule& rule) const noexcept;
  /// The rule goes on as one of `before`, which is the same: what its signals have told, and tell until this engine decides,
  /// counts. `stays_armed`: else it is armed anew. That of `before` is as new afterwards. [non-rt]
  void go_on(std::size_t rule, Engine& before, std::size_t rule_before, bool stays_armed) noexcept;

  // ---- the decision thread: what it finds of the architecture

  /// Whether all that the rule is about is there and runs: it is armed, or watches no longer. [rt]
  void set_present(std::size_t rule, bool present, time_ns_t now_ns) MAUVE_RT;
  /// All rules are present. [rt]
  void arm(time_ns_t now_ns) MAUVE_RT;
  /// Whether nothing is left to be done by the act now. [rt]
  void set_in_place(std::size_t rule, Act act, bool in_place) MAUVE_RT;
  /// Whether the act could begin at once; it can until the opposite is said. [rt]
  void set_ready(std::size_t rule, Act act, bool ready) MAUVE_RT;
  /// The rule is active since before this engine; or what it did is not undone yet. [rt]
  void adopt(std::size_t rule, bool is_active, time_ns_t now_ns) MAUVE_RT;
  /// Ends an active rule whose condition is false, be it latched; false: it is not so. [rt]
  bool reset(std::size_t rule, time_ns_t now_ns) MAUVE_RT;
  /// The architecture is another one: nothing of before counts. [rt]
  void forget() MAUVE_RT;
  /// The same of one rule, that somebody else is to run: it watches no longer. [rt]
  void forget(std::size_t rule) MAUVE_RT;

  // ---- the decision thread: deciding

  /// Looks at all conditions; the instant at which it has to at the latest. [rt]
  time_ns_t step(time_ns_t now_ns) MAUVE_RT;
  /// What to do now, found by the last step. [rt]
  const std::optional<PendingAction>& pending() const MAUVE_RT { return pending_; }
  /// The pending action is being carried out. [rt]
  void begun(time_ns_t now_ns) MAUVE_RT;
  /// An action that was begun has ended. [rt]
  void ended(std::size_t rule, Act act, Ended how, time_ns_t now_ns) MAUVE_RT;
  /// The rule's `do` or `undo` that is under way, which is to be called off: a rule of higher rank, or its own reserve action,
  /// comes before it. [rt]
  std::optional<Act> gives_way(std::size_t rule) const MAUVE_RT;
  /// Whether its next action may be prepared now: no action about its components is under way. [rt]
  bool may_prepare(std::size_t rule) const MAUVE_RT;
  /// Whether the two are about one component. [rt]
  bool contend(std::size_t one, std::size_t other) const MAUVE_RT;

  // ---- telling

  /// The next decision that was not taken yet; one thread at a time. [rt]
  std::optional<Decision> take() MAUVE_RT;
  /// Decisions that found no room, as nobody took them. [rt]
  std::uint64_t lost() const MAUVE_RT { return lost_.load(std::memory_order_relaxed); }
  /// The decision thread. [rt]
  RuleStatus status(std::size_t rule) const MAUVE_RT;
  bool is_active(std::size_t rule) const MAUVE_RT;
  std::size_t size() const MAUVE_RT { return lives_.size(); }
  /// [rt]
  const Rule& rule(std::size_t rule) const MAUVE_RT;

 private:
  struct Life;
  static constexpr std::size_t kRing = 512;
  static constexpr std::size_t kNone = SIZE_MAX;

  void look(Life& life, time_ns_t now_ns) noexcept;
  void turn_after_cooldown(Life& life, time_ns_t now_ns) noexcept;
  void turn(Life& life, time_ns_t now_ns) noexcept;
  void forget_found_beside(const Life& life) noexcept;
  time_ns_t next_look(const Life& life, time_ns_t now_ns) const noexcept;
  void consider(Life& life, Act act, time_ns_t now_ns) noexcept;
  void otherwise_ended(Life& life, Ended how, time_ns_t now_ns) noexcept;
  bool want_otherwise(Life& life, time_ns_t now_ns) noexcept;
  const Life* in_the_way(const Life& life) noexcept;
  const Life* outranking(const Life& life) const noexcept;
  void settle(Life& life, Act act, time_ns_t now_ns) noexcept;
  void suppress(Life& life, Act act, Why why, time_ns_t now_ns, const Life* other = nullptr,
                time_ns_t wait_ns = 0) noexcept;
  void tell(const Life& life, Decision decision) noexcept;

  std::vector<std::unique_ptr<Signal>> signals_;
  std::vector<Heard> heard_;
  std::vector<std::unique_ptr<Life>> lives_;
  std::vector<Life*> by_rank_;  // the highest first
  std::optional<PendingAction> pending_;
  std::array<Decision, kRing> ring_{};
  const std::shared_ptr<EngineWord> word_;
  alignas(64) Atomic<std::uint64_t> told_{0};
  alignas(64) Atomic<std::uint64_t> taken_{0};
  Atomic<std::uint64_t> lost_{0};
};

}  // namespace mauve::rules
