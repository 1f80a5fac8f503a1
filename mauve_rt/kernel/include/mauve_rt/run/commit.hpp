// SPDX-License-Identifier: LGPL-3.0-or-later
// Commit: one change of N components that takes effect at one logical instant, without a meeting.
#pragma once

#include <exception>
#include <functional>
#include <optional>
#include <utility>
#include <vector>

#include "mauve_rt/base/contract.hpp"
#include "mauve_rt/base/rt.hpp"
#include "mauve_rt/base/seam/atomic.hpp"
#include "mauve_rt/base/thread_safety.hpp"
#include "mauve_rt/base/time.hpp"
#include "mauve_rt/run/cut.hpp"

namespace mauve {

class CommitGate;
class Publication;
class Task;

/// One part of a change. Prepared on an ordinary thread; adopt and take run on the thread of the component that the action
/// changes. They run on the requester's where that component is parked and has no thread.
class CommitAction {
 public:
  virtual ~CommitAction() = default;
  /// May refuse by returning false or throwing; changes nothing. [rt] as far as the part is.
  virtual bool adopt() { return true; }
  /// Makes the change; cannot fail. [rt] as far as the part is.
  virtual void take() noexcept = 0;
  /// Writes the safe value, of that time, through the ends that the action gives its component, whether it has been taken or not;
  /// false when it must wait for a lock and may not. [rt], the component's thread hangs.
  virtual bool make_safe(bool /*may_wait*/, time_ns_t /*time_ns*/) MAUVE_RT { return true; }
  /// The time that adopt and take declare to need together; 0: none declared. [rt]
  virtual time_ns_t declared_ns() const MAUVE_RT { return 0; }
  /// Whether the component may vote in this wait; `is_last`: all others have voted. Asked of the last voter (Commit::set_last()) in each
  /// wait until it says so; what it says then holds until the vote. [rt] as far as the part is, the component's thread
  virtual bool is_ready(bool /*is_last*/) noexcept { return true; }
  /// The action's name in the trace. [rt]
  virtual std::uint32_t trace_id() const MAUVE_RT { return 0; }

  const Task* task{nullptr};  // of the component that it changes
  time_ns_t instant_ns{0};    // T, set before take
  time_ns_t adopt_ns{0};      // measured
  time_ns_t take_ns{0};
};

/// What becomes of a component when the change is in.
enum class Afterwards : std::uint8_t {
  go_on,  // at its pending instant; a parked one stays parked
  restart,  // in its initial state, at the pending instant if that is on its new grid, else at the grid's next; a
            // parked one starts
  stop,  // parked, its outputs written
};

class Commit;

/// One component's part in a commit.
///
/// | member            | written by                                        | read by       | order                   |
/// | ----------------- | ------------------------------------------------- | ------------- | ----------------------- |
/// | task ... is_own   | requester, before it posts                        | anyone after  | the task's slot         |
/// | has_command       | requester                                         | requester     | -                       |
/// | has_voted         | who votes for it: its thread, else the requester  | the same      | the task's slot         |
/// | was_asked ...     | the component's thread                            | requester     | relaxed: lone facts     |
/// | visit_ns          |                                                   |               |                         |
/// | parked ... shift  | who takes for it, before it passes                | requester     | passed                  |
/// | passed            | who takes for it                                  | requester     | release/acquire         |
/// | release_*         | the component's thread, before released           | requester     | through released        |
/// | released (futex)  | the component's thread                            | requester     | release/acquire         |
struct Participant {
  static constexpr std::uint32_t kReleased = 1;
  static constexpr std::uint32_t kSuperseded = 2;  // another change was taken before the release

  Task* task{nullptr};
  Commit* commit{nullptr};
  Afterwards afterwards{Afterwards::go_on};
  std::optional<time_ns_t> start_clock_ns{};  // of a restart: the grid's reference, when not the deployment's
  bool replaces_parts{false};                 // its outputs are written as the ports' on_commit says
  time_ns_t epoch_lead_ns{0};  // its grid counts from a new epoch, T - 1 and this; 0: the epoch stays
  bool repairs{false};         // it was FAULTED, and the change repairs it
  bool only_epoch{false};      // it was FAULTED or not configured, and takes the new epoch for its next start
  std::vector<CommitAction*> actions{};  // those of its own component, in the order of the change
  bool in_flight{false};                 // it was not parked when the change was posted
  bool is_own{false};  // its own thread votes and takes; else the requester does, the component being parked
  /// Its thread still runs a timed-out execution, and does not come back before the decision: it is to be removed, or takes the new epoch
  /// only.
  bool left_behind{false};
  /// It has nothing to take: it votes, so that no job of its is pending at T (set_idle).
  bool is_silent{false};
  bool has_voted{false};
  bool has_command{false};  // the requester has its command mutex, and is to unlock it

  Atomic<bool> was_asked{false};         // whether it is ready
  Atomic<std::uint32_t> unfit_waits{0};  // waits that the declared budget did not fit in
  Atomic<bool> has_agreed{false};        // it has voted, for a message
  Atomic<time_ns_t> visit_ns{0};         // when its adopt or take began; 0: neither is under way

  time_ns_t parked_ns{0};   // the visit in which it took the change began
  time_ns_t armed_ns{0};    // ... and ended
  time_ns_t pending_ns{0};  // the instant pending then; 0: the component was parked already
  time_ns_t period_ns{0};   // g before the change
  std::int64_t lost{
      0};       // instants that passed during its own adopt, before another wait in which it took the change
  Grid grid{};  // after the change
  time_ns_t resumes_ns{0};     // the instant that it goes on at
  time_ns_t grid_place_ns{0};  // where that belongs within a period (Machine::grid_place_ns)
  time_ns_t shift_ns{0};       // by which a new epoch makes its instants later
  Atomic<bool> passed{false};

  time_ns_t release_nominal_ns{0};  // of the release that follows
  time_ns_t release_actual_ns{0};
  Atomic<std::uint32_t> released{0};

  /// What its adopts and takes declare to need together; 0: nothing is declared. [rt]
  time_ns_t declared_ns() const MAUVE_RT {
    time_ns_t declared = 0;
    for (const CommitAction* action : actions) declared += action->declared_ns();
    return declared;
  }
  /// How long its adopts, or its takes, may last before the watchdog gives the component up; kForever: the requester watches them,
  /// as long as its patience lasts. [rt]
  time_ns_t limit_ns() const MAUVE_RT;
  /// Of a change that is made; 0: the epoch stays. [rt]
  time_ns_t new_epoch_ns() const MAUVE_RT;
  /// Whether it has taken the change, and all of the above is there. [rt]
  bool has_passed() const MAUVE_RT { return passed.load(std::memory_order_acquire); }
  /// After it has passed: whether a release follows; none does in a wait that only a stop ends. [non-rt]
  bool is_followed_by_release() const noexcept {
    if (afterwards == Afterwards::go_on && pending_ns == kForever) return false;
    return pending_ns != 0 && afterwards != Afterwards::stop;
  }
  /// The same, when it has not come yet. [non-rt]
  bool awaits_release() const noexcept {
    return in_flight && is_followed_by_release() && released.load(std::memory_order_acquire) == 0;
  }
};

/// One change under way. Each participant votes in a wait, once its adopt has agreed; the last vote closes the cut (cut.hpp),
/// which fixes T. Each participant executes up to T with old parts, and takes the change before it executes at T or later.
/// No participant waits for another.
///
/// The requester posts the change to the participants, and sleeps until the cut is decided. From then on it holds nobody: it
/// waits for those that have yet to take the change as long as its patience lasts. The decision is also the publication: the
/// gate puts what the change makes of the architecture into its table (commit_gate.hpp). A participant is settled when it has
/// passed: what it has put out may be freed then. The change's record may be freed once no thread is to come back to it (is_left()).
///
/// | member          | written by                              | read by     | order                                       |
/// | --------------- | --------------------------------------- | ----------- | ------------------------------------------- |
/// | cut_            | participants, requester, who calls off  | all         | its own: cut.hpp                            |
/// | to_vote_        | each participant once, when it has raised the cut | same | acq_rel: the last one sees all raises    |
/// | to_pass_ (futex)| each participant once: its last touch   | requester   | acq_rel: all that they wrote                |
/// | decided_ (futex)| who decides the cut                     | requester   | release/acquire; a hint, cut_ says it       |
/// | refusal_state_  | the first participant that refuses      | requester   | release/acquire: the refusal is complete    |
/// | refusal_, refused_by_, adopt_was_late_ | that one, in state writing | requester, if complete | refusal_state_ |
/// | pending_        | who looks for an idle instant           | requester   | relaxed: for a message                      |
/// | answered_       | requester                               | participants| relaxed: a hint                             |
/// | off_, off_by_   | who calls it off first                  | requester   | relaxed before the cut's exchange           |
/// | the rest        | requester, before it posts              | participants| the task's slot                             |
class Commit {
 public:
  /// A component is given up when its adopt or take still runs so long after the change was called off or timed out: machines
  /// stall for tens of milliseconds.
  static constexpr time_ns_t kPatience = ms_to_ns(100);

  enum class Outcome : std::uint8_t {
    made,
    refused,    // by an adopt, or by a check of this commit
    off,        // it was withdrawn, preempted, or the host is being shut down
    timed_out,  // a participant did not vote in time, or a command of one lasted; no idle instant came in time
    changed,    // a participant is STOPPING or FAULTED
    stale,      // the architecture is not the one that it was prepared for
  };
  enum class Off : std::uint8_t {
    not_yet,
    timed_out,
    not_idle,
    not_ready,
    withdrawn,
    shut_down,
    preempted,
    abandoned
  };

  /// Actions without a task are checks: their adopt runs on the requester, before it posts.
  Commit(std::size_t participants, std::vector<CommitAction*> actions);
  /// Gives up waiting for the releases that follow; the tasks that go on must exist still.
  ~Commit();
  Commit(const Commit&) = delete;
  Commit& operator=(const Commit&) = delete;

  /// The participants; fill in task and what is to become of it. [non-rt]
  std::vector<Participant>& participants() noexcept { return participants_; }
  const std::vector<Participant>& participants() const noexcept { return participants_; }
  /// Gives the participants their actions, and orders them by number. [non-rt] Once, before carry_out().
  void assign_actions();
  /// Whether a component's own thread takes part. [rt], from carry_out() on.
  bool has_own() const MAUVE_RT {
    return has_own_.load(std::memory_order_relaxed);
  }  // relaxed: looked at again when it is known
  /// It gives way to a prepared commit. [setup]
  void set_yields() noexcept { yields_ = true; }
  /// [rt]
  bool yields() const MAUVE_RT { return yields_; }
  /// It is made only at an instant at which no job of a participant is pending. After all have voted each participant that enters a
  /// wait looks for one (Cut::close_if); the change is called off when none has come so long after the last vote. [setup]
  ///
  /// Where all participants that run are pinned to one and the same CPU, only the lowest of them closes: it runs, so no component above it
  /// is ready, whether it takes part or not. Else each may close, and a component above one of them has to take part (is_silent).
  void set_idle(time_ns_t within_ns) noexcept {
    is_idle_ = true;
    idle_within_ns_ = within_ns;
  }
  /// [rt]
  bool is_idle() const MAUVE_RT { return is_idle_; }
  /// The participant, which runs, votes after all others, once its actions are ready. The change is called off when they are not so
  /// long after it was posted. In virtual time `pass_time` lets that time pass, up to its argument: false when it is reached. [setup]
  void set_last(Participant& participant, time_ns_t within_ns, std::function<bool(time_ns_t)> pass_time) {
    last_ = &participant;
    ready_within_ns_ = within_ns;
    pass_time_ = std::move(pass_time);
  }
  /// Whether the participant may vote in this wait. [rt] as far as the actions are, the participant's thread
  bool is_ready(Participant& participant) noexcept;
  /// It is for threads that run: it ends when they are shut down. [setup]
  void set_hosted() noexcept { is_hosted_ = true; }
  /// What it makes of the table. [setup]
  void set_publication(Publication& publication) noexcept { publication_ = &publication; }
  /// Puts that into the table. [rt], by the gate, within a Look
  void publish() MAUVE_RT;
  /// Whether it may be installed; its cut starts where it may then. [rt], by the gate, within a Look
  bool prepare_install() MAUVE_RT;
  /// It adds or removes something, or wires ports; who carries it out holds CommitGate::structural. [setup]
  void set_structural() noexcept { is_structural_ = true; }
  /// [rt]
  bool is_structural() const MAUVE_RT { return is_structural_; }
  /// Whether the task takes part. [rt]
  bool is_about(const Task& task) const MAUVE_RT { return find(task) != nullptr; }
  Commit* next{nullptr};  // the gate's

  // ---- the requester

  /// Makes the change, or not, at most until the instant. Where a component's adopt does not end the component is given up, which
  /// allocates. [rt] as far as the actions are. Ordinary threads and rules.
  Outcome decide(time_ns_t until_ns, CommitGate& gate) noexcept;
  /// Of one that is made: waits until all have passed, at most until the instant and a little longer; has_passed() says whether
  /// they have. A component whose take does not end is given up. [rt] as far as the actions are.
  void await_passes(time_ns_t until_ns) noexcept;
  /// Throws Error as the outcome demands, or what adopt threw; returns where adopt returned false. [non-rt], not made.
  void rethrow_refusal() const;
  /// [non-rt], after it ended.
  bool is_made() const noexcept { return cut_.look().is_closed(); }
  /// T. [rt], once it is made.
  time_ns_t instant_ns() const MAUVE_RT {
    const CutWord made = cut_.look();
    MAUVE_EXPECTS(made.is_closed());
    return made.instant_ns();
  }
  /// Whether all have taken the change: what it put out may be retired. [rt]
  bool has_passed() const MAUVE_RT { return to_pass_.load(std::memory_order_acquire) == 0; }
  /// Whether the requester has gone on without those that are late. [rt]
  bool is_answered() const MAUVE_RT { return answered_.load(std::memory_order_relaxed); }
  /// Sleeps until all have passed, at most until the instant. [non-rt]
  bool wait_passed(time_ns_t until_ns) const noexcept;
  /// Whether the participant's thread comes to its part no more: it has passed, or its component was abandoned. [non-rt], of one
  /// that is made.
  static bool is_over(const Participant& participant) noexcept;
  /// Whether no thread will touch the record any more. [non-rt], after it ended.
  bool is_left() const noexcept;
  /// Whether a component was given up whose adopt did not end. [non-rt], after it ended.
  bool has_given_up() const noexcept { return given_up_ != nullptr; }
  /// The action whose adopt had refused when the requester went on, or nullptr. [non-rt], after it ended.
  const CommitAction* refused_by() const noexcept { return is_refused_ ? refused_by_ : nullptr; }
  /// Why it was called off. [non-rt], after it ended.
  Off off() const noexcept;

  // ---- participants: their own threads, or the requester for a parked one

  /// [rt]
  CutWord look() const MAUVE_RT { return cut_.look(); }
  /// Before a participant that has voted executes at this clock. The end of a wait for an event comes at a clock that no look for an
  /// idle instant could know. [rt]
  CutWord raise(time_ns_t clock_ns, bool is_event) MAUVE_RT {
    return is_idle_ && is_event ? cut_.raise_always(clock_ns) : cut_.raise(clock_ns);
  }
  /// Whether a job at this clock has the new parts. After an idle close each does: an event may be older than T. [rt]
  bool is_new_at(time_ns_t clock_ns) const MAUVE_RT {
    const CutWord seen = cut_.look();
    return seen.is_closed() && (is_idle_ || clock_ns >= seen.instant_ns());
  }
  /// Of an idle one, by a participant in a wait, after its vote: makes the change if all have voted and no job is pending. True when
  /// this call did it, as vote(). [rt]
  bool close_if_idle(const Participant& by) MAUVE_RT;
  /// Runs the adopts of a participant; false when the change is refused, and called off. [rt] as far as the actions are.
  bool adopt(Participant& participant) noexcept;
  /// The participant agrees, and has executed nothing beyond this clock. True when it was the last: the caller wakes the
  /// requester, after what is more urgent. [rt]
  bool vote(Participant& participant, time_ns_t entered_ns) MAUVE_RT;
  /// Takes all actions of a participant; how long these and the adopts took beyond what they declared, else 0. [rt] as far as
  /// the actions are.
  time_ns_t take(Participant& participant) noexcept;
  /// The participant has taken the change: its last touch of it. [rt]
  void pass(Participant& participant) MAUVE_RT;
  /// False when the change is made already. Any thread that knows the commit to exist. [rt]
  bool call_off(Off why, const Task* by = nullptr) MAUVE_RT;
  /// The same, and the requester sleeps on until wake_requester(). [rt]
  bool call_off_quietly(Off why, const Task* by) MAUVE_RT;
  /// Of a commit that is decided. [rt]
  void wake_requester() MAUVE_RT;

 private:
  Participant* find(const Task& task) const MAUVE_RT;
  bool await_slots(time_ns_t until_ns, CommitGate& gate) noexcept;
  bool lock(time_ns_t until_ns) noexcept MAUVE_LOCKS_UNSEEN;  // as many as take part
  void unlock() noexcept MAUVE_LOCKS_UNSEEN;
  bool has_commands() const MAUVE_RT;
  bool is_one_cpu() const MAUVE_RT;
  void choose_closer() MAUVE_RT;
  const Participant* find_pending(CutWord seen) const MAUVE_RT;
  const Task* find_unfit() const noexcept;
  void begin() noexcept;
  bool check() noexcept;
  void refuse(const Participant* participant, const CommitAction& action, std::exception_ptr why,
              bool is_late) noexcept;
  void post_all(time_ns_t until_ns) noexcept;
  void vote_for_parked() noexcept;
  void visit_simulated() noexcept;
  void await_decision(time_ns_t until_ns) noexcept;
  void let_time_pass() noexcept;
  bool is_last_asked() const noexcept;
  void call_off_if_one_left() noexcept;
  void retract_posted() noexcept;
  void await_busy(time_ns_t until_ns) noexcept;
  void begin_completion() noexcept;
  bool give_up(const Participant& participant, const char* call) noexcept;
  void start_parked(time_ns_t until_ns) noexcept;
  [[noreturn]] void throw_unfit() const;
  [[noreturn]] void throw_timeout() const;
  [[noreturn]] void throw_not_idle() const;
  [[noreturn]] void throw_off() const;

  std::vector<Participant> participants_;
  std::vector<Participant*> order_;  // by the tasks' numbers: who commands two tasks takes them in this order
  std::vector<Participant*>
      posted_;  // as they are posted to: those of an idle one from the highest priority to the lowest
  std::vector<CommitAction*> actions_;
  bool yields_{false};
  bool is_hosted_{false};
  bool is_structural_{false};
  bool is_idle_{false};
  time_ns_t idle_within_ns_{0};
  Participant* last_{nullptr};  // votes last; nullptr: in any order
  time_ns_t ready_within_ns_{0};
  std::function<bool(time_ns_t)> pass_time_{};
  bool is_one_cpu_{false};
  const Participant* closer_{nullptr};           // the lowest that runs; nullptr: all are parked
  Atomic<const Participant*> pending_{nullptr};  // at the last look for an idle instant
  Atomic<bool> has_own_{false};
  time_ns_t timeout_ns_{0};
  const Task* unfit_{nullptr};
  const Task* locked_out_{nullptr};    // whose command lasted
  const Task* occupied_{nullptr};      // who has not taken an earlier change yet
  Publication* publication_{nullptr};  // nullptr: of a test
  Task* given_up_{nullptr};
  bool adopt_was_late_{false};
  std::exception_ptr refusal_{};
  const CommitAction* refused_by_{nullptr};
  enum class RefusalState : std::uint8_t { none, writing, complete };
  Atomic<RefusalState> refusal_state_{RefusalState::none};
  bool is_refused_{false};  // as the requester found it: a late adopt may refuse afterwards
  Atomic<bool> answered_{false};
  Atomic<Off> off_{Off::not_yet};
  Atomic<const Task*> off_by_{nullptr};
  alignas(64) Cut cut_{};
  Atomic<std::uint32_t> to_vote_{0};
  Atomic<std::uint32_t> to_pass_{0};
  alignas(64) Atomic<std::uint32_t> decided_{0};  // a line of its own: the requester sleeps on it
};

}  // namespace mauve
