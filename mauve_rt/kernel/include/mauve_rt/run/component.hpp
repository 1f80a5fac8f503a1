// SPDX-License-Identifier: LGPL-3.0-or-later
// Component: a shell, a core and an fsm, run by a task; each can be replaced while it runs.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "mauve_rt/base/rt.hpp"
#include "mauve_rt/base/seam/atomic.hpp"
#include "mauve_rt/base/seam/mutex.hpp"
#include "mauve_rt/parts/handover.hpp"
#include "mauve_rt/run/change_lock.hpp"
#include "mauve_rt/run/commit_gate.hpp"
#include "mauve_rt/run/probation.hpp"
#include "mauve_rt/run/shadow.hpp"
#include "mauve_rt/run/task.hpp"

namespace mauve {

/// In place of a figure that was not measured; as mauve_msgs/msg/StepReport.NOT_MEASURED.
inline constexpr std::int64_t kNotMeasured = -1;

/// What one step of a reconfiguration cost; fields as mauve_msgs/msg/StepReport.
struct StepReport {
  std::string step;
  std::string component;
  std::string from_core;
  std::string to_core;
  time_ns_t prepare_ns{0};
  time_ns_t blackout_ns{0};
  std::int64_t missed_releases{0};
  time_ns_t phase_nominal_ns{0};
  time_ns_t phase_actual_ns{kNotMeasured};
  std::string remark{};                 // why releases were missed; empty when none was
  time_ns_t shift_ns{0};                // by which a new epoch made its instants later
  time_ns_t released_ns{kNotMeasured};  // the instant of the release that followed
  time_ns_t instant_ns{kNotMeasured};   // T: the component executes with the change from this instant on
  time_ns_t release_ns{kNotMeasured};   // nominal instant of the release that followed
  std::vector<std::string> taken{};     // state fields that the new core took over
  std::vector<std::string> left{};      // state fields that it did not, with the reason
  std::vector<OutputStep> outputs{};    // of a bumpless change, as it listed them
};

struct CommitTimeouts {
  time_ns_t commit_ns{s_to_ns(1)};  // for the component to reach a wait
  time_ns_t phase_ns{s_to_ns(1)};   // for the release that follows, to measure its phase; 0: do not wait
  // For each hook that makes a part ready: afterwards the change is called off.
  time_ns_t prepare_ns{s_to_ns(60)};
};

/// The parts of a component; in a change a null pointer says that the part stays.
struct Parts {
  std::unique_ptr<Shell> shell{};
  std::unique_ptr<CoreBase> core{};
  std::unique_ptr<FsmBase> fsm{};
};

/// Where a port leads to. The step of a change that connects it counts from 1; 0 stands for what was there before.
struct Wire {
  std::string resource;
  ServiceBase* service{nullptr};
  int step{0};
  std::shared_ptr<const void> use{};  // Resource::use()
  const Frames* frames{nullptr};      // that the port declares
};
/// Whether both lead to the same service. [non-rt]
inline bool operator==(const Wire& a, const Wire& b) noexcept { return a.service == b.service; }
/// By port.
using Wires = std::map<std::string, Wire>;

class Architecture;
class Component;

/// What is shown of a core, also when the core itself is gone.
struct ShownCore {
  std::string name;
  CoreTimes wcet_ns;
  auto operator<=>(const ShownCore&) const = default;
};

/// New parts for a component: made ready while the old ones run, put in by a commit, the old ones retired after.
class PartsChange final : public CommitAction {
 public:
  /// A new shell takes the property values of the old one where name, type and range fit. With a new shell and no new
  /// fsm, another instance of the present fsm is made. [non-rt] Throws Error (prepare_failed) when that cannot be made.
  PartsChange(Component& component, Parts fresh);
  /// The new core is this candidate, which goes in where its outputs are near those of the core that runs (Shadow::await_near()). It
  /// executes in the component's shadow until then. Unless it is `fresh` it gets copies of the old core's state fields. [non-rt] Throws as
  /// Shadow::with_core().
  PartsChange(Component& component, std::shared_ptr<Shadow> candidate, bool is_fresh);
  ~PartsChange() override;

  /// The shell that will be in force: where properties of a new one are set and its ports connected. [non-rt]
  Shell& shell() noexcept;
  /// The fsm that will be in force. [non-rt], before the commit
  const FsmBase& fsm() const noexcept;
  /// Binds and configures the new parts. [non-rt] Throws Error; nothing but the new parts is touched.
  void prepare();
  /// Whether the component gets another fsm, for a new shell another instance of the same. It goes on in the wait of the same
  /// name, where the fsm has one and the pending instant lies on its grid; else it starts anew in the initial state. [rt]
  bool restarts() const MAUVE_RT { return restarts_; }
  /// Cleans up what is out: the old parts once they were taken, else the new ones. [non-rt]
  void retire() noexcept;
  /// The new core takes nothing over from the old one: that has failed. [setup]
  void start_afresh() noexcept { afresh_ = true; }
  /// The new core is put in as it is, neither bound nor configured: Listing 3 of the paper. [setup]
  void leave_unready() noexcept { unready_ = true; }
  /// The component starts anew in the initial state, whatever the wait that it is in. [setup]
  void give_up_place() noexcept { kept_waits_.clear(); }
  /// The new core is on probation once it was taken, from which put_back() puts the old one back. [setup]
  void set_probation(std::shared_ptr<Probation> probation) noexcept { probation_ = std::move(probation); }
  /// Gives the probation away; nullptr: there is none. [non-rt]
  std::shared_ptr<Probation> release_probation() noexcept { return std::move(probation_); }
  /// Of a bumpless change only where the outputs go over. [non-rt]
  bool has_probation() const noexcept;
  /// The new core is the candidate of the component's shadow. Unless it is `fresh` it gets copies of the old core's state fields. [setup]
  void promote(bool is_fresh) noexcept {
    promotes_ = true;
    afresh_ = is_fresh;
  }
  /// The candidate that goes in where its outputs are near; nullptr: none. [non-rt]
  const std::shared_ptr<Shadow>& candidate() const noexcept { return candidate_; }
  /// After take, of a core, or of an fsm and a core: exchanges the parts once more. No code of theirs runs. A running component
  /// goes on in the wait of the same name; before its first release, and after a fault, the caller starts it anew
  /// (Task::keep_place()). [rt]
  void put_back() MAUVE_RT;
  /// Before put_back(): ends a blend and takes the old core out of it. Whether the old core can go back in. [rt] as far as the core's
  /// bind_shell() is, the component's thread
  bool take_old_core() noexcept;
  /// Whether an fsm is replaced. [rt]
  bool replaces_fsm() const MAUVE_RT { return parts_.fsm != nullptr; }
  /// And it is the fallback. [setup]
  void be_fallback() noexcept { afresh_ = is_fallback_ = fallen_back_ = true; }

  /// What the new core takes over; nullptr: none, or it takes nothing. [non-rt]
  const Handover* handover() const noexcept { return handover_.get(); }
  /// The core that is not in force now. [setup]
  CoreBase* core() noexcept { return parts_.core.get(); }
  /// The fsm that is not in force now; nullptr: it replaces none. [non-rt]
  const FsmBase* fsm_out() const noexcept { return parts_.fsm.get(); }
  /// Gives away the core that is not in force now. [non-rt]
  std::unique_ptr<CoreBase> give_back_core() noexcept { return std::move(parts_.core); }
  /// Has it again. [non-rt]
  void take_core_back(std::unique_ptr<CoreBase> core) noexcept { parts_.core = std::move(core); }
  bool was_taken() const noexcept { return taken_; }

  bool is_ready(bool is_last) noexcept override;
  bool adopt() override;
  void take() noexcept override;
  bool make_safe(bool may_wait, time_ns_t time_ns) noexcept override;
  time_ns_t declared_ns() const noexcept override;
  std::uint32_t trace_id() const noexcept override { return trace_id_; }

 private:
  void prepare_parts();
  void prepare_candidate();
  void prepare_way_back();
  void exchange_core() MAUVE_RT;
  void exchange_fsm() MAUVE_RT;
  void take_over_events(const FsmBase& before, bool keeps_place) MAUVE_RT;

  Component& component_;
  Parts parts_;                // the new ones; after take the old ones
  Shell* const new_shell_;     // nullptr: the shell stays
  const FsmBase* fsm_before_;  // in force when the change was begun: for which the new parts are made
  CoreBinding binding_;
  time_ns_t period_ns_{0};
  std::vector<KeptWait> kept_waits_{};
  std::vector<KeptWait> waits_back_{};  // of the new fsm on probation, to the old one
  bool restarts_;
  std::unique_ptr<Handover> handover_{};  // from the core that ran when it was prepared
  const CoreBase* kept_core_{nullptr};    // the one that the binding was made for, when it stays
  const ShownCore* shown_core_{nullptr};  // of the core that is not in force
  bool fallen_back_{false};               // whether the component runs its fallback core, with that core
  std::shared_ptr<Probation> probation_{};
  std::shared_ptr<Shadow> candidate_{};
  time_ns_t budget_ns_{0};  // of the candidate's adopt and take
  bool afresh_{false};
  bool promotes_{false};
  bool unready_{false};
  bool is_fallback_{false};
  bool taken_{false};
  std::uint32_t trace_id_;
  std::string what_{};  // the part being prepared
};

/// Sets a property in a commit. The value is swapped with the old one, so that nothing is freed there.
class PropertyChange final : public CommitAction {
 public:
  /// `value` as PropertyBase::checked returned it.
  PropertyChange(PropertyBase& property, PropertyValue value);
  void take() noexcept override { property_.swap(value_); }
  std::uint32_t trace_id() const noexcept override { return trace_id_; }

 private:
  PropertyBase& property_;
  PropertyValue value_;
  std::uint32_t trace_id_;
};

/// What a component looks like, for those who must not touch its parts.
struct ShownPort {
  std::string name;
  PortKind kind;
  std::string type;
  std::string resource;  // empty: not connected
  std::string service;
  time_ns_t longest_hold_ns{0};           // of the resource's lock; 0: not declared
  std::vector<std::byte> stop_message{};  // what a stop writes; empty: nothing
  Frames frames{};
  bool operator==(const ShownPort&) const = default;
};
struct ShownProperty {
  std::string name;
  PropertyValue value;
  PropertyOptions options;
  bool operator==(const ShownProperty&) const = default;
};
struct ShownParts {
  std::string shell;
  std::string core;
  std::string fsm;
  std::vector<ShownPort> ports;
  std::vector<ShownProperty> properties;
  bool operator==(const ShownParts&) const = default;
};

/// One component of an architecture. All functions [non-rt]; its parts run on its task. What changes it
/// is made by its architecture, one change at a time, as a transaction where parts, properties or wiring change.
///
/// | member           | written by                                | read by             | under            |
/// | ---------------- | ----------------------------------------- | ------------------- | ---------------- |
/// | parts_, binding_ | commanders, parked; commits; a fallback   | the task            | parking, commits |
/// | present_shell_, present_core_, present_fsm_ | with parts_    | anyone              | release/acquire: the part's contents |
/// | has_ready_core_  | with binding_                             | anyone              | relaxed: a lone fact |
/// | wires_           | changes, as they are made                 | ordinary threads    | the gate's mutex |
/// | change_mark_     | changes                                   | anyone              | its own: commit_gate.hpp |
/// | shown_           | who changed something, after the fact     | any ordinary thread | shown_mutex_     |
/// | cores_           | who makes a change; none is erased        | ordinary threads    | shown_mutex_; a ShownCore is constant |
/// | shown_core_, faulted_core_ | with parts_                     | anyone              | release/acquire: the ShownCore |
/// | architecture_    | the architecture, with its lists          | any ordinary thread | release/acquire: it is there before it is asked |
/// | spare_ ... fallback_ | changes and renewals                   | the same            | the claim of the component |
/// | is_renewing_     | renewals, the component claimed           | anyone              | release/acquire: all that the renewal did |
/// | self_            | [setup]                                   | any ordinary thread | -                |
/// | probation_ ... shadow_ | changes, who settles; the component claimed | any ordinary thread | shown_mutex_   |
/// | the rest         | [setup]                                   | anyone              | -                |
class Component final : public Configurable {
 public:
  Component(std::string name, std::uint16_t number, ChangeSignal& changes);
  ~Component() override;

  /// This architecture lists it and hears of its changes. [rt], by the change that adds it
  void enter(Architecture& architecture) MAUVE_RT;
  /// None does any more. [non-rt]
  void leave_architecture() noexcept;

  /// Both under the architecture's change lock. [non-rt] Throw Error (already_running) unless it is parked.
  void configure() override;
  void cleanup() override;

  /// [setup]
  void set_parts(Parts parts);
  void set_settings(const TaskSettings& settings);
  /// The core that takes over after a fault, without a word from anybody. [setup]
  void set_fallback(std::unique_ptr<CoreBase> core);

  const std::string& name() const noexcept { return name_; }
  /// The shell in force. [rt]
  Shell& shell() const MAUVE_RT { return *present_shell_.load(std::memory_order_acquire); }
  /// The fsm in force; the old fsm of one on probation may take its place at any moment. An fsm that is out stays as it is
  /// until a change, or who settles, has claimed the component. [rt]
  const FsmBase& fsm() const MAUVE_RT { return *present_fsm_.load(std::memory_order_acquire); }
  /// The core in force; a fallback, or the old core of one on probation, may take its place at any moment. [rt]
  CoreBase& core() MAUVE_RT { return *present_core_.load(std::memory_order_acquire); }
  /// What changes it has been through. [rt]
  ChangeMark& change_mark() MAUVE_RT { return change_mark_; }
  /// Its wiring, as far as it is decided: a component that is late has other connections still. Never nullptr. [rt], within a
  /// CommitGate::Look
  const std::shared_ptr<const Wires>& wires() const MAUVE_RT { return wires_; }
  void swap_wires(std::shared_ptr<const Wires>& wires) MAUVE_RT { wires_.swap(wires); }
  /// [rt]
  Task& task() MAUVE_RT { return task_; }
  const Task& task() const MAUVE_RT { return task_; }
  /// The shell as the type it has. Throws std::bad_cast.
  template <typename ShellType>
  ShellType& shell_as() {
    return dynamic_cast<ShellType&>(shell());
  }
  template <typename CoreType>
  CoreType& core_as() {
    return dynamic_cast<CoreType&>(core());
  }
  std::string description() const override { return "component " + name_; }

  /// Names, wiring and property values now; unlike the parts themselves safe while they are being replaced. [non-rt]
  ShownParts shown() const;
  /// Of the fsm, with the worst cases that the core in force declares where neither the settings nor the fsm declares one.
  /// [non-rt]
  std::vector<DescribedState> described_states() const;
  /// The same before anything is configured: of an instance of the fsm made for that, where one can be made. [setup]
  /// Throws Error: it cannot be so.
  std::vector<DescribedState> previewed_states() const;
  /// How long the execution states took since the fsm was configured. [non-rt]
  std::shared_ptr<const StateTimes> state_times() const;
  /// To be called by who changed something, after the fact. [non-rt]
  void show();
  /// The core that runs now, package/Class. [non-rt]
  std::string core_implementation() const { return shown().core; }
  /// The fallback's name; empty when none was declared. [non-rt]
  const std::string& fallback_implementation() const noexcept { return fallback_name_; }

  /// As an alternative: whatever core there is.
  static constexpr const char* any_core = "*";

  /// Cores it takes beside the one it was declared with, and whether it may be changed at all. [setup]
  void allow(std::vector<std::string> alternatives, bool reconfigurable);
  const std::vector<std::string>& alternatives() const noexcept { return alternatives_; }
  /// Frames of ports by name, in addition to those that its shells declare. [setup]
  void declare_frames(std::map<std::string, Frames> frames) { frames_ = std::move(frames); }
  const std::map<std::string, Frames>& declared_frames() const noexcept { return frames_; }
  /// Lets the ports of a shell of this component have them, where it has such a port, and the component's max_slew. [setup], before it
  /// is connected. Throws Error: invalid_argument (a name; no number to limit), frame_mismatch, unknown_port (of max_slew).
  void set_up_ports(Shell& shell) const;
  /// The numbers of its outputs that have a max_slew, and how often that has acted. [non-rt]
  std::vector<SlewRecord> slews() const { return slewed_.records(); }
  /// Its outputs go on from the last values of this component, whose place it takes. [setup]
  void continue_outputs_of(const Component& other) noexcept { slewed_.continue_from(other.slewed_); }
  bool is_reconfigurable() const noexcept { return reconfigurable_; }
  /// Throws Error: not_reconfigurable, undeclared_core.
  void check_allowed(const std::string& core_implementation) const;
  /// Throws Error: not_reconfigurable.
  void check_reconfigurable() const;
  /// Throws Error: unknown_property.
  PropertyBase& require_property(const std::string& name) const;
  /// Throws Error (structural_property) when the component is configured and a part that reads the property only then
  /// is not among those `replaced`; a value that it has already may always be set. [non-rt]
  void check_structural(const PropertyBase& property, const PropertyValue& value,
                        ReadBy replaced = ReadBy::none) const;
  /// Throws Error: unknown_port.
  PortBase& require_port(const std::string& name) const;

  /// Sets a property: at once before the start, else in the component's next wait. [non-rt]
  /// Throws Error: unknown_property, type_mismatch, out_of_range; once configured structural_property,
  /// not_reconfigurable; timeout.
  StepReport set_property(const std::string& name, const PropertyValue& value,
                          const CommitTimeouts& timeouts = {});

  /// Throws Error (already_running) unless it is parked; `what` was to be done. [non-rt]
  void require_parked(const std::string& what) const;

  // Listing 3 of the paper: replacing the core of a stopped component; the new one waits for configure_core(). Throw
  // Error (already_running) otherwise. [non-rt]

  void cleanup_core();
  template <typename CoreType, typename... Args>
  CoreType& replace_core(Args&&... args) {
    auto core = std::make_unique<CoreType>(std::forward<Args>(args)...);
    CoreType& replaced = *core;
    replace_core(std::move(core));
    return replaced;
  }
  void replace_core(std::unique_ptr<CoreBase> core);
  void configure_core();
  /// Throws Error (not_configured) when it could not start for want of a core that is bound and configured. [non-rt]
  void require_ready_core() const;

  /// Replaces the core in flight: prepare, commit inside a wait, retire the old one. [non-rt]
  /// The component may also be stopped. Throws Error: prepare_failed, adopt_refused, timeout, faulted, not_configured,
  /// not_reconfigurable; the old core then goes on as if nothing had been asked.
  /// `committed` is called once the new core is in, before the release that follows is waited for.
  StepReport swap_core(std::unique_ptr<CoreBase> core, const CommitTimeouts& timeouts = {},
                       const std::function<void()>& committed = {});

  // ---- a core on probation (probation.hpp)

  /// Puts back the old core of a core on probation, whatever the component does; waits for its state to end, as long as told;
  /// of a parked component it is a change, and waits for another one under way.
  /// False when none is on probation, or it ends without that. From one of the component's own states it is pending by the
  /// return. [non-rt] Throws Error (timeout) naming the state still running; the request stays pending then.
  bool revert_probation(const std::string& reason, time_ns_t timeout_ns = s_to_ns(1));
  /// The registered core that has faulted, whose place the fallback core has taken; empty: it has not. [non-rt]
  std::string faulted_core() const;
  /// The last probation that was settled, then the present one, as far as there are. A new core is there once its change is
  /// completed. [non-rt]
  std::vector<ProbationRecord> probations() const;
  /// The one that has not been settled; nullptr: none. [non-rt]
  std::shared_ptr<Probation> present_probation() const;
  /// Its core is in: it is the present one from now on. [rt], in a take; its change keeps it until keep_probation().
  void set_next_probation(Probation& probation) MAUVE_RT {
    next_probation_.store(&probation, std::memory_order_release);
  }
  /// Has the parts that a change has put out, from which the new core may be reverted. [non-rt], by the change.
  void keep_probation(std::unique_ptr<PartsChange> parts);
  /// Ends the present probation if its time is over. Whether there is one that has ended. [non-rt]
  bool is_probation_over() const noexcept;
  /// Whether that has put the old core back. [non-rt]
  bool is_probation_reverted() const noexcept;
  /// Retires the parts that a probation which has ended has put out, beside this thread or at once. [non-rt], the component
  /// claimed.
  void settle_probation(bool at_once = false) noexcept;
  /// It takes the place of one whose core on probation hangs: that was its last probation. [setup]
  void begin_with(ProbationRecord last) {
    const LockGuard lock(shown_mutex_);
    last_probation_ = std::move(last);
  }
  /// Gives away the core of one that was added by a change that is not made: nothing but its end follows. [non-rt]
  std::unique_ptr<CoreBase> release_core() noexcept;
  void unbind_core() noexcept;
  /// Ends the present probation, inconclusive; settle_probation() retires its parts. [non-rt]
  void conclude_probation() noexcept;

  // ---- a candidate core in its shadow (shadow.hpp)

  /// The shadow that runs, or the last one that has ended; nullptr: there was none. [non-rt]
  std::shared_ptr<Shadow> last_shadow() const;
  /// Has a shadow that has begun. [non-rt], by the change.
  void keep_shadow(std::shared_ptr<Shadow> shadow);
  /// Ends the shadow that runs: the component is cleaned up, removed or shut down. [non-rt]
  void conclude_shadow() noexcept;
  /// Takes a shadow that has ended off the ports, and cleans it up. [non-rt], the component claimed.
  void settle_shadow() noexcept;
  /// Has one that has ended cleaned up, once. [non-rt]
  void retire_shadow(const std::shared_ptr<Shadow>& shadow) noexcept;

  /// After a change of parts: cleans up the parts that are out, and makes the fallback ready for the parts that are in force, where
  /// it is of no use as it is, or one of its kind is out. Beside changes and the component's thread, where threads run. [non-rt], the
  /// change lock held, or the component claimed.
  void renew_fallback(std::shared_ptr<PartsChange> out, bool is_outdated) noexcept;
  /// Whether the fallback is being made ready. The component can be changed then, and removed, but not be cleaned up in its place. [rt]
  bool is_renewing() const MAUVE_RT { return is_renewing_.load(std::memory_order_acquire); }
  /// Throws Error (already_running) while the fallback is being made ready. [non-rt]
  void check_renewed() const;
  /// What is done with its parts beside changes is done in the order of this lane, unless it is nullptr: in any. [non-rt]
  const void* lane() const noexcept { return fallback_name_.empty() ? nullptr : this; }
  /// [setup]
  void set_self(const std::shared_ptr<Component>& self) noexcept { self_ = self; }

  /// Brings the event waits' listening in line with the ports' wiring. [non-rt]
  void update_listening() { update_listening(fsm()); }
  /// Its event waits hear of nothing any more, for a component that is removed while a state of it hangs. [non-rt]
  void stop_listening() noexcept;
  /// Cleans up and configures anew a parked component, whatever its state; STOPPED then. [non-rt]
  /// Throws Error: already_running; what configure throws: it is UNCONFIGURED then.
  void configure_anew();
  /// New instances of its parts, of the declared core where the fallback is in force; nullptr: another one cannot be made. [non-rt],
  /// by who has claimed it; parked
  Parts another() const;
  /// Whether the core that runs is the fallback, and fallback_ holds the declared one. [non-rt], by who has claimed it; parked
  bool is_fallback_in() const noexcept;
  /// Another instance of its fallback core; nullptr: none was declared, or it cannot be made. [non-rt], claimed
  std::unique_ptr<CoreBase> another_fallback() const;

 private:
  friend class PartsChange;

  bool configure_hook() override;
  void check_cleanup() const override;
  void cleanup_hook() override;
  /// Its change lock held, and the component claimed, as far as they were not yet.
  class JoinedChange;
  JoinedChange join_change();
  Architecture& require_listed() const;
  void bind_and_configure(CoreBase& core, Shell& shell, const FsmBase& fsm, CoreBinding& binding);
  CoreBinding require_binding(CoreBase& core, const FsmBase& fsm) const;
  /// The fsm's states, with the core's worst cases. Throws Error (out_of_range): one is above the state's bound.
  std::vector<DescribedState> states_of(const FsmBase& fsm, const CoreBase& core) const;
  /// The times of a core, and which worst cases are enforced.
  void add_worst_cases(std::vector<DescribedState>& states, const std::string& core,
                       const CoreTimes& times) const;
  const ShownCore* keep_shown(const CoreBase& core);
  void bind_fsm(FsmBase& fsm, Shell& shell) const;
  void require_declared_states(const FsmBase& fsm) const;
  /// Refuses a shell whose messages do not fit on the task's stack. Throws Error (out_of_range).
  void check_stack(const Shell& shell) const;
  time_ns_t settled_period_ns(const FsmBase& fsm) const;
  void update_listening(const FsmBase& fsm);
  class FallbackRenewal;
  void prepare_fallback();
  /// Whether the code of the fallback was loaded anew since it was made.
  bool has_outdated_fallback() const;
  void dispose(std::shared_ptr<PartsChange> parts, bool is_outdated, bool at_once) noexcept;
  /// Runs hooks of parts that are out, which no change waits for; `what` is "cleanup of the shadow".
  void dispose(const std::string& what, std::function<void()> work);
  /// As a change: another one may look at the core that is in.
  void put_back_parked(Probation& probation);
  void check_fallback(const Shell& shell, const FsmBase& fsm) const;

  std::string name_;
  Atomic<Architecture*> architecture_{nullptr};
  Task task_;
  ChangeMark change_mark_;
  Parts parts_;
  std::shared_ptr<const Wires> wires_{std::make_shared<const Wires>()};
  Atomic<Shell*> present_shell_{nullptr};
  Atomic<CoreBase*> present_core_{nullptr};
  Atomic<const FsmBase*> present_fsm_{nullptr};
  CoreBinding binding_;
  Atomic<bool> has_ready_core_{false};  // whether binding_ is of a configured core
  std::string declared_core_;
  std::vector<std::string> alternatives_;
  std::map<std::string, Frames> frames_;
  SlewedOutputs slewed_;
  bool reconfigurable_{true};
  CoreBase* spare_{nullptr};                 // the fallback while one is ready or in force
  std::unique_ptr<CoreBase> fallback_core_;  // until it is put in
  std::string fallback_name_;
  std::unique_ptr<PartsChange> fallback_;
  Atomic<bool> is_renewing_{false};
  std::weak_ptr<Component> self_;

  mutable Mutex shown_mutex_;
  ShownParts shown_ MAUVE_GUARDED_BY(shown_mutex_);
  std::set<ShownCore> cores_ MAUVE_GUARDED_BY(shown_mutex_);  // that are or were in force, or prepared for it
  Atomic<const ShownCore*> shown_core_{nullptr};
  Atomic<const ShownCore*> faulted_core_{nullptr};  // of the one that the fallback took the place of last
  std::shared_ptr<const StateTimes> shown_times_ MAUVE_GUARDED_BY(shown_mutex_);
  std::vector<DescribedState> shown_states_ MAUVE_GUARDED_BY(shown_mutex_);
  std::shared_ptr<Probation> probation_ MAUVE_GUARDED_BY(shown_mutex_);
  Atomic<Probation*> next_probation_{nullptr};  // of a change that is not settled; cleared under shown_mutex_
  std::optional<ProbationRecord> last_probation_ MAUVE_GUARDED_BY(shown_mutex_);
  std::shared_ptr<Shadow> shadow_ MAUVE_GUARDED_BY(shown_mutex_);
};

/// What a commit cost one of its participants; waits for its next release as long as told. [non-rt]
StepReport report_of(const Participant& place, time_ns_t phase_timeout_ns);

}  // namespace mauve
