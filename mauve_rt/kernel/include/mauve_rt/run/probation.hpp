// SPDX-License-Identifier: LGPL-3.0-or-later
// Probation: a new core, or a new fsm and core, on trial, with the old parts ready to go back in.
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "mauve_rt/base/rt.hpp"
#include "mauve_rt/base/seam/atomic.hpp"
#include "mauve_rt/base/seam/mutex.hpp"
#include "mauve_rt/base/time.hpp"
#include "mauve_rt/data/number_place.hpp"
#include "mauve_rt/data/output_watch.hpp"

namespace mauve {

class Component;
class CoreBase;
class FsmBase;
class PartsChange;
class PortBase;
struct FaultNote;

/// What a number of an output must be. NaN breaks a bound, too. Bounds are finite, the minimum not above the maximum.
struct OutputLimit {
  std::string port{};
  std::string
      field{};  // path of a number, such as linear.x; empty: each number of the value at a fixed place
  std::optional<double> minimum{};
  std::optional<double> maximum{};
  bool not_nan{false};
};

/// How long a new core is on probation, and which violations put the old core back.
struct ProbationOptions {
  time_ns_t duration_ns{0};  // 1 to kLongest, by the host's clock, also while the component is stopped
  bool on_fault{true};       // an exception, a failed take, an execution over its bound
  bool on_overrun{false};    // a wait entered after its end
  bool on_over_declared{
      false};  // an execution over its bound (max_execution, wcet), without the other faults
  std::vector<OutputLimit> outputs{};
  std::int64_t min_releases{1};  // at least 1; with fewer the verdict is inconclusive
  bool is_blend{false};  // the old core executes in a blend: the probation ends with it, and no hang reverts
};
/// Throws Error (invalid_argument): a duration, a count or a bound makes no sense, whatever the component's ports are. [non-rt]
void check_options(const ProbationOptions& options, const std::string& component);

/// Numbered for services: fields are added at the end.
enum class ProbationVerdict : std::uint8_t {
  running,   // not decided yet
  passed,    // the new core stays
  reverted,  // the old core is back
  inconclusive,  // the new core stays, and nothing is known: too few releases, or something ended the probation early
};
/// "running", "passed", ... [rt]
const char* to_string(ProbationVerdict verdict) MAUVE_RT;

enum class ProbationCause : std::uint8_t {
  none,
  fault,          // reverted
  overrun,        // reverted
  over_declared,  // reverted
  output,         // reverted
  request,        // reverted, by Host::revert_probation()
  too_few,        // inconclusive
  replaced,       // inconclusive: another change of the component's parts was taken
  fell_back,  // inconclusive: the new core faulted, which on_fault did not watch, and the fallback core took over
  ended,      // inconclusive: the component was cleaned up or removed, or its host was shut down
  blend_ended,  // inconclusive: the blend ended before its time
  hung,         // reverted: a state of the new core does not end, and the old core goes on by another thread
};

/// One probation as anyone may see it.
struct ProbationRecord {
  std::string component{};
  std::string from_core{};
  std::string to_core{};
  ProbationVerdict verdict{ProbationVerdict::running};
  ProbationCause cause{ProbationCause::none};
  std::string
      reason{};  // in words: "output control.cmd.linear.x is nan"; empty while it runs, and when it passed
  std::int64_t releases{0};  // of the new core, each up to its next wait
  time_ns_t begin_ns{0};
  time_ns_t end_ns{0};  // when it was decided; while it runs: when it is over
};

/// A new core on probation. The parts that it replaced stay configured and bound, with the state that they had at the swap: the
/// new core got copies of the state fields (Handover). What the new core's own take() has moved out of the old core is gone from
/// it; a core that is to come back copies in take().
///
/// The component's own thread finds violations and puts the old core back; no other thread takes part:
/// - A fault: the old core goes in at once, the component goes on in the initial state at its next instant, as with a fallback
///   core, and is not FAULTED. Its outputs are written as `on_commit` says, not as `on_stop`. Where a watchdog has found the
///   execution over its bound while it lasted, the component was FAULTED until that ended, and its outputs were made safe.
///   With a stop pending the component parks with the old core, STOPPED; FAULTED after a stop by force. With a change that is
///   made and that it has yet to take, it ends FAULTED, with the old core unless the change brings another.
/// - An overrun, or an output beyond its limit, is looked at when the release enters its wait: the old core goes in within that
///   wait, at the same position and pending instant. The next release is the old core's. The value that breaks a limit is not
///   written: consumers keep the one before.
/// - A state that does not end for as long as counts as hung (StateAge::hung_after_ns), when somebody looks
///   (Host::settle_probations()): the component is FAULTED with safe outputs, and the verdict is reverted. The old core then goes on
///   by another thread, from the next instant of the grid on: in a component of the same name, with new instances of shell and
///   fsm, which replaces the one that hangs. Its thread is left behind, its ports closed. Where no other instance can be made, the
///   old core goes in when the state ends after all, as after a fault. A core that executes when its time is over is not decided
///   upon before that.
/// - A request, in the wait that it comes in, or in the next one; of a parked component at once.
/// A new fsm is on probation together with a new core, as an fsm is mostly compiled for the class of its core. "The old core"
/// above and below is then the old fsm and core, which go back in as one. The place is kept both ways, so these are refused when
/// they are prepared: event waits in either fsm, another period, and a wait that the other fsm has not, by name and by its end
/// within a period. An fsm whose loop does not lead back to its initial state has waits without a fixed place, and is refused, too.
/// - A violation that is found in a wait: the component goes on in the old fsm's wait of the same name, at the same pending
///   instant. Before its first release the component starts at the same instant in the initial state of the old fsm.
/// - A fault: the component starts in the initial state of the old fsm at its next instant.
/// - Until the revert is settled, descriptions and state times are those of the new fsm, and no fallback core is ready: the
///   fallback core was made ready for the new fsm. settle_probation() shows the old fsm and makes the fallback core ready for it.
/// - Ordinary threads read the fsm by Component::fsm(). Both fsms stay configured and unchanged while the component is not
///   claimed. A change remembers the fsm for which its parts are made (PartsChange), and its adopt refuses another one.
///
/// A release counts, and is watched, while its nominal instant is before the end. An overrun counts whatever made it late, also
/// when the old core left a backlog.
///
/// Who ends it otherwise: Host::settle_probations(), and each change as it begins, once the time is over (passed, or
/// inconclusive with too few releases). A change of the component's core, fsm or shell ends it as inconclusive when it is taken,
/// and takes over from the new core; where such a change is refused the probation goes on. So does the fallback's take. Setting
/// properties and connecting ports do not end it: these stay as they are when the old core is put back. A stop does not end it:
/// the time goes on. Cleaning up, configuring anew, removing the component, and a shutdown of the host end it as inconclusive.
/// It has precedence over a fallback core, which stays ready for later.
///
/// A new core whose outputs go over (blend.hpp) is on probation for faults and requests, as long as the blend lasts. The old core executes
/// in the blend until it goes back in, with the state that it has by then. A state that does not end is not given up.
/// A change that was prepared to replace the core before the old one was put back is refused by its adopt, and stale once the
/// revert was settled.
///
/// | member            | written by                                | read by             | order                                |
/// | ----------------- | ----------------------------------------- | ------------------- | ------------------------------------ |
/// | phase_ (futex)    | who takes; then who ends it first, by CAS | anyone              | acq_rel: hands over what it wrote before |
/// | parts_            | who takes; the parts themselves, a core or an fsm and a core: who has moved phase_ | same | phase_ |
/// | fsms in parts_    | [setup]; who settles, the component claimed | anyone, by Component::fsm() | present_fsm_: component.hpp |
/// | kept_             | the change that made it, then who settles | same                | the component's claim                |
/// | begin_ns_, end_ns_| who takes                                 | anyone              | phase_                               |
/// | ended_ns_, cause_, hung_for_ns_ | who ends it                 | anyone              | phase_                               |
/// | found_ ...        | the component's thread, or who is parked for it | anyone, once ended | phase_                          |
/// | releases_         | the component's thread                    | anyone              | relaxed: a lone number               |
/// | is_requested_     | requesters                                | component's thread  | release/acquire                      |
/// | request_, left_out_, core_back_ | requesters; who brings the old core back | anyone | request_mutex_                       |
/// | is_comeback_claimed_ | who settles                            | who settles         | relaxed: a lone flag                 |
/// | the rest          | [setup]                                   | anyone              | -                                    |
class Probation : public std::enable_shared_from_this<Probation> {
 public:
  /// Throws Error: unknown_port, invalid_argument (no number there, no write port, no duration). [non-rt]
  Probation(Component& component, const std::string& to_core, ProbationOptions options);
  ~Probation();
  Probation(const Probation&) = delete;
  Probation& operator=(const Probation&) = delete;

  // ---- the component's thread, or who acts for a parked one

  /// The new core is in. [rt]
  void begin(PartsChange& parts) MAUVE_RT;
  /// A release has reached its next wait; whether the old core is to be put back. [rt]
  bool end_release() MAUVE_RT;
  /// The new core has faulted; whether the old core is to be put back. [rt], it copies a reference.
  bool note_fault(const FaultNote& fault) MAUVE_RT;
  /// Whether the request is to be carried out now. [rt]
  bool note_request() MAUVE_RT;
  /// Puts the old core back, for the violation that was found; false when there is none, or it has ended before. [rt]
  bool put_back() MAUVE_RT;
  /// Name in the trace of the change that puts it back. [rt]
  std::uint32_t trace_id() const MAUVE_RT { return trace_id_; }
  /// The new core stays; does nothing when it has ended before. [rt]
  void conclude(ProbationCause why) MAUVE_RT;

  // ---- ordinary threads

  /// What a request by request_here() is called. [non-rt]
  void name_request(const std::string& reason);
  /// Asks for the old core; the caller is the component's thread in a wait, or acts for a parked one. [rt]
  void request_here() MAUVE_RT { is_requested_.store(true, std::memory_order_release); }
  /// Asks for the old core; the component's thread is to be woken. [non-rt]
  void request(const std::string& reason);
  /// Sleeps until it has ended, at most until the instant. [non-rt]
  bool wait_ended(time_ns_t until_ns) const noexcept;
  /// [rt]
  bool has_ended() const MAUVE_RT { return phase() >= kConcluded; }
  /// Whether it begins and ends with a blend. [rt]
  bool is_of_blend() const MAUVE_RT { return options_.is_blend; }
  /// [rt]
  bool has_begun() const MAUVE_RT { return phase() != kPrepared; }
  bool is_reverted() const MAUVE_RT { return phase() == kReverted; }
  /// Ends it when its time is over. Whether it has ended. [non-rt]
  bool conclude_if_over() noexcept;
  /// Where a state of the new core does not end: takes the old core out; the verdict is reverted from then on, and the thread that hangs
  /// puts nothing back any more. The core that give_back() has brought, too. nullptr: it is out, or the probation has ended. [non-rt]
  std::unique_ptr<CoreBase> take_over() noexcept;
  /// The change that was to bring the core back was not made: keeps the core for the next one, or for who cleans up the component. Leaves it
  /// to the caller where the probation has ended. [non-rt]
  void give_back(std::unique_ptr<CoreBase>& core) noexcept;
  /// Whether it has the core that was given back. [non-rt]
  bool has_core_back() const;
  /// The core that was taken over goes on in another component. [rt]
  void end_comeback() MAUVE_RT;
  /// Puts the core that was given back into its parked component; false when there is none. [non-rt], by who has claimed the component.
  bool put_back_taken() noexcept;
  /// Whether that is done, or about to be. [rt]
  bool is_taken_over() const MAUVE_RT;
  /// The first caller is to bring the old core back of one that hangs. [non-rt]
  bool claim_comeback() noexcept;
  /// That failed. [non-rt]
  void note_left_out(const std::string& why);
  /// The fsm that is to run with the old core. [non-rt], while it has not ended
  const FsmBase& old_fsm() const noexcept;
  /// Has the parts that are out from now on. [non-rt], once the change is completed.
  void keep(std::unique_ptr<PartsChange> parts) noexcept;
  /// Lets go of what refers to it and gives away the parts that are out. [non-rt], once it has ended.
  std::unique_ptr<PartsChange> release_parts() noexcept;
  ProbationRecord record() const;

 private:
  enum Phase : std::uint32_t { kPrepared, kRunning, kEnding, kTakenOver, kConcluded, kReverted };
  struct Limit {
    std::string path;
    NumberPlace place;
    double minimum;
    double maximum;
    bool is_bounded;
  };
  /// The limits of one port.
  class PortLimits;
  struct Found {
    ProbationCause cause{ProbationCause::none};
    time_ns_t instant_ns{0};
    const PortLimits* port{nullptr};
    const Limit* limit{nullptr};
    double number{0.0};
  };

  bool is_executing() noexcept;
  bool reverts_hang() const noexcept {
    return !options_.is_blend && (options_.on_fault || options_.on_overrun);
  }
  Phase phase() const MAUVE_RT { return static_cast<Phase>(phase_.load(std::memory_order_acquire)); }
  bool is_watched() const MAUVE_RT;
  void find(const Found& found) MAUVE_RT;
  bool begin_end() MAUVE_RT;
  bool end_taken_over() MAUVE_RT;
  void end(Phase phase, ProbationCause why) MAUVE_RT;
  void add(const OutputLimit& limit);
  PortLimits& limits_of(PortBase& port);
  std::string reason() const;

  Component& component_;
  const std::string from_core_;
  const std::string to_core_;
  const ProbationOptions options_;
  const std::uint32_t trace_id_;
  std::vector<std::unique_ptr<PortLimits>> limits_;

  Atomic<std::uint32_t> phase_{kPrepared};
  PartsChange* parts_{nullptr};
  std::unique_ptr<PartsChange> kept_;
  time_ns_t begin_ns_{0};
  time_ns_t end_ns_{0};
  time_ns_t ended_ns_{0};
  ProbationCause cause_{ProbationCause::none};
  std::uint64_t overruns_{0};  // of the component, when the present release began
  Found found_{};
  std::shared_ptr<const std::string> fault_;
  time_ns_t fault_bound_ns_{0};
  time_ns_t fault_cpu_ns_{0};
  std::uint32_t fault_where_{0};
  Atomic<std::int64_t> releases_{0};
  Atomic<bool> is_requested_{false};
  Atomic<bool> is_comeback_claimed_{false};
  mutable Mutex request_mutex_;
  std::string request_ MAUVE_GUARDED_BY(request_mutex_){};
  std::string left_out_ MAUVE_GUARDED_BY(request_mutex_){};                 // why the old core does not go on
  std::unique_ptr<CoreBase> core_back_ MAUVE_GUARDED_BY(request_mutex_){};  // taken over, and given back
  time_ns_t hung_for_ns_{0};
};

}  // namespace mauve
