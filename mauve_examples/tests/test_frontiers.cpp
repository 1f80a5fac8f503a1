// SPDX-License-Identifier: LGPL-3.0-or-later
#include <gtest/gtest.h>

#include <cmath>

#include "mauve_examples/frontiers.hpp"
#include "mauve_examples/ray_caster.hpp"
#include "mauve_examples/reachability.hpp"
#include "mauve_examples/scan_integration.hpp"
#include "mauve_examples/start_poses.hpp"
#include "test_maps.hpp"

namespace mauve_examples::test_frontiers {

FrontierOptions fine() { return {0.3, 3.0, 0.5, 0.0}; }

TEST(Frontiers, AreReachableFreeCellsBesideTheUnknown) {
  // The right room ends in the unknown; the lower one too, but no way leads there.
  const GridMap map = testing::drawn(
      {"##########", "#....##..#", "#........ ", "#....##..#", "##########", "#.......  ", "##########"});
  FrontierFinder finder;
  finder.configure(map, fine());
  const FrontierList& list = finder.find(map.cells, {1.5, 3.5, 0.0});
  ASSERT_EQ(list.size(), 1U);
  EXPECT_DOUBLE_EQ(list[0].at.x, 8.5);
  EXPECT_DOUBLE_EQ(list[0].at.y, 4.5);
  EXPECT_NEAR(list[0].cost_m, 7.4, 0.1);  // one diagonal and six straight steps, a diagonal counting 1.4
  EXPECT_TRUE(finder.any_near(list[0].at, 1.0));
  EXPECT_FALSE(finder.any_near({7.5, 1.5, 0.0}, 1.0));
  EXPECT_TRUE(std::isinf(finder.cost_m({7.5, 1.5, 0.0})));
  EXPECT_NEAR(finder.cost_m({2.5, 3.5, 0.0}), 1.0, 1e-9);
}

TEST(Frontiers, UnknownCellsThatTouchWallsAreOfNoInterest) {
  const GridMap map = testing::drawn({"#######", "#.....#", "#.....#", "#.. ###", "#######"}, 0.2);
  FrontierFinder finder;
  finder.configure(map, {0.25, 3.0, 0.1, 0.0});
  EXPECT_TRUE(finder.find(map.cells, {0.5, 0.5, 0.0}).empty());
}

TEST(Frontiers, NearOnesComeFirstAndLongOnesAreCut) {
  GridMap map = testing::drawn({"...................."});
  map.height = 20;
  map.resolution_m = 0.5;
  map.cells.assign(map.cell_count(), kFree);
  for (int column = 0; column < 20; ++column) map.cells[map.index({column, 19})] = kUnknown;
  FrontierFinder finder;
  finder.configure(map, {0.2, 1.5, 0.2, 0.0});
  const FrontierList& list = finder.find(map.cells, {5.0, 1.0, 0.0});
  ASSERT_GE(list.size(), 3U);
  double total_m = 0.0;
  for (std::size_t i = 0; i < list.size(); ++i) {
    total_m += list[i].size_m;
    EXPECT_LE(list[i].size_m, 3.6);
    if (i > 0) {
      EXPECT_GE(list[i].cost_m, list[i - 1].cost_m);
    }
  }
  EXPECT_DOUBLE_EQ(total_m, 10.0);
}

TEST(Frontiers, AtMostSixteenAreKept) {
  GridMap map;
  map.width = 200;
  map.height = 9;
  map.resolution_m = 0.1;
  map.cells.assign(map.cell_count(), kFree);
  for (int column = 3; column < 200; column += 5) map.cells[map.index({column, 8})] = kUnknown;
  FrontierFinder finder;
  finder.configure(map, {0.05, 0.2, 0.0, 0.0});
  const FrontierList& list = finder.find(map.cells, {10.0, 0.5, 0.0});
  ASSERT_EQ(list.size(), kMaxFrontiers);
  for (const Frontier& frontier : list) EXPECT_LT(std::abs(frontier.at.x - 10.0), 5.0);
}

TEST(Frontiers, NoneIsLeftWhenAllIsKnown) {
  const GridMap map = load_map(testing::own_map("arena"));
  FrontierFinder finder;
  finder.configure(map, {});
  EXPECT_TRUE(finder.find(map.cells, {-4.0, -4.0, 0.0}).empty());
}

TEST(Frontiers, TheSameFinderServesManyMaps) {
  const GridMap truth = load_map(testing::own_map("office"));
  const Pose2D pose = start_poses(truth, 1, 3)[0];
  OccupancyGrid map;
  map.configure(truth);
  Scan scan;
  range_scan(truth, pose, 5.0F, scan);
  integrate_scan(scan, pose, map);
  FrontierFinder finder;
  finder.configure(truth, {});
  const std::size_t first = finder.find(map.cells(), {pose.x, pose.y, 0.0}).size();
  EXPECT_GT(first, 0U);
  finder.find(truth.cells, {pose.x, pose.y, 0.0});
  EXPECT_EQ(finder.find(map.cells(), {pose.x, pose.y, 0.0}).size(), first);
}

TEST(Reachability, SpreadsFromTheStartsOverWhereTheRobotFits) {
  const GridMap map = testing::drawn({"#########", "#...#...#", "#...#...#", "#...#...#", "#########"}, 0.3);
  const std::vector<Pose2D> starts{{0.75, 0.75, 0.0}};
  const auto mask = reachable_cells(map, starts, 0.2);
  EXPECT_EQ(std::count(mask.begin(), mask.end(), 1),
            1);  // the centres of the outer cells are 15 cm from the wall
  EXPECT_EQ(mask[map.index({2, 2})], 1);
  const auto thin = reachable_cells(map, starts, 0.1);
  EXPECT_EQ(std::count(thin.begin(), thin.end(), 1), 9);
}

TEST(StartPoses, AreApartTogetherAndTheSameForEverySeed) {
  for (const char* name : {"office", "room", "arena"}) {
    const GridMap map = load_map(testing::own_map(name));
    for (std::uint64_t seed = 0; seed < 20; ++seed) {
      const auto poses = start_poses(map, 8, seed);
      ASSERT_EQ(poses.size(), 8U);
      const auto mask = reachable_cells(map, std::span(poses).first(1), 0.2);
      EXPECT_GT(std::count(mask.begin(), mask.end(), 1), 1000) << name;
      for (std::size_t i = 0; i < poses.size(); ++i) {
        EXPECT_EQ(mask[map.index(map.cell_at(poses[i].x, poses[i].y))], 1);
        for (std::size_t j = 0; j < i; ++j) EXPECT_GE(distance_m(poses[i], poses[j]), 0.99);
      }
      EXPECT_LE(distance_m(poses[0], poses[1]), 3.0);
      const auto again = start_poses(map, 2, seed);
      EXPECT_EQ(again[1].x, poses[1].x);
      EXPECT_EQ(again[0].theta, poses[0].theta);
    }
  }
}

TEST(StartPoses, SayWhenThereIsNoRoom) {
  EXPECT_THROW(start_poses(testing::drawn({"###", "#.#", "###"}, 0.3), 1, 1), MapError);
  try {
    start_poses(testing::drawn({"####", "#..#", "#..#", "####"}, 0.5), 9, 1);
    FAIL();
  } catch (const MapError& error) {
    EXPECT_NE(std::string(error.what()).find("room for 9"), std::string::npos);
  }
}

}  // namespace mauve_examples::test_frontiers
