// SPDX-License-Identifier: LGPL-3.0-or-later
// A change to components that run: they meet in their waits, and the last to come makes it for all.
#pragma once

#include <pthread.h>

#include <atomic>
#include <exception>
#include <memory>
#include <optional>
#include <vector>

#include "mauve_rt/time.hpp"

namespace mauve {

class Task;

/// One part of a change. Prepared on an ordinary thread; its two calls run on the thread of one of the components
/// that the change touches, or on the requester's while all of these are parked.
class CommitAction {
 public:
  virtual ~CommitAction() = default;
  /// May refuse by returning false or throwing; changes nothing. [rt]
  virtual bool adopt() { return true; }
  /// Makes the change; cannot fail. [rt]
  virtual void take() noexcept = 0;
  /// The time adopt and take need together. [rt]
  virtual time_ns_t budget_ns() const noexcept { return us_to_ns(5); }
  /// What the trace calls it. [rt]
  virtual std::uint32_t trace_id() const noexcept { return 0; }

  const Task* task{nullptr};  // of the component that it changes, whose trace tells of it
  time_ns_t adopt_ns{0};      // measured
  time_ns_t take_ns{0};
};

/// What becomes of a component when the change is in.
enum class Afterwards : std::uint8_t {
  go_on,    // at its pending instant; a parked one stays parked
  restart,  // in its initial state, at the next instant of its grid; a parked one starts
  stop,     // parked, its outputs written
};

class Commit;

/// One component's part in a commit.
///
/// | member            | written by                                      | read by              | order                    |
/// | ----------------- | ----------------------------------------------- | -------------------- | ------------------------ |
/// | task ... clock    | requester, before it is posted                  | anyone after         | the task's slot          |
/// | arrived           | the component's thread                          | requester            | relaxed: for a message   |
/// | parked, pending   | the component's thread, before it arrives       | who makes the change | the gate                 |
/// | armed             | the component's thread, before it lets go       | requester, after it  | the task's at_commit_    |
/// | release_*         | the component's thread, before released         | requester, after it  | through released         |
/// | released (futex)  | the component's thread                          | requester            | release/acquire          |
struct Participant {
  static constexpr std::uint32_t kReleased = 1;
  static constexpr std::uint32_t kSuperseded = 2;  // another commit came before the release

  Task* task{nullptr};
  Commit* commit{nullptr};
  Afterwards afterwards{Afterwards::go_on};
  std::optional<time_ns_t>
      start_clock_ns{};    // of a restart: the grid's reference, when it is not the deployment's
  time_ns_t budget_ns{0};  // what adopt and take of its own core declare
  bool in_flight{false};   // it was running when the commit began

  std::atomic<bool> arrived{false};
  time_ns_t parked_ns{0};
  time_ns_t armed_ns{0};
  time_ns_t pending_ns{0};  // the instant pending at the park; 0: the component was parked already

  time_ns_t release_nominal_ns{0};  // of the release that follows
  time_ns_t release_actual_ns{0};
  std::atomic<std::uint32_t> released{0};

  /// After the commit was made: whether a release is to follow, and has not come. [non-rt]
  bool awaits_release() const noexcept {
    return in_flight && pending_ns != 0 && afterwards != Afterwards::stop &&
           released.load(std::memory_order_acquire) == 0;
  }
};

/// One change under way: its participants, its actions and the gate where the participants meet.
///
/// A component comes to the gate in its wait. While others are missing it leaves again for its pending instant and comes
/// back in the wait after, so that it misses no release; when half of the time is gone, those who come stay. The last
/// one to come carries out all actions; then all go on.
///
/// | member       | written by                                            | read by           | order                           |
/// | ------------ | ----------------------------------------------------- | ----------------- | ------------------------------- |
/// | gate_(futex) | who comes, leaves, makes the change, or withdraws it  | all of these      | acq_rel: hands over all results |
/// | expected_    | requester, before the first participant is posted     | participants      | the task's slot                 |
/// | results      | who makes the change                                  | all, after kDone  | gate_                           |
class Commit {
 public:
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
  time_ns_t budget_ns() const noexcept { return budget_ns_; }

  /// Whether it was made; else nothing was changed. [non-rt], after it ended.
  bool committed() const noexcept { return committed_; }
  /// What adopt threw, if it did. [non-rt], after it ended.
  const std::exception_ptr& refusal() const noexcept { return refusal_; }
  /// The action whose adopt refused, or nullptr. [non-rt], after it ended.
  const CommitAction* refused_by() const noexcept { return refused_by_; }

  // ---- for those who come to the gate

  enum class Answer : std::uint8_t { made_it, wait, closed };
  /// Comes to the gate: made_it when it was the last and made the change, closed when the commit is off. [rt]
  Answer arrive() noexcept;
  /// Waits for the others; false when it left the gate at the instant, before the change was begun. [rt]
  bool wait_others(time_ns_t leave_at_ns) noexcept;
  /// Calls the commit off because a participant cannot come any more. [rt]
  void refuse() noexcept;

  // ---- for who conducts it

  /// How many are to come. [non-rt]
  void expect(std::uint32_t parties) noexcept { expected_ = parties; }
  /// Makes the change: all adopt, then all take. [rt]
  void make_change() noexcept;
  /// From now on those who come stay. [rt]
  void be_strict() noexcept;
  /// Sleeps until it ended or was refused, at most until the instant; whether it did. [rt]
  bool wait_end(time_ns_t until_ns) noexcept;
  /// Calls it off; false when the change was being made already: it has ended by the return. [rt]
  bool withdraw() noexcept;
  bool was_refused() const noexcept { return (gate_.load(std::memory_order_acquire) & kRefused) != 0; }

 private:
  static constexpr std::uint32_t kCount = 0xFFFF, kClosed = 0x10000, kDone = 0x20000, kWithdrawn = 0x40000,
                                 kStrict = 0x80000, kRefused = 0x100000;

  std::vector<Participant> participants_;
  std::vector<Participant*> order_;
  std::vector<CommitAction*> actions_;
  time_ns_t budget_ns_{0};
  std::uint32_t expected_{0};
  bool committed_{false};
  std::exception_ptr refusal_{};
  const CommitAction* refused_by_{nullptr};
  alignas(64) std::atomic<std::uint32_t> gate_{0};
};

/// Posts a commit to its running participants, in their order, and sees it to its end. Runs no user code. [rt]
/// Returns once no participant refers to the commit any more; false when it was called off for want of time.
bool conduct(Commit& commit, time_ns_t timeout_ns) noexcept;

/// The thread that conducts commits, SCHED_FIFO above all components where that is granted.
///
/// | member          | written by | read by    | order                                 |
/// | --------------- | ---------- | ---------- | ------------------------------------- |
/// | order_ (futex)  | requester  | the thread | release/acquire: hands over commit_   |
/// | finished_(futex)| the thread | requester  | release/acquire: hands over in_time_  |
class Conductor {
 public:
  /// [setup] Without the right to SCHED_FIFO it is an ordinary thread.
  Conductor();
  ~Conductor();
  Conductor(const Conductor&) = delete;
  Conductor& operator=(const Conductor&) = delete;

  /// conduct() on the thread; one caller at a time. [non-rt]
  bool conduct(Commit& commit, time_ns_t timeout_ns) noexcept;

 private:
  static constexpr std::uint32_t kNone = 0, kConduct = 1, kEnd = 2;

  static void* entry(void* self) noexcept;
  void run() noexcept;

  pthread_t thread_{};
  Commit* commit_{nullptr};
  time_ns_t timeout_ns_{0};
  bool in_time_{false};
  std::atomic<std::uint32_t> order_{kNone};
  std::atomic<std::uint32_t> finished_{0};
};

/// Carries out a commit on tasks of any state and waits for its end: by the conductor when it has one, else by the
/// calling thread; at once when every participant is parked or simulated. [non-rt]
/// Throws Error: timeout naming the state still running, faulted; rethrows what adopt threw; returns whether every
/// adopt agreed. Unless it returns true nothing was changed.
bool carry_out(Commit& commit, time_ns_t timeout_ns, Conductor* conductor);

}  // namespace mauve
