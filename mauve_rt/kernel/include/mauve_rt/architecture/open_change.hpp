// SPDX-License-Identifier: LGPL-3.0-or-later
// OpenChange: a change from its draft to the end of what it has put out, as its architecture sees it.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "mauve_rt/base/present_state.hpp"
#include "mauve_rt/base/rt.hpp"
#include "mauve_rt/base/time.hpp"

namespace mauve {

class Component;
class Task;

/// How far an open change is.
enum class OpenChangePhase : std::uint8_t {
  preparing,  // its parts are being prepared
  waiting,    // its components have not all agreed yet: it can still be called off
  made,       // it is decided, and a component has not taken it, or what it has put out is there still
};
/// "preparing", "waiting", "made". [rt]
const char* to_string(OpenChangePhase phase) MAUVE_RT;

/// A component for which an open change waits.
struct LateComponent {
  std::string name{};
  StateAge state{};
  bool left_behind{false};  // its execution was given up, and its thread has not come back
};

/// An open change, as of one moment.
struct OpenChangeFacts {
  std::string author{};              // empty: unknown
  std::vector<std::string> steps{};  // in words
  time_ns_t begun_ns{0};             // when it was asked for, on the host's clock
  OpenChangePhase phase{OpenChangePhase::preparing};
  std::string hook{};  // the hook of a part that it is at: "configure of core my_robot/Pid"; empty: at none
  time_ns_t hook_age_ns{0};  // for how long
  time_ns_t instant_ns{0};   // T; 0: it is not decided
  std::vector<LateComponent>
      late{};  // made: the components that have not taken it; waiting: those that have not agreed
};

/// All with the architecture's change lock held, but for what is told of it to anyone.
class OpenChange {
 public:
  virtual ~OpenChange() = default;
  /// Settles the part of each component that has taken the change, or retires one that was called off and that a thread had not
  /// left by then. Whether nothing is left to be done. [non-rt]
  virtual bool settle() noexcept = 0;
  /// Lets go of all that it has, if what it was prepared against has changed for good. [non-rt]
  virtual void drop_if_stale() noexcept {}
  /// A component that has not taken it yet, of those that it was made of; nullptr: there is none. [non-rt]
  virtual const Task* find_late() const noexcept { return nullptr; }
  /// Whether it is more than prepared and watching. [non-rt]
  virtual bool is_under_way() const noexcept { return true; }

  // ---- for anyone, while the architecture's list of open changes is locked

  /// Appends what is known of it, if it is open. [non-rt]
  virtual void tell(std::vector<OpenChangeFacts>& /*all*/) const {}
  /// The component of that name if it is made, and that component has not taken it. [non-rt]
  virtual std::shared_ptr<Component> find_awaited(const std::string& /*component*/) const { return nullptr; }
  /// Whether it also gives that component new parts. [non-rt]
  virtual bool awaits_parts(const std::string& /*component*/) const { return false; }
  /// Whether a step of it names that component, or resource. [non-rt]
  virtual bool is_about(const std::string& /*target*/) const noexcept { return false; }
  /// Whether it is at a hook that has lasted for longer than who asked for it allows. [non-rt]
  virtual bool is_overdue() const { return false; }
  /// While it executes a hook of a new part, and only then: its requester is answered at once, and what it has claimed is free. What
  /// the hook uses is released when it returns. Whether it was called off. [non-rt]
  virtual bool call_off_preparation() { return false; }
};

}  // namespace mauve
