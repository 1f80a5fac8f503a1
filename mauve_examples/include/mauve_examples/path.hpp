// SPDX-License-Identifier: LGPL-3.0-or-later
// The points a robot goes through, one after the other.
#pragma once

#include <cstddef>
#include <vector>

#include "mauve_examples/types.hpp"

namespace mauve_examples {

/// A list of waypoints of fixed capacity and how many of them are behind the robot. Not thread-safe.
class Path {
 public:
  static constexpr std::size_t kCapacity = 2048;

  /// Allocates. [setup]
  void configure() { points_.reserve(kCapacity); }

  /// [rt]
  void clear() noexcept {
    points_.clear();
    next_ = 0;
    length_m_ = 0.0;
  }
  /// Appends; false when full: a path that long is cut, and planned anew at its end. [rt]
  bool push_back(const Point& point) noexcept {
    if (points_.size() == kCapacity) return false;
    points_.push_back(point);  // within what configure() reserved
    return true;
  }
  bool finished() const noexcept { return next_ >= points_.size(); }
  /// The waypoint to go to; only while not finished. [rt]
  const Point& target() const noexcept { return points_[next_]; }
  /// The waypoint to go to is reached. [rt]
  void advance() noexcept { ++next_; }

  const std::vector<Point>& points() const noexcept { return points_; }
  std::size_t next() const noexcept { return next_; }
  double length_m() const noexcept { return length_m_; }
  void set_length_m(double length_m) noexcept { length_m_ = length_m; }

 private:
  std::vector<Point> points_;
  std::size_t next_{0};
  double length_m_{0.0};
};

}  // namespace mauve_examples
