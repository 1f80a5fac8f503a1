// SPDX-License-Identifier: LGPL-3.0-or-later
// When the safe message of an output is sent again: by the bridge after a stop, by the sentinel after a crash.
#pragma once

#include <array>
#include <cstddef>

#include "mauve_rt/base/time.hpp"

namespace mauve::bridge {

// Of a best-effort topic, after its first message: a loss that lasts for some ms does not take them all.
inline constexpr std::array kCopies{ms_to_ns(5), ms_to_ns(20)};
// Of a reliable topic, while it is not acknowledged: only a message makes the middleware report soon what it has sent, else
// listeners ask for a lost one seconds later. So long takes an acknowledgement; and as often as a bad cable needs.
inline constexpr time_ns_t kRepairEvery = ms_to_ns(10);
inline constexpr std::size_t kRepairs = 20;

/// How long after the first message the next copy is due, when so many were sent; kForever: there is none. [non-rt]
inline time_ns_t copy_after_ns(bool is_reliable, std::size_t copies) noexcept {
  if (is_reliable) return copies < kRepairs ? static_cast<time_ns_t>(copies + 1) * kRepairEvery : kForever;
  return copies < kCopies.size() ? kCopies[copies] : kForever;
}

}  // namespace mauve::bridge
