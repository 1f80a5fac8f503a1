// SPDX-License-Identifier: LGPL-3.0-or-later
// The basic elements of the common types, for architecture files: mauve_rt/TwistRelay, mauve_rt/PoseFilterShell ...
// CMakeLists.txt lists the same types for the ament index.
#include "mauve_rt/elements/elements.hpp"

MAUVE_PLUGINS(registry) {
  using namespace mauve;
  registry.type<types::Vector3>();
  registry.type<types::Quaternion>();
  register_elements<types::Bool>(registry, "mauve_rt/Bool");
  register_elements<types::Int64>(registry, "mauve_rt/Int64");
  register_elements<types::Float64>(registry, "mauve_rt/Float64");
  register_elements<types::Point>(registry, "mauve_rt/Point");
  register_elements<types::Pose>(registry, "mauve_rt/Pose");
  register_elements<types::Pose2D>(registry, "mauve_rt/Pose2D");
  register_elements<types::Twist>(registry, "mauve_rt/Twist");
  register_element<PidCore>(registry, "mauve_rt/Pid");
  register_element<LimiterCore<types::Float64>>(registry, "mauve_rt/Float64Limiter");
  register_element<LimiterCore<types::Twist>>(registry, "mauve_rt/TwistLimiter");
  register_element<LowPassCore<types::Float64>>(registry, "mauve_rt/Float64LowPass");
  register_element<LowPassCore<types::Twist>>(registry, "mauve_rt/TwistLowPass");
}
