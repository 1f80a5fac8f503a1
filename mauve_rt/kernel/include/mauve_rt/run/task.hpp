// SPDX-License-Identifier: LGPL-3.0-or-later
// Task: one component's machine (machine.hpp) under command, on a real-time thread of its own or in simulated time.
#pragma once

#include <pthread.h>

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "mauve_rt/base/barrier.hpp"
#include "mauve_rt/base/pi_mutex.hpp"
#include "mauve_rt/base/revocable_reference.hpp"
#include "mauve_rt/base/rt.hpp"
#include "mauve_rt/base/seam/atomic.hpp"
#include "mauve_rt/base/seam/mutex.hpp"
#include "mauve_rt/base/seam/thread.hpp"
#include "mauve_rt/base/thread_counters.hpp"
#include "mauve_rt/base/waiter.hpp"
#include "mauve_rt/run/commit.hpp"
#include "mauve_rt/run/machine.hpp"
#include "mauve_rt/run/queue_place.hpp"
#include "mauve_rt/run/task_settings.hpp"
#include "mauve_rt/run/watchdog.hpp"

namespace mauve {

class Probation;
class Shadow;
enum class ProbationCause : std::uint8_t;
enum class ShadowCause : std::uint8_t;

/// Numbered as mauve_msgs/msg/ComponentInfo, whose 3 is no longer used.
enum class ComponentState : std::uint32_t { unconfigured = 0, stopped, running, stopping = 4, faulted };

/// "UNCONFIGURED", "STOPPED", ... [rt]
std::string_view to_string(ComponentState state) MAUVE_RT;
struct Fault {
  std::string what;
  std::string where;  // state
  time_ns_t when_ns{0};
};

/// A fault as it is kept, so that a watchdog can note one without allocating.
struct FaultNote {
  std::shared_ptr<const std::string> what{};  // nullptr: an execution over its bound
  time_ns_t bound_ns{0};
  time_ns_t cpu_ns{0};     // that the execution used, where the bound is its budget of CPU time
  bool is_visit{false};    // the bound was that of an adopt or a take
  std::uint32_t where{0};  // the state's name in the trace
  time_ns_t when_ns{0};

  /// Of an execution that used more CPU time than its worst case. [non-rt]
  std::string over_budget() const;
};

/// Shared by all tasks of a deployment: bumped on every change of a component's state.
/// A component not listed yet has nobody to tell.
struct ChangeSignal {
  Atomic<std::uint32_t> word{0};
  RevocableReference<ChangeSignal> listener;

  /// Who else is told from now on; nullptr: nobody, and who was told before is told no more on return. [non-rt]
  void set_listener(ChangeSignal* other) noexcept {
    listener.revoke(kForever);
    if (other != nullptr) listener.set(*other);
  }
  void bump() MAUVE_RT;  // [rt]
  /// Bumps unless there was a bump since `word` had this value: of several callers at one value one has it. [rt]
  bool claim(std::uint32_t seen) MAUVE_RT;
};

/// Runs one component.
///
/// The machine goes from wait to wait; the task is what lies around it: the thread, which sleeps in between, the commands,
/// its votes and takes in commits, the time-out of what lasts too long. resume() takes up commands and steps the machine; in
/// simulated time whoever simulates calls it.
///
/// "machine" is here whoever runs it: the component's thread, or a simulation.
///
/// | member                 | written by                            | read by      | order                              |
/// | ---------------------- | ------------------------------------- | ------------ | ---------------------------------- |
/// | control_ (futex)       | commanders set bits, machine clears   | machine      | acq_rel: a bit hands over its data |
/// | state_ (futex)         | machine; watchdog: faulted            | anyone       | release/acquire: publishes a park  |
/// | slot_ (futex)          | requester: empty -> posted -> empty;  | both         | acq_rel: hands over the participant; seq_cst with  |
/// |                        | machine: posted -> busy -> any        |              | parked_, ended_: one sees the other |
/// | participant_           | requester, slot empty                 | machine; requesters, relaxed: whose it is | slot_ |
/// | removed_               | machine, in a take                    | anyone       | release/acquire: it never starts again |
/// | awaiting_release_      | machine; who takes it out owns it     | both         | acq_rel: hands over the commit     |
/// | parked_, ready_, ended_| machine                               | commanders   | release/acquire: all it wrote      |
/// | started_               | machine; commanders clear it          | commanders   | release/acquire: all it wrote      |
/// | ended_runs_            | machine                               | who stops    | release/acquire: the run's end     |
/// | is_ramping_            | machine                               | machine, who stops | relaxed: who stops words a message by it |
/// | start_at_ns_, start_.. | commanders, machine parked            | machine      | the kStart bit of control_         |
/// | outputs_ (futex)       | who times it out, writer, machine     | all of these | acq_rel: one at a time writes them |
/// | demoted_, time_out_note_ | who times it out, machine           | machine      | execution_                         |
/// | shell_                 | commanders, machine parked; its takes | machine, who times it out | release/acquire       |
/// | core_                  | commanders, machine parked; its takes | machine      | parking                            |
/// | epoch_ns_              | machine, or who gives it an epoch     | same             | acq_rel: join_newer()          |
/// | taken_ns_              | machine, or who takes for it          | who times it out | relaxed: a lone number         |
/// | fault_                 | machine; who timed it out                | anyone       | under fault_mutex_ (PI), a copy    |
/// | watchdog_, locks_held_ | creator of the thread; the thread     | machine, who | has_thread_; execution_            |
/// |                        |                                       | times out    |                                    |
/// | fallback_              | ordinary threads; machine uses it up  | machine      | acq_rel: hands over the action     |
/// | is_falling_back_       | machine                               | who retracts it | release/acquire: it was put in  |
/// | probation_             | machine, in a take; who settles it    | machine alone| its own: base/revocable_reference.hpp |
/// | shadow_                | machine, in a take; who settles it    | machine alone| its own: base/revocable_reference.hpp |
/// | has_thread_            | commanders                            | anyone       | release/acquire: publishes facts_  |
/// | facts_                 | creator of the thread                 | anyone after | has_thread_                        |
/// | machine_               | machine                               | machine      | its own: machine.hpp               |
/// | queue_place_ ...       | machine                               | machine      | its own                            |
/// | ring_                  | ordinary threads, no thread of its own| both         | ring_mutex_; thread's creation     |
/// | log_ring_              | ordinary threads, no thread of its own| its thread   | thread's creation                  |
/// | command_mutex_ (PI)    | who starts, commits, ends the thread, gives an epoch | -            | -                                  |
/// | order_mutex_ (PI)      | who stops, who starts; for the moment | -            | no stop of one run ends the next   |
class Task final : public Waiter {
 public:
  Task(std::string name, std::uint16_t number, ChangeSignal& changes);
  ~Task();
  Task(const Task&) = delete;
  Task& operator=(const Task&) = delete;

  /// What the machine will run. Parked, or in a commit. [rt]
  void set_machine(Shell& shell, const FsmBase& fsm, CoreBinding* core, time_ns_t period_ns) MAUVE_RT;
  /// Before a commit puts in another fsm, with this initial state. [rt]
  void leave_event_to(const State& initial) MAUVE_RT { machine_.leave_event_to(initial); }
  /// Machine::keep_place(), before a commit puts in another fsm. [rt]
  bool keep_place(std::span<const KeptWait> waits, time_ns_t period_ns) MAUVE_RT {
    return place_kept_ = machine_.keep_place(waits, period_ns);
  }
  /// Machine::give_up_place_for(), when the place is not kept. [rt]
  void give_up_place_for(const State& initial) MAUVE_RT { machine_.give_up_place_for(initial); }
  /// [setup]
  void set_settings(const TaskSettings& settings) {
    settings_ = settings;
    log_source().set_level(settings.log_level);
  }
  /// [rt]
  const TaskSettings& settings() const MAUVE_RT { return settings_; }
  Context& context() MAUVE_RT { return machine_.context(); }
  /// What puts a fallback core in after a fault; nullptr: a fault is the end. [non-rt]
  void set_fallback(CommitAction* fallback) noexcept { fallback_.store(fallback, std::memory_order_release); }
  /// Takes it back; where the component's thread has begun to put it in, it is in by the return. [non-rt], not on that thread
  void retract_fallback() noexcept;
  void set_fallen_back(bool fallen_back) noexcept {
    fallen_back_.store(fallen_back, std::memory_order_release);
  }
  /// Whether the core that runs is the fallback. [rt]
  bool has_fallen_back() const MAUVE_RT { return fallen_back_.load(std::memory_order_acquire); }

  // ---- a core on probation (probation.hpp)

  /// Gives up a component whose core on probation hangs: it is FAULTED, its outputs are safe, and when the state ends after all the
  /// old core goes in. False when it is in a wait by now. [non-rt]
  bool give_up_on_probation(const StateAge& age);
  /// Whether that was done, and its thread has not come back. [rt]
  bool is_given_up_on_probation() const MAUVE_RT {
    return is_left_behind() && (control_.load(std::memory_order_acquire) & kGivenUp) != 0;
  }
  /// Its core is on probation from now on. [rt], in a take.
  void set_probation(Probation& probation) MAUVE_RT { probation_.set(probation); }
  /// The core is replaced by another one: it is on probation no more. [rt], in a take.
  void end_probation(ProbationCause why) MAUVE_RT;
  /// The machine does not refer to the probation any more, which has ended; it may have another by now. [non-rt], the
  /// component claimed.
  void forget_probation(const Probation& probation) noexcept { probation_.revoke(probation, kForever); }
  /// Lets the machine look whether the old core was asked for; in virtual time it has looked by the return. [non-rt]
  void notify_revert() noexcept;
  /// Puts the old core back in the next step, or at once; the caller is the machine's thread in a wait, or acts for a parked
  /// component. [rt]
  void revert_here(Probation& probation) MAUVE_RT;
  /// Puts the old core back, as was asked for, if the component is parked and no command of it lasts. [non-rt], it is claimed.
  void put_back_parked(Probation& probation) noexcept;
  /// Whether the calling thread runs one of its own states. [non-rt]
  bool is_called_from_own_state() const noexcept;

  // ---- a shadow of the component (shadow.hpp)

  /// The releases from now on are captured for the shadow. [rt] as far as the cores' state fields are, in a take.
  void set_shadow(Shadow& shadow) noexcept;
  /// The component's parts or wiring change, which ends its shadow. [rt], in a take.
  void end_shadow(ShadowCause why) MAUVE_RT;
  /// The outputs go over from those of this core, which has just been replaced. False: they do not, and it is still the caller's. [rt]
  /// as far as the core's bind_shell() is, in a take.
  bool begin_blend(Shadow& shadow, std::unique_ptr<CoreBase>& old, time_ns_t instant_ns) noexcept;
  /// No thread uses the shadow any more afterwards; the component may have another by now. [non-rt], the component claimed.
  void forget_shadow(const Shadow& shadow) noexcept { shadow_.revoke(shadow, kForever); }

  /// Creates the thread, prefaults its stack and reads back its rights; it meets the barrier (if any), then parks.
  /// [setup] Without the right to SCHED_FIFO it falls back to SCHED_OTHER, or throws Error (realtime_denied)
  /// when told so; and Error (timeout) while an earlier thread of the task has not ended.
  void create_thread(Barrier* barrier, bool require_realtime, bool trace,
                     std::shared_ptr<Watchdog> watchdog = {});
  /// Tells the thread to end, then joins it; false when it was still in user code at the instant, or when a commit held
  /// the task until then, in the adopt of a parked component's new core. An abandoned one is not waited for. [non-rt]
  bool end_thread(time_ns_t until_ns) noexcept;
  bool has_thread() const noexcept { return has_thread_.load(std::memory_order_acquire); }
  /// Nobody will join its thread, which may come to its end long after: the task stays for ever. [non-rt]
  void detach_thread() noexcept;
  /// Whether its last thread has come to its end. [non-rt]
  bool has_ended() const noexcept { return !has_thread() || ended_.load(std::memory_order_acquire) != 0; }

  /// In place of a thread: every command is taken up at once, on the calling thread. [setup]
  void simulate(const Clock& clock, bool trace);
  void end_simulation() noexcept;
  bool is_simulated() const noexcept { return simulated_; }
  /// For the simulation's queue alone. [rt]
  QueuePlace& queue_place() MAUVE_RT { return queue_place_; }
  const Clock& clock() const MAUVE_RT { return machine_.clock(); }

  /// One step of the machine: takes up commands; when its wait is over, runs to the next one. [rt] as far as the states are.
  void resume() noexcept;
  /// The instant that the wait under way ends at; kForever while parked. [rt], the machine's thread or a simulation.
  time_ns_t due_ns() const MAUVE_RT { return machine_.due_ns(); }

  /// Counts the grid from the deployment's epoch: start() falls back on it; returns its first instant. [setup]
  time_ns_t join(time_ns_t epoch_ns) noexcept {
    epoch_ns_.store(epoch_ns, std::memory_order_relaxed);  // relaxed: no commit is under way
    return machine_.join(epoch_ns);
  }
  /// The same for the epoch that a commit gives to one that does not run, unless another commit has given it a later one. Several threads
  /// may, at the same time: that of the component, and requesters. [rt]
  void join_newer(time_ns_t epoch_ns) MAUVE_RT { note_newer(epoch_ns, true); }
  /// The epoch of a commit that the component takes no part in: one that runs, or is in a visit, keeps its grid until its next start.
  /// [non-rt]
  void join_when_it_starts(time_ns_t epoch_ns) noexcept;
  /// The grid now; another commit may change it any moment. [rt]
  Grid grid() const MAUVE_RT { return machine_.grid(); }

  /// Enters the initial state at exactly this instant; for deployment. Does not wait for the thread. [non-rt]
  void start_at(time_ns_t instant_ns);
  /// Whether the thread has taken up the start that was posted last, at the instant at the latest. [non-rt]
  bool wait_started(time_ns_t until_ns) noexcept;
  static constexpr time_ns_t kStartTimeout = s_to_ns(2);
  /// Enters the initial state at the first clock + k * period, k >= 0, later than now + 200 us (Listing 3): a clock that
  /// is still to come is the start itself; without one it is the deployment's first instant. Another fsm keeps that grid.
  /// [non-rt] Throws Error: already_running, faulted, not_configured; timeout while a commit or another command of the
  /// component lasts, or when its thread does not get to run; it is not started then. wrong_revision, as of stop().
  void start(std::optional<time_ns_t> clock_ns = std::nullopt, time_ns_t timeout_ns = kStartTimeout,
             std::uint64_t expected_revision = 0);
  /// Parks at the next state boundary; a wait is interrupted at once; the FSM position is given up. [non-rt]
  /// A commit that the component takes part in is called off, unless it is made: then it is taken first. Waits for no other
  /// component.
  /// From one of the component's own states it is pending by the return, and takes effect when the state ends.
  /// Outputs with a max_slew are moved to the value of the stop first, one step a period; by force, at the end of the thread and without
  /// a period that value is written at once. In virtual time the stop is pending by the return then.
  /// By force: a component that still executes a state, or a guard, when the time is over is given up: it is FAULTED, its outputs
  /// are written as on a stop, its thread is demoted and left behind until the state ends. True when that was done.
  /// Throws Error: not_running; timeout naming the state still running - the stop then stays pending; wrong_revision where
  /// the architecture is not at `expected_revision` (0: any), and nothing is stopped.
  bool stop(time_ns_t timeout_ns = s_to_ns(1), bool force = false, std::uint64_t expected_revision = 0);
  /// Nominal instant of the last entry of the initial state (Listing 3). [rt]
  time_ns_t get_time() const MAUVE_RT {
    return machine_.context().instant_ns.load(std::memory_order_relaxed);
  }

  // ---- the task's side of a commit (commit.hpp)

  /// Waits for an earlier change that it has not taken yet; false when it has not at the instant. [rt]
  bool wait_slot(time_ns_t until_ns) MAUVE_RT;
  /// Posts a commit: the component votes in its next wait. As wait_slot() first. [rt], under the command mutex.
  bool post(Participant& participant, time_ns_t until_ns) MAUVE_RT;
  /// Lets it look at its slot: the commit is decided. [rt]
  void notify_commit() MAUVE_RT;
  /// Takes back a commit that was called off; false while the component is in its adopt, at the instant. [rt]
  bool retract(const Participant& participant, time_ns_t until_ns) MAUVE_RT;
  /// Its steps of a commit, in virtual time. [non-rt]
  void visit_simulated() noexcept;
  /// Takes a commit that is made, for a parked component, and starts it if the commit does. [rt] as far as the actions are,
  /// command mutex held.
  void take_parked(Participant& participant) noexcept;
  /// Machine::entered_ns() [rt], parked or timed out.
  time_ns_t entered_ns() const MAUVE_RT { return machine_.entered_ns(); }
  /// Whether a job of it may be pending, or executing, whose clock is this one or an earlier one. [rt], anyone, while it runs
  bool may_have_job_at(time_ns_t clock_ns) const MAUVE_RT { return machine_.may_have_job_at(clock_ns); }
  /// It has left the architecture: it starts no more. [rt], in a take.
  void set_removed() MAUVE_RT { removed_.store(true, std::memory_order_release); }
  /// Writes the outputs that say so: on_commit, or on_stop. [rt]
  void write_outputs(bool commit) MAUVE_RT { write_outputs(commit, machine_.clock_ns()); }
  void write_outputs(bool commit, time_ns_t time_ns) MAUVE_RT;
  /// Waits for the release that follows a commit; false when it had not come by the instant, or when another commit
  /// came first. May be called again. [non-rt]
  static bool wait_release(const Participant& participant, time_ns_t until_ns) noexcept;
  /// After this the machine does not refer to the participant any more. [non-rt]
  void forget_release(Participant& participant) noexcept;
  ChangeSignal& changes() noexcept { return changes_; }
  PiMutex& command_mutex() noexcept { return command_mutex_; }
  [[noreturn]] void throw_state_running(const std::string& what, time_ns_t timeout_ns,
                                        const std::string& remedy) const;

  /// Tells the machine that an event it may wait for has come. [rt]
  void signal_event() MAUVE_RT override;

  // ---- a wait within a state, for what another thread does

  /// The task whose thread this is, or whose states it runs now in a simulation, or nullptr. [rt]
  static const Task* executing_here() MAUVE_RT;
  /// By who runs a simulated task, around it; nullptr: none. [rt]
  static void set_simulated_here(const Task* task) MAUVE_RT;
  void await(const Atomic<std::uint32_t>& word, std::uint32_t number, time_ns_t until_ns) MAUVE_RT override;
  void signal_awaited() MAUVE_RT override;
  bool is_to_stop() const MAUVE_RT override {
    return (control_.load(std::memory_order_acquire) & (kStop | kExit)) != 0;
  }

  // ---- watched executions (rule 11, execution_word.hpp)

  /// Times out the watched execution under way, whatever its bound (of a state that declares one, an adopt or a take): tells
  /// FAULTED, takes the thread's priority away, then writes what outputs can be written without waiting. False when none is
  /// under way. [non-rt], it allocates.
  bool time_out(std::string what, time_ns_t now_ns);
  /// The same where it is over its bound, or over its budget of CPU time. [rt]
  bool time_out_if_over(time_ns_t now_ns) MAUVE_RT;
  /// The earliest instant at which a bounded execution, under way or foreseen, can be over its bound or budget; kForever: the
  /// thread wakes the watchdog itself. [rt]
  time_ns_t earliest_excess_ns(time_ns_t now_ns) const MAUVE_RT;
  /// Outputs that had to be left because of a lock: takes the right to write them; writes those that can be, all of them
  /// or not. [rt] as far as the resources are. By the watchdog's writer.
  bool take_outputs_left() noexcept;
  bool write_outputs_left() noexcept;

  /// The thread of an execution that timed out is not to come back from now on; false when it has. [rt], who removes the
  /// component, or gives it a new epoch.
  bool claim() MAUVE_RT { return machine_.execution().claim(); }
  /// It may again; or never, and what its outputs lack is not written any more. [rt], the same.
  void give_up_claim() MAUVE_RT { machine_.execution().give_up_claim(); }
  void abandon() MAUVE_RT;
  bool is_abandoned() const MAUVE_RT { return machine_.execution().is_abandoned(); }
  /// Whether its thread still runs a timed-out execution. [rt]
  bool is_left_behind() const MAUVE_RT { return machine_.execution().has_timed_out(); }
  /// What a person can do about a component whose thread does not come back. [rt]
  static constexpr const char* kLeftBehindRemedy =
      "its thread still executes: remove the component and add it anew, in one transaction";
  /// What a person can do about a FAULTED component. [rt]
  static constexpr const char* kRepairRemedy =
      "repair it first (a step configure, or replace_core), or remove it";

  /// [rt]
  ComponentState state() const MAUVE_RT {
    return static_cast<ComponentState>(state_.load(std::memory_order_acquire));
  }
  /// For configure and cleanup of the component. [non-rt]
  void set_state(ComponentState state) noexcept;
  /// Makes a parked component UNCONFIGURED: no start comes any more. False: it is not parked, or a start is posted. [non-rt]
  bool unconfigure() noexcept;
  /// Exchanges what is known of the last fault, for one to be forgotten or remembered. [rt], the machine parked.
  void swap_fault(FaultNote& note) MAUVE_RT;
  /// Forgets a fault, for configure. [non-rt], parked.
  void clear_fault() noexcept;
  /// Tells who waits for changes that there was one. [rt]
  void signal_change() MAUVE_RT { changes_.bump(); }
  /// Whether the machine is out of user code for good, until the next start, and no start is posted. [non-rt]
  bool is_parked() const noexcept {
    // seq_cst, in this order: the thread sets parked_ to 0 before it clears kStart
    return (control_.load(std::memory_order_seq_cst) & kStart) == 0 &&
           parked_.load(std::memory_order_seq_cst) != 0;
  }
  /// The state being executed or waited in; empty before the start. [non-rt]
  std::string current_state() const;
  /// How long that lasts, also while it does, against the declared bound and what counts as hung. [non-rt]
  StateAge state_age() const;
  /// The last fault, also of a core that a fallback has replaced; empty when there was none. [non-rt]
  Fault fault() const;
  const ThreadFacts& facts() const noexcept { return facts_; }
  const TaskStatistics& statistics() const noexcept { return machine_.statistics(); }
  /// When the last release was; 0: there was none. [rt]
  time_ns_t released_ns() const MAUVE_RT { return machine_.released_ns(); }
  /// Who is told of what befalls the component. [rt]
  TaskListening& listening() MAUVE_RT { return machine_.listening(); }
  /// What the thread allocated, and its page faults, since its last start. [rt]
  const ThreadCounters& counters() const MAUVE_RT { return counters_; }
  /// The trace's ring, for who runs the machine; nullptr when nothing is traced. [rt]
  TraceRing* ring() MAUVE_RT { return ring_.get(); }
  /// The ring of its log lines; nullptr: the task belongs to no architecture. [rt]
  LogRing* log_ring() MAUVE_RT { return log_ring_.get(); }
  /// Where its log lines go. Once, before it has a thread. [setup]
  void set_log_queue(std::shared_ptr<LogQueue> queue) noexcept {
    machine_.context().log.set_up(std::move(queue), number_, 0);
  }
  /// [rt]
  LogSource& log_source() MAUVE_RT { return machine_.context().log; }
  const LogSource& log_source() const MAUVE_RT { return machine_.context().log; }
  /// How many records an earlier component of its number has written: its own are numbered from there. [setup]
  void set_first_record(std::uint64_t sequence) noexcept { first_record_ = sequence; }
  /// Appends the ring's records and adds its counts to those; leaves all alone when nothing is traced. [non-rt]
  void drain_ring(std::vector<TraceRecord>& into, std::uint64_t& written, std::uint64_t& dropped);
  /// Gives the ring away, when the component is removed before the ring is drained; parked, no thread. [non-rt]
  std::unique_ptr<TraceRing> release_ring();
  const std::string& name() const noexcept { return name_; }
  std::uint16_t number() const noexcept { return number_; }

 private:
  static constexpr std::uint32_t kStop = 1, kCommit = 2, kStart = 4, kExit = 8, kEvent = 16, kAwaited = 32,
                                 kRevert = 64, kGivenUp = 128,
                                 kAtOnce = 256;                        // of control_
  enum ReconfigurationPhase : std::int64_t { kAdopt = 1, kTake = 2 };  // as the trace has them

  // commands
  void post_start(time_ns_t instant_ns) noexcept;
  std::uint32_t order_stop(std::uint64_t expected_revision);
  void claim_revision(std::uint64_t expected);
  time_ns_t start_on(std::optional<time_ns_t> reference_ns) noexcept;
  time_ns_t next_instant() const noexcept;
  time_ns_t restart_instant(const Participant& participant) noexcept;
  bool withdraw_start() noexcept;
  void end_wait_for_start() noexcept;
  void require_startable() const;
  bool can_take_up_start() const noexcept;
  void begin_trace(bool trace);
  void begin_log();

  // the thread
  static void* thread_entry(void* self) noexcept;
  void thread_main() noexcept;
  bool must_act(std::uint32_t control) noexcept;

  // its steps around the machine's
  void take_up_start();
  void start_machine(time_ns_t instant_ns) noexcept;
  void run_to_next_wait();
  void step();
  void settle_event() noexcept;
  void release(time_ns_t actual_ns) noexcept;
  template <typename Steps>
  void run_guarded(Steps&& steps) noexcept;

  // its part in a commit
  enum class Visit : std::uint8_t { goes_on, parks, timed_out };
  bool visit_posted();
  bool visit_before_release();
  bool settle_visit(Visit visit);
  Visit visit_slot() noexcept;
  Visit look_at_cut(Participant& participant, time_ns_t began_ns) noexcept;
  bool fits_in_wait(Participant& participant) const noexcept;
  bool vote(Participant& participant, time_ns_t began_ns) noexcept;
  Visit take(Participant& participant, time_ns_t began_ns) noexcept;
  void go_on_with(Participant& participant, bool was_started) noexcept;
  void trace_take(const Participant& participant) noexcept;
  void trace_refusal(Participant& participant, time_ns_t began_ns) noexcept;
  void wake_if_decided(Commit& commit) noexcept;
  void pass(Participant& participant) noexcept;
  bool settle_slot(bool ends = false) noexcept;
  bool end_slot(Participant& participant) noexcept;
  void release_withdrawn() noexcept;
  bool enter_slot() MAUVE_RT;
  void leave_slot(std::uint32_t to) MAUVE_RT;
  void skip_lost(Participant& participant, time_ns_t began_ns) noexcept;
  void end_run() noexcept;
  bool ramps_down() noexcept;
  void park_stopped() noexcept;
  void park_faulted(const char* what, time_ns_t bound_ns = 0, time_ns_t cpu_ns = 0) noexcept;
  void park_timed_out(bool has_taken_change = false) noexcept;
  void end_in_fault(bool has_taken_change = false) noexcept;
  void park(ComponentState state) noexcept;
  bool time_out(const ExecutionWord::Look& execution, std::string what, time_ns_t now_ns);
  bool time_out_unless_waiting();
  void carry_out_time_out() MAUVE_RT;
  void await_time_out() noexcept;
  void take_back_outputs() noexcept;
  bool make_safe(bool may_wait) MAUVE_RT;
  Shell* shell() const MAUVE_RT { return shell_.load(std::memory_order_acquire); }
  void note_taken(const Commit& commit) MAUVE_RT;
  void join_new_epoch(const Participant& participant) MAUVE_RT;
  void note_newer(time_ns_t epoch_ns, bool moves_grid) MAUVE_RT;
  void regain_priority() noexcept;
  void fall_back(CommitAction& fallback) noexcept;
  void watch_probation() noexcept;
  void note_swap(time_ns_t instant_ns) MAUVE_RT;
  void start_shadow() noexcept;
  void leave_shadow() noexcept;
  void capture_release() noexcept;
  void blend_release() noexcept;
  void end_blend(ShadowCause why) noexcept;
  void take_up_revert() noexcept;
  void revert_in_park() noexcept;
  void put_back_in_wait(Probation& probation) noexcept;
  bool leaves_core_to_change() noexcept;
  bool note_fault_on_probation() noexcept;
  bool is_taken_over() noexcept;
  bool put_back_after_fault(bool has_taken_change) noexcept;
  void publish_state(ComponentState state) MAUVE_RT;
  void tell_over_declared() MAUVE_RT;

  std::string name_;
  std::uint16_t number_;
  std::uint64_t first_record_{0};
  ChangeSignal& changes_;
  TaskSettings settings_;
  Machine machine_{settings_};
  ThreadCounters counters_;
  Mutex ring_mutex_;
  std::unique_ptr<TraceRing> ring_;
  std::shared_ptr<LogRing> log_ring_;

  Atomic<Shell*> shell_{nullptr};
  CoreBinding* core_{nullptr};

  PiMutex command_mutex_;
  PiMutex order_mutex_;
  Thread thread_;
  Barrier* barrier_{nullptr};
  Atomic<bool> has_thread_{false};
  bool simulated_{false};
  ThreadFacts facts_;
  mutable PiMutex fault_mutex_;
  FaultNote fault_ MAUVE_GUARDED_BY(fault_mutex_);
  FaultNote time_out_note_;  // of an execution that timed out, then the fault before it; empty while none has
  std::shared_ptr<Watchdog> watchdog_;  // outlives what its thread may still tell it
  const Atomic<int>* locks_held_{nullptr};
  bool demoted_{false};

  alignas(64) Atomic<std::uint32_t> control_{0};
  Atomic<std::uint32_t> state_{static_cast<std::uint32_t>(ComponentState::unconfigured)};
  Atomic<std::uint32_t> parked_{1};
  Atomic<std::uint32_t> ready_{0};
  Atomic<std::uint32_t> ended_{0};
  Atomic<std::uint32_t> started_{
      1};  // the start that was posted last has been taken up; none is open at first
  Atomic<std::uint32_t> ended_runs_{0};
  Atomic<bool> is_ramping_{false};
  static constexpr std::uint32_t kEmpty = 0, kPosted = 1, kBusy = 2, kSlot = 3, kWaited = 4;  // of slot_
  Atomic<std::uint32_t> slot_{kEmpty};
  Atomic<Participant*> participant_{nullptr};
  Atomic<bool> removed_{false};
  Atomic<time_ns_t> taken_ns_{0};  // T of the last change that it has taken
  Atomic<time_ns_t> epoch_ns_{0};  // the latest that it was given
  time_ns_t start_at_ns_{0};
  static constexpr std::uint32_t kAllWritten = 0, kLeft = 1, kWriting = 2;
  Atomic<std::uint32_t> outputs_{kAllWritten};
  Atomic<Participant*> awaiting_release_{nullptr};
  Atomic<CommitAction*> fallback_{nullptr};
  Atomic<bool> is_falling_back_{false};
  Atomic<bool> fallen_back_{false};
  RevocableReference<Probation> probation_;
  RevocableReference<Shadow> shadow_;

  // the machine's own
  QueuePlace queue_place_{};         // of a simulated one
  bool in_resume_{false};            // its code is on some stack: what it calls must not resume it
  bool has_decided_{false};          // by its vote, and the commit's requester sleeps still
  Participant* withdrawn_{nullptr};  // its commit is called off, and its requester sleeps still
  bool place_kept_{false};           // the fsm that a commit has put in goes on in its place
  time_ns_t overlong_ns_{0};  // what adopt and take of its core took, when that was more than they declared
};

}  // namespace mauve
