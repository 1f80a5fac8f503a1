// SPDX-License-Identifier: LGPL-3.0-or-later
// Ways through known and unknown space: clearance, A*, the path and following it.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include "mauve_examples/a_star.hpp"
#include "mauve_examples/disc_collision.hpp"
#include "mauve_examples/navigator.hpp"
#include "mauve_examples/start_poses.hpp"
#include "test_maps.hpp"

namespace mauve_examples::test_planning {

TEST(Clearance, EqualsBruteForce) {
  GridMap map;
  map.width = 37;
  map.height = 23;
  map.resolution_m = 0.1;
  map.cells.assign(map.cell_count(), kFree);
  std::mt19937 random(7);  // NOLINT(bugprone-random-generator-seed): the same map every time
  for (int i = 0; i < 12; ++i) map.cells[random() % map.cells.size()] = kOccupied;
  ClearanceField field;
  field.configure(map, 0.5);
  field.compute(map.cells);
  for (std::size_t i = 0; i < map.cells.size(); ++i) {
    int nearest = 1'000;
    for (std::size_t j = 0; j < map.cells.size(); ++j) {
      if (map.cells[j] != kOccupied) continue;
      const int across = map.cell(i).column - map.cell(j).column;
      const int along = map.cell(i).row - map.cell(j).row;
      nearest = std::min(nearest, across * across + along * along);
    }
    for (int squared = 0; squared <= 36; ++squared) {
      EXPECT_EQ(field.at_least(i, static_cast<std::uint16_t>(squared)), nearest >= squared);
    }
  }
}

TEST(Clearance, AfterChangesEqualsOneComputedAnew) {
  GridMap map;
  map.width = 201;
  map.height = 130;
  map.resolution_m = 0.1;
  map.cells.assign(map.cell_count(), kUnknown);
  std::mt19937 random(11);  // NOLINT(bugprone-random-generator-seed): the same map every time
  ClearanceField field;
  field.configure(map, 0.7);
  for (int round = 0; round < 60; ++round) {
    // Obstacles come and go; at times nothing changes, or only what is no obstacle.
    for (int i = 0; i < round % 7; ++i) {
      const std::array states{kOccupied, kOccupied, kFree, kUnknown};
      map.cells[random() % map.cells.size()] = states[random() % states.size()];
    }
    if (round == 40) std::replace(map.cells.begin(), map.cells.end(), kOccupied, kFree);
    field.compute(map.cells);
    ClearanceField anew;
    anew.configure(map, 0.7);
    anew.compute(map.cells);
    std::size_t wrong = 0;
    for (std::size_t i = 0; i < map.cells.size(); ++i) wrong += field.squared(i) != anew.squared(i) ? 1U : 0U;
    EXPECT_EQ(wrong, 0U) << round;
  }
}

/// Room enough for a thin robot on a coarse grid.
PlanOptions thin() { return {0.3, 0.5, 0.0, 0.0, 0.8}; }

double length_m(const Point& start, const std::vector<Point>& points) {
  double length = 0.0;
  Point from = start;
  for (const Point& to : points) {
    length += distance_m(from, to);
    from = to;
  }
  return length;
}

TEST(AStar, FindsTheShortestWayAroundAWall) {
  const GridMap map = testing::drawn({".......", ".......", "######.", ".......", "......."});
  AStar planner;
  planner.configure(map, thin());
  Path path;
  path.configure();
  ASSERT_EQ(planner.plan(map.cells, {0.5, 0.5, 0.0}, {0.5, 4.5, 0.0}, 1.0, path), PlanStatus::found);
  // Six columns there and six back, one of each on the diagonal, and straight up through the gap.
  EXPECT_NEAR(path.length_m(), 12.0 + 2.0 * std::sqrt(2.0), 1e-9);
  EXPECT_NEAR(path.points().back().y, 4.5, 1e-9);
}

TEST(AStar, CutsNoCorners) {
  const GridMap map = testing::drawn({".#", "#."});
  AStar planner;
  planner.configure(map, thin());
  Path path;
  path.configure();
  EXPECT_EQ(planner.plan(map.cells, {0.5, 1.5, 0.0}, {1.5, 0.5, 0.0}, 1.0, path), PlanStatus::no_path);
  EXPECT_TRUE(path.finished());
}

TEST(AStar, PassesTheUnknownOnlyWhenAllowed) {
  const GridMap map = testing::drawn({".  .", "####"});
  AStar planner;
  Path path;
  path.configure();
  planner.configure(map, thin());
  EXPECT_EQ(planner.plan(map.cells, {0.5, 1.5, 0.0}, {3.5, 1.5, 0.0}, 1.0, path), PlanStatus::no_path);
  PlanOptions bold = thin();
  bold.unknown_weight = 1.0;
  planner.configure(map, bold);
  EXPECT_EQ(planner.plan(map.cells, {0.5, 1.5, 0.0}, {3.5, 1.5, 0.0}, 1.0, path), PlanStatus::found);
}

TEST(AStar, SaysWhichEndIsBlocked) {
  const GridMap map = testing::drawn({"###..", "###..", "###..", "###..", "###.."});
  AStar planner;
  planner.configure(map, thin());
  Path path;
  path.configure();
  EXPECT_EQ(planner.plan(map.cells, {0.5, 0.5, 0.0}, {4.5, 0.5, 0.0}, 1.0, path), PlanStatus::start_blocked);
  EXPECT_EQ(planner.plan(map.cells, {4.5, 0.5, 0.0}, {0.5, 0.5, 0.0}, 1.0, path), PlanStatus::goal_blocked);
}

/// Plans between many places of a map and checks every path against the disc robot's exact collision test.
void check_paths(const GridMap& map) {
  AStar planner;
  planner.configure(map, {});
  Path path;
  path.configure();
  constexpr double kStep_m = 1.0;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const Pose2D from = start_poses(map, 1, seed)[0];
    const Pose2D to = start_poses(map, 1, seed + 100)[0];
    const Point start{from.x, from.y, 0.0};
    ASSERT_EQ(planner.plan(map.cells, start, {to.x, to.y, 0.0}, kStep_m, path), PlanStatus::found);
    EXPECT_LE(length_m(start, path.points()), path.length_m() + 1e-6);
    EXPECT_GE(path.length_m(), distance_m(from, to) - 2.0);
    Point at = start;
    for (const Point& next : path.points()) {
      const double leg_m = distance_m(at, next);
      EXPECT_LE(leg_m, kStep_m + map.resolution_m * 1.5);
      for (int step = 0; step <= 20; ++step) {
        const double part = step / 20.0;
        const double x = at.x + part * (next.x - at.x);
        const double y = at.y + part * (next.y - at.y);
        EXPECT_FALSE(disc_collides(map, x, y, kRobotRadius_m)) << x << " " << y;
      }
      at = next;
    }
  }
}

TEST(AStar, PathsKeepTheRobotClearInTheOffice) { check_paths(load_map(testing::own_map("office"))); }
TEST(AStar, PathsKeepTheRobotClearInTheRoom) { check_paths(load_map(testing::own_map("room"))); }
TEST(AStar, PathsKeepTheRobotClearInTheDepot) {
  if (!std::filesystem::exists(testing::shared_map("depot")))
    GTEST_SKIP() << "no folder shared/maps beside the clone";
  check_paths(load_map(testing::shared_map("depot")));
}

TEST(Navigator, NoticesAnObstacleThatComesToLight) {
  GridMap map;
  map.width = 100;
  map.height = 40;
  map.resolution_m = 0.1;
  map.cells.assign(map.cell_count(), kFree);
  Navigator navigator;
  navigator.configure(map, {});
  const Pose2D robot{1.0, 2.0, 0.0};
  ASSERT_EQ(navigator.plan(map.cells, robot, {9.0, 2.0, 0.0}, 1.0), PlanStatus::found);
  EXPECT_FALSE(navigator.blocked(map.cells, robot, 4.0));
  map.cells[map.index({60, 20})] = kOccupied;
  EXPECT_FALSE(navigator.blocked(map.cells, robot, 2.0));
  EXPECT_TRUE(navigator.blocked(map.cells, robot, 6.0));
  ASSERT_EQ(navigator.plan(map.cells, robot, {9.0, 2.0, 0.0}, 1.0), PlanStatus::found);
  EXPECT_FALSE(navigator.blocked(map.cells, robot, 10.0));
}

TEST(Navigator, HandsOutWaypointsUntilTheGoal) {
  GridMap map;
  map.width = 100;
  map.height = 40;
  map.resolution_m = 0.1;
  map.cells.assign(map.cell_count(), kFree);
  Navigator navigator;
  navigator.configure(map, {});
  ASSERT_EQ(navigator.plan(map.cells, {1.0, 2.0, 0.0}, {9.0, 2.0, 0.0}, 1.0), PlanStatus::found);
  EXPECT_GE(navigator.path().points().size(), 8U);
  const Point first = navigator.path().target();
  navigator.follow(map.cells, {first.x - 0.9, first.y, 0.0}, 0.5);
  EXPECT_EQ(navigator.path().next(), 0U);
  for (int step = 10; step <= 91; ++step) navigator.follow(map.cells, {0.1 * step, 2.0, 0.0}, 0.5);
  EXPECT_TRUE(navigator.path().finished());
}

TEST(Navigator, TellsARobotThatIsStuck) {
  GridMap map;
  map.width = 100;
  map.height = 40;
  map.resolution_m = 0.1;
  map.cells.assign(map.cell_count(), kFree);
  Navigator navigator;
  navigator.configure(map, {});
  const Pose2D robot{1.0, 2.0, 0.0};
  EXPECT_FALSE(navigator.stalled(robot, 0, 10));  // no path: it has nowhere to go
  ASSERT_EQ(navigator.plan(map.cells, robot, {9.0, 2.0, 0.0}, 1.0), PlanStatus::found);
  EXPECT_FALSE(navigator.stalled(robot, 5, 10));
  EXPECT_TRUE(navigator.stalled(robot, 16, 10));
  EXPECT_FALSE(navigator.stalled(robot, 17, 10));
  EXPECT_FALSE(navigator.stalled({1.5, 2.0, 0.0}, 40, 10));
}

}  // namespace mauve_examples::test_planning
