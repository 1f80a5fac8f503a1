// SPDX-License-Identifier: LGPL-3.0-or-later
// Rigid transforms: their values, products, inverses and interpolation.
#pragma once

#include "mauve_rt/base/rt.hpp"
#include "mauve_rt/data/cdr.hpp"

namespace mauve {

struct Vector3 {
  double x{0.0};
  double y{0.0};
  double z{0.0};
};

struct Quaternion {
  double x{0.0};
  double y{0.0};
  double z{0.0};
  double w{1.0};
};

/// Turns a point, then moves the point: parent = rotation * child + translation. The rotation has length 1.
struct Transform {
  Vector3 translation{};
  Quaternion rotation{};
};

}  // namespace mauve

MAUVE_TYPE(mauve::Vector3, "geometry_msgs/msg/Vector3", x, y, z)
MAUVE_TYPE(mauve::Quaternion, "geometry_msgs/msg/Quaternion", x, y, z, w)
MAUVE_TYPE(mauve::Transform, "geometry_msgs/msg/Transform", translation, rotation)

namespace mauve {

/// The square of the length. [rt]
double squared_length(const Quaternion& rotation) MAUVE_RT;
/// The same rotation with length 1; `rotation` is not zero. [rt]
Quaternion normalised(const Quaternion& rotation) MAUVE_RT;
/// Whether no number is infinite or NaN. [rt]
bool is_finite(const Transform& transform) MAUVE_RT;
/// The turned point. [rt]
Vector3 rotate(const Quaternion& rotation, const Vector3& point) MAUVE_RT;
/// First `inner`, then `outer`. [rt]
Transform compose(const Transform& outer, const Transform& inner) MAUVE_RT;
/// [rt]
Transform inverse(const Transform& transform) MAUVE_RT;
/// Between two transforms, linear in the translation and along the shorter arc of the rotation. [rt]
/// `part` is 0 at `from` and 1 at `to`.
Transform interpolate(const Transform& from, const Transform& to, double part) MAUVE_RT;

}  // namespace mauve
