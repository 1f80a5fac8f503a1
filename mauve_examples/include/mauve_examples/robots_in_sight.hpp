// SPDX-License-Identifier: LGPL-3.0-or-later
// The other robots that a range finder sees: no radio is needed for what is in sight.
#pragma once

#include "mauve_examples/types.hpp"

namespace mauve_examples {

/// A robot in sight.
struct Sighting {
  std::uint8_t number{0};
  Point at;  // its centre, as far as its visible side tells
};

inline constexpr std::size_t kMaxSightings = 16;
using Sightings = mauve::BoundedVector<Sighting, kMaxSightings>;

/// Every robot that beams of the scan ended at. [rt]
void robots_in_sight(const Scan& scan, const Pose2D& pose, Sightings& found) noexcept;

struct ApartOptions {
  double gap_m{0.08};        // between two robots that stand
  double braking_mps2{1.6};  // a little less than the body's
  double delay_s{0.12};      // from a robot's move to the other's command
  double turning_rad{0.35};  // how far the heading may have turned until the robot has slowed down
};

/// The wanted velocities, slowed so that the robot stops within half of the way to every robot in sight: as long as
/// each does so, no two meet. Turning on the spot is always allowed. [rt]
Twist keep_apart(const Twist& wanted, const Scan& scan, const ApartOptions& options) noexcept;

}  // namespace mauve_examples
