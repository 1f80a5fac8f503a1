// SPDX-License-Identifier: LGPL-3.0-or-later
// The clock of a shadow: time that stands still while the candidate executes.
#pragma once

#include "mauve_rt/run/shadow.hpp"

namespace mauve {

class Shadow::StillClock final : public Clock {
 public:
  time_ns_t now_ns() const noexcept override { return now_ns_; }
  bool sleep_until(time_ns_t, const Atomic<std::uint32_t>&, std::uint32_t) const noexcept override {
    return false;
  }
  /// Is noted, and no time passes by it. [rt]
  void spend(time_ns_t declared_ns) const noexcept override { spent_ns_ = later_by(spent_ns_, declared_ns); }

  void set_now(time_ns_t instant_ns) noexcept {
    now_ns_ = instant_ns;
    spent_ns_ = 0;
  }
  /// What the states since set_now() declare. [rt]
  time_ns_t spent_ns() const MAUVE_RT { return spent_ns_; }

 private:
  time_ns_t now_ns_{0};
  mutable time_ns_t spent_ns_{0};  // a clock is const to the machine that lives by it
};

}  // namespace mauve
