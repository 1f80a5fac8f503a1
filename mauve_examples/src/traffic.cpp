// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_examples/traffic.hpp"

#include <algorithm>
#include <cmath>

#include "mauve_examples/disc_collision.hpp"
#include "mauve_examples/nearest_cell.hpp"

namespace mauve_examples {

namespace {

constexpr double kStep_m = 0.1;    // between places that are looked at; no wall fits between them unseen
constexpr double kMoved_m = 0.15;  // less may be an error of sight
constexpr double kHardly_m = 0.1;  // less is standing still
constexpr double kClear_m = 0.6;   // between the centres of two robots that pass
constexpr double kBeside_m = 0.3;
constexpr double kOutOfWay_m = 0.9;  // farther from a robot's way there is nothing to gain
constexpr double kWayAhead_m = 4.0;  // how far on a robot is expected to want to go
constexpr double kWayCost = 0.08;    // a metre to drive is worth so many of distance

double distance_to_segment_m(const Point& place, const Point& from, const Direction& way,
                             double length_m) noexcept {
  const double along_m = std::clamp((place.x - from.x) * way.x + (place.y - from.y) * way.y, 0.0, length_m);
  return std::hypot(place.x - from.x - along_m * way.x, place.y - from.y - along_m * way.y);
}

}  // namespace

void Traffic::configure(const GridGeometry& geometry, std::uint8_t number, const TrafficOptions& options) {
  geometry_ = geometry;
  number_ = number;
  options_ = options;
  others_.fill(Other{});
  drawn_.clear();
  side_ = 2 * static_cast<int>(std::ceil(options.refuge_reach_m / kStep_m)) + 1;
  const auto places = static_cast<std::size_t>(side_) * static_cast<std::size_t>(side_);
  visited_.assign(places, 0);
  queue_.assign(places, 0);
  steps_.assign(places, 0);
}

void Traffic::see(const Scan& scan, const Pose2D& pose, std::int64_t now_ns) noexcept {
  now_ns_ = now_ns;
  pose_ = pose;
  if (distance_m(pose, stood_at_) > kHardly_m) {
    stood_at_ = {pose.x, pose.y, 0.0};
    stands_since_ns_ = now_ns;
  }
  robots_in_sight(scan, pose, sightings_);
  for (const Sighting& sighting : sightings_) {
    Other& other = others_[sighting.number];
    if (!in_sight(other)) other.anchor = sighting.at;
    other.at = sighting.at;
    other.seen_at_ns = now_ns;
    const double moved_m = distance_m(other.at, other.anchor);
    if (moved_m < kMoved_m) continue;
    other.way = {(other.at.x - other.anchor.x) / moved_m, (other.at.y - other.anchor.y) / moved_m};
    other.anchor = other.at;
    other.moved_at_ns = now_ns;
  }
}

void Traffic::draw(std::span<std::int8_t> cells) noexcept {
  for (std::size_t number = 1; number < others_.size(); ++number) {
    const Other& other = others_[number];
    if (!in_sight(other) || distance_m(other.at, pose_) > options_.heed_m) continue;
    // One that has to go around this robot is none to go around, as long as it does.
    if (moving(other) && number > number_) continue;
    draw_disc(cells, other.at);
    for (double ahead_m = kStep_m; moving(other) && ahead_m <= options_.lane_m; ahead_m += kStep_m) {
      const Point ahead{other.at.x + ahead_m * other.way.x, other.at.y + ahead_m * other.way.y, 0.0};
      if (distance_m(ahead, pose_) < options_.berth_m + kRobotRadius_m) break;
      draw_disc(cells, ahead);
    }
  }
}

void Traffic::erase(std::span<std::int8_t> cells, std::span<const std::int8_t> map) noexcept {
  for (const Point& at : drawn_)
    for_each_cell_of_disc(at, [&](std::size_t index) { cells[index] = map[index]; });
  drawn_.clear();
}

void Traffic::draw_disc(std::span<std::int8_t> cells, const Point& at) noexcept {
  if (!drawn_.push_back(at)) return;
  for_each_cell_of_disc(at, [&](std::size_t index) { cells[index] = kOccupied; });
}

template <typename Visit>
void Traffic::for_each_cell_of_disc(const Point& at, Visit&& visit) const {
  const Cell low = geometry_.cell_at(at.x - options_.berth_m, at.y - options_.berth_m);
  const Cell high = geometry_.cell_at(at.x + options_.berth_m, at.y + options_.berth_m);
  for (int row = low.row; row <= high.row; ++row) {
    for (int column = low.column; column <= high.column; ++column) {
      const Cell cell{column, row};
      if (!geometry_.contains(cell) || distance_m(geometry_.centre(cell), at) > options_.berth_m) continue;
      visit(geometry_.index(cell));
    }
  }
}

bool Traffic::must_back_off(bool has_path) noexcept {
  const double near_m = has_path ? options_.near_m : options_.idle_near_m;
  bool jammed = false;
  goes_first_ = true;
  for (std::size_t number = 1; number < others_.size(); ++number) {
    if (!in_sight(others_[number]) || distance_m(others_[number].at, pose_) > near_m) continue;
    jammed = true;
    goes_first_ = goes_first_ && number > number_;
  }
  const std::int64_t patience_ns = has_path && goes_first_ ? options_.right_of_way_ns : options_.patience_ns;
  if (!jammed || now_ns_ - stands_since_ns_ < patience_ns) return false;
  stands_since_ns_ = now_ns_;
  return true;
}

std::optional<Point> Traffic::refuge(std::span<const std::int8_t> cells) noexcept {
  std::fill(visited_.begin(), visited_.end(), 0);
  const auto side = static_cast<std::uint32_t>(side_);
  const std::uint32_t middle = side / 2 * side + side / 2;
  const auto place = [&](std::uint32_t index) {
    return Point{pose_.x + (static_cast<int>(index % side) - side_ / 2) * kStep_m,
                 pose_.y + (static_cast<int>(index / side) - side_ / 2) * kStep_m, 0.0};
  };
  std::optional<Point> best;
  double most_m = worth(place(middle), 0.0) + kHardly_m;
  std::size_t size = 1;
  queue_[0] = middle;
  steps_[0] = 0;
  visited_[middle] = 1;
  for (std::size_t done = 0; done < size; ++done) {  // breadth first: the nearest places first
    const std::uint32_t index = queue_[done];
    const double way_m = steps_[done] * kStep_m;
    const double worth_m = worth(place(index), way_m);
    if (worth_m > most_m) {
      most_m = worth_m;
      best = place(index);
    }
    const std::uint32_t column = index % side;
    const std::uint32_t row = index / side;
    if (column == 0 || row == 0 || column + 1 == side || row + 1 == side) continue;
    for (const std::uint32_t next : {index - 1, index + 1, index - side, index + side}) {
      if (visited_[next] != 0) continue;
      visited_[next] = 1;
      if (!roomy(cells, place(next))) continue;
      queue_[size] = next;
      steps_[size++] = static_cast<std::uint16_t>(steps_[done] + 1);
    }
  }
  return best;
}

bool Traffic::roomy(std::span<const std::int8_t> cells, const Point& at) const noexcept {
  const Cell cell = geometry_.cell_at(at.x, at.y);
  if (!geometry_.contains(cell) || cells[geometry_.index(cell)] != kFree) return false;
  for (std::size_t number = 1; number < others_.size(); ++number) {
    const Other& other = others_[number];
    const double away_m = distance_m(other.at, at);
    if (!in_sight(other) || away_m >= kClear_m) continue;
    // Beside a robot it may only go away.
    if (distance_m(at, pose_) > kBeside_m || away_m < distance_m(other.at, pose_)) return false;
  }
  const int reach = cells_of(geometry_, kRobotRadius_m) + 1;
  const auto obstacle = nearest_cell(geometry_, cell, reach,
                                     [&](Cell near) { return cells[geometry_.index(near)] == kOccupied; });
  return !obstacle || std::hypot(obstacle->column - cell.column, obstacle->row - cell.row) > reach;
}

double Traffic::worth(const Point& place, double way_m) const noexcept {
  double apart_m = kOutOfWay_m;
  for (const Other& other : others_) {
    if (!in_sight(other) || distance_m(other.at, pose_) > options_.heed_m) continue;
    const double away_m = std::max(1e-6, distance_m(other.at, pose_));
    // One that stands wants to get past this robot, if anywhere.
    const Direction past{(pose_.x - other.at.x) / away_m, (pose_.y - other.at.y) / away_m};
    const Direction& way = moving(other) ? other.way : past;
    apart_m = std::min(apart_m, distance_to_segment_m(place, other.at, way, kWayAhead_m));
  }
  return apart_m - kWayCost * way_m;
}

}  // namespace mauve_examples
