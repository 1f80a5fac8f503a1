// SPDX-License-Identifier: LGPL-3.0-or-later
// RunningHook: user code that an ordinary thread executes now.
#pragma once

#include <string>
#include <thread>

#include "mauve_rt/base/time.hpp"

namespace mauve {

/// While it lives its thread executes a hook of a part, which may hang: an open change reports it. What the thread of a component
/// executes is in Task::state_age(). All functions [non-rt].
class RunningHook {
 public:
  struct Facts {
    std::string hook{};     // "configure of core my_robot/Pid"; empty: none
    time_ns_t since_ns{0};  // on the monotonic clock
  };

  /// `name`: "configure", ...; a hook that calls another one is the present one again when that ends.
  RunningHook(const char* name, const std::string& part);
  ~RunningHook();
  RunningHook(const RunningHook&) = delete;
  RunningHook& operator=(const RunningHook&) = delete;

  /// What that thread executes now.
  static Facts of(std::thread::id thread);

 private:
  Facts outer_;
};

}  // namespace mauve
