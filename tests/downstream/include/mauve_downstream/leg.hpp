// SPDX-License-Identifier: LGPL-3.0-or-later
// A struct of this package, which is its message, too: the state of a leg.
#pragma once

#include <array>

#include <mauve_rt/data/cdr.hpp>
#include <mauve_types/geometry_msgs/msg/point.hpp>

namespace mauve_downstream {

struct Joint {
  double angle{};
  bool is_hot{};
};

struct Leg {
  mauve::BoundedString<16> name;
  mauve::msg::geometry_msgs::Point foot;
  mauve::BoundedVector<double, 3> torque;
  std::array<Joint, 2> joints;
};

}  // namespace mauve_downstream

MAUVE_TYPE(mauve_downstream::Joint, "mauve_downstream/msg/Joint", angle, is_hot)
MAUVE_TYPE(mauve_downstream::Leg, "mauve_downstream/msg/Leg", name, foot, torque, joints)
