// SPDX-License-Identifier: LGPL-3.0-or-later
// What a port read last, kept in place with its writer's time.
#pragma once

#include "mauve_rt/base/rt.hpp"
#include "mauve_rt/data/port.hpp"

namespace mauve {

/// The newest sample of a read port, and its age: for components that pass on what others write.
template <Described T>
class LatestSample {
 public:
  /// Reads the port once. [rt]
  void update(ReadPort<T>& port) MAUVE_RT {
    time_ns_t time_ns = 0;
    const DataStatus status = port.read(value_, &time_ns);
    is_new_ = status == DataStatus::new_data;
    if (status == DataStatus::none) {
      has_value_ = false;
    } else if (is_new_ || time_ns != 0) {  // an emptied ring says `old`, and has no value to go with it
      has_value_ = true;
      time_ns_ = time_ns;
    }
  }
  /// Whether there is a value, not older at that instant than `max_age_ns` (0: of any age). [rt]
  bool is_fresh(time_ns_t now_ns, time_ns_t max_age_ns) const MAUVE_RT {
    return has_value_ && (max_age_ns == 0 || now_ns - time_ns_ <= max_age_ns);
  }
  /// Whether the last update found one that the port had not seen. [rt]
  bool is_new() const MAUVE_RT { return is_new_; }
  const T& value() const MAUVE_RT { return value_; }

 private:
  T value_{};
  time_ns_t time_ns_{0};
  bool has_value_{false};
  bool is_new_{false};
};

}  // namespace mauve
