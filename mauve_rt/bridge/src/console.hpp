// SPDX-License-Identifier: LGPL-3.0-or-later
// Console: a thread of its own writes the process's log lines, so that a terminal or pipe that is not read blocks no other
// thread.
#pragma once

#include "mauve_rt/base/time.hpp"

namespace mauve::bridge {

/// One for the process, for as long as it lives. All functions [non-rt].
class Console {
 public:
  /// From here on each line that the process logs goes to the handler before this one and, in addition, to the console. Once, after
  /// rcl has configured its logging, without a console (`--disable-stdout-logs`).
  static void start();
  /// Waits until all lines are written, at most so long. False: the console is not read.
  static bool flush(time_ns_t timeout_ns) noexcept;
};

}  // namespace mauve::bridge
