// SPDX-License-Identifier: LGPL-3.0-or-later
// Task: the real-time thread that runs one component's state machine on its grid.
#pragma once

#include <pthread.h>

#include <atomic>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "mauve_rt/commit.hpp"
#include "mauve_rt/context.hpp"
#include "mauve_rt/fsm.hpp"
#include "mauve_rt/statistics.hpp"

namespace mauve {

enum class ComponentState : std::uint32_t { unconfigured = 0, stopped, running, held, stopping, faulted };

/// "UNCONFIGURED", "STOPPED", ... [rt]
std::string_view to_string(ComponentState state) noexcept;

/// What to do when an instant has passed before its wait is entered.
enum class OverrunPolicy : std::uint8_t {
  skip,      // go on at the next instant of the grid
  catch_up,  // go on at once, owing at most max_backlog instants
  fault,
};

struct TaskSettings {
  int priority{50};         // SCHED_FIFO, 1 to 98; 99 is kept for the conductor of transactions
  std::vector<int> cpus{};  // empty: any
  time_ns_t offset_ns{0};   // instants are epoch + offset + k * period
  time_ns_t period_ns{0};   // 0: the gcd of the FSM's cycles
  OverrunPolicy overrun{OverrunPolicy::skip};
  std::int64_t max_backlog{10};
  std::size_t stack_bytes{std::size_t{512} * 1024};  // of which the first 128 KiB are prefaulted
};

/// What the kernel gave the thread, read back from it.
struct ThreadFacts {
  std::string policy;
  int priority{0};
  std::vector<int> cpus;
};

struct Fault {
  std::string what;
  std::string where;  // state
  time_ns_t when_ns{0};
};

/// Shared by all tasks of a deployment: bumped on every change of a component's state.
struct ChangeSignal {
  std::atomic<std::uint32_t> word{0};
  void bump() noexcept;  // [rt]
};

/// The thread of one component.
///
/// | member                | written by                           | read by      | order                              |
/// | --------------------- | ------------------------------------ | ------------ | ---------------------------------- |
/// | control_ (futex)      | commanders set bits, thread clears   | thread       | acq_rel: a bit hands over its data |
/// | state_ (futex)        | thread; watchdog: faulted            | anyone       | release/acquire: publishes fault_  |
/// | commit_               | commanders; who takes it out owns it | both         | acq_rel: hands over the commit     |
/// | commit_budget_ns_     | commanders, before commit_           | thread       | relaxed: control_ orders it        |
/// | awaiting_release_     | thread; who takes it out owns it     | both         | acq_rel: hands over the commit     |
/// | parked_, ended_       | thread                               | commanders   | release/acquire: all it wrote      |
/// | start_at_ns_          | commanders, thread parked            | thread       | the kStart bit of control_         |
/// | current_              | thread                               | anyone       | relaxed: a lone fact               |
/// | context_, statistics_ | thread                               | anyone       | relaxed: lone facts                |
/// | shell_, fsm_, core_   | commanders, thread parked; commits   | thread       | parking                            |
/// | fault_                | who set condemned_, before state_    | anyone after | through state_                     |
/// | condemned_            | thread or watchdog, the first wins   | both         | acq_rel: one writer of fault_      |
/// | facts_                | thread, before the barrier           | anyone after | the barrier                        |
/// | boundary_ns_ ...      | thread                               | thread       | its own                            |
/// | command_mutex_        | ordinary threads, a command each     | -            | -                                  |
class Task {
 public:
  Task(std::string name, std::uint16_t number, ChangeSignal& changes,
       const Clock& clock = MonotonicClock::instance());
  ~Task();
  Task(const Task&) = delete;
  Task& operator=(const Task&) = delete;

  /// What the thread will run. Not while running. [setup]
  void set_machine(Shell& shell, const FsmBase& fsm, CoreBinding* core) noexcept;
  void set_settings(const TaskSettings& settings) { settings_ = settings; }
  const TaskSettings& settings() const noexcept { return settings_; }
  Context& context() noexcept { return context_; }

  /// Creates the thread, which prefaults its stack, reads back its rights and meets the barrier, then parks.
  /// [setup] Without the right to SCHED_FIFO it falls back to SCHED_OTHER, or throws Error (realtime_denied)
  /// when told so.
  void create_thread(pthread_barrier_t& barrier, bool require_realtime, bool trace);
  /// Tells the thread to end, then joins it; false when it was still in user code at the instant. [non-rt]
  bool end_thread(time_ns_t until_ns) noexcept;
  bool has_thread() const noexcept { return has_thread_; }

  /// The grid of the deployment: start() falls back on it. [setup]
  void set_grid(const Grid& grid) noexcept;
  const Grid& grid() const noexcept { return grid_; }

  /// Enters the initial state at exactly this instant; for deployment. Does not wait for the thread. [non-rt]
  void start_at(time_ns_t instant_ns);
  /// Returns once the thread has taken up a start. [non-rt]
  void wait_started() noexcept;
  /// Enters the initial state at the first clock + k * period later than now + 200 us (Listing 3). [non-rt]
  /// Throws Error: already_running, faulted, not_configured.
  void start(std::optional<time_ns_t> clock_ns = std::nullopt);
  /// Parks at the next state boundary; a wait is interrupted at once; the FSM position is given up. [non-rt]
  /// Throws Error: not_running; timeout naming the state still running - the stop then stays pending.
  void stop(time_ns_t timeout_ns = s_to_ns(1));
  /// Nominal instant of the last entry of the initial state (Listing 3). [rt]
  time_ns_t get_time() const noexcept { return context_.instant_ns.load(std::memory_order_relaxed); }

  /// Carries out the action inside the component's wait, or here and now when it is parked. [non-rt]
  /// Returns false when adopt returned false; rethrows what it threw. Throws Error (timeout) naming the state
  /// still running; nothing was changed then.
  bool commit(Commit& commit, time_ns_t timeout_ns);
  /// Waits for the release that follows a commit; false when it had not come by the instant, or when another commit
  /// came first. [non-rt]
  bool wait_release(Commit& commit, time_ns_t until_ns) noexcept;

  /// Rule 11's watchdog side: when the state under way is over its declared bound, marks the component
  /// FAULTED, writes its outputs and takes the thread's priority away. Returns whether it did. [non-rt]
  bool check_execution(time_ns_t now_ns);

  ComponentState state() const noexcept {
    return static_cast<ComponentState>(state_.load(std::memory_order_acquire));
  }
  /// For configure and cleanup of the component. [non-rt]
  void set_state(ComponentState state) noexcept;
  /// Forgets a fault, for configure; the thread must be parked. [non-rt]
  void clear_fault() noexcept;
  /// Tells who waits for changes that there was one. [rt]
  void signal_change() noexcept { changes_.bump(); }
  /// Whether the thread is out of user code for good, until the next start. [non-rt]
  bool is_parked() const noexcept { return parked_.load(std::memory_order_acquire) != 0; }
  /// The state being executed or waited in; empty before the start. [non-rt]
  std::string current_state() const;
  const Fault& fault() const noexcept { return fault_; }
  const ThreadFacts& facts() const noexcept { return facts_; }
  const TaskStatistics& statistics() const noexcept { return statistics_; }
  TraceRing* ring() noexcept { return ring_.get(); }
  const std::string& name() const noexcept { return name_; }

 private:
  static constexpr std::uint32_t kStop = 1, kCommit = 2, kStart = 4, kExit = 8;

  static void* thread_entry(void* self) noexcept;
  void thread_main() noexcept;
  bool wait_for_start() noexcept;
  void run_machine();
  const State* execute(const State& state);
  bool wait(const State& state);
  void handle_overrun(const State& state, time_ns_t now_ns);
  bool sleep_until_clock(const State& state);
  bool may_commit_now() noexcept;
  void commit_pending(const State& state) noexcept;
  void carry_out(Commit& commit, const State* state) noexcept;
  void refuse_pending_commit() noexcept;
  void release(const State& state, time_ns_t actual_ns) noexcept;
  void park_stopped() noexcept;
  void park_faulted(const char* what) noexcept;
  void park(ComponentState state) noexcept;
  void wait_condemned() const noexcept;
  void post_start(time_ns_t instant_ns) noexcept;
  void write_outputs(bool commit) noexcept;
  void publish_state(ComponentState state) noexcept;
  void read_back_thread();
  void trace(TraceKind kind, std::uint32_t name = 0, std::int64_t a = 0, std::int64_t b = 0,
             std::int64_t c = 0) noexcept {
    if (active_ring_ != nullptr) active_ring_->push(kind, name, a, b, c);
  }
  void trace_at(time_ns_t time_ns, TraceKind kind, std::uint32_t name, std::int64_t a = 0,
                std::int64_t b = 0) noexcept {
    if (active_ring_ != nullptr) active_ring_->push_at(time_ns, kind, name, a, b);
  }
  time_ns_t clock_ns() const noexcept { return context_.clock_ns.load(std::memory_order_relaxed); }
  void set_clock_ns(time_ns_t instant) noexcept {
    context_.clock_ns.store(instant, std::memory_order_relaxed);
  }
  [[noreturn]] void throw_state_running(const std::string& what, time_ns_t timeout_ns,
                                        const std::string& remedy) const;

  std::string name_;
  ChangeSignal& changes_;
  const Clock& clock_;
  TaskSettings settings_;
  Context context_;
  TaskStatistics statistics_;
  std::unique_ptr<TraceRing> ring_;
  TraceRing* active_ring_{nullptr};

  Shell* shell_{nullptr};
  const FsmBase* fsm_{nullptr};
  CoreBinding* core_{nullptr};
  Grid grid_;

  std::mutex command_mutex_;
  pthread_t thread_{};
  pthread_barrier_t* barrier_{nullptr};
  bool has_thread_{false};
  ThreadFacts facts_;
  Fault fault_;

  alignas(64) std::atomic<std::uint32_t> control_{0};
  std::atomic<std::uint32_t> state_{static_cast<std::uint32_t>(ComponentState::unconfigured)};
  std::atomic<std::uint32_t> parked_{1};
  std::atomic<std::uint32_t> ended_{0};
  std::atomic<Commit*> commit_{nullptr};
  std::atomic<time_ns_t> commit_budget_ns_{0};
  time_ns_t start_at_ns_{0};
  std::atomic<const State*> current_{nullptr};
  std::atomic<time_ns_t> execution_began_ns_{0};  // 0: no execution state under way
  std::atomic<Commit*> awaiting_release_{nullptr};
  std::atomic<std::uint32_t> condemned_{0};
  time_ns_t boundary_ns_{
      0};             // the thread's own: when the last state ended or the last release came, read once
  int deferrals_{0};  // the thread's own: releases a commit was put off for want of time
};

}  // namespace mauve
