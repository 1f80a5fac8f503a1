// SPDX-License-Identifier: LGPL-3.0-or-later
// RuleRunner: rules at work beside the components of one host.
#pragma once

#include <array>
#include <atomic>
#include <condition_variable>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "mauve_rt/base/rt.hpp"
#include "mauve_rt/base/threads.hpp"
#include "mauve_rt/deploy/host.hpp"
#include "mauve_rt/rules/action.hpp"
#include "mauve_rt/rules/engine.hpp"
#include "mauve_rt/rules/feeds.hpp"

namespace mauve::rules {

/// What one rule of the engine does and undoes.
struct RuleActions {
  ActionSteps do_steps{};
  TransactionOptions do_options{};
  ActionSteps undo_steps{};  // none: it does not undo
  TransactionOptions undo_options{};
};

/// One decision, for who tells it.
struct Told {
  Decision decision{};
  ActionReport action{};  // of `done` and `failed`: what came of it
};

/// How one rule fares.
struct RuleFacts {
  std::string name{};
  RuleStatus status{};
  bool ready{false};            // what it would do or undo next could begin
  std::string problem{};        // why that cannot be prepared, or what it hears not be heard; empty: it can
  std::size_t memory_bytes{0};  // of what is kept prepared
};

/// Runs an engine beside the components of a host: decides and commits on a real-time thread above the components and
/// below who conducts their changes; prepares, completes and tells on an ordinary thread of its own. Neither needs
/// Python, but for parts that are written in it, nor anything of another process.
///
/// In virtual time there are no threads: whoever simulates calls advance().
///
/// "decision thread", "preparation thread": the two threads.
///
/// | member            | written by | read by        | order                                                            |
/// | ----------------- | ---------- | -------------- | ---------------------------------------------------------------- |
/// | engine_           | decision thread    | the same       | its decisions: its own                                           |
/// | feeds_            | preparation thread     | the same       | -                                                                |
/// | Rule::acts        | both       | both           | their own: action.hpp                                            |
/// | Rule::found       | preparation thread     | decision thread| release/acquire: what was found lies in it                       |
/// | Rule::in_effect   | decision thread    | preparation thread         | relaxed: work_ is bumped after it                                |
/// | Rule::status      | decision thread    | facts()        | status_mutex_, which the decision thread only tries                      |
/// | ends_             | decision thread    | preparation thread         | release/acquire: what was done before lies in the architecture   |
/// | work_ (futex)     | anyone     | preparation thread         | release/acquire: who sees the bump sees the work                 |
/// | ending_ (futex)   | stop()     | both           | release/acquire                                                  |
/// | told_ ... woken_  | preparation thread, wake() | anyone  | told_mutex_                                                      |
class RuleRunner {
 public:
  /// `actions`: of the engine's rules, in their order. `topics`: topic -> the resource that is bound to it. [setup]
  /// Throws Error as Feeds::open(); invalid_argument: a kind of step that there is not.
  RuleRunner(Host& host, std::unique_ptr<Engine> engine, const std::vector<RuleActions>& actions,
             std::map<std::string, std::string> topics = {});
  /// As stop().
  ~RuleRunner();
  RuleRunner(const RuleRunner&) = delete;
  RuleRunner& operator=(const RuleRunner&) = delete;

  /// Begins to watch; the host is deployed. A rule is armed once its components run. [non-rt] Throws Error (internal).
  void start();
  /// Nothing is done any more on return; what is in effect stays so. May be called again. [non-rt]
  void stop() noexcept;

  /// Decisions not taken yet; waits for one, at most so long, or until wake(). [non-rt]
  std::vector<Told> wait_told(time_ns_t timeout_ns);
  /// Ends that wait, now and from now on. [non-rt]
  void wake();
  /// [non-rt]
  std::vector<RuleFacts> facts() const;
  /// The executor's Python side works: conditions node_silent receive that. [rt], one thread. In virtual time advance() does it.
  void beat() MAUVE_RT { feeds_.beat(); }
  /// How many decisions were left out, because those before them were not taken in time. [non-rt]
  std::uint64_t lost() const;

  /// In virtual time: does all that is to be done now; when it has to be called again at the latest. [non-rt]
  time_ns_t advance();

 private:
  struct Rule {
    explicit Rule(const RuleActions& actions)
        : acts{Action(actions.do_steps, actions.do_options),
               Action(actions.undo_steps, actions.undo_options)} {}
    Action& action(Act act) MAUVE_RT { return acts[static_cast<std::size_t>(act)]; }

    std::array<Action, 2> acts;           // by Act
    std::uint32_t name{0};                // in the trace
    std::atomic<std::uint64_t> found{0};  // kKnown ... below, above them the ends that it was found after
    std::atomic<bool> in_effect{false};
    RuleStatus status{};
    std::uint64_t applied{0};  // of found, by the decision thread
    bool was_present{false};   // once, so far as the decision thread knows
  };

  void run_decisions() noexcept;
  void run_preparation() noexcept;
  time_ns_t step() MAUVE_RT;
  void hear_ends(time_ns_t now_ns) MAUVE_RT;
  void apply_found(std::size_t index, time_ns_t now_ns) MAUVE_RT;
  void show_status() MAUVE_RT;
  bool tend();
  bool look_around(std::uint64_t ends);
  bool make_ready(Rule& rule, std::uint64_t revision);
  void keep(std::size_t index, const Rule& rule, const std::string& unobservable);
  void tell();
  std::string follow();
  void end() noexcept;

  Host& host_;
  std::unique_ptr<Engine> engine_;
  std::vector<std::unique_ptr<Rule>> rules_;
  Feeds feeds_;
  Action* under_way_{nullptr};  // of the decision thread
  std::atomic<std::uint64_t> ends_{0};
  ChangeSignal work_;
  std::atomic<std::uint32_t> ending_{0};
  Thread decision_thread_;
  Thread preparation_thread_;
  bool runs_{false};
  mutable PiMutex status_mutex_;
  mutable std::mutex told_mutex_;
  std::condition_variable told_changed_;
  std::deque<Told> told_;
  std::uint64_t left_out_{0};
  struct Kept {
    std::string problem{};
    std::size_t memory_bytes{0};
    bool operator==(const Kept&) const = default;
  };
  std::vector<Kept> kept_;  // by rule
  bool woken_{false};
  std::uint16_t trace_number_;
};

}  // namespace mauve::rules
