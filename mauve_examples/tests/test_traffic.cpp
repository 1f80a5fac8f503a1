// SPDX-License-Identifier: LGPL-3.0-or-later
// Robots that meet: they pass, or one makes room; they never touch, and none waits for ever.
#include <gtest/gtest.h>

#include "mission_simulation.hpp"
#include "test_maps.hpp"

namespace mauve_examples::test_traffic {

using testing::MissionSimulation;

constexpr double kResolution_m = 0.05;

/// Two rooms of 4 m x 4 m, and between them a corridor of 8 m along y = 2 m.
GridMap corridor(double width_m) {
  GridMap map;
  map.width = 320;
  map.height = 80;
  map.resolution_m = kResolution_m;
  map.cells.assign(map.cell_count(), kOccupied);
  for (std::size_t i = 0; i < map.cells.size(); ++i) {
    const Point at = map.centre(map.cell(i));
    const bool room = (at.x > 0.1 && at.x < 4.0) || (at.x > 12.0 && at.x < 15.9);
    const bool inside = at.y > 0.1 && at.y < 3.9;
    if ((room && inside) || (at.x > 3.9 && at.x < 12.1 && std::abs(at.y - 2.0) < width_m / 2.0))
      map.cells[i] = kFree;
  }
  return map;
}

/// As the corridor, but its right room is walled up: a dead end.
GridMap dead_end() {
  GridMap map = corridor(0.8);
  for (std::size_t i = 0; i < map.cells.size(); ++i) {
    if (map.centre(map.cell(i)).x > 11.0) map.cells[i] = kOccupied;
  }
  return map;
}

struct Meeting {
  const char* name;
  GridMap map;
  std::vector<Pose2D> starts;
  std::vector<Point> goals;
};

class Meetings : public ::testing::TestWithParam<Meeting> {};

TEST_P(Meetings, EndWithEverybodyAtTheGoalAndNobodyTouched) {
  const Meeting& meeting = GetParam();
  MissionSimulation mission(meeting.map, {.robots = meeting.starts.size(),
                                          .duration_s = 120.0,
                                          .starts = meeting.starts,
                                          .goals = meeting.goals});
  EXPECT_TRUE(mission.run_to_goals());
  EXPECT_EQ(mission.contact_s(), 0.0);
  EXPECT_GT(mission.nearest_m(), 2.0 * kRobotRadius_m);
  RecordProperty("seconds", std::to_string(mission.now_s()));
}

INSTANTIATE_TEST_SUITE_P(
    Places, Meetings,
    ::testing::Values(Meeting{"HeadOnInAWideCorridor",
                              corridor(1.6),
                              {{2.0, 2.0, 0.0}, {14.0, 2.0, 3.1}},
                              {{14.0, 2.0, 0.0}, {2.0, 2.0, 0.0}}},
                      Meeting{"HeadOnInANarrowCorridor",
                              corridor(0.8),
                              {{2.0, 2.0, 0.0}, {14.0, 2.0, 3.1}},
                              {{14.0, 2.0, 0.0}, {2.0, 2.0, 0.0}}},
                      Meeting{"HeadOnTheOtherWayRound",
                              corridor(0.8),
                              {{14.0, 2.0, 3.1}, {2.0, 2.0, 0.0}},
                              {{2.0, 2.0, 0.0}, {14.0, 2.0, 0.0}}},
                      Meeting{"TwoBehindOneAnotherAgainstOne",
                              corridor(0.8),
                              {{2.0, 2.0, 0.0}, {13.0, 2.0, 3.1}, {14.5, 2.0, 3.1}},
                              {{14.0, 2.0, 0.0}, {2.0, 1.0, 0.0}, {2.0, 3.0, 0.0}}},
                      Meeting{"OneThatHasNothingToDoInTheWay",
                              corridor(0.8),
                              {{2.0, 2.0, 0.0}, {8.0, 2.0, 0.0}},
                              {{14.0, 2.0, 0.0}}},
                      Meeting{"OutOfADeadEnd",
                              dead_end(),
                              {{2.0, 2.0, 0.0}, {10.5, 2.0, 3.1}},
                              {{10.0, 2.0, 0.0}, {2.0, 1.0, 0.0}}},
                      Meeting{"FourCrossing",
                              corridor(1.6),
                              {{1.0, 1.0, 0.0}, {3.4, 3.4, 0.0}, {1.0, 3.4, 0.0}, {3.4, 1.0, 0.0}},
                              {{3.4, 3.4, 0.0}, {1.0, 1.0, 0.0}, {3.4, 1.0, 0.0}, {1.0, 3.4, 0.0}}}),
    [](const auto& info) { return info.param.name; });

TEST(Traffic, ARobotInSightIsNeverWrittenIntoTheMap) {
  const GridMap map = corridor(1.6);
  OccupancyGrid own;
  own.configure(map);
  Scan scan;
  const Pose2D pose{1.0, 2.0, 0.0};
  const RobotBody other{2, 2.5, 2.0, kRobotRadius_m};
  for (int i = 0; i < 10; ++i) {
    range_scan(map, pose, 5.0F, scan);
    scan_robots(std::span(&other, 1), pose, scan);
    integrate_scan(scan, pose, own);
  }
  EXPECT_EQ(own.at(map.cell_at(2.2, 2.0)), kFree);
  EXPECT_EQ(own.at(map.cell_at(2.31, 2.0)), kUnknown) << "its shadow is not free either";
  EXPECT_EQ(own.at(map.cell_at(2.7, 2.0)), kUnknown);
}

}  // namespace mauve_examples::test_traffic
