// SPDX-License-Identifier: LGPL-3.0-or-later
// A change to components that run: they meet in their waits, and the last to come makes it for all.
#pragma once

#include <atomic>
#include <exception>
#include <memory>
#include <optional>
#include <vector>

#include "mauve_rt/base/threads.hpp"
#include "mauve_rt/base/time.hpp"
#include "mauve_rt/run/lent.hpp"

namespace mauve {

class Task;

/// One part of a change. Prepared on an ordinary thread; its two calls run on the thread of one of the components
/// that the change touches, or on the requester's while all of these are parked.
class CommitAction {
 public:
  virtual ~CommitAction() = default;
  /// May refuse by returning false or throwing; changes nothing. [rt] as far as the part is.
  virtual bool adopt() { return true; }
  /// Makes the change; cannot fail. [rt] as far as the part is.
  virtual void take() noexcept = 0;
  /// The time adopt and take need together, declared or reckoned. [rt]
  virtual time_ns_t budget_ns() const MAUVE_RT { return us_to_ns(5); }
  /// What of it was declared and is held against them; 0: it is only reckoned. [rt]
  virtual time_ns_t declared_ns() const MAUVE_RT { return 0; }
  /// What the trace calls it. [rt]
  virtual std::uint32_t trace_id() const MAUVE_RT { return 0; }

  const Task* task{nullptr};  // of the component that it changes, whose trace tells of it
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
/// | member            | written by                                      | read by              | order                    |
/// | ----------------- | ----------------------------------------------- | -------------------- | ------------------------ |
/// | task ... in_flight| requester, before it is posted                  | anyone after         | the task's place         |
/// | came, arrived,    | the component's thread                          | requester            | relaxed: for a message   |
/// | passed            |                                                 |                      |                          |
/// | leaves_at_ns      | the component's thread, before it arrives       | who comes last       | relaxed: the gate        |
/// | parked, pending   | the component's thread, before it arrives       | who makes the change | the gate                 |
/// | holds_until_ns    | the component's thread                          | the same             | -                        |
/// | overlong_ns       | who makes the change                            | component's thread   | the gate                 |
/// | period            | requester, before it is posted                  | requester            | its own                  |
/// | armed, lost, grid,| the component's thread, before it lets go       | requester, after it  | the task's place         |
/// | resumes, ..place, |                                                 |                      |                          |
/// | shift             |                                                 |                      |                          |
/// | release_*         | the component's thread, before released         | requester, after it  | through released         |
/// | released (futex)  | the component's thread                          | requester            | release/acquire          |
struct Participant {
  static constexpr std::uint32_t kReleased = 1;
  static constexpr std::uint32_t kSuperseded = 2;  // another commit came before the release

  Task* task{nullptr};
  Commit* commit{nullptr};
  Afterwards afterwards{Afterwards::go_on};
  std::optional<time_ns_t>
      start_clock_ns{};                // of a restart: the grid's reference, when it is not the deployment's
  time_ns_t budget_ns{0};              // what adopt and take of its own core need
  bool replaces_parts{false};          // its outputs are written as the ports' on_commit says
  bool in_flight{false};               // it was running when the commit began
  bool makes_parked{false};            // it is parked, as all are, and its thread makes the change
  bool repairs{false};                 // it was FAULTED, and the change mends it
  const time_ns_t* epoch_ns{nullptr};  // the new one, once the change is made; nullptr: the epoch stays
  bool left_behind{false};  // to be removed, while its thread still executes what it was condemned for

  std::atomic<bool> came{false};           // it was at the gate, or would have been but for the budget
  std::atomic<bool> arrived{false};        // it is at the gate
  std::atomic<std::uint32_t> passed{0};    // its releases since, before which the budget did not fit
  std::atomic<time_ns_t> leaves_at_ns{0};  // for its pending instant
  time_ns_t holds_until_ns{0};             // the last of the instants that it may miss, or the pending one
  time_ns_t overlong_ns{0};  // what adopt and take of its core took, when that was more than they declared
  std::int64_t lost{0};      // instants that passed while it waited in vain
  time_ns_t parked_ns{0};
  time_ns_t armed_ns{0};
  time_ns_t pending_ns{0};     // the instant pending at the park; 0: the component was parked already
  time_ns_t period_ns{0};      // g before the change
  Grid grid{};                 // after it
  time_ns_t resumes_ns{0};     // the instant that it goes on at
  time_ns_t grid_place_ns{0};  // where that belongs within a period (Task::grid_place_ns_)

  time_ns_t shift_ns{0};  // by which a new epoch makes its instants later

  time_ns_t release_nominal_ns{0};  // of the release that follows
  time_ns_t release_actual_ns{0};
  std::atomic<std::uint32_t> released{0};

  /// Whether its thread has to do with the change. [rt]
  bool is_called() const MAUVE_RT { return in_flight || makes_parked; }
  /// After the commit was made: whether a release follows; none does in a wait that only a stop ends. [non-rt]
  bool is_followed_by_release() const noexcept {
    if (afterwards == Afterwards::go_on && pending_ns == kForever) return false;
    return pending_ns != 0 && afterwards != Afterwards::stop;
  }
  /// The same, when it has not come yet. [non-rt]
  bool awaits_release() const noexcept {
    return in_flight && is_followed_by_release() && released.load(std::memory_order_acquire) == 0;
  }
};

/// One change under way: its participants, its actions and the gate where the participants meet.
///
/// A component comes to the gate in its wait. While others are missing it leaves again for its pending instant and comes
/// back in the wait after, so that it misses no release, until all have met. The last one to come carries out all
/// actions; then all go on. Nobody stays past its pending instant, unless the request allows some to be missed: these
/// are spent only when everybody has been there once, since who is in a long state would not come for them.
///
/// The gate goes from gathering to adopting (the last has come) to taking to done. Until taking begins the commit can be
/// called off by anyone, also while an adopt lasts; whether it was, one compare-exchange decides.
///
/// | member          | written by                                            | read by           | order                           |
/// | --------------- | ----------------------------------------------------- | ----------------- | ------------------------------- |
/// | gate_ (futex)   | who comes, leaves, makes the change, or calls it off  | all of these      | acq_rel: hands over all results |
/// | settled_ (futex)| who calls it off; the last to go on                   | who conducts      | release: all has been written   |
/// | expected_ ...   | requester, before the first participant is posted     | participants      | the task's place                |
/// | going_          | each that goes on after the change                    | the same          | acq_rel: one is the last        |
/// | came_           | participants                                          | participants      | relaxed: a count                |
/// | maker_, began_, | who comes last, before adopting begins                | all               | relaxed: gate_ publishes them   |
/// | adopting_       | who makes the change                                  | requester, a text | release/acquire                 |
/// | off_, off_by_   | who calls it off first                                | requester, at end | the tasks' places               |
/// | patience_ns_    | who shuts down                                        | who conducts      | relaxed: a lone number          |
/// | results         | who makes the change                                  | all, after kDone  | gate_                           |
class Commit {
 public:
  /// An adopt is given so long, at least, before its component is given up: machines stall.
  static constexpr time_ns_t kPatience = ms_to_ns(100);

  Commit(std::size_t participants, std::vector<CommitAction*> actions);
  /// Gives up waiting for the releases that follow; the tasks that go on must exist still.
  ~Commit();
  Commit(const Commit&) = delete;
  Commit& operator=(const Commit&) = delete;

  /// The participants; fill in task and afterwards. [non-rt]
  std::vector<Participant>& participants() noexcept { return participants_; }
  /// In the order they are called to the gate: the longest budget first; among equals the shortest period last, for
  /// that one can least afford to wait (rule 10). [non-rt]
  void order_participants();
  const std::vector<Participant*>& in_order() const noexcept { return order_; }
  const std::vector<CommitAction*>& actions() const noexcept { return actions_; }
  /// Time needed for all actions. [rt]
  time_ns_t budget_ns() const MAUVE_RT { return budget_ns_; }
  /// What of it was declared. [rt]
  time_ns_t declared_ns() const MAUVE_RT { return declared_ns_; }
  /// How many releases each participant may be held past, all in all. [non-rt], before it is posted.
  void set_max_missed(std::int64_t releases) noexcept { max_missed_ = releases; }

  /// Whether it was made; else nothing was changed. [non-rt], after it ended.
  bool committed() const noexcept { return !is_abandoned() && committed_; }
  /// What adopt threw, if it did. [non-rt], after it ended.
  const std::exception_ptr& refusal() const noexcept { return refusal_; }
  /// The action whose adopt refused, or nullptr. [non-rt], after it ended.
  const CommitAction* refused_by() const noexcept { return refused_by_; }
  /// Puts one that was called off for its time down to the action that was most over its budget, and returns that;
  /// nullptr: no adopt of a component was begun. [non-rt], after it ended: no abandoned maker may do it.
  const CommitAction* put_down() noexcept;
  /// Whether that was for the time its adopt took. [non-rt], after it ended.
  bool adopt_was_late() const noexcept { return adopt_was_late_; }

  /// It gives way to a prepared commit. [setup]
  void set_yields() noexcept { yields_ = true; }
  /// [rt]
  bool yields() const MAUVE_RT { return yields_; }

  // ---- for those who come to the gate

  enum class Answer : std::uint8_t {
    made_it,    // it was the last, and the change is made or refused
    done,       // so it is, by another
    left,       // it has to go, and may come again
    off,        // the commit was called off
    abandoned,  // it has lasted so long that the component was given up
  };
  /// Comes to the gate, and waits there for the others or makes the change. [rt] as far as the actions are.
  Answer meet(Participant& place) noexcept;
  /// Called by each that was there when the change was made, once it is armed. [rt]
  void gone_on(bool made_it) MAUVE_RT;
  /// Notes that it was there, or would have been but for the budget. [rt]
  void note_came(Participant& place) MAUVE_RT;
  /// How many more releases it may be held past, now. [rt]
  std::int64_t may_miss(const Participant& place) const MAUVE_RT;
  /// The last of the instants that it may miss now, or its pending one. [rt]
  time_ns_t holds_until_ns(const Participant& place) const MAUVE_RT;
  /// Lets those at the gate look whether they have to go. [rt]
  void poke() MAUVE_RT;

  // ---- for who conducts it, and who wants it not to happen

  enum class Off : std::uint8_t { not_yet, timed_out, withdrawn, overran, shut_down, preempted };
  /// Calls it off, without waiting for anybody: withdrawn by a task that is stopped or faulted, e.g. False when the
  /// change was made already, or is being taken this moment. [rt]
  bool call_off(Off why, const Task* task = nullptr) MAUVE_RT;
  /// Lets an adopt that lasts have no more than kPatience from now on. [rt]
  void hurry() MAUVE_RT;
  /// How many are to come. [non-rt]
  void expect(std::uint32_t parties) noexcept;
  /// Makes the change where nobody is to come. [rt] as far as the actions are.
  void make_alone() noexcept;
  /// Sleeps until all have gone on, or it was called off, at most until the instant; whether it did. [rt]
  bool wait_settled(time_ns_t until_ns) MAUVE_RT;
  /// The instant at which an adopt or take that still lasts is given up. [rt]
  time_ns_t patience_ends_ns(time_ns_t timeout_at_ns) const MAUVE_RT;
  /// Gives up who makes the change, if anybody does still; whether it is given up now. [rt]
  bool abandon() MAUVE_RT;

  /// Why it was called off. [non-rt], after it ended.
  Off off() const noexcept;
  const Task* off_by() const noexcept { return off_by_.load(std::memory_order_relaxed); }
  bool is_abandoned() const noexcept { return (gate_.load(std::memory_order_acquire) & kAbandoned) != 0; }
  bool is_taking() const noexcept { return (gate_.load(std::memory_order_acquire) & kTaking) != 0; }
  /// Who makes the change, and the part that is being made. [non-rt], once abandoned.
  Participant* maker() const noexcept { return maker_.load(std::memory_order_relaxed); }
  const CommitAction* under_way() const noexcept { return adopting_.load(std::memory_order_acquire); }

 private:
  static constexpr std::uint32_t kCount = 0xFFFF, kAdopting = 1U << 16U, kTaking = 1U << 17U,
                                 kDone = 1U << 18U, kOff = 1U << 19U, kAbandoned = 1U << 20U,
                                 kPoke = 1U << 24U;

  std::optional<Answer> arrive(Participant& place) noexcept;
  bool have_time(const Participant& last, time_ns_t now_ns) const noexcept;
  Answer wait_others(Participant& place) noexcept;
  Answer make_change() noexcept;
  bool adopt_all(const Clock& clock) noexcept;
  bool begin_taking() noexcept;
  void take_all(const Clock& clock) noexcept;
  void borrow_priority() noexcept;
  void repay_priority() MAUVE_RT;
  void settle() noexcept;

  std::vector<Participant> participants_;
  std::vector<Participant*> order_;
  std::vector<CommitAction*> actions_;
  time_ns_t budget_ns_{0};
  time_ns_t declared_ns_{0};
  std::int64_t max_missed_{0};
  std::uint32_t expected_{0};
  int own_priority_{0};  // of who makes the change, while it works at another's; 0: it does not
  bool committed_{false};
  bool yields_{false};
  bool adopt_was_late_{false};
  std::exception_ptr refusal_{};
  const CommitAction* refused_by_{nullptr};
  std::atomic<Participant*> maker_{nullptr};
  std::atomic<time_ns_t> began_ns_{0};
  std::atomic<const CommitAction*> adopting_{nullptr};
  std::atomic<std::uint32_t> came_{0};
  std::atomic<Off> off_{Off::not_yet};
  std::atomic<const Task*> off_by_{nullptr};
  std::atomic<time_ns_t> patience_ns_{kForever};
  alignas(64) std::atomic<std::uint32_t> gate_{0};
  std::atomic<std::uint32_t> going_{0};
  alignas(64) std::atomic<std::uint32_t> settled_{
      0};  // a line of its own: whoever sleeps on it is no participant
};

/// Posts a commit to its running participants, in their order, and sees it to its end. Runs no user code. [rt]
/// Returns once no participant refers to the commit any more, but for one whose adopt or take does not end.
void conduct(Commit& commit, time_ns_t timeout_ns) MAUVE_RT;

/// The thread that conducts commits, SCHED_FIFO above all components where that is granted.
///
/// | member          | written by | read by    | order                                 |
/// | --------------- | ---------- | ---------- | ------------------------------------- |
/// | order_ (futex)  | requester  | the thread | release/acquire: hands over commit_   |
/// | finished_(futex)| the thread | requester  | release/acquire: the commit's end     |
/// | under_way_      | requester  | anyone     | its own: lent.hpp                     |
/// | pressing_       | who presses| requester  | seq_cst with under_way_: one of them sees the other |
class Conductor {
 public:
  /// [setup] Without the right to SCHED_FIFO it is an ordinary thread.
  Conductor();
  ~Conductor();
  Conductor(const Conductor&) = delete;
  Conductor& operator=(const Conductor&) = delete;

  /// conduct() on the thread; one caller at a time. [rt]
  void conduct(Commit& commit, time_ns_t timeout_ns) MAUVE_RT;
  /// Makes a commit whose tasks are all parked on the calling thread, where withdraw() finds it; one caller at a time.
  /// [rt] as far as the actions are.
  void make_alone(Commit& commit) noexcept;
  /// Calls off the commit under way, where that gives way, and each such that comes before relax(). [rt]
  void press() MAUVE_RT;
  void relax() MAUVE_RT { pressing_.fetch_sub(1, std::memory_order_seq_cst); }
  /// Calls off the commit under way, if there is one, and does not wait for its end; any thread. [rt]
  void withdraw() MAUVE_RT;

 private:
  static constexpr std::uint32_t kNone = 0, kConduct = 1, kEnd = 2;

  static void* entry(void* self) noexcept;
  void run() noexcept;
  void give_way(Commit& commit) MAUVE_RT;

  Thread thread_;
  Commit* commit_{nullptr};
  time_ns_t timeout_ns_{0};
  Lent<Commit> under_way_;
  std::atomic<std::uint32_t> pressing_{0};
  std::atomic<std::uint32_t> order_{kNone};
  std::atomic<std::uint32_t> finished_{0};
};

/// Carries out a commit on tasks of any state and waits for its end: by the conductor, or at once by the calling thread
/// when every participant is parked or simulated. [non-rt]
/// Throws Error: timeout naming the state still running; wrong_revision when a participant was stopped or faulted
/// meanwhile; faulted when an adopt did not end and its component was given up (Commit::is_abandoned: the commit and all
/// its actions must then outlive that component's thread). Rethrows what adopt threw; returns whether every adopt agreed.
/// Unless it returns true nothing was changed.
bool carry_out(Commit& commit, time_ns_t timeout_ns, Conductor* conductor);

/// The same in two: the real-time part, and what it answers.
class PreparedCommit {
 public:
  enum class Outcome : std::uint8_t { made, refused, off, timed_out, changed };

  /// Of a commit whose participants are filled in. [non-rt]
  explicit PreparedCommit(Commit& commit);
  /// [rt] as far as the actions are: it allocates only where it gives up a component (Commit::is_abandoned).
  Outcome carry_out(time_ns_t until_ns, Conductor* conductor) noexcept;
  /// Why it was not made: throws what mauve::carry_out() throws; returns where an adopt disagreed. [non-rt], after it.
  void rethrow_refusal() const;

 private:
  bool lock(time_ns_t until_ns) noexcept;
  void unlock() noexcept;

  Commit& commit_;
  std::vector<Task*> tasks_;  // by number: whoever commands two takes them in this order
  time_ns_t timeout_ns_{0};
  bool has_begun_{false};  // the tasks' commands were held
  std::exception_ptr given_up_{};
};

}  // namespace mauve
