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
#include "mauve_examples/pilot.hpp"
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
  std::vector<Pose2D> starts{};  // none: by the seed
  std::vector<Point>
      goals{};  // of robots that know the map and are sent somewhere; the others stay where they are
};

/// One robot: the five components' algorithms and what they hand on to each other.
struct SimulatedRobot {
  std::string name;
  Unicycle body;
  OccupancyGrid map;
  Pilot pilot;
  PointController controller;
  Explorer explorer;
  Scan scan;
  Twist command;
  Point target;
  bool has_target{false};
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
    const std::vector<Pose2D> starts =
        options.starts.empty() ? start_poses(map, options.robots, options.seed) : options.starts;
    reachable_ = reachable_cells(map, starts, kRobotRadius_m);
    reachable_count_ = static_cast<std::size_t>(std::count(reachable_.begin(), reachable_.end(), 1));
    for (std::size_t i = 0; i < options.robots; ++i) {
      auto robot = std::make_unique<SimulatedRobot>();
      robot->name = "robot_" + std::to_string(i + 1);
      robot->body.pose = starts[i];
      told_.push_back(starts[i]);
      tell_.push_back(starts[i]);
      robot->map.configure(map);
      robot->pilot.configure(map, static_cast<std::uint8_t>(i + 1));
      robot->controller.set_options({});
      std::vector<std::string> peers;
      for (std::size_t j = 0; j < options.robots; ++j) {
        if (j != i) peers.push_back("robot_" + std::to_string(j + 1));
      }
      robot->explorer.configure(map, robot->name, peers, explorer);
      if (!options.starts.empty()) know(*robot);
      if (i < options.goals.size()) robot->pilot.set_goal(options.goals[i]);
      robots_.push_back(std::move(robot));
    }
  }

  /// Runs 10 ms.
  void step() {
    count_contacts();
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

  /// Runs until every robot that was sent somewhere has been there; true when they all have.
  bool run_to_goals() {
    std::vector<bool> been(options_.goals.size(), false);
    while (now_s() < options_.duration_s) {
      step();
      for (std::size_t i = 0; i < been.size(); ++i) {
        if (distance_m(robots_[i]->body.pose, options_.goals[i]) < 0.6) been[i] = true;
      }
      if (std::all_of(been.begin(), been.end(), [](bool there) { return there; })) return true;
    }
    return false;
  }

  bool all_done() const {
    return now_s() > 1.0 && std::all_of(robots_.begin(), robots_.end(),
                                        [](const auto& robot) { return robot->explorer.done(); });
  }
  double now_s() const { return static_cast<double>(now_ns_) * 1e-9; }
  const std::vector<std::unique_ptr<SimulatedRobot>>& robots() const { return robots_; }
  /// For how long the discs of two robots overlapped, over all pairs.
  double contact_s() const { return contact_s_; }
  /// The least distance there ever was between the centres of two robots.
  double nearest_m() const { return nearest_m_; }
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

  void know(SimulatedRobot& robot) const {
    for (std::size_t i = 0; i < map_.cells.size(); ++i) {
      if (map_.cells[i] == kFree) robot.map.observe_free(map_.cell(i));
      if (map_.cells[i] == kOccupied) robot.map.observe_hit(map_.cell(i));
    }
  }

  void step_robot(SimulatedRobot& robot, std::size_t number) {
    // The robots' grids are out of phase, as those of processes started one after the other.
    const std::int64_t phase_ns = static_cast<std::int64_t>(number) * 130'000'000 % 500'000'000;
    move(robot);
    if (every(20'000'000)) sense(robot, number);
    if (every(kUnit_ns)) {
      integrate_scan(robot.scan, robot.body.pose, robot.map);
    }
    if (options_.starts.empty() && now_ns_ >= phase_ns && every(500'000'000, phase_ns)) explore(robot);
    if (now_ns_ >= robot.guidance_at_ns) guide(robot);
    if (every(20'000'000)) {
      const Twist wanted =
          robot.has_target ? robot.controller.step(robot.body.pose, robot.target, 0.02) : Twist{};
      robot.command = keep_apart(wanted, robot.scan, ApartOptions{});
    }
  }

  void sense(SimulatedRobot& robot, std::size_t number) {
    mauve::BoundedVector<RobotBody, kMaxSightings> others;
    for (std::size_t i = 0; i < robots_.size(); ++i) {
      const Pose2D& told = told_[i];
      if (i != number) others.push_back({static_cast<std::uint8_t>(i + 1), told.x, told.y, kRobotRadius_m});
    }
    range_scan(map_, robot.body.pose, 5.0F, robot.scan);
    scan_robots(std::span(others.data(), others.size()), robot.body.pose, robot.scan);
  }

  /// Robots hear of each other's places 20 times a second, and 10 ms late.
  void count_contacts() {
    if (every(50'000'000)) told_ = tell_;
    for (std::size_t i = 0; i < robots_.size(); ++i) {
      if (every(50'000'000, 40'000'000)) tell_[i] = robots_[i]->body.pose;
      for (std::size_t j = i + 1; j < robots_.size(); ++j) {
        const double apart_m = distance_m(robots_[i]->body.pose, robots_[j]->body.pose);
        nearest_m_ = std::min(nearest_m_, apart_m);
        if (apart_m < 2.0 * kRobotRadius_m) contact_s_ += 0.01;
      }
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
    robot.pilot.read_map(robot.map);
    robot.pilot.look(robot.scan, robot.body.pose, now_ns_);
    if (robot.pilot.wants_path()) {
      ++robot.plans;
      if (robot.pilot.plan(1.0) != PlanStatus::found) ++robot.failed_plans;
      robot.guidance_at_ns = now_ns_ + 5 * kUnit_ns;
    } else if (robot.pilot.has_path()) {
      robot.pilot.follow(0.5);
      robot.guidance_at_ns = now_ns_ + 2 * kUnit_ns;
    } else {
      robot.guidance_at_ns = now_ns_ + kUnit_ns;
    }
    if (!robot.pilot.has_path()) return;
    robot.target = robot.pilot.target();
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
    if (chosen) robot.pilot.set_goal(robot.explorer.destination());
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
  std::vector<Pose2D> tell_;  // the robots' places that are under way to the others
  std::vector<Pose2D> told_;
  double contact_s_{0.0};
  double nearest_m_{1e9};
};

}  // namespace mauve_examples::testing
