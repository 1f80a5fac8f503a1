// SPDX-License-Identifier: LGPL-3.0-or-later
// What runs on component threads allocates nothing after configure: every allocation of the process is
// counted.
#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <memory>
#include <new>

#include "mauve_examples/explorer.hpp"
#include "mauve_examples/navigator.hpp"
#include "mauve_examples/point_controller.hpp"
#include "mauve_examples/ray_caster.hpp"
#include "mauve_examples/scan_integration.hpp"
#include "mauve_examples/start_poses.hpp"
#include "mauve_examples/unicycle.hpp"
#include "test_maps.hpp"

namespace {

std::atomic<std::size_t> allocations{0};

void* counted(std::size_t size) {
  ++allocations;
  if (void* memory = std::malloc(size == 0 ? 1 : size)) return memory;
  throw std::bad_alloc();
}

}  // namespace

void* operator new(std::size_t size) { return counted(size); }
void* operator new[](std::size_t size) { return counted(size); }
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete[](void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::size_t) noexcept { std::free(memory); }

namespace mauve_examples {
namespace {

TEST(Allocation, IsCounted) {
  const std::size_t before = allocations;
  std::make_unique<int>(3);
  EXPECT_GT(allocations, before);
}

TEST(Allocation, TheAlgorithmsDoNone) {
  const GridMap world = load_map(testing::own_map("office"));
  Unicycle body{.pose = start_poses(world, 1, 1)[0]};
  PointController controller;
  Navigator navigator;
  navigator.configure(world, {});
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

  const std::size_t before = allocations;
  for (std::int64_t tick = 0; tick < 30; ++tick) {
    range_scan(world, body.pose, 5.0F, scan);
    integrate_scan(scan, body.pose, map);
    explorer.refresh(map);
    explorer.look(body.pose, tick);
    if (tick % 2 == 0 ? explorer.decide_together(tick) : explorer.decide_alone(tick)) {
      navigator.plan(map.cells(), body.pose, explorer.destination(), 1.0);
    }
    explorer.compose(*message);
    peer.receive(*message);
    peer.look(body.pose, tick);
    peer.decide_together(tick);
    peer.compose(*answer);
    explorer.receive(*answer);
    for (int step = 0; step < 20 && !navigator.path().finished(); ++step) {
      navigator.follow(map.cells(), body.pose, 0.5);
      navigator.blocked(map.cells(), body.pose, 4.0);
      navigator.stalled(body.pose, tick, 100);
      if (navigator.path().finished()) break;
      controller.set_options({});
      body.step(controller.step(body.pose, navigator.path().target(), 0.02), {}, 0.02);
    }
  }
  EXPECT_EQ(allocations, before);
  EXPECT_GT(map.free_count(), 1000U);
}

}  // namespace
}  // namespace mauve_examples
