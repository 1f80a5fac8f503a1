// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_examples/robot.hpp"

#include <algorithm>
#include <cmath>

#include "mauve_examples/disc_collision.hpp"
#include "mauve_examples/ray_caster.hpp"

namespace mauve_examples {

namespace {

/// Of a frame that the port declares.
mauve::FrameName own_frame(const mauve::PortBase& port, std::string mauve::Frames::* which) {
  const std::string name = port.frames() == nullptr ? "" : port.frames()->*which;
  mauve::FrameName frame;
  if (!name.empty() && frame.assign(name)) return frame;
  const bool is_child = which == &mauve::Frames::child_frame;
  throw mauve::Error(
      mauve::ErrorCode::configure_failed, "the frame of a port is missing or too long",
      {.element = "port " + port.name(),
       .expected = std::string(is_child ? "child_frame" : "frame") + ", at most " +
                   std::to_string(mauve::FrameName::capacity()) + " characters",
       .found = name.empty() ? "none" : name,
       .remedy = "declare it under `frames` of the component, as architecture/robot.yaml does"});
}

mauve::Transform transform_of(const Pose2D& pose) {
  return {.translation = {.x = pose.x, .y = pose.y, .z = 0.0},
          .rotation = {.x = 0.0, .y = 0.0, .z = std::sin(pose.theta / 2.0), .w = std::cos(pose.theta / 2.0)}};
}

}  // namespace

bool Robot::configure_hook() {
  world_ = load_map(shell().map.value());
  body_ = {.pose = {shell().start_x, shell().start_y, shell().start_yaw},
           .speed_mps = 0.0,
           .turn_rate_radps = 0.0};
  if (disc_collides(world_, body_.pose.x, body_.pose.y, shell().radius)) {
    throw mauve::Error(
        mauve::ErrorCode::configure_failed, "the robot does not fit where it starts",
        {.element = "properties start_x, start_y",
         .expected = "a place free for a disc of " + std::to_string(shell().radius.value()) + " m",
         .found = "(" + std::to_string(body_.pose.x) + ", " + std::to_string(body_.pose.y) + ") in " +
                  shell().map.value(),
         .remedy = "start it elsewhere"});
  }
  const mauve::FrameName odom = own_frame(shell().odometry, &mauve::Frames::frame);
  const mauve::FrameName base = own_frame(shell().odometry, &mauve::Frames::child_frame);
  odom_ = {.parent = own_frame(shell().pose, &mauve::Frames::frame), .child = odom, .is_static = true};
  base_ = {.parent = odom, .child = base};
  scanner_ = {.parent = base, .child = own_frame(shell().scan, &mauve::Frames::frame), .is_static = true};
  are_static_frames_set_ = false;
  start_ = body_.pose;
  scan_ = std::make_unique<Scan>();
  walls_ = std::make_unique<Scan>();
  (void)beam_table();  // computed at its first use, which is not to be in real time
  others_.clear();
  steps_ = 0;
  collisions_ = 0;
  collision_mark_ = mauve::TraceNames::intern("collision");
  return true;
}

Twist Robot::command_in_force() const {
  const mauve::Sample<Twist> sample = shell().command.read();
  const auto timeout_ns = static_cast<mauve::time_ns_t>(shell().command_timeout * 1e9);
  return sample.status != mauve::DataStatus::none && sample.age_ns(clock_ns()) <= timeout_ns ? sample.value
                                                                                             : Twist{};
}

void Robot::move() {
  limits_.speed_mps = shell().max_speed;
  Unicycle next = body_;
  next.step(command_in_force(), limits_, static_cast<double>(period_ns()) * 1e-9);
  if (disc_collides(world_, next.pose.x, next.pose.y, shell().radius)) {
    next.pose.x = body_.pose.x;  // turning on the spot is always possible for a disc
    next.pose.y = body_.pose.y;
    next.speed_mps = 0.0;
    mauve::trace_mark(collision_mark_, ++collisions_);
  }
  body_ = next;
}

void Robot::meet_others() {
  constexpr std::int64_t kStepsPerTelling = 5;  // 20 Hz
  const auto number = static_cast<std::uint8_t>(shell().number.value());
  RobotBody body;
  while (shell().bodies.read(body) == mauve::DataStatus::new_data) {
    if (body.number == number) continue;
    const auto known = std::ranges::find(others_, body.number, &RobotBody::number);
    if (known != others_.end()) {
      *known = body;
    } else {
      others_.push_back(body);
    }
  }
  if (steps_++ % kStepsPerTelling == 0)
    shell().body.write({number, body_.pose.x, body_.pose.y, shell().radius.value()});
}

void Robot::set_frame(mauve::SetTransform::Request& request, const mauve::Transform& transform) {
  request.transform = transform;
  request.time_ns = clock_ns();
  mauve::SetTransform::Response response;
  shell().set_frame(request, response);
}

void Robot::set_frames() {
  const Pose2D odometry = pose_from(start_, body_.pose);
  shell().odometry.write(odometry);
  set_frame(base_, transform_of(odometry));
  if (are_static_frames_set_) return;
  are_static_frames_set_ = true;
  set_frame(odom_, transform_of(start_));
  set_frame(scanner_, {});  // beams begin at the centre, and beam 0 points ahead
}

void Robot::sense() {
  meet_others();
  const auto range_m = static_cast<float>(shell().max_range.value());
  const bool as_before = walls_->max_range_m == range_m && seen_from_.x == body_.pose.x &&
                         seen_from_.y == body_.pose.y && seen_from_.theta == body_.pose.theta;
  if (!as_before) range_scan(world_, body_.pose, range_m, *walls_);
  seen_from_ = body_.pose;
  *scan_ = *walls_;
  scan_robots(others_, body_.pose, *scan_);
  set_frames();  // before values of this time are there
  // One right after the other: who reads both on another CPU seldom gets one of them without the other.
  shell().pose.write(body_.pose);
  shell().scan.write(*scan_);
}

void Robot::take(mauve::CoreBase& old) noexcept {
  if (const auto* robot = dynamic_cast<const Robot*>(&old)) {
    body_ = robot->body_;
    start_ = robot->start_;
    others_ = robot->others_;
    collisions_ = robot->collisions_;
  }
}

}  // namespace mauve_examples
