// SPDX-License-Identifier: LGPL-3.0-or-later
// PortTap: receives each value that a read port has read, or that a write port is about to write.
#pragma once

#include "mauve_rt/base/rt.hpp"
#include "mauve_rt/data/service.hpp"

namespace mauve {

class PortTap {
 public:
  PortTap() = default;
  virtual ~PortTap() = default;
  PortTap(const PortTap&) = delete;
  PortTap& operator=(const PortTap&) = delete;

  /// A read has found this; with status none the value has no meaning. [rt], on the thread that reads.
  virtual void on_read(const void* value, DataStatus status, time_ns_t time_ns) MAUVE_RT = 0;
  /// A write begins. [rt], on the thread that writes.
  virtual void on_write(const void* value) MAUVE_RT = 0;
};

}  // namespace mauve
