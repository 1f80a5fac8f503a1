// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_examples/control.hpp"

#include "mauve_examples/robots_in_sight.hpp"

namespace mauve_examples {

bool Control::configure_hook() {
  controller_.reset();
  scan_ = std::make_unique<Scan>();
  return true;
}

void Control::control() {
  ControlOptions options;
  options.max_speed_mps = shell().max_speed;
  options.heading.proportional = shell().heading_gain;
  options.distance.proportional = shell().distance_gain;
  controller_.set_options(options);
  const mauve::Sample<Pose2D> pose = shell().pose.read();
  const mauve::Sample<Point> target = shell().target.read();
  if (pose.status == mauve::DataStatus::none || target.status == mauve::DataStatus::none) {
    shell().command.write({});
    return;
  }
  shell().scan.read(*scan_);
  const Twist wanted = controller_.step(pose.value, target.value, static_cast<double>(period_ns()) * 1e-9);
  shell().command.write(keep_apart(wanted, *scan_, ApartOptions{}));
}

}  // namespace mauve_examples
