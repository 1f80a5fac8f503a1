// SPDX-License-Identifier: LGPL-3.0-or-later
// The values that files, requests and ROS parameters set: of properties, and of the parameters of resources.
#pragma once

#include <concepts>
#include <cstdint>
#include <string>
#include <variant>

namespace mauve {

using PropertyValue = std::variant<bool, std::int64_t, double, std::string>;

template <typename T>
concept PropertyType = std::same_as<T, bool> || std::same_as<T, std::int64_t> || std::same_as<T, double> ||
                       std::same_as<T, std::string>;

}  // namespace mauve
