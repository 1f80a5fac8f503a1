// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/data/transformed_values.hpp"

namespace mauve {

namespace {

constexpr std::size_t kSize = 6;
using Matrix = std::array<std::array<double, kSize>, kSize>;

Vector3 cross(const Vector3& a, const Vector3& b) noexcept {
  return {.x = a.y * b.z - a.z * b.y, .y = a.z * b.x - a.x * b.z, .z = a.x * b.y - a.y * b.x};
}

Vector3 sum(const Vector3& a, const Vector3& b) noexcept {
  return {.x = a.x + b.x, .y = a.y + b.y, .z = a.z + b.z};
}

/// The columns of a linear map of two vectors.
template <typename Map>
Matrix matrix_of(const Map& map) noexcept {
  Matrix matrix{};
  for (std::size_t column = 0; column < kSize; ++column) {
    std::array<double, kSize> unit{};
    unit[column] = 1.0;
    Vector3 first{.x = unit[0], .y = unit[1], .z = unit[2]};
    Vector3 second{.x = unit[3], .y = unit[4], .z = unit[5]};
    map(first, second);
    const std::array<double, kSize> image{first.x, first.y, first.z, second.x, second.y, second.z};
    for (std::size_t row = 0; row < kSize; ++row) matrix[row][column] = image[row];
  }
  return matrix;
}

/// M C M^T.
void map_covariance(const Matrix& map, Covariance& covariance) noexcept {
  Matrix half{};
  for (std::size_t row = 0; row < kSize; ++row) {
    for (std::size_t column = 0; column < kSize; ++column) {
      for (std::size_t k = 0; k < kSize; ++k)
        half[row][column] += map[row][k] * covariance[k * kSize + column];
    }
  }
  for (std::size_t row = 0; row < kSize; ++row) {
    for (std::size_t column = 0; column < kSize; ++column) {
      double entry = 0.0;
      for (std::size_t k = 0; k < kSize; ++k) entry += half[row][k] * map[column][k];
      covariance[row * kSize + column] = entry;
    }
  }
}

}  // namespace

Quaternion turned(const Quaternion& by, const Quaternion& rotation) noexcept {
  return compose({.rotation = by}, {.rotation = rotation}).rotation;
}

void transform_twist(const Transform& by, Vector3& linear, Vector3& angular) noexcept {
  angular = rotate(by.rotation, angular);
  linear = sum(rotate(by.rotation, linear), cross(by.translation, angular));
}

void transform_wrench(const Transform& by, Vector3& force, Vector3& torque) noexcept {
  force = rotate(by.rotation, force);
  torque = sum(rotate(by.rotation, torque), cross(by.translation, force));
}

void transform_pose_covariance(const Transform& by, Covariance& covariance) noexcept {
  map_covariance(matrix_of([&](Vector3& position, Vector3& rotation) {
                   position = rotate(by.rotation, position);
                   rotation = rotate(by.rotation, rotation);
                 }),
                 covariance);
}

void transform_twist_covariance(const Transform& by, Covariance& covariance) noexcept {
  map_covariance(matrix_of([&](Vector3& linear, Vector3& angular) { transform_twist(by, linear, angular); }),
                 covariance);
}

}  // namespace mauve
