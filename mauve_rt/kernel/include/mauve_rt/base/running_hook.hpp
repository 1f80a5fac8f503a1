// SPDX-License-Identifier: LGPL-3.0-or-later
// RunningHook: user code that an ordinary thread executes now.
#pragma once

#include <functional>
#include <string>

#include "mauve_rt/base/seam/ordinary_thread.hpp"
#include "mauve_rt/base/time.hpp"

namespace mauve {

/// While it lives its thread executes a hook of a part, which may hang: an open change reports it. What the thread of a component
/// executes is in Task::state_age(). All functions [non-rt].
class RunningHook {
 public:
  struct Facts {
    std::string hook{};     // "configure of core my_robot/Pid"; empty: none
    time_ns_t since_ns{0};  // on the monotonic clock
    bool is_off{false};     // it was called off: its requester was answered
  };

  static constexpr const char* kCalledOff =
      "the change was called off while it was prepared; nothing was changed";

  /// `name`: "configure", ...; a hook that calls another one is the present one again when that ends.
  RunningHook(const char* name, const std::string& part);
  ~RunningHook();
  RunningHook(const RunningHook&) = delete;
  RunningHook& operator=(const RunningHook&) = delete;

  /// The hook has returned: from here on it cannot be called off. Throws Error (wrong_revision) where it was.
  void leave();

  /// What that thread executes now.
  static Facts of(std::thread::id thread);
  /// While that thread executes a hook, and only then: calls `decide`, and if that returns true the hook is called off: leave()
  /// throws. Whether it was called off. No hook of any thread begins or ends while `decide` runs.
  static bool call_off(std::thread::id thread, const std::function<bool()>& decide);

 private:
  bool end() noexcept;

  Facts outer_;
  bool has_ended_{false};
};

}  // namespace mauve
