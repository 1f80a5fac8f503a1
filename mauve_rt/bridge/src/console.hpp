// SPDX-License-Identifier: LGPL-3.0-or-later
// Console: a thread of its own writes the process's log lines, so that a terminal or pipe that is not read blocks no other
// thread.
#pragma once

#include <cstddef>
#include <string>

#include "mauve_rt/base/time.hpp"

namespace mauve::bridge {

/// Where in the code a line was written.
struct LinePlace {
  std::string function{};
  std::string file{};
  std::size_t number{0};
};

/// One for the process, for as long as it lives. All functions [non-rt].
class Console {
 public:
  /// From here on each line that the process logs goes to the handler before this one and, in addition, to the console. Once, after
  /// rcl has configured its logging, without a console (`--disable-stdout-logs`).
  static void start();
  /// Writes a line with a time of its own (CLOCK_REALTIME), to /rosout and the console; severity as of rcutils. Its level is not
  /// compared with that of the logger.
  static void write(int severity, const std::string& name, time_ns_t time_ns, const std::string& text,
                    const LinePlace& place);
  /// Waits until all lines are written, at most so long. False: the console is not read.
  static bool flush(time_ns_t timeout_ns) noexcept;
};

}  // namespace mauve::bridge
