// SPDX-License-Identifier: LGPL-3.0-or-later
// Console: the process's log lines, written by a thread of its own, so that a terminal or pipe that nobody reads blocks no
// other thread.
#pragma once

#include <cstdint>

#include "mauve_rt/base/time.hpp"

namespace mauve::bridge {

/// One for the process, for as long as it lives. All functions [non-rt].
class Console {
 public:
  /// From here on each line that the process logs goes to whom it went before and, in addition, to the console. Once, after
  /// rcl has configured its logging, without a console (`--disable-stdout-logs`).
  static void start();
  /// Waits until all lines are written, at most so long. False: nobody reads them.
  static bool flush(time_ns_t timeout_ns) noexcept;
  /// Lines that were left out, because too many waited to be written.
  static std::uint64_t dropped() noexcept;
};

}  // namespace mauve::bridge
