// SPDX-License-Identifier: LGPL-3.0-or-later
// Draft: what the steps of a transaction, one after another, will have made of an architecture.
#pragma once

#include <algorithm>
#include <list>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "mauve_rt/architecture/architecture.hpp"
#include "mauve_rt/architecture/plugin.hpp"
#include "mauve_rt/base/contract.hpp"
#include "mauve_rt/base/error.hpp"

namespace mauve {

struct DraftProperty {
  PropertyValue value;  // as PropertyBase::checked returned it
  int step{0};
};

struct DraftComponent {
  std::shared_ptr<Component> component;
  bool is_added{false};
  ComponentState state{ComponentState::unconfigured};  // as the draft found it
  bool ran{false};
  bool runs{false};      // afterwards
  bool restarts{false};  // because it was stopped and started
  std::optional<time_ns_t> clock_ns{};
  Parts fresh{};             // of an added one: all its parts
  std::uint32_t changes{0};  // of one that was there: ChangeMark, as the draft found it
  Wires wires_before{};
  Wires wires{};
  std::map<std::string, int> disconnected{};  // by port: the last step that disconnected it
  std::map<std::string, DraftProperty> properties{};
  int shell_step{0};
  int fsm_step{0};
  int core_step{0};
  std::optional<ProbationOptions> probation{};  // of the new core
  std::optional<BumplessOptions> bumpless{};    // the new core goes in where its outputs are near
  std::shared_ptr<Shadow> promoted{};           // the new core is its candidate
  bool is_fresh{false};                         // which gets no copies of the old core's state
  bool is_candidate_out{false};                 // the preparation has taken it out of the shadow
  std::shared_ptr<Shadow> shadow{};             // begins
  int shadow_step{0};
  std::shared_ptr<Shadow> candidate{};  // of a bumpless change that found no shadow
  bool core_unready{false};             // the new core is put in as it is
  int configure_step{0};                // the last that configures it anew
  bool is_made_anew{false};             // by new instances of its parts
  int first_step{0};
  std::shared_ptr<Probation>
      comeback_of{};  // its core is taken over from that one, which has it back when the change is not made
  bool only_epoch{
      false};  // FAULTED or not configured: it takes a new epoch for its next start, and nothing else
  std::vector<std::unique_ptr<CommitAction>>
      actions{};  // taken in by the commit beside all this; not of an added one

  const std::string& name() const noexcept { return component->name(); }
  /// The shell that will be in force.
  Shell& shell() const noexcept { return fresh.shell != nullptr ? *fresh.shell : component->shell(); }
  /// The parts that are configured anew; with a new shell the fsm is, whether it is another one or not.
  ReadBy replaced() const noexcept {
    ReadBy parts = core_step != 0 ? ReadBy::core : ReadBy::none;
    if (fsm_step != 0) parts = parts | ReadBy::fsm;
    if (shell_step != 0) parts = parts | ReadBy::shell | ReadBy::fsm;
    if (configure_step != 0) parts = parts | ReadBy::core | ReadBy::fsm | ReadBy::shell;
    return parts;
  }
  /// Whether a new core is to wait for an instant at which its outputs are near.
  bool awaits_near() const noexcept { return bumpless && ran && runs && !restarts; }
  /// Whether it was FAULTED, and is STOPPED or RUNNING afterwards.
  bool is_repaired() const noexcept { return state == ComponentState::faulted && replaced() != ReadBy::none; }
  bool sets_structural() const noexcept {
    return std::any_of(properties.begin(), properties.end(), [this](const auto& set) {
      return component->require_property(set.first).options().structural != ReadBy::none;
    });
  }
  bool has_new_parts() const noexcept {
    return fresh.shell != nullptr || fresh.core != nullptr || fresh.fsm != nullptr || promoted != nullptr;
  }
};

struct DraftResource {
  std::shared_ptr<Resource> resource;
  int added_step{0};

  const std::string& name() const noexcept { return resource->name(); }
};

/// An overlay of an architecture: what the steps touch of it, and nothing else, however large it is. Nothing of it is in
/// force. Ordinary threads, the architecture's change lock held while steps enter and finish() checks. It notes how often each
/// component that it touches has changed by then: an urgent change may come before it is made, which is refused then.
class Draft {
 public:
  Draft(Architecture& architecture, bool deployed) : architecture_(architecture), deployed_(deployed) {}
  ~Draft() { release(); }
  Draft(const Draft&) = delete;
  Draft& operator=(const Draft&) = delete;

  Architecture& architecture() const noexcept { return architecture_; }
  bool is_deployed() const noexcept { return deployed_; }
  const PluginRegistry& registry() const { return architecture_.require_registry(); }

  /// The step being entered.
  void begin(int step) noexcept { step_ = step; }
  int step() const noexcept { return step_; }

  /// Every component that was there before and is touched is claimed until then, or until the change is made: no other change
  /// that is not urgent is about it.
  void release() noexcept;
  /// No change at all is made of this one meanwhile: its parts that are in are acted on. Throws Error (wrong_revision) when it is
  /// not as the draft found it any more.
  void hold(const DraftComponent& component);
  /// The change is made: whether who publishes it is to release the claims. [rt], within a CommitGate::Look
  bool forget_claims() MAUVE_RT {
    MAUVE_AUDIT(architecture_.commit_gate().is_looked_at_here());
    const bool is_claiming = is_claiming_;
    is_claiming_ = false;
    return is_claiming;
  }
  const std::vector<std::shared_ptr<Component>>& claimed() const noexcept { return claimed_; }
  /// Whether it adds or removes something, wires a port, replaces a shell, or gives all components a new epoch: of such changes
  /// one at a time is made.
  bool is_structural() const noexcept;

  /// Marks it as touched by this step. Throws Error: unknown_component.
  DraftComponent& touch(const std::string& name);
  /// The same for what `reconfigurable: false` forbids, and a FAULTED thread that still executes.
  /// Throws Error: not_reconfigurable, faulted besides.
  DraftComponent& change(const std::string& name);
  /// The component that a step has touched, or nullptr.
  DraftComponent* find(const std::string& name) noexcept;
  /// Throws Error: unknown_resource.
  Resource& resource(const std::string& name);

  /// Throws Error: duplicate_name, out_of_range (settings).
  DraftComponent& add_component(const std::string& name, const TaskSettings& settings);
  void remove_component(const std::string& name);
  void add_resource(const std::string& name, std::shared_ptr<Resource> resource, TopicBinding topic,
                    time_ns_t longest_hold_ns, const Frames& frames);
  /// Throws Error (invalid_argument) while it is connected or bound to a topic.
  void remove_resource(const std::string& name);
  void set_property(DraftComponent& component, const std::string& name, const PropertyValue& value);

  /// Touches all that can take a new epoch. Throws Error: not_configured when nothing is deployed.
  void resynchronise();
  /// The step that did; 0: none.
  int resynchronise_step() const noexcept { return resynchronise_step_; }

  /// Checks what only the whole shows: faults repaired, kept connections of new shells, structural properties, ports that must
  /// lead somewhere, ports per service, frames of a resource's ports. Throws Error with the step.
  void finish();
  /// The frames of resources whose ports change, of the resources and all ports at them. After finish().
  const std::map<Resource*, Frames>& frames() const noexcept { return frames_; }

  /// Those that are there afterwards and were touched, in the order of the steps.
  std::list<DraftComponent>& components() noexcept { return components_; }
  std::list<DraftComponent>& removed_components() noexcept { return removed_components_; }
  /// Those that are added.
  std::list<DraftResource>& resources() noexcept { return resources_; }
  std::vector<std::shared_ptr<Resource>>& removed_resources() noexcept { return removed_resources_; }

 private:
  DraftComponent claim(std::shared_ptr<Component> component);
  bool is_removed(const std::string& component) const noexcept;
  bool is_unsettled(Component& component) const;
  std::shared_ptr<Resource> find_resource(const std::string& name) const;
  std::vector<std::string> component_names() const;
  std::vector<std::string> ports_of(const Resource& resource) const;
  void check_kept_wires(const DraftComponent& component) const;
  static void check_structural(const DraftComponent& component);
  static void check_repaired(const DraftComponent& component);
  void check_probation(const DraftComponent& component) const;
  void check_bumpless(const DraftComponent& component) const;
  static void check_shadow(const DraftComponent& component);
  static void check_core(const DraftComponent& component);
  void check_required_ports(const DraftComponent& component) const;
  void check_port_counts() const;
  bool touches_frames() const;
  void check_frames();

  Architecture& architecture_;
  bool deployed_;
  int step_{0};
  int resynchronise_step_{0};
  std::vector<std::shared_ptr<Component>> claimed_;
  bool is_claiming_{true};  // under the gate's mutex
  std::list<DraftComponent> components_;
  std::map<std::string, DraftComponent*> by_name_;  // of components_
  std::list<DraftComponent> removed_components_;    // those that were there before
  std::list<DraftResource> resources_;
  std::map<std::string, DraftResource*> resources_by_name_;
  std::vector<std::shared_ptr<Resource>> removed_resources_;
  std::map<Resource*, Frames> frames_;
};

/// An error of a thing that knows neither its component nor the step.
[[noreturn]] void rethrow_as_of(const Error& failure, const std::string& component, int step);

}  // namespace mauve
