// SPDX-License-Identifier: LGPL-3.0-or-later
// Common types for robotic applications: the ROS messages that most components exchange, declared once for all.
#pragma once

#include <cstdint>

#include "mauve_rt/data/cdr.hpp"
#include "mauve_rt/data/transform.hpp"

/// A type's identity is its name and its layout: ports of these structs connect to any other ones of the same message that have
/// the same fields in the same places. Units as in ROS: m, rad, m/s, rad/s.
namespace mauve::types {

struct Bool {
  bool data{false};
};

struct Int64 {
  std::int64_t data{0};
};

struct Float64 {
  double data{0.0};
};

struct Point {
  double x{0.0};
  double y{0.0};
  double z{0.0};
};

using mauve::Quaternion;
using mauve::Vector3;

struct Pose {
  Point position;
  Quaternion orientation;
};

struct Pose2D {
  double x{0.0};
  double y{0.0};
  double theta{0.0};
};

struct Twist {
  Vector3 linear;
  Vector3 angular;
};

}  // namespace mauve::types

MAUVE_TYPE(mauve::types::Bool, "std_msgs/msg/Bool", data)
MAUVE_TYPE(mauve::types::Int64, "std_msgs/msg/Int64", data)
MAUVE_TYPE(mauve::types::Float64, "std_msgs/msg/Float64", data)
MAUVE_TYPE(mauve::types::Point, "geometry_msgs/msg/Point", x, y, z)
MAUVE_TYPE(mauve::types::Pose, "geometry_msgs/msg/Pose", position, orientation)
MAUVE_TYPE(mauve::types::Pose2D, "geometry_msgs/msg/Pose2D", x, y, theta)
MAUVE_TYPE(mauve::types::Twist, "geometry_msgs/msg/Twist", linear, angular)
