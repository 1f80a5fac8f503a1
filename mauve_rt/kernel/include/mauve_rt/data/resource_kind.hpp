// SPDX-License-Identifier: LGPL-3.0-or-later
// What a kind of resource tells of itself; files, requests and their checks know of it what stands here.
#pragma once

#include <array>
#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "mauve_rt/base/rt.hpp"
#include "mauve_rt/base/value.hpp"

namespace mauve {

/// What one resource of a kind can be told.
struct ResourceParameter {
  std::string name;
  PropertyValue initial;      // unless told otherwise; its type is the parameter's
  std::string description{};  // what it says, as "how long a call may take"
  std::string unit{};
  std::optional<double> minimum{};
  std::optional<double> maximum{};
  bool is_required{false};
  std::size_t values_each{0};   // values that take memory, for each one that it counts
  bool is_reader_limit{false};  // so many ports may connect to the service `read`
  std::string file_key{};       // where architecture files have it, unless under its name
  bool operator==(const ResourceParameter&) const = default;
};

/// Whose types a resource may be of.
enum class TypeNeed : std::uint8_t { none, data, call, action };

/// As PluginRegistry::names() has these types; "": it has none. [rt]
constexpr std::string_view to_string(TypeNeed need) MAUVE_RT {
  constexpr std::array<std::string_view, 4> kNames{"", "type", "call_type", "action_type"};
  return kNames[static_cast<std::size_t>(need)];
}

struct ResourceKind {
  std::string name;
  std::vector<ResourceParameter> parameters{};
  TypeNeed type{TypeNeed::none};
  std::vector<std::string> messages{};  // as which its topic may say it, the last where no type is given
  std::size_t values{0};                // so many take memory, besides those that parameters count
  bool has_one_writer{false};           // the service `write` is for one port, or an incoming topic
  bool operator==(const ResourceKind&) const = default;
};

/// By name. A kind's factory gets all of its parameters, checked.
using ResourceParameters = std::map<std::string, PropertyValue>;

/// A parameter's value. [setup]
template <PropertyType T>
const T& get(const ResourceParameters& parameters, const std::string& name) {
  return std::get<T>(parameters.at(name));
}

/// Of one message where no library registered its type, so that it is held serialized. [setup]
ResourceParameter max_bytes_parameter();

}  // namespace mauve
