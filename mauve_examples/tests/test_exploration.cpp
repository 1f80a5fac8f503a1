// SPDX-License-Identifier: LGPL-3.0-or-later
// Whole missions without threads: coverage, the lost link, lost messages, one to eight robots.
#include <gtest/gtest.h>

#include "mission_simulation.hpp"
#include "test_maps.hpp"

namespace mauve_examples::test_exploration {

using testing::MissionSimulation;
using testing::SimulationOptions;

TEST(Exploration, TwoRobotsExploreTheOffice) {
  const GridMap map = load_map(testing::own_map("office"));
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    MissionSimulation mission(map, {.robots = 2, .seed = seed});
    EXPECT_FALSE(mission.run_until(60.0)) << "the demo's link returns at 45 s: the map must last longer";
    EXPECT_LT(mission.union_coverage(), 0.95);
    EXPECT_TRUE(mission.run());
    EXPECT_GT(mission.union_coverage(), 0.99);
    EXPECT_LT(mission.now_s(), 120.0);
    EXPECT_GT(mission.accuracy(), 0.999);
    RecordProperty("seconds_seed_" + std::to_string(seed), std::to_string(mission.now_s()));
  }
}

TEST(Exploration, WithoutTheLinkTheRobotsStallWithItTheyGoOn) {
  const GridMap map = load_map(testing::own_map("office"));
  MissionSimulation mission(map, {.seed = 1, .link_lost_s = 20.0, .link_back_s = 60.0});
  mission.run_until(45.0);
  const double stalled_from = mission.union_coverage();
  mission.run_until(60.0);
  EXPECT_EQ(mission.union_coverage(), stalled_from) << "the last goals were reached long ago";
  mission.run_until(75.0);
  EXPECT_GT(mission.union_coverage(), stalled_from + 0.02);
  EXPECT_TRUE(mission.run());
  EXPECT_GT(mission.union_coverage(), 0.99);
}

TEST(Exploration, DecidingAloneCoverageGrowsWhileTheLinkIsDown) {
  const GridMap map = load_map(testing::own_map("office"));
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    MissionSimulation mission(
        map, {.seed = seed, .link_lost_s = 20.0, .link_back_s = 45.0, .local_while_lost = true});
    mission.run_until(22.0);
    const double at_loss = mission.union_coverage();
    mission.run_until(45.0);
    EXPECT_GT(mission.union_coverage(), at_loss + 0.1);
    EXPECT_TRUE(mission.run());
    EXPECT_GT(mission.union_coverage(), 0.99);
  }
}

TEST(Exploration, LostMessagesCostTimeAndNothingElse) {
  const GridMap map = load_map(testing::own_map("arena"));
  MissionSimulation mission(map, {.robots = 3, .seed = 2, .drop_share = 0.5});
  EXPECT_TRUE(mission.run());
  EXPECT_GT(mission.messages_lost(), 50U);
  EXPECT_GT(mission.union_coverage(), 0.99);
}

class Teams : public ::testing::TestWithParam<std::size_t> {};

TEST_P(Teams, FinishWithoutDeadlock) {
  const GridMap map = load_map(testing::own_map("arena"));
  MissionSimulation mission(map, {.robots = GetParam(), .seed = 5, .drop_share = 0.1});
  EXPECT_TRUE(mission.run());
  EXPECT_GT(mission.union_coverage(), 0.99);
}
INSTANTIATE_TEST_SUITE_P(Sizes, Teams, ::testing::Values(1, 2, 3, 5, 9));

class Crowds : public ::testing::TestWithParam<std::size_t> {};

TEST_P(Crowds, MeetAndDoNotTouch) {
  const GridMap map = load_map(testing::own_map("office"));
  for (std::uint64_t seed = 1; seed <= 2; ++seed) {
    MissionSimulation mission(map, {.robots = GetParam(),
                                    .seed = seed,
                                    .link_lost_s = 20.0,
                                    .link_back_s = 45.0,
                                    .local_while_lost = true});
    EXPECT_TRUE(mission.run()) << seed;
    EXPECT_EQ(mission.contact_s(), 0.0) << seed;
    EXPECT_GT(mission.union_coverage(), 0.99) << seed;
    const std::string run = std::to_string(GetParam()) + "_robots_seed_" + std::to_string(seed);
    RecordProperty(run + "_seconds", std::to_string(mission.now_s()));
    RecordProperty(run + "_nearest_m", std::to_string(mission.nearest_m()));
  }
}
INSTANTIATE_TEST_SUITE_P(Sizes, Crowds, ::testing::Values(2, 4, 9));

class RealMaps : public ::testing::TestWithParam<const char*> {};

TEST_P(RealMaps, AreExplored) {
  const auto path = testing::shared_map(GetParam());
  if (!std::filesystem::exists(path)) GTEST_SKIP() << "no folder shared/maps beside the clone";
  const GridMap map = load_map(path);
  MissionSimulation mission(map, {.seed = 1});
  EXPECT_TRUE(mission.run());
  EXPECT_GT(mission.union_coverage(), 0.95);
}
INSTANTIATE_TEST_SUITE_P(Files, RealMaps, ::testing::Values("depot", "tb3_sandbox"));

}  // namespace mauve_examples::test_exploration
