// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/data/transform.hpp"

#include <cmath>

namespace mauve {

namespace {

/// Below this angle (radians) an arc and its chord differ by less than the precision of a double.
constexpr double kSmallAngle = 1e-6;

Quaternion product(const Quaternion& a, const Quaternion& b) noexcept {
  return {.x = a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
          .y = a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x,
          .z = a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w,
          .w = a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z};
}

Quaternion mixed(const Quaternion& a, double of_a, const Quaternion& b, double of_b) noexcept {
  return {.x = of_a * a.x + of_b * b.x,
          .y = of_a * a.y + of_b * b.y,
          .z = of_a * a.z + of_b * b.z,
          .w = of_a * a.w + of_b * b.w};
}

Quaternion along_arc(const Quaternion& from, const Quaternion& to, double part) noexcept {
  const double dot = from.x * to.x + from.y * to.y + from.z * to.z + from.w * to.w;
  const double sign = dot < 0.0 ? -1.0 : 1.0;  // both q and -q are the rotation: take the nearer
  // The arc cosine of the dot product is not exact for small angles.
  const double angle = 2.0 * std::atan2(std::sqrt(squared_length(mixed(to, sign, from, -1.0))),
                                        std::sqrt(squared_length(mixed(to, sign, from, 1.0))));
  if (angle < kSmallAngle) return normalised(mixed(from, 1.0 - part, to, sign * part));
  const double whole = std::sin(angle);
  return normalised(
      mixed(from, std::sin((1.0 - part) * angle) / whole, to, sign * std::sin(part * angle) / whole));
}

}  // namespace

double squared_length(const Quaternion& rotation) noexcept {
  return rotation.x * rotation.x + rotation.y * rotation.y + rotation.z * rotation.z +
         rotation.w * rotation.w;
}

Quaternion normalised(const Quaternion& rotation) noexcept {
  return mixed(rotation, 1.0 / std::sqrt(squared_length(rotation)), rotation, 0.0);
}

bool is_finite(const Transform& transform) noexcept {
  const auto& [p, q] = transform;
  return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z) && std::isfinite(q.x) &&
         std::isfinite(q.y) && std::isfinite(q.z) && std::isfinite(q.w);
}

Vector3 rotate(const Quaternion& rotation, const Vector3& point) noexcept {
  const auto& [x, y, z, w] = rotation;
  const Vector3 twice{.x = 2.0 * (y * point.z - z * point.y),
                      .y = 2.0 * (z * point.x - x * point.z),
                      .z = 2.0 * (x * point.y - y * point.x)};
  return {.x = point.x + w * twice.x + y * twice.z - z * twice.y,
          .y = point.y + w * twice.y + z * twice.x - x * twice.z,
          .z = point.z + w * twice.z + x * twice.y - y * twice.x};
}

Transform compose(const Transform& outer, const Transform& inner) noexcept {
  const Vector3 turned = rotate(outer.rotation, inner.translation);
  return {.translation = {.x = outer.translation.x + turned.x,
                          .y = outer.translation.y + turned.y,
                          .z = outer.translation.z + turned.z},
          .rotation = product(outer.rotation, inner.rotation)};
}

Transform inverse(const Transform& transform) noexcept {
  const auto& [x, y, z, w] = transform.rotation;
  const Quaternion back{.x = -x, .y = -y, .z = -z, .w = w};
  const Vector3 turned = rotate(back, transform.translation);
  return {.translation = {.x = -turned.x, .y = -turned.y, .z = -turned.z}, .rotation = back};
}

Transform interpolate(const Transform& from, const Transform& to, double part) noexcept {
  const auto between = [part](double a, double b) noexcept { return a + part * (b - a); };
  return {.translation = {.x = between(from.translation.x, to.translation.x),
                          .y = between(from.translation.y, to.translation.y),
                          .z = between(from.translation.z, to.translation.z)},
          .rotation = along_arc(from.rotation, to.rotation, part)};
}

}  // namespace mauve
