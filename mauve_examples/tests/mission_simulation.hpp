// SPDX-License-Identifier: LGPL-3.0-or-later
// The mission without threads, kernel or ROS: the components' algorithms stepped in one loop, as fast as they
// go.
#pragma once

#include <algorithm>
#include <cstdint>
#include <deque>
#include <memory>
#include <string>
#include <vector>

#include "mauve_examples/disc_collision.hpp"
#include "mauve_examples/explorer.hpp"
#include "mauve_examples/navigator.hpp"
#include "mauve_examples/point_controller.hpp"
#include "mauve_examples/ray_caster.hpp"
#include "mauve_examples/reachability.hpp"
#include "mauve_examples/scan_integration.hpp"
#include "mauve_examples/start_poses.hpp"
#include "mauve_examples/unicycle.hpp"

namespace mauve_examples::testing {

struct SimulationOptions {
  std::size_t robots{2};
  std::uint64_t seed{1};
  double link_lost_s{1e9};
  double link_back_s{1e9};
  bool local_while_lost{
      false};  // swap to deciding alone a second after the loss, and back 3 s after the return
  double drop_share{0.0};
  double duration_s{300.0};
};

/// One robot: the five components' algorithms and what they hand on to each other.
struct SimulatedRobot {
  std::string name;
  Unicycle body;
  OccupancyGrid map;
  Navigator navigator;
  PointController controller;
  Explorer explorer;
  Scan scan;
  Twist command;
  Point target;
  bool has_target{false};
  Point goal;
  Point planned_goal;
  bool has_goal{false};
  bool needs_path{false};
  std::int64_t guidance_at_ns{0};
  int collisions{0};
  int plans{0};
  int failed_plans{0};
  double driven_m{0.0};
  double idle_s{0.0};
  std::deque<std::pair<std::int64_t, std::shared_ptr<PeerMessage>>> inbox;  // with the time of arrival
};

class MissionSimulation {
 public:
  MissionSimulation(const GridMap& map, const SimulationOptions& options,
                    const ExplorerOptions& explorer = {})
      : map_(map), options_(options) {
    const std::vector<Pose2D> starts = start_poses(map, options.robots, options.seed);
    reachable_ = reachable_cells(map, starts, kRobotRadius_m);
    reachable_count_ = static_cast<std::size_t>(std::count(reachable_.begin(), reachable_.end(), 1));
    for (std::size_t i = 0; i < options.robots; ++i) {
      auto robot = std::make_unique<SimulatedRobot>();
      robot->name = "robot_" + std::to_string(i + 1);
      robot->body.pose = starts[i];
      robot->map.configure(map);
      robot->navigator.configure(map, PlanOptions{});
      robot->controller.set_options({});
      std::vector<std::string> peers;
      for (std::size_t j = 0; j < options.robots; ++j) {
        if (j != i) peers.push_back("robot_" + std::to_string(j + 1));
      }
      robot->explorer.configure(map, robot->name, peers, explorer);
      robots_.push_back(std::move(robot));
    }
  }

  /// Runs 10 ms.
  void step() {
    for (std::size_t i = 0; i < robots_.size(); ++i) step_robot(*robots_[i], i);
    now_ns_ += kStep_ns;
  }

  /// Runs until the time, or until every robot says it is done; true when they all are.
  bool run_until(double time_s) {
    while (now_s() < time_s) {
      step();
      if (all_done()) return true;
    }
    return false;
  }
  bool run() { return run_until(options_.duration_s); }

  bool all_done() const {
    return now_s() > 1.0 && std::all_of(robots_.begin(), robots_.end(),
                                        [](const auto& robot) { return robot->explorer.done(); });
  }
  double now_s() const { return static_cast<double>(now_ns_) * 1e-9; }
  const std::vector<std::unique_ptr<SimulatedRobot>>& robots() const { return robots_; }
  std::size_t messages_lost() const { return messages_lost_; }

  /// Share of the reachable cells that the robot has seen to be free.
  double coverage(std::size_t robot) const {
    return share([&](std::size_t cell) { return robots_[robot]->map.cells()[cell] == kFree; });
  }
  double union_coverage() const {
    return share([&](std::size_t cell) {
      return std::any_of(robots_.begin(), robots_.end(),
                         [&](const auto& robot) { return robot->map.cells()[cell] == kFree; });
    });
  }
  /// Share of the cells known to any robot whose state is the true one.
  double accuracy() const {
    std::size_t known = 0;
    std::size_t right = 0;
    for (const auto& robot : robots_) {
      for (std::size_t i = 0; i < map_.cells.size(); ++i) {
        if (robot->map.cells()[i] == kUnknown) continue;
        ++known;
        if ((robot->map.cells()[i] == kFree) == (map_.cells[i] == kFree)) ++right;
      }
    }
    return static_cast<double>(right) / static_cast<double>(known);
  }

 private:
  static constexpr std::int64_t kStep_ns = 10'000'000;
  static constexpr std::int64_t kUnit_ns = 100'000'000;
  static constexpr std::int64_t kFlight_ns = 10'000'000;

  template <typename Covered>
  double share(Covered&& covered) const {
    std::size_t count = 0;
    for (std::size_t i = 0; i < reachable_.size(); ++i) count += reachable_[i] != 0 && covered(i) ? 1U : 0U;
    return static_cast<double>(count) / static_cast<double>(reachable_count_);
  }

  bool link_up() const { return now_s() < options_.link_lost_s || now_s() >= options_.link_back_s; }
  bool local() const {
    return options_.local_while_lost && now_s() >= options_.link_lost_s + 1.0 &&
           now_s() < options_.link_back_s + 3.0;
  }
  bool every(std::int64_t period_ns, std::int64_t offset_ns = 0) const {
    return (now_ns_ - offset_ns) % period_ns == 0;
  }

  void step_robot(SimulatedRobot& robot, std::size_t number) {
    // The robots' grids are out of phase, as those of processes started one after the other.
    const std::int64_t phase_ns = static_cast<std::int64_t>(number) * 130'000'000 % 500'000'000;
    move(robot);
    if (every(kUnit_ns)) {
      range_scan(map_, robot.body.pose, 5.0F, robot.scan);
      integrate_scan(robot.scan, robot.body.pose, robot.map);
    }
    if (now_ns_ >= phase_ns && every(500'000'000, phase_ns)) explore(robot);
    if (now_ns_ >= robot.guidance_at_ns) guide(robot);
    if (every(20'000'000)) {
      robot.command = robot.has_target ? robot.controller.step(robot.body.pose, robot.target, 0.02) : Twist{};
    }
  }

  void move(SimulatedRobot& robot) {
    Unicycle next = robot.body;
    next.step(robot.command, {}, 0.01);
    if (disc_collides(map_, next.pose.x, next.pose.y, kRobotRadius_m)) {
      ++robot.collisions;
      next.pose.x = robot.body.pose.x;
      next.pose.y = robot.body.pose.y;
      next.speed_mps = 0.0;
    }
    const double moved_m = distance_m(next.pose, robot.body.pose);
    robot.driven_m += moved_m;
    if (moved_m < 0.0005) robot.idle_s += 0.01;
    robot.body = next;
  }

  void guide(SimulatedRobot& robot) {
    const bool blocked = !robot.navigator.path().finished() &&
                         robot.navigator.blocked(robot.map.cells(), robot.body.pose, 4.0);
    const bool stalled = robot.navigator.stalled(robot.body.pose, now_ns_, 2'000'000'000);
    const bool moved = robot.has_goal && distance_m(robot.goal, robot.planned_goal) > 0.0;
    if (robot.has_goal && (moved || blocked || stalled || robot.needs_path)) {
      robot.planned_goal = robot.goal;
      ++robot.plans;
      const PlanStatus status = robot.navigator.plan(robot.map.cells(), robot.body.pose, robot.goal, 1.0);
      robot.needs_path = status != PlanStatus::found;
      if (robot.needs_path) ++robot.failed_plans;
      set_target(robot);
      robot.guidance_at_ns = now_ns_ + 5 * kUnit_ns;
    } else if (!robot.navigator.path().finished()) {
      robot.navigator.follow(robot.map.cells(), robot.body.pose, 0.5);
      set_target(robot);
      robot.guidance_at_ns = now_ns_ + 2 * kUnit_ns;
    } else {
      robot.guidance_at_ns = now_ns_ + kUnit_ns;
    }
  }

  static void set_target(SimulatedRobot& robot) {
    if (robot.navigator.path().finished()) return;
    robot.target = robot.navigator.path().target();
    robot.has_target = true;
  }

  void explore(SimulatedRobot& robot) {
    while (!robot.inbox.empty() && robot.inbox.front().first <= now_ns_) {
      robot.explorer.receive(*robot.inbox.front().second);
      robot.inbox.pop_front();
    }
    robot.explorer.refresh(robot.map);
    robot.explorer.look(robot.body.pose, now_ns_);
    const bool chosen =
        local() ? robot.explorer.decide_alone(now_ns_) : robot.explorer.decide_together(now_ns_);
    if (chosen) {
      robot.goal = robot.explorer.destination();
      robot.has_goal = true;
    }
    auto message = std::make_shared<PeerMessage>();
    robot.explorer.compose(*message);
    for (const auto& other : robots_) {
      if (other.get() == &robot) continue;
      if (!link_up() || random() < options_.drop_share) {
        ++messages_lost_;
      } else {
        other->inbox.emplace_back(now_ns_ + kFlight_ns, message);
      }
    }
  }

  double random() {
    random_ = random_ * 6364136223846793005ULL + 1442695040888963407ULL;
    return static_cast<double>(random_ >> 11U) / static_cast<double>(1ULL << 53U);
  }

  GridMap map_;
  SimulationOptions options_;
  std::vector<std::uint8_t> reachable_;
  std::size_t reachable_count_{0};
  std::vector<std::unique_ptr<SimulatedRobot>> robots_;
  std::int64_t now_ns_{0};
  std::uint64_t random_{42};
  std::size_t messages_lost_{0};
};

}  // namespace mauve_examples::testing
