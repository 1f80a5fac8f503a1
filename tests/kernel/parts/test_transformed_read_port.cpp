// SPDX-License-Identifier: LGPL-3.0-or-later
// Values in the frame of who reads them; how they are computed is held to scipy by test_transformed_values.py.
#include <cmath>

#include "fixtures.hpp"

namespace mauve::testing::test_transformed_read_port {

struct Stamp {
  std::int32_t sec{0};
  std::uint32_t nanosec{0};
};
struct Header {
  Stamp stamp{};
  BoundedString<31> frame_id{};
};
struct Point3 {
  double x{0.0}, y{0.0}, z{0.0};
};
struct Seen {
  Header header{};
  Point3 point{};
};
struct Bare {
  Vector3 force{};
  Vector3 torque{};
};
struct Moving {
  struct Velocity {
    Vector3 linear{};
    Vector3 angular{};
  } twist{};
  std::array<double, 36> covariance{};
};

}  // namespace mauve::testing::test_transformed_read_port

MAUVE_TYPE(mauve::testing::test_transformed_read_port::Stamp, "test_frames/Stamp", sec, nanosec)
MAUVE_TYPE(mauve::testing::test_transformed_read_port::Header, "test_frames/Header", stamp, frame_id)
MAUVE_TYPE(mauve::testing::test_transformed_read_port::Point3, "test_frames/Point3", x, y, z)
MAUVE_TYPE(mauve::testing::test_transformed_read_port::Seen, "test_frames/Seen", header, point)
MAUVE_TYPE(mauve::testing::test_transformed_read_port::Bare, "test_frames/Bare", force, torque)

namespace mauve::testing::test_transformed_read_port {

const double kHalf = std::sqrt(0.5);
const Transform kQuarterLeft{.translation = {.x = 1.0, .y = 2.0, .z = 0.0},
                             .rotation = {.x = 0.0, .y = 0.0, .z = kHalf, .w = kHalf}};

TEST(TransformedValues, AreToldByTheirFields) {
  Point3 point{.x = 1.0};
  transform_value(kQuarterLeft, point);
  EXPECT_NEAR(1.0, point.x, 1e-12);
  EXPECT_NEAR(3.0, point.y, 1e-12);
  Vector3 vector{.x = 1.0};
  transform_value(kQuarterLeft, vector);
  EXPECT_NEAR(0.0, vector.x, 1e-12) << "a vector turns, and does not move";
  EXPECT_NEAR(1.0, vector.y, 1e-12);
  Bare wrench{.force = {.x = 1.0}};
  transform_value(kQuarterLeft, wrench);
  EXPECT_NEAR(1.0, wrench.force.y, 1e-12);
  EXPECT_NEAR(1.0, wrench.torque.z, 1e-12) << "(1, 2, 0) x (0, 1, 0)";
  Moving moving{.twist = {.angular = {.z = 1.0}}};
  moving.covariance[35] = 4.0;
  transform_value(kQuarterLeft, moving);
  EXPECT_NEAR(2.0, moving.twist.linear.x, 1e-12) << "(1, 2, 0) x (0, 0, 1)";
  EXPECT_NEAR(-1.0, moving.twist.linear.y, 1e-12);
  EXPECT_NEAR(16.0, moving.covariance[0], 1e-12) << "of what the rotation moves the origin by";
  Quaternion rotation;
  transform_value(kQuarterLeft, rotation);
  EXPECT_NEAR(kHalf, rotation.z, 1e-12);
}

struct SeeShell : Shell {
  CallPort<CallOf<LookupTransform>>& lookup = call_port<LookupTransform>("lookup");
  TransformedReadPort<Seen> thing{read_port<Seen>("thing"), lookup, {.to = "map"}};
  TransformedReadPort<Seen> latest{read_port<Seen>("latest"), lookup, {.to = "map", .is_latest = true}};
  TransformedReadPort<Bare> push{read_port<Bare>("push").in_frame("base"), lookup, {.to = "map"}};
  TransformedReadPort<Bare> lost{read_port<Bare>("lost"), lookup, {.to = "map"}};
  WritePort<Seen>& seen = write_port<Seen>("seen");
  WritePort<Bare>& pushed = write_port<Bare>("pushed");
};

struct SeeCore : Core<SeeShell> {
  void update() {
    shell().seen.write({.header = {.frame_id = "base"}, .point = {.x = 1.0}});
    shell().pushed.write({.force = {.x = 1.0}});
    thing = shell().thing.read();
    latest = shell().latest.read();
    push = shell().push.read();
    lost = shell().lost.read();
    ++runs;
  }
  TransformedSample<Seen> thing, latest;
  TransformedSample<Bare> push, lost;
  std::atomic<int> runs{0};
};

struct SeeFsm : Fsm<SeeShell, SeeCore> {
  void define() override {
    State& run = execution("Run", "update", &SeeCore::update);
    State& pause = wait("Pause", ms_to_ns(2));
    set_initial(run);
    next(run, pause);
    next(pause, run);
  }
};

struct Rig {
  Rig() {
    architecture.add_resource<SharedData<Seen>>("seen");
    architecture.add_resource<SharedData<Bare>>("pushed");
    tree = &architecture.add_resource<TransformTree>("frames");
    architecture.add_component<SeeShell, SeeCore, SeeFsm>("see");
    architecture.connect("see", "lookup", "frames", "lookup");
    for (const char* const port : {"thing", "latest"}) architecture.connect("see", port, "seen", "read");
    for (const char* const port : {"push", "lost"}) architecture.connect("see", port, "pushed", "read");
    architecture.connect("see", "seen", "seen", "write");
    architecture.connect("see", "pushed", "pushed", "write");
    architecture.configure();
  }
  SeeCore& run() {
    Simulation simulation;
    simulation.add(architecture);
    simulation.deploy();
    simulation.run_until(simulation.epoch_ns() + ms_to_ns(5));
    simulation.shutdown();
    return architecture.component("see").core_as<SeeCore>();
  }
  void set(time_ns_t time_ns, bool is_static) {
    const SetTransform::Request request{.parent = "map",
                                        .child = "base",
                                        .transform = kQuarterLeft,
                                        .time_ns = time_ns,
                                        .is_static = is_static};
    SetTransform::Response response;
    tree->set.call(request, response);
    ASSERT_EQ(TransformOutcome::done, response.result());
  }

  Architecture architecture;
  TransformTree* tree;
};

TEST(TransformedReadPort, YieldsValuesInItsOwnFrame) {
  Rig rig;
  rig.set(0, true);
  const SeeCore& core = rig.run();
  ASSERT_TRUE(core.thing);
  EXPECT_NEAR(3.0, core.thing.value.point.y, 1e-12);
  EXPECT_EQ("map", core.thing.value.header.frame_id);
  ASSERT_TRUE(core.push) << "values without a header have the frame that the port was given";
  EXPECT_NEAR(1.0, core.push.value.torque.z, 1e-12);
  EXPECT_FALSE(core.lost);
  EXPECT_EQ(TransformOutcome::unknown_frame, core.lost.outcome);
}

TEST(TransformedReadPort, LooksAtTheTimeOfTheValue) {
  Rig rig;
  rig.set(1, false);
  const SeeCore& core = rig.run();
  EXPECT_FALSE(core.thing);
  EXPECT_EQ(TransformOutcome::after_interval, core.thing.outcome);
  EXPECT_EQ("base", core.thing.frame);
  EXPECT_EQ(0.0, core.thing.value.point.y) << "no value of another frame is passed off as one";
  EXPECT_TRUE(core.latest);
}

TEST(TransformedReadPort, AllocatesNothing) {
  if (allocation_counting() == AllocationCounting::none)
    GTEST_SKIP() << "a sanitizer counts allocations itself";
  Rig rig;
  rig.set(0, true);
  Deployer deployer(rig.architecture);
  deployer.deploy();
  Component& component = rig.architecture.component("see");
  wait_until([&] { return component.core_as<SeeCore>().runs.load() > 5; }, "some releases");
  EXPECT_EQ(0U, component.task().counters().allocations());
}

}  // namespace mauve::testing::test_transformed_read_port
