// SPDX-License-Identifier: LGPL-3.0-or-later
// Transaction: any number of changes to an architecture that come into force as one, or not at all.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "mauve_rt/architecture/plugin.hpp"
#include "mauve_rt/data/resource.hpp"
#include "mauve_rt/run/component.hpp"

namespace mauve {

class Draft;

/// What a component to be added consists of; parts by their registered names.
struct ComponentParts {
  std::string shell{};
  std::string core{};
  std::string fsm{};
  TaskSettings settings{};
  std::map<std::string, PropertyValue> properties{};
  std::vector<std::string> alternatives{};
  std::string fallback{};
  bool reconfigurable{true};
  std::map<std::string, Frames> frames{};  // by port, in addition to those that the shell declares
};

/// A component to be added: its parts by name, or as objects.
struct NewComponent {
  ComponentParts rest{};
  bool by_name{true};
  Parts parts{};
  std::unique_ptr<CoreBase> fallback{};
};

/// A resource to be added: of a registered kind, or as an object.
struct NewResource {
  std::string kind{};
  std::string type{};
  ResourceParameters parameters{};
  bool by_kind{true};
  std::unique_ptr<Resource> resource{};
  TopicBinding topic{TopicBinding::none};
  time_ns_t longest_hold_ns{0};
  Frames frames{};
};

/// How a core is put in.
struct ReplaceOptions {
  std::optional<ProbationOptions> probation{};  // probation.hpp
  /// Of a component that runs: only where its outputs are near those of the core that it replaces (output_steps.hpp). Until then it
  /// executes in the component's shadow, each release with the state fields that the other core had before it. Of one that is STOPPED it
  /// goes in at once.
  std::optional<BumplessOptions> bumpless{};
};

/// A core to be put in with options: by the step's name, or as an object.
struct CoreWithOptions {
  std::unique_ptr<CoreBase> core{};
  ReplaceOptions options{};
};

/// How the candidate of a shadow becomes the core.
struct PromoteOptions {
  std::optional<BumplessOptions>
      bumpless{};        // as in ReplaceOptions; its budget counts for nothing, the shadow has one
  bool is_fresh{false};  // it gets no copies of the state fields of the core that it replaces
};

/// A core to execute in a component's shadow: by the step's name, or as an object. Without a shell as an object, the registry makes
/// one of the component's shell's name.
struct CoreInShadow {
  std::unique_ptr<CoreBase> core{};
  ShadowOptions options{};
  std::unique_ptr<Shell> shell{};
};

/// What a step puts in, as its kind takes it.
using StepValue = std::variant<std::monostate, PropertyValue, std::unique_ptr<CoreBase>,
                               std::unique_ptr<FsmBase>, std::unique_ptr<Shell>, NewComponent, NewResource,
                               CoreWithOptions, PromoteOptions, CoreInShadow>;

struct StepKind;

/// One step: checks itself against what the steps before it will have made of the architecture. All functions [non-rt].
class TransactionStep {
 public:
  TransactionStep(const StepKind& its_kind, std::string its_target, std::string its_name,
                  StepValue its_value);

  /// "connect mapping.scan lidar.read": kind, target, value.
  const std::string& text() const noexcept { return text_; }
  /// "connect".
  std::string_view kind() const noexcept;
  /// The component it is about; empty for steps about resources.
  const std::string& component() const noexcept;
  /// Whether it has a report of every component that it touched.
  bool is_for_all() const noexcept;
  /// Whether it adds or removes something, wires a port, replaces a shell, or gives all components a new epoch.
  bool is_structural() const noexcept;
  /// Which element of its target it sets, as Authored::element.
  std::string element() const;
  /// Whether its target is gone with it.
  bool removes() const noexcept;
  /// Enters its effect into the draft; uses up the parts it was given. Throws Error.
  void draft(Draft& draft);

  const std::string target;  // a component, or a resource
  const std::string name;    // what of it: a property, a port, a registered part
  StepValue value;

 private:
  const StepKind& kind_;
  std::string text_;
};

/// A list of steps, taken in order; nothing happens before Host::commit or Architecture::commit. All functions [non-rt].
/// Parts are given by registered name or as objects; objects serve one commit.
class Transaction {
 public:
  /// A step by the name of its kind; the calls below are the same, typed. Throws Error (invalid_argument): no such kind.
  Transaction& add(std::string_view kind, std::string target = {}, std::string name = {},
                   StepValue value = {});
  /// A step of a kind in no table.
  Transaction& add(const StepKind& kind, std::string target, std::string name = {}, StepValue value = {});

  /// By name: one of the component's declared alternatives, or the core it was declared with.
  Transaction& replace_core(const std::string& component, const std::string& implementation);
  Transaction& replace_core(const std::string& component, std::unique_ptr<CoreBase> core);
  /// The same on probation (probation.hpp): the old core stays ready, and a violation puts it back. Of a deployed component that
  /// runs or is STOPPED; not together with a new shell or fsm, a configure step, or a structural property that its core reads.
  Transaction& replace_core(const std::string& component, const std::string& implementation,
                            ProbationOptions options);
  Transaction& replace_core(const std::string& component, std::unique_ptr<CoreBase> core,
                            ProbationOptions options);
  /// With any options. A bumpless change is of one deployed component, with no new shell or fsm, wiring or property of it, no configure
  /// step, and nothing but read, write and event ports of trivially copyable types, as a shadow.
  Transaction& replace_core(const std::string& component, const std::string& implementation,
                            ReplaceOptions options);
  Transaction& replace_core(const std::string& component, std::unique_ptr<CoreBase> core,
                            ReplaceOptions options);
  /// Executes a candidate core in the component's shadow (shadow.hpp); the live core stays. Of a deployed component that runs or is
  /// STOPPED and has no shadow, whose parts and wiring the transaction leaves alone. By name as in replace_core(). As an object:
  /// `shell` is another instance of the component's shell class; nullptr: the registry makes it.
  Transaction& shadow(const std::string& component, const std::string& implementation, ShadowOptions options);
  Transaction& shadow(const std::string& component, std::unique_ptr<CoreBase> core, ShadowOptions options,
                      std::unique_ptr<Shell> shell = nullptr);
  /// Of one whose core on probation hangs: the old core goes on by another thread, in a component that takes its place (probation.hpp).
  /// The architecture asks for it by itself.
  Transaction& bring_back(const std::string& component);
  /// Ends the component's shadow; without a shadow there is nothing to do.
  Transaction& end_shadow(const std::string& component);
  /// Replaces the live core by the candidate of the component's shadow. It gets copies of the live core's state fields of the same name
  /// and type, and keeps its own state besides.
  Transaction& promote(const std::string& component, PromoteOptions options = {});
  /// Puts a core into a stopped component as it is; the component is to configure it before it starts (Listing 3).
  Transaction& place_core(const std::string& component, std::unique_ptr<CoreBase> core);
  /// The new fsm goes on in the wait of the same name, where it has one in a cycle with its initial state and the pending
  /// instant lies on its grid. Else it starts in its initial state, on its own period, on the deployment's epoch.
  Transaction& replace_fsm(const std::string& component, const std::string& implementation);
  Transaction& replace_fsm(const std::string& component, std::unique_ptr<FsmBase> fsm);
  /// Ports keep their connections by name, properties their values.
  Transaction& replace_shell(const std::string& component, const std::string& implementation);
  Transaction& replace_shell(const std::string& component, std::unique_ptr<Shell> shell);
  Transaction& set_property(const std::string& component, const std::string& name,
                            const PropertyValue& value);
  Transaction& connect(const std::string& component, const std::string& port, const std::string& resource,
                       const std::string& service);
  Transaction& disconnect(const std::string& component, const std::string& port);

  /// Arrives STOPPED; a start step starts it on the deployment's grid.
  Transaction& add_component(const std::string& name, const ComponentParts& parts);
  /// With its parts as objects; the names in `rest` stay unused, but for the fallback's where none is given.
  Transaction& add_component(const std::string& name, Parts parts, const ComponentParts& rest = {},
                             std::unique_ptr<CoreBase> fallback = nullptr);
  template <typename ShellType, typename CoreType, typename FsmType>
  Transaction& add_component(const std::string& name, const ComponentParts& rest = {}) {
    return add_component(name,
                         Parts{.shell = new_part<Shell, ShellType>(),
                               .core = new_part<CoreBase, CoreType>(),
                               .fsm = new_part<FsmBase, FsmType>()},
                         rest);
  }
  /// It is parked, its outputs written as on a stop, its ports disconnected.
  Transaction& remove_component(const std::string& name);
  /// `topic`: as Architecture::publish() or Resource::bind_input(). `longest_hold_ns`: as
  /// Resource::set_longest_hold_ns(); 0: what the resource's own code declares. `frames`: as Resource::set_frames().
  Transaction& add_resource(const std::string& name, const std::string& kind, const std::string& type,
                            ResourceParameters parameters = {}, TopicBinding topic = TopicBinding::none,
                            time_ns_t longest_hold_ns = 0, const Frames& frames = {});
  Transaction& add_resource(const std::string& name, std::unique_ptr<Resource> resource,
                            TopicBinding topic = TopicBinding::none, time_ns_t longest_hold_ns = 0,
                            const Frames& frames = {});
  /// Refused while a port is connected to it.
  Transaction& remove_resource(const std::string& name);
  /// As Task::start: in the initial state, on the grid of `clock_ns` or of the deployment.
  Transaction& start(const std::string& component, std::optional<time_ns_t> clock_ns = std::nullopt);
  Transaction& stop(const std::string& component);
  /// Gives a component that is not running new instances of its parts (ComponentPart::another()), configured with the properties
  /// that the transaction sets; it is STOPPED then, a fault is forgotten. They take nothing over from the present parts. Where
  /// another instance cannot be made, the hooks run on the present parts before the commit: where these refuse, it is UNCONFIGURED.
  Transaction& configure(const std::string& component);
  /// A new common epoch: the commit's instant + 20 ms. Every running component goes on in its place, all its instants
  /// later by the same, less than a period, so that they lie on the new epoch's grid; one that has no period is left
  /// alone. The stopped ones take the epoch when they start. Not for an architecture that is not deployed.
  Transaction& resynchronise();

  /// Who makes the change, for Architecture::authors(): "rule link_lost". Empty: the program itself.
  Transaction& by(std::string author);
  const std::string& author() const noexcept { return author_; }

  const std::vector<std::unique_ptr<TransactionStep>>& steps() const noexcept { return steps_; }

 private:
  std::vector<std::unique_ptr<TransactionStep>> steps_;
  std::string author_;
};

struct TransactionOptions {
  CommitTimeouts timeouts{};
  bool dry_run{false};                 // check and prepare everything, then throw it away
  std::uint64_t expected_revision{0};  // of the architecture; 0: any
  // A component that the transaction removes, stops or gives new parts, and whose state does not end within the commit's
  // timeout, is stopped by force (Task::stop): it is FAULTED then, whatever becomes of the transaction. The commit is tried
  // once more, without the thread of one that is removed or stopped; for new parts it is refused (faulted).
  bool force{false};
  // The change is made at an instant at which no job of a participant is pending: from T on all that executes has the new parts. The
  // change is called off (timeout) when no such instant has come `idle_within_ns` after the last participant has agreed.
  //
  // Where the participants that run are pinned to one and the same CPU, no component that stands above the lowest of them has a job
  // pending either. On several CPUs each component at or above a participant's priority takes part for that, if it may run on a CPU of
  // that participant: it agrees, and takes nothing; one that is started or added meanwhile does not. A job that was timed out does not
  // count. In virtual time a request takes no time: the change is called off at once where a job is pending. Not of a prepared change.
  bool idle{false};
  time_ns_t idle_within_ns{s_to_ns(1)};
};

struct TransactionReport {
  std::vector<StepReport> steps;
  std::uint64_t revision{0};           // of the architecture, after
  time_ns_t prepare_ns{0};             // all of it
  time_ns_t blackout_ns{0};            // the longest of any component's
  bool is_complete{true};              // false: a release that follows has not come yet
  bool is_idle{false};                 // it was made while no job of a participant was pending
  time_ns_t instant_ns{kNotMeasured};  // T; kNotMeasured when the transaction changed no running component
};

}  // namespace mauve
