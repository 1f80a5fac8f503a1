// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_examples/pilot.hpp"

namespace mauve_examples {

namespace {

constexpr double kLookAhead_m = 4.0;
constexpr std::int64_t kPatience_ns = 2'000'000'000;
constexpr std::int64_t kBackOff_ns = 4'000'000'000;  // time for the other to pass
// And for one that had no other way but this one's, which goes first.
constexpr std::int64_t kLongBackOff_ns = 10'000'000'000;

}  // namespace

void Pilot::configure(const GridGeometry& geometry, std::uint8_t number) {
  navigator_.configure(geometry, PlanOptions{});
  traffic_.configure(geometry, number, TrafficOptions{});
  geometry_ = geometry;
  changes_.configure(geometry.tile_count());
  map_.assign(geometry.cell_count(), kUnknown);
  cells_ = map_;
  has_goal_ = wants_path_ = makes_room_ = false;
}

void Pilot::read_map(const OccupancyGrid& map) noexcept {
  const auto columns = static_cast<std::size_t>(geometry_.tile_columns());
  changes_.collect(map, [&](std::size_t tile) {
    for_each_tile_cell(geometry_, static_cast<int>(tile % columns), static_cast<int>(tile / columns),
                       [&](Cell cell, std::size_t) {
                         const std::size_t index = geometry_.index(cell);
                         map_[index] = cells_[index] = map.cells()[index];
                       });
    return true;
  });
}

void Pilot::set_goal(const Point& goal) noexcept {
  if (!has_goal_ || distance_m(goal, goal_) > 0.0) wants_path_ = was_on_its_way_ = true;
  has_goal_ = true;
  goal_ = goal;
}

void Pilot::look(const Scan& scan, const Pose2D& pose, std::int64_t now_ns) noexcept {
  const bool backed_off = backing_off() && was_on_its_way_;
  now_ns_ = now_ns;
  pose_ = pose;
  if (backed_off && !backing_off()) wants_path_ = true;
  traffic_.erase(cells_, map_);
  traffic_.see(scan, pose, now_ns);
  traffic_.draw(cells_);
  const bool blocked = has_path() && navigator_.blocked(cells_, pose, kLookAhead_m);
  if (navigator_.stalled(pose, now_ns, kPatience_ns) || blocked) wants_path_ = true;
  const bool on_its_way = has_path() || wants_path_;
  makes_room_ = traffic_.must_back_off(on_its_way);
  if (!makes_room_) return;
  if (!backing_off()) was_on_its_way_ = on_its_way;
  wants_path_ = true;
}

PlanStatus Pilot::plan(double path_step_m) noexcept {
  wants_path_ = false;
  if (makes_room_) {
    makes_room_ = false;
    back_off_until_ns_ = 0;
    const auto refuge = traffic_.refuge(map_);
    if (refuge && navigator_.plan(cells_, pose_, *refuge, path_step_m) == PlanStatus::found) {
      back_off_until_ns_ =
          now_ns_ + (traffic_.goes_first() && was_on_its_way_ ? kLongBackOff_ns : kBackOff_ns);
      return PlanStatus::found;
    }
    if (!was_on_its_way_) return PlanStatus::no_path;
  }
  if (!has_goal_ || backing_off()) return PlanStatus::no_path;
  const PlanStatus status = plan_to(goal_, path_step_m);
  wants_path_ = status != PlanStatus::found;
  return status;
}

PlanStatus Pilot::plan_to(const Point& place, double path_step_m) noexcept {
  const PlanStatus status = navigator_.plan(cells_, pose_, place, path_step_m);
  if (status == PlanStatus::found) return status;
  // No way around the others: up to them then, who will move, or make this one back off.
  return navigator_.plan(map_, pose_, place, path_step_m);
}

}  // namespace mauve_examples
