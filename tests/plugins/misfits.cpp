// SPDX-License-Identifier: LGPL-3.0-or-later
// Structs that bear the names of ROS messages and are not like them, one that is, and one too large for most stacks.
#include <array>

#include "mauve_rt/mauve_rt.hpp"

namespace misfits {

/// geometry_msgs/msg/Vector3 with two fields in each other's place.
struct Swapped {
  double y{};
  double x{};
  double z{};
};
/// geometry_msgs/msg/Quaternion without its last field.
struct Short {
  double x{};
  double y{};
  double z{};
};
/// geometry_msgs/msg/Pose2D and a field more.
struct Long {
  double x{};
  double y{};
  double theta{};
  double age{};
};
/// std_msgs/msg/Float32
struct Wide {
  double data{};
};
struct Point {
  double x{};
  double y{};
  double z{};
};
/// geometry_msgs/msg/Pose with a message of another name, and a misfit, within.
struct Pose {
  Point position;
  Short orientation;
};
/// geometry_msgs/msg/Polygon of points in double precision.
struct Polygon {
  mauve::BoundedVector<Point, 4> points;
};
/// mauve_msgs/msg/PeerAck with room for longer names.
struct Ack {
  mauve::BoundedString<64> peer;
  std::uint32_t sequence{};
  std::uint32_t round{};
  std::uint32_t map_batch{};
};
/// geometry_msgs/msg/AccelWithCovariance has 36 in place of 35.
struct Accel {
  Point linear;
  Point angular;
};
struct Covariance {
  Accel accel;
  std::array<double, 35> covariance{};
};
struct TriggerRequest {};
struct TriggerResponse {
  mauve::BoundedString<16> message;
  bool success{};
};
struct Trigger {
  using Request = TriggerRequest;
  using Response = TriggerResponse;
};

struct OutputStep {
  mauve::BoundedString<16> output;
  double greatest{};
  double difference{};
  double least{};
  std::int64_t least_instant_ns{};
  double step{};
};

/// As mauve_msgs/msg/StepReport, the names with a word more where that says more, shorter strings.
struct Report {
  mauve::BoundedString<16> step;
  mauve::BoundedString<16> component_name;
  std::int64_t prepare_ns{};
  std::int64_t blackout_ns{};
  std::int64_t missed_releases{};
  std::int64_t phase_nominal_ns{};
  std::int64_t phase_actual_ns{};
  mauve::BoundedString<16> from_core;
  mauve::BoundedString<16> to_core;
  mauve::BoundedString<16> remark;
  std::int64_t instant_ns{};
  std::int64_t release_ns{};
  mauve::BoundedVector<mauve::BoundedString<64>, 4> taken;
  mauve::BoundedVector<mauve::BoundedString<64>, 4> left;
  mauve::BoundedVector<OutputStep, 4> outputs;
};

struct Large {
  std::array<std::uint8_t, 3'000'000> data{};
};

}  // namespace misfits

MAUVE_TYPE(misfits::Swapped, "geometry_msgs/msg/Vector3", y, x, z)
MAUVE_TYPE(misfits::Short, "geometry_msgs/msg/Quaternion", x, y, z)
MAUVE_TYPE(misfits::Long, "geometry_msgs/msg/Pose2D", x, y, theta, age)
MAUVE_TYPE(misfits::Wide, "std_msgs/msg/Float32", data)
MAUVE_TYPE(misfits::Point, "geometry_msgs/msg/Point", x, y, z)
MAUVE_TYPE(misfits::Pose, "geometry_msgs/msg/Pose", position, orientation)
MAUVE_TYPE(misfits::Polygon, "geometry_msgs/msg/Polygon", points)
MAUVE_TYPE(misfits::Ack, "mauve_msgs/msg/PeerAck", peer, sequence, round, map_batch)
MAUVE_TYPE(misfits::Accel, "geometry_msgs/msg/Accel", linear, angular)
MAUVE_TYPE(misfits::Covariance, "geometry_msgs/msg/AccelWithCovariance", accel, covariance)
MAUVE_TYPE(misfits::TriggerRequest, "std_srvs/srv/Trigger_Request")
MAUVE_TYPE(misfits::TriggerResponse, "std_srvs/srv/Trigger_Response", message, success)
MAUVE_CALL_TYPE(misfits::Trigger, "std_srvs/srv/Trigger")
MAUVE_TYPE(misfits::OutputStep, "mauve_msgs/msg/OutputStep", output, greatest, difference, least,
           least_instant_ns, step)
MAUVE_TYPE(misfits::Report, "mauve_msgs/msg/StepReport", step, component_name, prepare_ns, blackout_ns,
           missed_releases, phase_nominal_ns, phase_actual_ns, from_core, to_core, remark, instant_ns,
           release_ns, taken, left, outputs)
MAUVE_TYPE(misfits::Large, "misfits/Large", data)

namespace misfits {

/// Passes what it reads on, at every activation.
template <typename T>
struct PassShell : mauve::Shell {
  mauve::ReadPort<T>& input = this->template read_port<T>("input");
  mauve::WritePort<T>& output = this->template write_port<T>("output");
};
template <typename T>
struct Pass : mauve::Core<PassShell<T>> {
  void act() {
    const auto sample = this->shell().input.read();
    if (sample.is_new()) this->shell().output.write(sample.value);
  }
};
template <typename T>
struct PassFsm : mauve::Fsm<PassShell<T>, Pass<T>> {
  void define() override {
    mauve::State& run = this->execution("Pass", "act", &Pass<T>::act);
    mauve::State& pause = this->wait("Pause", mauve::ms_to_ns(10));
    this->set_initial(run);
    this->next(run, pause);
    this->next(pause, run);
  }
};

template <typename T>
void register_pass(mauve::PluginRegistry& registry, const std::string& name) {
  registry.shell<PassShell<T>>(name + "Shell");
  registry.core<Pass<T>>(name, name + "Shell");
  registry.fsm<PassFsm<T>>(name + "Fsm", name + "Shell");
}

}  // namespace misfits

MAUVE_PLUGINS(registry) {
  registry.type<misfits::Swapped>();
  registry.type<misfits::Short>();
  registry.type<misfits::Long>();
  registry.type<misfits::Wide>();
  registry.type<misfits::Pose>();
  registry.type<misfits::Polygon>();
  registry.type<misfits::Ack>();
  registry.type<misfits::Covariance>();
  registry.type<misfits::Report>();
  registry.type<misfits::Large>();
  registry.call_type<misfits::Trigger>();
  misfits::register_pass<misfits::Short>(registry, "misfits/Short");
  misfits::register_pass<misfits::Large>(registry, "misfits/Large");
}
