// SPDX-License-Identifier: LGPL-3.0-or-later
// OutputWatch: checks each value that a write port is about to write.
#pragma once

#include "mauve_rt/base/rt.hpp"

namespace mauve {

class OutputWatch {
 public:
  OutputWatch() = default;
  virtual ~OutputWatch() = default;
  OutputWatch(const OutputWatch&) = delete;
  OutputWatch& operator=(const OutputWatch&) = delete;

  /// Whether the port writes the value; a value that the watch refuses is dropped. [rt], on the thread that writes.
  virtual bool admits(const void* value) MAUVE_RT = 0;
};

}  // namespace mauve
