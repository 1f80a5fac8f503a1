// SPDX-License-Identifier: LGPL-3.0-or-later
// From rays to the map: the grid traversal, the simulated scan, its integration, tiles.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "mauve_examples/merged_map.hpp"
#include "mauve_examples/ray_caster.hpp"
#include "mauve_examples/scan_integration.hpp"
#include "test_maps.hpp"

namespace mauve_examples::test_mapping {

std::vector<Cell> cells_on(const GridGeometry& grid, const Point& from, const Direction& direction,
                           double length_m) {
  std::vector<Cell> cells;
  traverse(grid, from, direction, length_m, [&](Cell cell, double) {
    cells.push_back(cell);
    return true;
  });
  return cells;
}

TEST(GridTraversal, VisitsEveryCellOnce) {
  const GridGeometry grid{10, 10, 0.5, -1.0, -1.0};
  const auto cells = cells_on(grid, {-0.9, -0.9, 0.0}, {0.8, 0.6}, 3.0);
  for (std::size_t i = 1; i < cells.size(); ++i) {
    EXPECT_EQ(std::abs(cells[i].column - cells[i - 1].column) + std::abs(cells[i].row - cells[i - 1].row), 1);
  }
  EXPECT_EQ(cells.front(), (Cell{0, 0}));
  EXPECT_EQ(cells.back(), grid.cell_at(-0.9 + 2.4, -0.9 + 1.8));
}

TEST(GridTraversal, RunsAlongAxesAndBackwards) {
  const GridGeometry grid{5, 5, 1.0, 0.0, 0.0};
  EXPECT_EQ(cells_on(grid, {0.5, 2.5, 0.0}, {1.0, 0.0}, 2.0).size(), 3U);
  EXPECT_EQ(cells_on(grid, {0.5, 2.5, 0.0}, {0.0, -1.0}, 2.0).back(), (Cell{0, 0}));
  EXPECT_EQ(cells_on(grid, {2.5, 2.5, 0.0}, {-1.0, 0.0}, 0.0).size(), 1U);
}

TEST(RayCaster, RangesAreExact) {
  const GridMap map = testing::drawn({"#####", "#...#", "#...#", "#...#", "#####"});
  const Point middle{2.5, 2.5, 0.0};
  EXPECT_DOUBLE_EQ(cast_ray(map, middle, {1.0, 0.0}, 10.0), 1.5);
  EXPECT_DOUBLE_EQ(cast_ray(map, middle, {0.0, -1.0}, 10.0), 1.5);
  const double diagonal = std::numbers::sqrt2 / 2.0;
  EXPECT_NEAR(cast_ray(map, middle, {diagonal, diagonal}, 10.0), 1.5 * std::numbers::sqrt2, 1e-9);
  EXPECT_TRUE(std::isinf(cast_ray(map, middle, {1.0, 0.0}, 1.4)));
}

TEST(RayCaster, UnknownCellsAndTheMapsEndStopBeams) {
  const GridMap map = testing::drawn({".. ", "...", "..."});
  EXPECT_DOUBLE_EQ(cast_ray(map, {0.5, 2.5, 0.0}, {1.0, 0.0}, 10.0), 1.5);
  EXPECT_DOUBLE_EQ(cast_ray(map, {0.5, 0.5, 0.0}, {1.0, 0.0}, 10.0), 2.5);
}

TEST(ScanIntegration, DrawsWhatTheScanSaw) {
  const GridMap truth = load_map(testing::own_map("room"));
  OccupancyGrid map;
  map.configure(truth);
  Scan scan;
  for (const Pose2D& pose : {Pose2D{-3.0, 1.0, 0.3}, Pose2D{2.0, -2.0, 2.0}, Pose2D{4.7, 2.7, -1.0}}) {
    range_scan(truth, pose, 5.0F, scan);
    integrate_scan(scan, pose, map);
  }
  std::size_t known = 0;
  std::size_t wrong = 0;
  for (std::size_t i = 0; i < truth.cells.size(); ++i) {
    if (map.cells()[i] == kUnknown) continue;
    ++known;
    if ((map.cells()[i] == kFree) != (truth.cells[i] == kFree)) ++wrong;
  }
  EXPECT_GT(known, 20'000U);
  EXPECT_EQ(wrong, 0U);
}

TEST(OccupancyGrid, OneHitOutweighsSeveralPassesAndCountersSaturate) {
  OccupancyGrid map;
  map.configure({20, 20, 1.0, 0.0, 0.0});
  const Cell cell{3, 4};
  EXPECT_EQ(map.at(cell), kUnknown);
  map.observe_free(cell);
  EXPECT_EQ(map.at(cell), kFree);
  map.observe_hit(cell);
  EXPECT_EQ(map.at(cell), kOccupied);
  for (int i = 0; i < 100; ++i) map.observe_free(cell);
  EXPECT_EQ(map.at(cell), kFree);
  EXPECT_EQ(map.free_count(), 1U);
  for (int i = 0; i < 3; ++i) map.observe_hit(cell);
  EXPECT_EQ(map.at(cell), kOccupied);  // however often it was passed before
  EXPECT_EQ(map.free_count(), 0U);
}

TEST(OccupancyGrid, RevisionsTellWhichTilesChanged) {
  OccupancyGrid map;
  map.configure({40, 20, 1.0, 0.0, 0.0});  // 3 x 2 tiles, the last ones cut
  ASSERT_EQ(map.tile_count(), 6U);
  map.observe_free({39, 19});
  map.observe_free({39, 19});
  map.observe_free({100, 100});
  for (std::size_t tile = 0; tile < 6; ++tile) EXPECT_EQ(map.revision(tile), tile == 5 ? 1U : 0U);
  MapTile tile;
  map.copy_tile(5, tile);
  EXPECT_EQ(tile.column, 2);
  EXPECT_EQ(tile.row, 1);
  EXPECT_EQ(tile.revision, 1U);
  EXPECT_EQ(tile.cells[3 * 16 + 7], kFree);
  EXPECT_EQ(tile.cells[0], kUnknown);
  EXPECT_EQ(tile.cells[255], kUnknown);  // beyond the grid
}

TEST(MergedMap, OwnObservationsOutweighPeers) {
  OccupancyGrid own;
  own.configure({40, 20, 1.0, 0.0, 0.0});
  own.observe_free({1, 1});
  MergedMap merged;
  merged.configure(own.geometry());
  merged.refresh(own);
  MapTile tile;
  tile.cells.fill(kUnknown);
  tile.cells[1 * 16 + 1] = kOccupied;
  tile.cells[2 * 16 + 2] = kOccupied;
  EXPECT_TRUE(merged.merge(tile));
  const auto at = [&](Cell cell) { return merged.cells()[own.geometry().index(cell)]; };
  EXPECT_EQ(at({1, 1}), kFree);
  EXPECT_EQ(at({2, 2}), kOccupied);
  EXPECT_EQ(at({3, 3}), kUnknown);
  own.observe_free({2, 2});
  merged.refresh(own);
  EXPECT_EQ(at({2, 2}), kFree);
  tile.column = 3;
  EXPECT_FALSE(merged.merge(tile));
  merged.copy_tile(0, tile);
  EXPECT_EQ(tile.revision, 2U);
  EXPECT_EQ(tile.cells[2 * 16 + 2], kFree);
}

}  // namespace mauve_examples::test_mapping
