// SPDX-License-Identifier: LGPL-3.0-or-later
// Component: a shell, a core and an fsm, run by a task; its core and properties can be replaced while it
// runs.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "mauve_rt/task.hpp"

namespace mauve {

/// In place of a figure that was not measured; as mauve_msgs/msg/StepReport.NOT_MEASURED.
inline constexpr std::int64_t kNotMeasured = -INT64_MAX;

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
};

struct CommitTimeouts {
  time_ns_t commit_ns{s_to_ns(1)};  // for the component to reach a wait
  time_ns_t phase_ns{s_to_ns(1)};   // for the release that follows, to measure its phase; 0: do not wait
};

/// One component of an architecture. Its functions are for ordinary threads; its parts run on its task.
///
/// | member                         | written by                               | read by             | under            |
/// | ------------------------------ | ---------------------------------------- | ------------------- | ---------------- |
/// | core_, binding_                | commanders, parked; the task, in commits | the task            | parking, commits |
/// | shown_core_, shown_properties_ | who changed one, after the fact          | any ordinary thread | shown_mutex_     |
/// | the rest                       | [setup]                                  | anyone              | -                |
class Component final : public Configurable {
 public:
  Component(std::string name, std::uint16_t number, ChangeSignal& changes);
  ~Component() override;

  void set_parts(std::unique_ptr<Shell> shell, std::unique_ptr<CoreBase> core, std::unique_ptr<FsmBase> fsm);
  void set_settings(const TaskSettings& settings);

  const std::string& name() const noexcept { return name_; }
  Shell& shell() noexcept { return *shell_; }
  CoreBase& core() noexcept { return *core_; }
  const FsmBase& fsm() const noexcept { return *fsm_; }
  Task& task() noexcept { return task_; }
  const Task& task() const noexcept { return task_; }
  /// The shell as the type it has. Throws std::bad_cast.
  template <typename ShellType>
  ShellType& shell_as() {
    return dynamic_cast<ShellType&>(*shell_);
  }
  template <typename CoreType>
  CoreType& core_as() {
    return dynamic_cast<CoreType&>(*core_);
  }
  std::string description() const override { return "component " + name_; }

  /// The core that runs now, package/Class; unlike core() safe while it is being replaced. [non-rt]
  std::string core_implementation() const;
  /// The properties' values in the shell's order; safe while one is being set. [non-rt]
  std::vector<PropertyValue> property_values() const;

  /// Cores it takes beside the one it was declared with, and whether it may be changed at all. [setup]
  void allow(std::vector<std::string> alternatives, bool reconfigurable);
  const std::vector<std::string>& alternatives() const noexcept { return alternatives_; }
  bool is_reconfigurable() const noexcept { return reconfigurable_; }
  /// Throws Error: not_reconfigurable, undeclared_core.
  void check_allowed(const std::string& core_implementation) const;

  /// Sets a property: at once before the start, else in the component's next wait. [non-rt]
  /// Throws Error: unknown_property, type_mismatch, out_of_range, not_reconfigurable (while running),
  /// timeout.
  StepReport set_property(const std::string& name, const PropertyValue& value,
                          const CommitTimeouts& timeouts = {});

  // Listing 3 of the paper: replacing the core of a stopped component. Throw Error (already_running)
  // otherwise.

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

  /// Replaces the core in flight: prepare, commit inside a wait, retire the old one. [non-rt]
  /// The component may also be stopped. Throws Error: prepare_failed, adopt_refused, timeout, faulted; the
  /// old core then goes on as if nothing had been asked.
  /// `committed` is called once the new core is in, before the release that follows is waited for.
  StepReport swap_core(std::unique_ptr<CoreBase> core, const CommitTimeouts& timeouts = {},
                       const std::function<void()>& committed = {});

 private:
  bool configure_hook() override;
  void check_cleanup() const override;
  void cleanup_hook() override;
  PropertyBase& require_property(const std::string& name);
  void require_parked(const std::string& what) const;
  void prepare(CoreBase& core, CoreBinding& binding);
  void settle_period();
  StepReport run_commit(CommitAction& action, const CommitTimeouts& timeouts,
                        const std::function<void()>& committed);
  void show_core();
  void show_property(const PropertyBase& property, PropertyValue value);

  std::string name_;
  Task task_;
  std::unique_ptr<Shell> shell_;
  std::unique_ptr<CoreBase> core_;
  std::unique_ptr<FsmBase> fsm_;
  CoreBinding binding_;
  std::string declared_core_;
  std::vector<std::string> alternatives_;
  bool reconfigurable_{true};

  mutable std::mutex shown_mutex_;
  std::string shown_core_;
  std::vector<PropertyValue> shown_properties_;
};

}  // namespace mauve
