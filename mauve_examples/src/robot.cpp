// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_examples/robot.hpp"

#include <algorithm>

#include "mauve_examples/disc_collision.hpp"
#include "mauve_examples/ray_caster.hpp"

namespace mauve_examples {

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

void Robot::sense() {
  meet_others();
  const auto range_m = static_cast<float>(shell().max_range.value());
  const bool as_before = walls_->max_range_m == range_m && seen_from_.x == body_.pose.x &&
                         seen_from_.y == body_.pose.y && seen_from_.theta == body_.pose.theta;
  if (!as_before) range_scan(world_, body_.pose, range_m, *walls_);
  seen_from_ = body_.pose;
  *scan_ = *walls_;
  scan_robots(others_, body_.pose, *scan_);
  // One right after the other: who reads both on another CPU seldom gets one of them without the other.
  shell().pose.write(body_.pose);
  shell().scan.write(*scan_);
}

void Robot::take(mauve::CoreBase& old) noexcept {
  if (const auto* robot = dynamic_cast<const Robot*>(&old)) {
    body_ = robot->body_;
    others_ = robot->others_;
    collisions_ = robot->collisions_;
  }
}

}  // namespace mauve_examples
