// SPDX-License-Identifier: LGPL-3.0-or-later
// One robot of the mission without ROS, for tests.
#pragma once

#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "mauve_rt/data/action_server.hpp"

#include "mauve_examples/control.hpp"
#include "mauve_examples/exploration.hpp"
#include "mauve_examples/guidance.hpp"
#include "mauve_examples/mapping.hpp"
#include "mauve_examples/model/control_fsm.hpp"
#include "mauve_examples/model/exploration_fsm.hpp"
#include "mauve_examples/model/guidance_fsm.hpp"
#include "mauve_examples/model/guidance_psm.hpp"
#include "mauve_examples/model/mapping_fsm.hpp"
#include "mauve_examples/model/robot_fsm.hpp"
#include "mauve_examples/reachability.hpp"
#include "mauve_examples/robot.hpp"
#include "mauve_examples/start_poses.hpp"
#include "test_maps.hpp"

namespace mauve_examples::testing {

/// The fsms that are generated from model.yaml.
struct GeneratedFsms {
  using RobotFsm = mauve_examples::RobotFsm;
  using ControlFsm = mauve_examples::ControlFsm;
  using GuidanceFsm = mauve_examples::GuidanceFsm;
  using MappingFsm = mauve_examples::MappingFsm;
  using ExplorationFsm = mauve_examples::ExplorationFsm;
};

/// Robots as in the project's architecture file, without ROS.
template <typename Fsms>
class RobotArchitectureOf {
 public:
  explicit RobotArchitectureOf(const std::string& map_name, const std::string& peers = "",
                               bool declares_odometry = true) {
    const std::string map = own_map(map_name).string();
    world_ = load_map(map);
    start_ = start_poses(world_, 1, 4)[0];
    auto& robot =
        architecture_.add_component<RobotShell, Robot, typename Fsms::RobotFsm>("robot", {.priority = 80});
    auto& control = architecture_.add_component<ControlShell, Control, typename Fsms::ControlFsm>(
        "control", {.priority = 70});
    auto& guidance = architecture_.add_component<GuidanceShell, Guidance, typename Fsms::GuidanceFsm>(
        "guidance", {.priority = 60});
    auto& mapping = architecture_.add_component<MappingShell, Mapping, typename Fsms::MappingFsm>(
        "mapping", {.priority = 50});
    auto& exploration =
        architecture_.add_component<ExplorationShell, Exploration, typename Fsms::ExplorationFsm>(
            "exploration", {.priority = 40});
    declare(robot, "pose", "map", "robot_1/base");
    if (declares_odometry) declare(robot, "odometry", "robot_1/odom", "robot_1/base");
    declare(robot, "scan", "robot_1/scan");
    robot.set_property("start_x", start_.x);
    robot.set_property("start_y", start_.y);
    robot.set_property("start_yaw", start_.theta);
    for (mauve::Component* component : {&robot, &guidance, &mapping, &exploration})
      component->set_property("map", map);
    exploration.set_property("peers", peers);

    auto& pose = architecture_.add_resource<mauve::SharedData<Pose2D>>("pose");
    auto& odometry = architecture_.add_resource<mauve::SharedData<Pose2D>>("odometry");
    auto& frames = architecture_.add_resource<mauve::TransformTree>("frames", 8U);
    auto& drive_to =
        architecture_.add_resource<mauve::ActionServer<DriveTo>>("drive_to", 1, mauve::s_to_ns(2));
    auto& command = architecture_.add_resource<mauve::SharedData<Twist>>("command");
    auto& scan = architecture_.add_resource<mauve::SharedData<Scan>>("scan");
    auto& body = architecture_.add_resource<mauve::SharedData<RobotBody>>("body");
    auto& bodies =
        architecture_.add_resource<mauve::RingBuffer<RobotBody>>("bodies", 64U, mauve::WhenFull::overwrite);
    auto& target = architecture_.add_resource<mauve::SharedData<Point>>("target");
    auto& goal = architecture_.add_resource<mauve::SharedData<Point>>("goal");
    auto& done = architecture_.add_resource<mauve::SharedData<Bool>>("done");
    auto& own_map = architecture_.add_resource<OccupancyMap>("map");
    auto& updates = architecture_.add_resource<mauve::RingBuffer<MapUpdate>>("map_updates", 8U);
    auto& outbox =
        architecture_.add_resource<mauve::RingBuffer<PeerMessage>>("outbox", 4U, mauve::WhenFull::overwrite);
    auto& inbox =
        architecture_.add_resource<mauve::RingBuffer<PeerMessage>>("inbox", 16U, mauve::WhenFull::overwrite);
    const auto connect = [this](mauve::Component& component, const char* port, mauve::Resource& resource,
                                const char* service) {
      architecture_.connect(component, port, resource, service);
    };
    connect(robot, "command", command, "read");
    connect(robot, "pose", pose, "write");
    connect(robot, "odometry", odometry, "write");
    connect(robot, "scan", scan, "write");
    connect(robot, "set_frame", frames, "set");
    connect(robot, "body", body, "write");
    connect(robot, "bodies", bodies, "read");
    connect(control, "scan", scan, "read");
    connect(guidance, "scan", scan, "read");
    connect(control, "pose", pose, "read");
    connect(control, "target", target, "read");
    connect(control, "command", command, "write");
    connect(guidance, "pose", pose, "read");
    connect(guidance, "goal", goal, "read");
    for (const std::string service : {"status", "goal", "decide", "feedback", "result"})
      connect(guidance, ("drive_to_" + service).c_str(), drive_to, service.c_str());
    connect(guidance, "lookup", frames, "lookup");
    connect(guidance, "target", target, "write");
    connect(guidance, "map_get", own_map, "get");
    connect(mapping, "pose", pose, "read");
    connect(mapping, "scan", scan, "read");
    connect(mapping, "map_update", own_map, "update");
    connect(mapping, "map_updates", updates, "write");
    connect(exploration, "pose", pose, "read");
    connect(exploration, "map_get", own_map, "get");
    connect(exploration, "inbox", inbox, "read");
    connect(exploration, "outbox", outbox, "write");
    connect(exploration, "goal", goal, "write");
    connect(exploration, "done", done, "write");
    map_ = &own_map;
    done_ = &done;
    goal_ = &goal;
    pose_ = &pose;
    odometry_ = &odometry;
    frames_ = &frames;
    drive_to_ = &drive_to;
    command_ = &command;
  }

  mauve::Architecture& architecture() { return architecture_; }
  const Pose2D& start() const { return start_; }
  mauve::Component& component(const std::string& name) { return architecture_.component(name); }

  double coverage() {
    const std::vector<Pose2D> starts{start_};
    const auto reachable = reachable_cells(world_, starts, 0.2);
    double covered = 0.0;
    double total = 0.0;
    map_->get.call([&](const OccupancyGrid& map) {
      for (std::size_t i = 0; i < reachable.size(); ++i) {
        if (reachable[i] == 0) continue;
        total += 1.0;
        covered += map.cells()[i] == kFree ? 1.0 : 0.0;
      }
    });
    return covered / total;
  }
  bool done() { return value(*done_).data; }
  Pose2D pose() { return value(*pose_); }
  Pose2D odometry() { return value(*odometry_); }
  const mauve::TransformBuffer& frames() const { return frames_->buffer(); }
  mauve::ActionServer<DriveTo>& drive_to() { return *drive_to_; }
  void command(const Twist& twist, mauve::time_ns_t now_ns) { command_->write.write(twist, now_ns); }
  std::uint64_t goals() {
    Point goal;
    mauve::time_ns_t time_ns = 0;
    mauve::ReaderState reader;
    goal_->read.read(goal, time_ns, reader);
    return reader.seen;
  }
  bool wait_done(std::chrono::seconds timeout) {
    const auto until = std::chrono::steady_clock::now() + timeout;
    while (!done() && std::chrono::steady_clock::now() < until)
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    return done();
  }
  void expect_no_faults() {
    for (const auto& each : architecture_.components())
      EXPECT_EQ(each->task().fault().what, "") << each->name();
  }

 private:
  static void declare(mauve::Component& component, const char* port, const char* frame,
                      const char* child = "") {
    component.shell().find_port(port)->declare_frames({.frame = frame, .child_frame = child});
  }
  template <typename T>
  T value(mauve::SharedData<T>& resource) {
    T value{};
    mauve::time_ns_t time_ns = 0;
    mauve::ReaderState reader;
    resource.read.read(value, time_ns, reader);
    return value;
  }

  GridMap world_;
  Pose2D start_;
  mauve::Architecture architecture_;
  OccupancyMap* map_{nullptr};
  mauve::SharedData<Bool>* done_{nullptr};
  mauve::SharedData<Point>* goal_{nullptr};
  mauve::SharedData<Pose2D>* pose_{nullptr};
  mauve::SharedData<Pose2D>* odometry_{nullptr};
  mauve::TransformTree* frames_{nullptr};
  mauve::ActionServer<DriveTo>* drive_to_{nullptr};
  mauve::SharedData<Twist>* command_{nullptr};
};

using RobotArchitecture = RobotArchitectureOf<GeneratedFsms>;

}  // namespace mauve_examples::testing
