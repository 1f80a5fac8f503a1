// SPDX-License-Identifier: LGPL-3.0-or-later
// The instant at which a message was sent, and its number, in a geometry_msgs/Point.
#pragma once

#include <cstdint>

#include "mauve_rt/base/time.hpp"

namespace bench {

/// Fills a Point of whatever struct: x and y are the seconds and nanoseconds of CLOCK_MONOTONIC, z is the number. Doubles
/// hold all three exactly.
template <typename Point>
void stamp(Point& point, mauve::time_ns_t instant_ns, std::int64_t number) {
  point.x = static_cast<double>(instant_ns / mauve::s_to_ns(1));
  point.y = static_cast<double>(instant_ns % mauve::s_to_ns(1));
  point.z = static_cast<double>(number);
}

/// The instant that was put into it.
template <typename Point>
mauve::time_ns_t instant_of(const Point& point) {
  return mauve::s_to_ns(static_cast<std::int64_t>(point.x)) + static_cast<std::int64_t>(point.y);
}

}  // namespace bench
