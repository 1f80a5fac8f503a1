// SPDX-License-Identifier: LGPL-3.0-or-later
// Core: a component's data and algorithms, replaceable while the component runs.
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "mauve_rt/base/context.hpp"
#include "mauve_rt/base/rt.hpp"
#include "mauve_rt/parts/component_part.hpp"
#include "mauve_rt/parts/core_times.hpp"
#include "mauve_rt/parts/shell.hpp"
#include "mauve_rt/parts/state_fields.hpp"

namespace mauve {

/// A core seen without its shell's type.
class CoreBase : public ComponentPart<CoreBase> {
 public:
  /// Binds the core to a shell; false when the shell is not of the type the core was written for. [setup]
  virtual bool bind_shell(Shell& shell) noexcept = 0;
  /// Whether bind_shell would succeed; changes nothing. [non-rt]
  virtual bool accepts(const Shell& /*shell*/) const noexcept { return false; }

  /// Checks that the old core's state can be carried over; nothing is changed yet. [rt] as far as the core is.
  /// Runs on the component's own thread, inside a wait, or while the component is stopped; on the requester's where the
  /// component has no thread. It may be some releases older than take, as other components of the same change vote after it.
  /// Returning false or throwing refuses the change.
  virtual bool adopt(const CoreBase& /*old*/) { return true; }
  /// Moves the old core's newest state over; cannot fail. [rt] as far as the core is. On the same thread, between the last
  /// execution of the old core and the first one of this core.
  virtual void take(CoreBase& /*old*/) noexcept {}
  /// The members that are copied from the old core of the same field name and type, before take: MAUVE_STATE writes this. The
  /// addresses stay valid as long as the core. Cores of different generations (of a library that was loaded anew) get no more of
  /// each other: adopt and take see a core of no type that they know. [non-rt], while the core may run.
  virtual std::vector<StateField> state_fields() { return {}; }
  /// The time adopt and take need together, held against them. [rt] An adopt that takes longer refuses the change, after a
  /// longer take the component is FAULTED. With less left before a release, adopt waits for the one after. 0: none declared.
  virtual time_ns_t budget_ns() const MAUVE_RT { return 0; }

  // Of a core whose state fields are copies of values that stand elsewhere, e.g. in Python.

  /// Brings the fields up to date; false: one of them still has an earlier value. [rt] as far as the core is.
  virtual bool store_state() noexcept { return true; }
  /// Has been given new values of its fields. [rt] as far as the core is.
  virtual void load_state() noexcept {}
  /// Whether adopt and take look no C++ type up in the old core. [non-rt]
  virtual bool is_dynamic() const noexcept { return false; }

  /// [setup] Throws Error (out_of_range) as check_core_times().
  void set_wcet_ns(CoreTimes times) {
    check_core_times(implementation(), times);
    wcet_ns_ = std::move(times);
  }
  /// The worst-case execution times of its methods, as far as they are declared. [rt]
  const CoreTimes& wcet_ns() const MAUVE_RT { return wcet_ns_; }

  /// [setup]
  virtual void set_context(const Context* context) noexcept { context_ = context; }
  std::string description() const override { return "core " + implementation(); }

 protected:
  /// Lines for the console, /rosout and the bag, of this component: log().warn("tracking error {} m", error). [rt]
  Log log() const MAUVE_RT { return Log(context_ != nullptr ? &context_->log : nullptr); }
  /// The component's logical clock: the nominal instant it acts at. [rt]
  time_ns_t clock_ns() const MAUVE_RT {
    return context_ != nullptr ? context_->clock_ns.load(std::memory_order_relaxed) : monotonic_now_ns();
  }
  /// The component's period g. [rt]
  time_ns_t period_ns() const MAUVE_RT {
    return context_ != nullptr ? context_->period_ns.load(std::memory_order_relaxed) : 0;
  }

 private:
  const Context* context_{nullptr};
  CoreTimes wcet_ns_{};
};

/// Derive from this with the shell the core was written for (Listing 2 of the paper).
template <typename ShellType>
class Core : public CoreBase {
 public:
  using shell_type = ShellType;

  bool bind_shell(Shell& shell) noexcept override {
    shell_ = shell_as<ShellType>(shell);
    return shell_ != nullptr;
  }
  bool accepts(const Shell& shell) const noexcept override {
    return shell_as<ShellType>(const_cast<Shell&>(shell)) != nullptr;
  }

 protected:
  ShellType& shell() const noexcept { return *shell_; }

 private:
  ShellType* shell_{nullptr};
};

/// A core whose methods are found by name, e.g. one written in Python. It serves any fsm whose method names
/// it has.
class DynamicCore : public CoreBase {
 public:
  bool is_dynamic() const noexcept override { return true; }
  /// The number of a method, or -1 when the core has none of that name. [non-rt]
  virtual int find_method(std::string_view name) const = 0;
  /// Runs an action; may throw. [rt] as far as the core is.
  virtual void run(int method) = 0;
  /// Evaluates a guard; may throw. [rt] as far as the core is.
  virtual bool test(int method) = 0;
};

}  // namespace mauve
