// SPDX-License-Identifier: LGPL-3.0-or-later
// Values of messages in another frame: points, vectors, rotations, poses, twists and wrenches, also stamped and with covariance.
#pragma once

#include <array>
#include <concepts>
#include <cstddef>
#include <string_view>

#include "mauve_rt/base/rt.hpp"
#include "mauve_rt/data/cdr.hpp"
#include "mauve_rt/data/transform.hpp"

namespace mauve {

/// A 6 by 6 covariance by rows, as messages have it.
using Covariance = std::array<double, 36>;

/// The same rotation seen from the frame that the transform leads to. [rt]
Quaternion turned(const Quaternion& by, const Quaternion& rotation) MAUVE_RT;
/// A velocity of a rigid body, at the origin of its frame, becomes the velocity of the same body at the origin of the other frame
/// (the adjoint, as KDL has it): angular' = R angular, linear' = R linear + t x angular'. [rt]
void transform_twist(const Transform& by, Vector3& linear, Vector3& angular) MAUVE_RT;
/// A force and a torque about the origin of the frame become the same force and the torque about the origin of the other frame:
/// force' = R force, torque' = R torque + t x force'. [rt]
void transform_wrench(const Transform& by, Vector3& force, Vector3& torque) MAUVE_RT;
/// Of a pose: position, then rotation about the fixed axes: C' = diag(R, R) C diag(R, R)^T. [rt]
void transform_pose_covariance(const Transform& by, Covariance& covariance) MAUVE_RT;
/// Of a twist: linear, then angular: C' = A C A^T, where A is the adjoint. [rt]
void transform_twist_covariance(const Transform& by, Covariance& covariance) MAUVE_RT;

namespace detail {

template <typename T>
concept HasXyz = requires(T value) {
  { value.x } -> std::convertible_to<double>;
  { value.y } -> std::convertible_to<double>;
  { value.z } -> std::convertible_to<double>;
};
template <typename T>
concept HasXyzw = HasXyz<T> && requires(T value) { value.w; };
/// geometry_msgs has the same fields in points and vectors: the name of its type marks a vector.
template <typename T>
concept IsVector = HasXyz<T> && !HasXyzw<T> && requires { TypeTraits<T>::name; } &&
                   std::string_view(TypeTraits<T>::name).ends_with("Vector3");

template <HasXyz T>
Vector3 as_vector(const T& value) MAUVE_RT {
  return {.x = static_cast<double>(value.x),
          .y = static_cast<double>(value.y),
          .z = static_cast<double>(value.z)};
}
template <HasXyz T>
void put_vector(T& value, const Vector3& vector) MAUVE_RT {
  value.x = static_cast<decltype(value.x)>(vector.x);
  value.y = static_cast<decltype(value.y)>(vector.y);
  value.z = static_cast<decltype(value.z)>(vector.z);
}
template <HasXyz T>
void move_point(const Transform& by, T& value) MAUVE_RT {
  const Vector3 turned = rotate(by.rotation, as_vector(value));
  put_vector(
      value,
      {.x = turned.x + by.translation.x, .y = turned.y + by.translation.y, .z = turned.z + by.translation.z});
}
template <HasXyzw T>
void turn(const Transform& by, T& value) MAUVE_RT {
  const Quaternion rotation = turned(by.rotation, {.x = value.x, .y = value.y, .z = value.z, .w = value.w});
  put_vector(value, {.x = rotation.x, .y = rotation.y, .z = rotation.z});
  value.w = static_cast<decltype(value.w)>(rotation.w);
}
template <typename Move, HasXyz T>
void move_pair(const Transform& by, T& first, T& second, const Move& move) MAUVE_RT {
  Vector3 one = as_vector(first), other = as_vector(second);
  move(by, one, other);
  put_vector(first, one);
  put_vector(second, other);
}
template <typename Move, typename Matrix>
void move_covariance(const Transform& by, Matrix& matrix, const Move& move) MAUVE_RT {
  Covariance covariance;
  for (std::size_t place = 0; place < covariance.size(); ++place) covariance[place] = matrix[place];
  move(by, covariance);
  for (std::size_t place = 0; place < covariance.size(); ++place) matrix[place] = covariance[place];
}

}  // namespace detail

/// The value as seen from the frame that the transform leads to: by its fields, as geometry_msgs names them. [rt]
/// A header is left as it is.
template <typename T>
void transform_value(const Transform& by, T& value) MAUVE_RT {
  if constexpr (requires { value.pose; }) {
    transform_value(by, value.pose);
    if constexpr (requires { value.covariance[35]; })
      detail::move_covariance(by, value.covariance, transform_pose_covariance);
  } else if constexpr (requires { value.twist; }) {
    transform_value(by, value.twist);
    if constexpr (requires { value.covariance[35]; })
      detail::move_covariance(by, value.covariance, transform_twist_covariance);
  } else if constexpr (requires { value.position, value.orientation; }) {
    detail::move_point(by, value.position);
    detail::turn(by, value.orientation);
  } else if constexpr (requires { value.linear, value.angular; }) {
    detail::move_pair(by, value.linear, value.angular, transform_twist);
  } else if constexpr (requires { value.force, value.torque; }) {
    detail::move_pair(by, value.force, value.torque, transform_wrench);
  } else if constexpr (requires { value.point; }) {
    transform_value(by, value.point);
  } else if constexpr (requires { value.vector; }) {
    detail::put_vector(value.vector, rotate(by.rotation, detail::as_vector(value.vector)));
  } else if constexpr (requires { value.wrench; }) {
    transform_value(by, value.wrench);
  } else if constexpr (requires { value.quaternion; }) {
    transform_value(by, value.quaternion);
  } else if constexpr (detail::HasXyzw<T>) {
    detail::turn(by, value);
  } else if constexpr (detail::IsVector<T>) {
    detail::put_vector(value, rotate(by.rotation, detail::as_vector(value)));
  } else {
    static_assert(detail::HasXyz<T>, "no pose, point, vector, rotation, twist or wrench is in this type");
    detail::move_point(by, value);
  }
}

}  // namespace mauve
