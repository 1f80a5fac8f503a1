// SPDX-License-Identifier: LGPL-3.0-or-later
// The elements of joints: they stand in sources, since their ports are of types that are generated in this build.
#pragma once

#include <string>

#include <mauve_types/sensor_msgs/msg/joint_state.hpp>

#include "mauve_rt/architecture/plugin.hpp"

namespace mauve::joints {

using msg::sensor_msgs::JointState;

/// Throws Error (configure_failed) where a message of the output has no room for so many joints with a velocity. [setup]
void require_room(const JointState& output, std::size_t joints, bool with_positions,
                  const std::string& element);

/// [setup]
void register_differential_drive(PluginRegistry& registry);
void register_joint_trajectory(PluginRegistry& registry);

}  // namespace mauve::joints
