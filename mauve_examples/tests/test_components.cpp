// SPDX-License-Identifier: LGPL-3.0-or-later
// The five components on real threads: one robot explores a room, its exploration core is replaced on the
// way.
#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "mauve_examples/control.hpp"
#include "mauve_examples/exploration.hpp"
#include "mauve_examples/guidance.hpp"
#include "mauve_examples/mapping.hpp"
#include "mauve_examples/reachability.hpp"
#include "mauve_examples/robot.hpp"
#include "mauve_examples/start_poses.hpp"
#include "test_maps.hpp"

namespace mauve_examples::test_components {

using mauve::RingBuffer;
using mauve::SharedData;
using namespace std::chrono_literals;

/// Robots as in the project's architecture file, without ROS.
class RobotArchitecture {
 public:
  explicit RobotArchitecture(const std::string& map_name, const std::string& peers = "") {
    const std::string map = testing::own_map(map_name).string();
    world_ = load_map(map);
    start_ = start_poses(world_, 1, 4)[0];
    auto& robot = architecture_.add_component<RobotShell, RobotCore, RobotFsm>("robot", {.priority = 80});
    auto& control =
        architecture_.add_component<ControlShell, ControlCore, ControlFsm>("control", {.priority = 70});
    auto& guidance =
        architecture_.add_component<GuidanceShell, GuidanceCore, GuidanceFsm>("guidance", {.priority = 60});
    auto& mapping =
        architecture_.add_component<MappingShell, MappingCore, MappingFsm>("mapping", {.priority = 50});
    auto& exploration = architecture_.add_component<ExplorationShell, ExplorationCore, ExplorationFsm>(
        "exploration", {.priority = 40});
    robot.set_property("start_x", start_.x);
    robot.set_property("start_y", start_.y);
    robot.set_property("start_yaw", start_.theta);
    for (mauve::Component* component : {&robot, &guidance, &mapping, &exploration})
      component->set_property("map", map);
    exploration.set_property("peers", peers);

    auto& pose = architecture_.add_resource<SharedData<Pose2D>>("pose");
    auto& command = architecture_.add_resource<SharedData<Twist>>("command");
    auto& scan = architecture_.add_resource<SharedData<Scan>>("scan");
    auto& body = architecture_.add_resource<SharedData<RobotBody>>("body");
    auto& bodies =
        architecture_.add_resource<RingBuffer<RobotBody>>("bodies", 64U, mauve::WhenFull::overwrite);
    auto& target = architecture_.add_resource<SharedData<Point>>("target");
    auto& goal = architecture_.add_resource<SharedData<Point>>("goal");
    auto& done = architecture_.add_resource<SharedData<Bool>>("done");
    auto& own_map = architecture_.add_resource<OccupancyMap>("map");
    auto& updates = architecture_.add_resource<RingBuffer<MapUpdate>>("map_updates", 8U);
    auto& outbox =
        architecture_.add_resource<RingBuffer<PeerMessage>>("outbox", 4U, mauve::WhenFull::overwrite);
    auto& inbox =
        architecture_.add_resource<RingBuffer<PeerMessage>>("inbox", 16U, mauve::WhenFull::overwrite);
    const auto connect = [this](mauve::Component& component, const char* port, mauve::Resource& resource,
                                const char* service) {
      architecture_.connect(component, port, resource, service);
    };
    connect(robot, "command", command, "read");
    connect(robot, "pose", pose, "write");
    connect(robot, "scan", scan, "write");
    connect(robot, "body", body, "write");
    connect(robot, "bodies", bodies, "read");
    connect(control, "scan", scan, "read");
    connect(guidance, "scan", scan, "read");
    connect(control, "pose", pose, "read");
    connect(control, "target", target, "read");
    connect(control, "command", command, "write");
    connect(guidance, "pose", pose, "read");
    connect(guidance, "goal", goal, "read");
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
    while (!done() && std::chrono::steady_clock::now() < until) std::this_thread::sleep_for(20ms);
    return done();
  }
  void expect_no_faults() {
    for (const auto& each : architecture_.components())
      EXPECT_EQ(each->task().fault().what, "") << each->name();
  }

 private:
  template <typename T>
  T value(SharedData<T>& resource) {
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
  SharedData<Bool>* done_{nullptr};
  SharedData<Point>* goal_{nullptr};
  SharedData<Pose2D>* pose_{nullptr};
  SharedData<Twist>* command_{nullptr};
};

TEST(Components, PeriodsAreThoseOfTheirMachines) {
  RobotArchitecture robot("room");
  robot.architecture().configure();
  const auto period_ms = [&](const char* name) {
    return robot.component(name).fsm().period_ns() / 1'000'000;
  };
  EXPECT_EQ(period_ms("robot"), 10);
  EXPECT_EQ(period_ms("control"), 20);
  EXPECT_EQ(period_ms("guidance"), 100);  // gcd of the cycles of 5, 2 and 1 units
  EXPECT_EQ(period_ms("mapping"), 100);
  EXPECT_EQ(period_ms("exploration"), 500);
}

TEST(Components, OneRobotExploresARoomWhileItsCoresAreReplaced) {
  RobotArchitecture robot("room");
  robot.architecture().configure();
  mauve::Deployer deployer(robot.architecture(), {.require_realtime = false, .trace = true});
  deployer.deploy();
  std::this_thread::sleep_for(2200ms);
  EXPECT_FALSE(robot.done());
  const auto there = robot.component("exploration").swap_core(std::make_unique<LocalExplorationCore>());
  EXPECT_EQ(there.missed_releases, 0);
  std::this_thread::sleep_for(1200ms);
  const auto back = robot.component("exploration").swap_core(std::make_unique<ExplorationCore>());
  EXPECT_EQ(back.missed_releases, 0);
  EXPECT_TRUE(robot.wait_done(60s));
  deployer.shutdown();
  robot.expect_no_faults();
  EXPECT_GT(robot.coverage(), 0.99);
}

TEST(Components, WithASilentPeerExplorationWaitsAndLocalExplorationDoesNot) {
  RobotArchitecture robot("room", "robot_2");
  robot.architecture().configure();
  mauve::Deployer deployer(robot.architecture(), {.require_realtime = false, .trace = true});
  deployer.deploy();
  std::this_thread::sleep_for(1700ms);
  EXPECT_EQ(robot.goals(), 0U);
  EXPECT_FALSE(robot.done());
  robot.component("exploration").swap_core(std::make_unique<LocalExplorationCore>());
  const auto until = std::chrono::steady_clock::now() + 10s;
  while (robot.goals() == 0 && std::chrono::steady_clock::now() < until) std::this_thread::sleep_for(20ms);
  EXPECT_GT(robot.goals(), 0U);
  deployer.shutdown();
  robot.expect_no_faults();
}

TEST(Components, ReplacingTheRobotsOrTheMappingsCoreLosesNothing) {
  RobotArchitecture robot("arena");
  robot.architecture().configure();
  mauve::Deployer deployer(robot.architecture(), {.require_realtime = false, .trace = true});
  deployer.deploy();
  const auto until = std::chrono::steady_clock::now() + 30s;
  std::this_thread::sleep_for(200ms);  // until the first pose is there
  while (distance_m(robot.pose(), robot.start()) < 4.0 && std::chrono::steady_clock::now() < until) {
    std::this_thread::sleep_for(20ms);
  }
  const double covered = robot.coverage();
  robot.component("mapping").swap_core(std::make_unique<MappingCore>());
  EXPECT_GE(robot.coverage(), covered);
  robot.component("robot").swap_core(std::make_unique<RobotCore>());
  EXPECT_GT(distance_m(robot.pose(), robot.start()), 2.0);
  deployer.shutdown();
  robot.expect_no_faults();
}

TEST(Components, ARobotStandsStillOnceCommandsNoLongerCome) {
  RobotArchitecture robot("arena");
  robot.architecture().configure();
  mauve::Simulation simulation;
  mauve::SimulatedHost& host = simulation.add(robot.architecture());
  simulation.deploy();
  const auto run_for = [&](mauve::time_ns_t time_ns) { simulation.run_until(simulation.now_ns() + time_ns); };
  run_for(mauve::ms_to_ns(100));
  host.stop("control");
  Twist forward;
  forward.linear.x = 0.1;
  const mauve::time_ns_t last_ns = simulation.now_ns() + mauve::s_to_ns(2);
  simulation.every(simulation.now_ns(), mauve::ms_to_ns(20), [&] {
    if (simulation.now_ns() <= last_ns) robot.command(forward, simulation.now_ns());
  });
  simulation.run_until(last_ns);
  const Pose2D last = robot.pose();
  EXPECT_GT(distance_m(last, robot.start()), 0.1);
  run_for(mauve::ms_to_ns(150));  // the robot waits 200 ms for a command
  EXPECT_GT(distance_m(robot.pose(), last), 0.01);
  run_for(mauve::ms_to_ns(350));  // and brakes for 50 ms
  const Pose2D stopped = robot.pose();
  run_for(mauve::s_to_ns(1));
  EXPECT_EQ(distance_m(robot.pose(), stopped), 0.0);
  EXPECT_LT(distance_m(stopped, last), 0.03);
  simulation.shutdown();
  robot.expect_no_faults();
}

TEST(Components, ARobotThatDoesNotFitIsRefused) {
  RobotArchitecture robot("room");
  robot.component("robot").set_property("start_x", 0.0);
  robot.component("robot").set_property("start_y", 0.0);  // inside the pillar
  EXPECT_THROW(robot.architecture().configure(), mauve::Error);
}

TEST(Components, ExplorationOfOtherPeersIsNotTakenOver) {
  RobotArchitecture robot("room", "robot_2");
  robot.architecture().configure();
  RobotArchitecture stranger("room", "robot_3");
  stranger.architecture().configure();
  auto& mine = robot.component("exploration").core();
  EXPECT_FALSE(mine.adopt(stranger.component("exploration").core()));
  EXPECT_TRUE(mine.adopt(mine));
  RobotArchitecture elsewhere("arena", "robot_2");
  elsewhere.architecture().configure();
  EXPECT_FALSE(mine.adopt(elsewhere.component("exploration").core()));
}

}  // namespace mauve_examples::test_components
