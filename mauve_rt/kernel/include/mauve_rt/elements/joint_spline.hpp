// SPDX-License-Identifier: LGPL-3.0-or-later
// Interpolation of one joint between two points of a trajectory.
#pragma once

#include "mauve_rt/base/rt.hpp"

namespace mauve {

/// The motion of a joint at one instant: rad, or m of a prismatic joint, and s.
struct JointMotion {
  double position{0.0};
  double velocity{0.0};
  double acceleration{0.0};
};

/// By what both ends have: positions; velocities, too; accelerations, too.
enum class SplineOrder : unsigned char { linear, cubic, quintic };

/// The motion `at_s` after `from`, of the polynomial that reaches `to` after `duration_s` > 0. [rt]
inline JointMotion interpolate(const JointMotion& from, const JointMotion& to, double duration_s, double at_s,
                               SplineOrder order) MAUVE_RT {
  // In u = at / duration, from 0 to 1: position = p0 + c1 u + ... + c5 u^5.
  const double u = at_s / duration_s;
  const double way = to.position - from.position;
  const double v0 = from.velocity * duration_s;
  const double v1 = to.velocity * duration_s;
  const double a0 = from.acceleration * duration_s * duration_s;
  const double a1 = to.acceleration * duration_s * duration_s;
  double c1 = way;
  double c2 = 0.0;
  double c3 = 0.0;
  double c4 = 0.0;
  double c5 = 0.0;
  if (order == SplineOrder::cubic) {
    c1 = v0;
    c2 = 3.0 * way - 2.0 * v0 - v1;
    c3 = -2.0 * way + v0 + v1;
  } else if (order == SplineOrder::quintic) {
    c1 = v0;
    c2 = a0 / 2.0;
    c3 = 10.0 * way - 6.0 * v0 - 4.0 * v1 - 1.5 * a0 + 0.5 * a1;
    c4 = -15.0 * way + 8.0 * v0 + 7.0 * v1 + 1.5 * a0 - a1;
    c5 = 6.0 * way - 3.0 * v0 - 3.0 * v1 - 0.5 * a0 + 0.5 * a1;
  }
  const double position = from.position + u * (c1 + u * (c2 + u * (c3 + u * (c4 + u * c5))));
  const double velocity = c1 + u * (2.0 * c2 + u * (3.0 * c3 + u * (4.0 * c4 + u * 5.0 * c5)));
  const double acceleration = 2.0 * c2 + u * (6.0 * c3 + u * (12.0 * c4 + u * 20.0 * c5));
  return {position, velocity / duration_s, acceleration / (duration_s * duration_s)};
}

}  // namespace mauve
