// SPDX-License-Identifier: LGPL-3.0-or-later
// What runs on component threads allocates nothing after configure: every allocation of the test's thread is
// counted.
#include <gtest/gtest.h>

#include <span>

#include "mauve_rt/base/thread_counters.hpp"

#include "mauve_examples/explorer.hpp"
#include "mauve_examples/pilot.hpp"
#include "mauve_examples/point_controller.hpp"
#include "mauve_examples/ray_caster.hpp"
#include "mauve_examples/robots_in_sight.hpp"
#include "mauve_examples/scan_integration.hpp"
#include "mauve_examples/start_poses.hpp"
#include "mauve_examples/unicycle.hpp"
#include "test_maps.hpp"

namespace mauve_examples::test_allocation {

TEST(Allocation, TheAlgorithmsDoNone) {
  if (mauve::allocation_counting() != mauve::AllocationCounting::all) {
    GTEST_SKIP() << "a sanitizer's operators new take the place of the counting ones";
  }
  const GridMap world = load_map(testing::own_map("office"));
  Unicycle body{.pose = start_poses(world, 1, 1)[0]};
  PointController controller;
  Pilot pilot;
  pilot.configure(world, 2);
  RobotBody other{1, body.pose.x + 0.7, body.pose.y, 0.2};  // in the way: there is room to be made
  OccupancyGrid map;
  map.configure(world);
  Explorer explorer;
  explorer.configure(world, "robot_1", {"robot_2"}, {});
  Explorer peer;
  peer.configure(world, "robot_2", {"robot_1"}, {});
  auto message = std::make_unique<PeerMessage>();
  auto answer = std::make_unique<PeerMessage>();
  Scan scan;
  beam_table();

  mauve::ThreadCounters counters;
  counters.attach();
  for (std::int64_t tick = 0; tick < 30; ++tick) {
    range_scan(world, body.pose, 5.0F, scan);
    scan_robots(std::span(&other, 1), body.pose, scan);
    integrate_scan(scan, body.pose, map);
    explorer.refresh(map);
    explorer.look(body.pose, tick);
    if (tick % 2 == 0 ? explorer.decide_together(tick) : explorer.decide_alone(tick)) {
      pilot.set_goal(explorer.destination());
    }
    pilot.read_map(map);
    pilot.look(scan, body.pose, tick * 1'500'000'000);
    if (pilot.wants_path()) pilot.plan(1.0);
    explorer.compose(*message);
    peer.receive(*message);
    peer.look(body.pose, tick);
    peer.decide_together(tick);
    peer.compose(*answer);
    explorer.receive(*answer);
    for (int step = 0; step < 20 && pilot.has_path(); ++step) {
      pilot.follow(0.5);
      if (!pilot.has_path()) break;
      controller.set_options({});
      body.step(keep_apart(controller.step(body.pose, pilot.target(), 0.02), scan, {}), {}, 0.02);
    }
  }
  EXPECT_EQ(counters.allocations(), 0U);
  EXPECT_GT(map.free_count(), 1000U);
}

}  // namespace mauve_examples::test_allocation
