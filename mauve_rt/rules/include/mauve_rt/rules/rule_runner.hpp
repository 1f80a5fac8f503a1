// SPDX-License-Identifier: LGPL-3.0-or-later
// RuleRunner: rules at work beside the components of one host.
#pragma once

#include <array>
#include <deque>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "mauve_rt/base/rt.hpp"
#include "mauve_rt/base/seam/atomic.hpp"
#include "mauve_rt/base/seam/condition_variable.hpp"
#include "mauve_rt/base/seam/thread.hpp"
#include "mauve_rt/base/sequence_cell.hpp"
#include "mauve_rt/deploy/host.hpp"
#include "mauve_rt/rules/action.hpp"
#include "mauve_rt/rules/engine.hpp"
#include "mauve_rt/rules/feeds.hpp"
#include "mauve_rt/rules/reserve.hpp"
#include "mauve_rt/rules/worker.hpp"

namespace mauve::rules {

/// What one rule of the engine does and undoes.
struct RuleActions {
  ActionSteps do_steps{};
  TransactionOptions do_options{};
  ActionSteps
      undo_steps{};  // of a rule that undoes: what becomes the base at its end; else that is what was there before
  TransactionOptions undo_options{};
  bool takes_over{false};  // ... also where a person gave it
  bool whole{false};       // it does nothing while a person or a rule of higher rank has taken a part of it
  ReserveKind reserve{ReserveKind::stop};  // what its reserve action does, where the engine's rule has one
};

/// One decision, for who tells it.
struct Told {
  Decision decision{};
  ActionReport action{};  // of `done` and `failed`: what came of it
  std::uint64_t number{
      0};  // of all decisions, as they were made: one that waits for its report is told after later ones
};

/// What tells the conditions of a RuleRunner.
enum class Inputs : std::uint8_t {
  architecture,  // its components, resources and topics
  told,          // the caller of tell() alone, in virtual time
};

/// How one rule fares.
struct RuleFacts {
  std::string name{};
  RuleStatus status{};
  bool ready{false};            // what it would do or undo next could begin
  std::string problem{};        // what keeps it from acting, now or when it is time; empty: nothing
  std::size_t memory_bytes{0};  // of what is kept prepared
};

/// Runs an engine beside the components of a host. Neither Python is needed for that, but for parts that are written in it,
/// nor anything of another process. No rule waits for another one, unless both are about the same component; two that add,
/// remove or wire something share the architecture's structure, and their commits go one after the other.
///
/// In virtual time there are no threads: whoever simulates calls advance().
///
/// The decision thread steps the engine and begins actions; it is above the components, and carries nothing out. The follower,
/// an ordinary thread, tells it what becomes of the architecture, and collects what it decided. Each rule has threads of its
/// own: the commit thread commits what is prepared, as urgent as the decision thread; the preparation thread, an ordinary one,
/// prepares, completes and reports; the reserve thread carries out the reserve action, where the rule has one.
///
/// | member            | written by      | read by         | order                                                       |
/// | ----------------- | --------------- | --------------- | ----------------------------------------------------------- |
/// | engine_           | decision thread | the same        | its decisions: its own                                      |
/// | feeds_            | follower        | the same        | -                                                           |
/// | Rule::acts, reserve | several       | several         | their own: action.hpp, reserve.hpp                          |
/// | Rule::found       | follower        | decision thread | release/acquire: what was found lies in it                  |
/// | Rule::ends        | decision thread | follower        | release/acquire: what was done before lies in the architecture |
/// | Rule::in_effect, may_prepare | decision thread | preparation thread | relaxed: the thread is asked after it         |
/// | Rule::status      | decision thread | facts()         | its own: sequence_cell.hpp; a read that meets a write repeats |
/// | Rule::held        | follower        | the same        | -                                                           |
/// | Rule::reports, failure, kept | preparation thread, reserve thread | follower, facts() | told_mutex_                   |
/// | Rule::hindrance   | follower        | facts()         | told_mutex_                                                 |
/// | Rule::preparing_since_ns | preparation thread | facts() | relaxed: a lone instant                                  |
/// | work_ (futex)     | anyone          | follower        | release/acquire: who sees the bump sees the work            |
/// | Rule::reset (futex) | reset(), decision thread | both   | release/acquire: whose turn it is                           |
/// | ending_ (futex)   | stop()          | decision thread, follower | release/acquire                                   |
/// | told_ ... woken_, unobservable_ | follower, wake() | anyone | told_mutex_                                          |
class RuleRunner {
 public:
  /// `actions`: of the rules, in their order. What rules that are active now, and not among these, have done is undone. `topics`: topic -> the resource that is bound to it. `before`: those of the same
  /// host whose place these rules take, stopped: a rule that is in both, and the same, goes on, and what it receives in between
  /// counts. It is of no use afterwards, and as it was where this throws. [setup]
  /// Throws Error as Feeds::open(); invalid_argument: a rule that cannot be so, a kind of step that there is not.
  RuleRunner(Host& host, std::vector<mauve::rules::Rule> rules, std::vector<RuleActions> actions,
             std::map<std::string, std::string> topics = {}, RuleRunner* before = nullptr,
             Inputs inputs = Inputs::architecture);
  /// As stop().
  ~RuleRunner();
  RuleRunner(const RuleRunner&) = delete;
  RuleRunner& operator=(const RuleRunner&) = delete;

  /// Begins to watch; the host is deployed. A rule is armed once its components run. [non-rt] Throws Error (internal).
  void start();
  /// Nothing is done any more on return; what is in effect stays so. May be called again. [non-rt]
  void stop() noexcept;

  /// Ends an active rule whose condition is false, be it latched. Empty: done; else why not, in words. [non-rt]
  std::string reset(const std::string& rule);

  /// Decisions not taken yet; waits for one, at most so long, or until wake(). [non-rt]
  std::vector<Told> wait_told(time_ns_t timeout_ns);
  /// Ends that wait, now and from now on. [non-rt]
  void wake();
  /// [non-rt]
  std::vector<RuleFacts> facts() const;
  /// The executor's Python side works: conditions node_silent receive that. [rt], one thread. In virtual time advance() does it.
  void beat() MAUVE_RT { feeds_->beat(); }
  /// How many decisions were left out, because those before them were not taken in time. [non-rt]
  std::uint64_t lost() const;

  /// What the conditions listen to, one for each; several may listen to the same. [non-rt]
  std::vector<SignalSpec> signals() const;
  /// With Inputs::told: one of signals() reports a value. Whether advance() has something to decide. [non-rt]
  /// Throws Error (invalid_argument).
  bool tell(std::size_t signal, time_ns_t time_ns, double value);
  /// The same: the rule is active since before, and the architecture is as it wants it. [non-rt]
  void adopt(std::size_t rule);
  /// In virtual time: does all that is to be done now; when it has to be called again at the latest. [non-rt]
  time_ns_t advance();

 private:
  /// What its preparation thread found out.
  struct Kept {
    std::string problem{};
    std::size_t memory_bytes{0};
    std::array<bool, 2> has_no_steps{};  // by Act: what it would bring about is so
    bool operator==(const Kept&) const = default;
  };
  static constexpr std::uint32_t kNoReset = 0;
  static constexpr std::uint32_t kResetAsked = 1;
  static constexpr std::uint32_t kIsReset = 2;
  static constexpr std::uint32_t kResetRefused = 3;

  struct Rule {
    Rule(const RuleActions& its_actions, const mauve::rules::Rule& rule)
        : actions(its_actions),
          acts{Action(true, actions.do_options, rule.name),
               Action(rule.undoes, actions.undo_options, rule.name)},
          reserve(actions.reserve, rule.otherwise_after_ns ? rule.about : std::vector<std::string>()) {}
    Action& action(Act act) MAUVE_RT { return acts[static_cast<std::size_t>(act)]; }
    bool is_unsettled() const MAUVE_RT { return acts[0].is_unsettled() || acts[1].is_unsettled(); }
    /// As the last step of the decision thread left it. [non-rt]
    RuleStatus shown_status() const noexcept {
      RuleStatus shown;
      time_ns_t time_ns = 0;
      std::uint64_t sequence = 0;
      while (!status.load(shown, time_ns, sequence)) {  // a write takes less than a microsecond
      }
      return shown;
    }

    const RuleActions actions;
    std::array<Action, 2> acts;        // by Act
    std::shared_ptr<Overlay> overlay;  // from start() on
    std::vector<std::size_t> shares;   // numbers of the rules that set one of its elements, too
    Reserve reserve;
    Worker commits;
    Worker prepares;
    Worker reserves;
    std::uint32_t name{0};           // in the trace
    Atomic<std::uint64_t> found{0};  // kKnown ... below, above them the ends that it was found after
    Atomic<std::uint64_t> ends{
        0};  // of actions and activities of this rule, and of those that contend with it
    Atomic<std::uint32_t> reset{kNoReset};
    Atomic<bool> in_effect{false};
    Atomic<bool> may_prepare{true};
    bool has_ended{false};  // an action of it, in this step of the decision thread
    SequenceCell<RuleStatus> status;
    std::uint64_t applied{0};  // of found, by the decision thread
    std::deque<Told> held{};   // decisions behind one whose report is not there yet, that one first
    std::array<std::deque<ActionReport>, kActs> reports{};  // by Act
    std::uint32_t structure{UINT32_MAX};                    // the preparation thread's: at its last look
    Kept kept{};
    Atomic<time_ns_t> preparing_since_ns{0};  // 0: nothing is being prepared
    std::string hindrance{};                  // why it is not armed
    std::string failure{};                    // of the action that has ended last
  };

  void run_decisions() noexcept;
  void run_follower() noexcept;
  time_ns_t step() MAUVE_RT;
  void begin(const PendingAction& pending, time_ns_t now_ns) MAUVE_RT;
  void reset_asked(time_ns_t now_ns) MAUVE_RT;
  void show_activity() MAUVE_RT;
  bool is_ready(std::size_t index, Act act) const MAUVE_RT;
  void hear_ends(time_ns_t now_ns) MAUVE_RT;
  void ended(std::size_t index, Act act, Ended how, time_ns_t now_ns) MAUVE_RT;
  void apply_found(std::size_t index, time_ns_t now_ns) MAUVE_RT;
  void show_status() MAUVE_RT;
  bool is_unsettled(std::size_t index) const MAUVE_RT;
  bool commit(std::size_t index) noexcept;
  bool reserve(std::size_t index) noexcept;
  bool prepare(std::size_t index);
  bool make_ready(Rule& rule, bool after_own);
  bool make_ready(Rule& rule, Act act, std::uint64_t revision);
  void load_overlays();
  void keep(Rule& rule);
  bool hinder(Rule& rule, std::string hindrance);
  std::string problem_of(const Rule& rule, const RuleStatus& status) const MAUVE_REQUIRES(told_mutex_);
  void report(std::size_t index);
  void deliver(Rule& rule, Act act, ActionReport report);
  bool look_around();
  std::uint64_t collect();
  void tell();
  std::string follow();
  std::optional<std::size_t> find(const RuleRunner& other, std::size_t rule) const;
  void open_feeds(const std::vector<std::optional<std::size_t>>& same);
  void go_on_from(RuleRunner& before, const std::vector<std::optional<std::size_t>>& same);
  void start_thread(Thread& thread, const ThreadSettings& settings, void* (*entry)(void*));
  void start_workers();
  void join_workers() noexcept;
  void end() noexcept;
  Overlays& overlays() const noexcept { return host_.architecture().overlays(); }

  Host& host_;
  const Clock& clock_;
  std::unique_ptr<Engine> engine_;
  std::vector<std::unique_ptr<Rule>> rules_;
  std::shared_ptr<Feeds> feeds_;
  const Inputs inputs_;
  ChangeSignal work_;
  Atomic<std::uint32_t> ending_{0};
  Thread decision_thread_;
  Thread follower_;
  std::uint64_t shown_{0};     // the decision thread's: how often it has shown the status of the rules
  std::uint64_t made_{0};      // the follower's: how many decisions
  std::uint64_t followed_{0};  // the follower's: the revision at which preparation threads were asked
  time_ns_t epoch_ns_{0};      // of the deployment that it was started in
  bool runs_{false};
  mutable Mutex told_mutex_;
  ConditionVariable told_changed_;
  std::deque<Told> told_ MAUVE_GUARDED_BY(told_mutex_);
  std::uint64_t left_out_ MAUVE_GUARDED_BY(told_mutex_){0};
  std::string unobservable_ MAUVE_GUARDED_BY(told_mutex_){};  // why something cannot be heard
  bool woken_ MAUVE_GUARDED_BY(told_mutex_){false};
  std::uint16_t trace_number_;
};

}  // namespace mauve::rules
