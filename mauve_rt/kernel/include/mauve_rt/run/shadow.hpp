// SPDX-License-Identifier: LGPL-3.0-or-later
// Shadow: a candidate core that executes in parallel with a component's live core, on the same inputs, without effects.
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "mauve_rt/base/revocable_reference.hpp"
#include "mauve_rt/base/rt.hpp"
#include "mauve_rt/base/seam/atomic.hpp"
#include "mauve_rt/base/seam/mutex.hpp"
#include "mauve_rt/base/time.hpp"
#include "mauve_rt/parts/core.hpp"
#include "mauve_rt/parts/fsm.hpp"
#include "mauve_rt/parts/handover.hpp"
#include "mauve_rt/parts/property.hpp"
#include "mauve_rt/run/blend.hpp"
#include "mauve_rt/run/machine.hpp"
#include "mauve_rt/run/output_comparison.hpp"
#include "mauve_rt/run/output_steps.hpp"
#include "mauve_rt/run/shadow_capture.hpp"

namespace mauve {

class Component;
class Task;
struct ShadowSignal;

struct ShadowOptions {
  /// > 0: what the candidate may execute per release, on average. After a release that took n budgets, n - 1 releases are skipped.
  /// On threads CPU time of the shadow's thread; in virtual time what the states declare (simulated_execution).
  time_ns_t budget_ns{0};
  /// The candidate begins with its own values, not with the state fields of the live core.
  bool is_fresh{false};
};

/// Numbered for services: fields are added at the end.
enum class ShadowVerdict : std::uint8_t {
  running,
  ended,     // by a request, a change of the component, or the host's shutdown
  faulted,   // the candidate threw an exception
  promoted,  // the candidate is the component's core now
  hung,      // a state of the candidate did not end
};
/// "running", "ended", ... [rt]
const char* to_string(ShadowVerdict verdict) MAUVE_RT;

enum class ShadowCause : std::uint8_t {
  none,
  fault,
  request,     // a step end_shadow
  changed,     // the component's parts or wiring were changed
  closed,      // the component was cleaned up or removed, or its host was shut down
  promotion,   // a step promote
  lost,        // a step promote was refused, and the candidate was cleaned up with it
  hung,        // a state of the candidate did not end
  overrun,     // of the component, in a blend
  stop,        // of the component, in a blend
  live_fault,  // of the new core, in a blend
  reverted,    // the old core of a blend went back in
};

/// One shadow as anyone may see it.
struct ShadowRecord {
  std::string component{};
  std::string core{};       // the candidate
  std::string live_core{};  // as the shadow began
  ShadowVerdict verdict{ShadowVerdict::running};
  std::string reason{};  // in words; empty while it runs
  time_ns_t begin_ns{0};
  time_ns_t end_ns{0};             // 0: it runs
  std::int64_t releases{0};        // of the live core since the begin
  std::int64_t compared{0};        // of them, those in which the candidate executed
  std::int64_t skipped_late{0};    // the shadow's thread was late, and no slot was free
  std::int64_t skipped_budget{0};  // to pay for releases over budget
  std::int64_t idle{0};            // the candidate was in a longer wait, or between two places
  std::int64_t over_budget{0};     // releases that took longer than the budget
  time_ns_t budget_ns{0};
  time_ns_t largest_execution_ns{0};        // of one release
  std::vector<OutputDifference> outputs{};  // by write port
  std::vector<OutputStep> steps{};          // of a bumpless change, as it listed them
  std::vector<OutputCurve> curves{};        // the same outputs
};

/// The parts of a candidate: a shell of the component's own class, the core, another instance of the component's fsm.
struct ShadowParts {
  std::unique_ptr<Shell> shell{};
  std::unique_ptr<CoreBase> core{};
  std::unique_ptr<FsmBase> fsm{};
};

/// A candidate next to the live core. The component's thread copies what the live core reads and writes (shadow_capture.hpp). The
/// shadow's thread (shadow_thread.hpp) then executes the candidate's fsm at the same nominal instant, on these inputs; what the
/// candidate writes goes to cells, and is compared with what the live core wrote in that release. In virtual time the simulation
/// does this right after the release, at the same instant, and no virtual time passes.
///
/// The candidate begins in the wait in which the live core is, with copies of the live core's state fields of the same name and type
/// (MAUVE_STATE), and goes its own way from there; it begins anew in the initial state when the component is started. Of each captured release it executes one chain of states, where its own wait has ended by that
/// instant; instants that were skipped are left out, as after an overrun. Events that it raises have no effect.
///
/// The shadow ends with a fault of the candidate, when a state of it hangs (its thread is left behind then, until the state ends), by a step end_shadow or promote, when the component's parts or wiring change, when
/// the component is cleaned up or removed, and at the host's shutdown. A stop of the component pauses it. Properties that are set
/// while it runs are set in the candidate's shell, too, soon after.
///
/// After a bumpless change with a blend (blend.hpp) it has the parts the other way round: the old core is in the shadow's shell, and
/// executes on the component's thread, at the end of each release, on the inputs that the new core has read in that very release. The
/// blend ends by its time, by an overrun of the component, a fault of either core, a stop, and by all that ends a shadow. As long as it
/// lasts the new core is on probation (probation.hpp): after a fault of the new core the old core goes back in.
///
/// | member            | written by                                  | read by                | order                                |
/// | ----------------- | ------------------------------------------- | ---------------------- | ------------------------------------ |
/// | phase_            | who takes it; then who ends it first, by CAS | anyone                | acq_rel: hands over what it wrote before |
/// | begin_ns_         | who takes it                                | anyone                 | phase_                               |
/// | ended_ns_, cause_ | who ends it                                 | anyone                 | phase_                               |
/// | capture_          | the component's thread, who executes        | both                   | its own: shadow_capture.hpp          |
/// | parts_ ... debt_  | who executes, prepares, suspends, retires   | same                   | run_mutex_                           |
/// | figures_ ... set_properties_ | who executes, or sets       | same                   | figures_mutex_                       |
/// | signal_           | before it begins                            | the component's thread | the commit publishes it              |
/// | handover_         | [setup]                                     | who begins it          | -                                    |
/// | steps_            | who makes it wait for near outputs          | who executes, or tells; the component's thread | figures_mutex_; the commit publishes it |
/// | near_             | who executes, who makes it wait             | the component's thread | release/acquire: the candidate's state after that release |
/// | awaiting_         | who makes it wait                           | who executes           | its own: base/revocable_reference.hpp |
/// | skipped_budget_   | who executes                                | anyone                 | relaxed: a lone number               |
/// | follows_          | who makes it wait for near outputs          | the component's thread | relaxed: a lone flag                 |
/// | awaits_outputs_   | the component's thread, who closes it       | anyone                 | release/acquire: the steps           |
/// | measures_outputs_ | the component's thread, who closes or detaches it | anyone           | release/acquire: the curves          |
/// | blend_            | who makes it wait for near outputs          | the component's thread, who retires it | figures_mutex_, run_mutex_; the commit publishes it |
/// | has_blended_, is_holding_ | the component's thread; who detaches | same, who tells of it | acq_rel: one of them ends the hold   |
/// | executing_since_ns_ | who executes                              | who settles            | relaxed: a lone number; 0: nothing executes |
/// | is_settled_       | who settles                                 | same                   | relaxed: one of them retires it      |
/// | the rest          | [setup]                                     | anyone                 | -                                    |
///
/// The component's thread waits for neither mutex, but in virtual time, where there is one thread.
class Shadow {
 public:
  /// A change waits so long for a state of the candidate to end, on a thread that gets little time.
  static constexpr time_ns_t kStateEnd = s_to_ns(1);

  /// Throws Error: invalid_argument (budget), type_mismatch, out_of_range (ports). [non-rt]
  Shadow(Component& component, ShadowParts parts, ShadowOptions options);
  ~Shadow();
  Shadow(const Shadow&) = delete;
  Shadow& operator=(const Shadow&) = delete;

  /// Connects, binds and configures the candidate's parts; it is to begin with the state of this core. [non-rt] Throws Error.
  void prepare(CoreBase& live);
  /// Whom the component's thread wakes; nullptr: the simulation executes it. [non-rt], before it begins.
  void set_signal(std::shared_ptr<ShadowSignal> signal) noexcept { signal_ = std::move(signal); }

  // ---- the component's thread, or who acts for a parked component

  /// Captures from now on; the component is in this wait, or in none, with this core. [rt] as far as the cores' state fields are.
  void begin(const State* wait, const CoreBase* live, time_ns_t now_ns) noexcept;
  /// [rt]
  bool has_begun() const MAUVE_RT { return phase_.load(std::memory_order_acquire) != kPrepared; }
  /// The component starts in its initial state. [rt]
  void start() MAUVE_RT;
  /// A release of this core has reached its next wait. Whether it is the last that is looked at. [rt] as far as the cores' state fields
  /// are.
  bool end_release(time_ns_t instant_ns, const State* next_wait, const CoreBase* live) noexcept;
  /// Ends it; does nothing when it has ended before. [rt], any thread
  void conclude(ShadowCause why, time_ns_t now_ns) MAUVE_RT;
  /// Captures no more: the component's ports refer to it no longer. [rt], or an ordinary thread that has claimed the component
  void detach() MAUVE_RT {
    end_measurement();
    capture_.detach();
    if (is_holding_.exchange(false, std::memory_order_acq_rel)) blend_->end();
  }
  bool has_ended() const MAUVE_RT { return phase_.load(std::memory_order_acquire) == kEnded; }

  // ---- a bumpless change: the candidate goes in where its outputs are near

  /// Whether each listed output was near in the component's last release. [rt], the component's thread
  bool is_near() const MAUVE_RT { return near_.load(std::memory_order_acquire) == capture_.captured(); }
  /// Gives away the candidate's core, which executes no more here; nothing: the shadow's thread looks at it this moment, or it has
  /// ended. [rt]
  void hand_over(std::unique_ptr<CoreBase>& to) MAUVE_RT;
  /// It was promoted: measures the first values of each listed output. Whether there is one to measure. [rt], the component's thread
  bool await_outputs() MAUVE_RT;
  /// The component runs with the promoted core from this instant on. [rt], the component's thread
  void note_swap(time_ns_t instant_ns) MAUVE_RT {
    if (measures_outputs()) steps_->note_swap(instant_ns);
  }

  // ---- a blend, by the component's thread

  /// Whether the outputs are to go over from those of this core. [rt]
  bool may_blend(const CoreBase& live) const MAUVE_RT {
    return blend_ != nullptr && blend_->binding.core == &live &&
           phase_.load(std::memory_order_acquire) == kRunning;
  }
  /// The old core goes on here, from that wait of this index, which ends at `due_ns`; w is 0 at the instant. False: the shadow has
  /// ended, and the core is still the caller's. [rt] as far as the core's bind_shell() is
  bool begin_blend(std::unique_ptr<CoreBase>& old, std::size_t wait, time_ns_t due_ns,
                   time_ns_t instant_ns) noexcept;
  /// Whether outputs are held. [rt]
  bool is_holding() const MAUVE_RT { return is_holding_.load(std::memory_order_acquire); }
  /// Before the wait that ends a release: executes the old core, and returns the time that its states declare in virtual time. [rt] as
  /// far as the states are
  time_ns_t execute_old(time_ns_t instant_ns) noexcept;
  /// Writes the outputs of this release; the last time, those of the new core. Why the blend has ended; none: it lasts. [rt]
  ShadowCause write_blended(time_ns_t instant_ns, time_ns_t now_ns) MAUVE_RT;
  /// Before its time. The outputs that are held are written: at a stop as they would be at the end of the release, after a fault of the
  /// new core not at all, else those of the new core. [rt]
  void end_blend(ShadowCause why, time_ns_t instant_ns, time_ns_t now_ns) MAUVE_RT;

  /// Ends the blend with the old core: gives the core away, and drops what the new one has written in this release. False: the blend
  /// has ended before. [rt]
  bool give_back_old(std::unique_ptr<CoreBase>& to, time_ns_t now_ns) MAUVE_RT;

  /// Ends it when a release of the candidate executes for longer than this. [non-rt]
  void conclude_if_hung(time_ns_t longest_ns) noexcept;
  /// It was promoted, and a listed output of the new core is yet to be measured. [rt], any thread
  bool awaits_outputs() const MAUVE_RT { return awaits_outputs_.load(std::memory_order_acquire); }
  /// It was promoted, and the curves of the listed outputs go on: OutputSteps::kCurve releases. [rt], any thread
  bool measures_outputs() const MAUVE_RT { return measures_outputs_.load(std::memory_order_acquire); }
  /// It has ended, and the component's ports still refer to it, or no thread of its own retires it. [rt], any thread
  bool is_to_settle() const MAUVE_RT {
    const bool is_to_retire = signal_ == nullptr && !is_settled_.load(std::memory_order_relaxed);
    return has_ended() && !measures_outputs() && (capture_.is_attached() || is_to_retire);
  }

  // ---- who executes: the shadow's thread, or a simulation

  /// Executes the oldest captured release; false: there is none, or it has ended. [non-rt]
  bool run_pending() noexcept;
  /// Cleans the candidate's parts up once it has ended, unless a state of it executes. May be called again. [non-rt]
  void retire() noexcept;
  /// True for the first caller, which has it retired; the shadow's own thread retires it as well. [rt], any thread
  bool begin_retirement() MAUVE_RT { return !is_settled_.exchange(true, std::memory_order_relaxed); }

  // ---- changes

  /// Takes the candidate's core out: it executes no more until resume(). [non-rt] Throws Error: timeout naming the state that still
  /// executes; not_running: it has ended.
  std::unique_ptr<CoreBase> suspend(time_ns_t timeout_ns);
  /// Calls the function with the candidate's core, which executes nothing meanwhile. [non-rt] Throws as suspend().
  void with_core(time_ns_t timeout_ns, const std::function<void(CoreBase&)>& use);
  /// What the candidate takes over from the live core as it begins; nullptr: nothing. [non-rt], after prepare()
  const Handover* handover() const noexcept { return handover_.get(); }
  /// From now on the task is woken when the listed outputs are near. Unless the candidate is fresh it begins each release with the state
  /// fields that the live core had before it. [non-rt] Throws Error as suspend(), and as OutputSteps; type_mismatch: one of both cores has
  /// no blend.
  void await_near(const BumplessOptions& options, bool is_fresh, Component& component);
  /// The reverse. [non-rt]
  void end_await() noexcept {
    awaiting_.revoke(kForever);
    follows_.store(false, std::memory_order_relaxed);
  }
  /// Puts that core back in, after a refused change; nullptr, or one that was cleaned up, ends the shadow. [non-rt]
  void resume(std::unique_ptr<CoreBase> core) noexcept;
  /// Sets a property of the candidate's shell, before the candidate executes next, to a value that checked() returned. [non-rt]
  void set_property(const std::string& name, const PropertyValue& value);
  /// [non-rt]
  ShadowRecord record() const;
  const std::string& core_name() const noexcept { return core_; }

 private:
  enum Phase : std::uint32_t { kPrepared, kRunning, kBlending, kEnding, kEnded };
  /// Time that stands still while the candidate executes.
  class StillClock;
  struct Figures {
    std::int64_t compared{0};
    std::int64_t idle{0};
    std::int64_t over_budget{0};
    time_ns_t largest_execution_ns{0};
  };

  void connect_cells();
  void bind();
  std::unique_lock<Mutex> lock_core(time_ns_t timeout_ns);
  bool measure_steps(time_ns_t instant_ns) MAUVE_RT;
  void end_measurement() MAUVE_RT {
    awaits_outputs_.store(false, std::memory_order_release);
    measures_outputs_.store(false, std::memory_order_release);
  }
  bool run_oldest() noexcept MAUVE_REQUIRES(run_mutex_);
  void execute(const ShadowCapture::Release& release) MAUVE_REQUIRES(run_mutex_);
  void take_properties() noexcept MAUVE_REQUIRES(figures_mutex_);
  void put_inputs();
  bool advance_to(const ShadowCapture::Release& release) MAUVE_REQUIRES(run_mutex_);
  bool is_blending() const MAUVE_RT { return phase_.load(std::memory_order_acquire) == kBlending; }
  void compare(const ShadowCapture::Release& release) MAUVE_REQUIRES(figures_mutex_);
  void count_execution(time_ns_t execution_ns) MAUVE_REQUIRES(run_mutex_, figures_mutex_);
  void fault(const std::string& what, time_ns_t instant_ns);
  void execute_wait_to_wait(time_ns_t instant_ns);
  std::unique_ptr<Blend> make_blend(time_ns_t duration_ns, Component& component);
  void clean_up() noexcept;
  std::string reason() const MAUVE_REQUIRES(figures_mutex_);
  std::string words_of_cause() const MAUVE_REQUIRES(figures_mutex_);

  const std::string component_;
  const std::string live_core_;
  const std::string core_;
  const ShadowOptions options_;
  const TaskSettings settings_;
  ShadowCapture capture_;
  std::shared_ptr<ShadowSignal> signal_{};
  std::unique_ptr<Handover> handover_{};
  std::unique_ptr<OutputSteps> steps_{};
  static constexpr std::uint64_t kNeverNear = std::numeric_limits<std::uint64_t>::max();
  Atomic<std::uint64_t> near_{kNeverNear};  // the last release, counted as ShadowCapture::captured()
  RevocableReference<Task> awaiting_;
  Atomic<bool> awaits_outputs_{false};
  Atomic<bool> measures_outputs_{false};
  Atomic<std::uint64_t> skipped_budget_{0};
  Atomic<bool> follows_{false};
  std::unique_ptr<Blend> blend_{};
  Atomic<bool> has_blended_{false};
  Atomic<bool> is_holding_{false};

  Atomic<std::uint32_t> phase_{kPrepared};
  Atomic<time_ns_t> executing_since_ns_{0};
  Atomic<bool> is_settled_{false};
  time_ns_t begin_ns_{0};
  time_ns_t ended_ns_{0};
  ShadowCause cause_{ShadowCause::none};

  Mutex run_mutex_;
  std::vector<std::unique_ptr<PortCell>> cells_;  // by the port's place in the shell; outlive the parts
  ShadowParts parts_;
  std::unique_ptr<StillClock> clock_;
  Machine machine_{settings_};
  CoreBinding binding_{};
  bool is_retired_{false};
  std::int64_t debt_ MAUVE_GUARDED_BY(run_mutex_){0};  // releases to be skipped
  bool is_anew_ MAUVE_GUARDED_BY(run_mutex_){false};   // as of a release that was skipped

  mutable Mutex figures_mutex_;
  Figures figures_ MAUVE_GUARDED_BY(figures_mutex_){};
  std::string fault_ MAUVE_GUARDED_BY(figures_mutex_){};
  std::vector<std::pair<std::string, PropertyValue>> properties_
      MAUVE_GUARDED_BY(figures_mutex_){};  // to be set
  std::vector<std::pair<std::string, PropertyValue>> set_properties_
      MAUVE_GUARDED_BY(figures_mutex_){};  // the values before; the next caller of set_property() frees them
  std::vector<std::pair<std::size_t, OutputComparison>> comparisons_
      MAUVE_GUARDED_BY(figures_mutex_);  // by the port's place in the shell
};

}  // namespace mauve
