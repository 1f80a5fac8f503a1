// SPDX-License-Identifier: LGPL-3.0-or-later
// The elements of joints for architecture files: mauve_rt/JointTrajectory ... CMakeLists.txt lists the same for the ament index.
#include "joint_plugins.hpp"

#include <algorithm>

#include "mauve_rt/base/error.hpp"

namespace mauve::joints {

void require_room(const JointState& output, std::size_t joints, bool with_positions,
                  const std::string& element) {
  std::size_t room = std::min(output.name.capacity(), output.velocity.capacity());
  if (with_positions) room = std::min(room, output.position.capacity());
  if (room >= joints) return;
  throw Error(
      ErrorCode::configure_failed, "the resource of the port 'output' has too little room",
      {.element = element,
       .expected = "a capacity of at least " + std::to_string(joints) + " for the lists of names and values",
       .found = std::to_string(room),
       .remedy = "raise the capacities of name, position and velocity of the resource"});
}

}  // namespace mauve::joints

MAUVE_PLUGINS(registry) {
  mauve::joints::register_differential_drive(registry);
  mauve::joints::register_joint_trajectory(registry);
}
