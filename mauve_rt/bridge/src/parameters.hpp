// SPDX-License-Identifier: LGPL-3.0-or-later
// The parameters of a ROS command line, as rcl reads them: of `-p` and of parameter files.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace mauve::bridge {

/// A value of a parameter.
using ParameterValue = std::variant<bool, std::int64_t, double, std::string, std::vector<bool>,
                                    std::vector<std::int64_t>, std::vector<double>, std::vector<std::string>>;

/// The parameters of the nodes that a name or a pattern such as /** stands for.
struct NodeParameters {
  std::string nodes;
  std::vector<std::pair<std::string, ParameterValue>> values;
};

/// What `--ros-args` says to nodes, in rcl's order: a later value takes the place of an earlier one.
/// Throws Error (invalid_argument), with what rcl says. [non-rt]
std::vector<NodeParameters> parameters_of(const std::vector<std::string>& words);

}  // namespace mauve::bridge
