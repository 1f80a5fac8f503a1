// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/data/capacities.hpp"

#include <algorithm>
#include <iterator>
#include <string_view>

#include "mauve_rt/base/error.hpp"
#include "mauve_rt/data/number_place.hpp"

namespace mauve {

namespace {

constexpr std::string_view kPrefix = "capacity.";
constexpr std::int64_t kMost = 1'000'000'000;

void add_paths(const std::vector<FieldShape>& fields, const std::string& before,
               std::vector<std::string>& paths) {
  for (const FieldShape& field : fields) {
    const std::string path = before + field.name;
    if (field.arity == FieldArity::sequence) paths.push_back(path);
    add_paths(field.fields, path + ".", paths);
  }
}

/// Whether a path in the words of the message is that of a struct, whose members may have one word more.
bool is_path(std::string_view member, std::string_view field) {
  while (!member.empty() && !field.empty()) {
    if (!detail::is_field(detail::next_part(member), detail::next_part(field))) return false;
  }
  return member.empty() && field.empty();
}

std::size_t elsewhere(const std::vector<FieldShape>& fields, const std::string& before,
                      const Capacities& capacities) {
  std::size_t bytes = 0;
  for (const FieldShape& field : fields) {
    const std::string path = before + field.name;
    const std::size_t within = elsewhere(field.fields, path + ".", capacities);
    switch (field.arity) {
      case FieldArity::one:
        bytes += within;
        break;
      case FieldArity::fixed:
      case FieldArity::bounded:
        bytes += field.size * within;
        break;
      case FieldArity::sequence:
        bytes += capacities.at(path) * (field.item_bytes + within);
        break;
    }
  }
  return bytes;
}

std::size_t checked_capacity(const std::string& parameter, const PropertyValue& value) {
  const auto* const number = std::get_if<std::int64_t>(&value);
  if (number == nullptr) {
    throw Error(ErrorCode::type_mismatch, "a capacity is no whole number",
                {.element = parameter, .expected = "a number of elements, such as 100"});
  }
  if (*number < 1 || *number > kMost) {
    throw Error(ErrorCode::out_of_range, "a sequence cannot have that capacity",
                {.element = parameter,
                 .expected = "1 to " + std::to_string(kMost),
                 .found = std::to_string(*number)});
  }
  return static_cast<std::size_t>(*number);
}

}  // namespace

std::vector<std::string> sequence_paths(const MessageShape& message) {
  std::vector<std::string> paths;
  add_paths(message.fields, "", paths);
  return paths;
}

bool is_capacity(const std::string& parameter) { return parameter.starts_with(kPrefix); }

Capacities capacities_of(const MessageShape& message, const ResourceParameters& given) {
  const std::vector<std::string> paths = sequence_paths(message);
  Capacities capacities;
  for (const auto& [name, value] : given) {
    if (!is_capacity(name)) continue;
    const std::string_view asked = std::string_view(name).substr(kPrefix.size());
    const auto path = std::find_if(paths.begin(), paths.end(),
                                   [&](const std::string& each) { return is_path(each, asked); });
    if (path == paths.end()) {
      throw Error(ErrorCode::invalid_argument, "the type has no such sequence",
                  {.element = name,
                   .expected = paths.empty() ? "none: each field of " + message.type + " has its bound"
                                             : "one of " + join(paths),
                   .found = std::string(asked),
                   .remedy = "check the name"});
    }
    capacities[*path] = checked_capacity(name, value);
  }
  std::vector<std::string> missing;
  std::copy_if(paths.begin(), paths.end(), std::back_inserter(missing),
               [&](const std::string& path) { return !capacities.contains(path); });
  if (missing.empty()) return capacities;
  std::string remedy;
  for (const std::string& path : missing) remedy += (remedy.empty() ? "" : ", ") + path + ": N";
  throw Error(ErrorCode::invalid_argument, "each sequence of " + message.type + " needs a capacity",
              {.element = std::string(kPrefix) + missing.front(),
               .expected = "how many elements it holds at most",
               .found = "none",
               .remedy = "add capacity: {" + remedy + "}"});
}

std::size_t value_bytes(const MessageShape& message, const Capacities& capacities) {
  return message.bytes + elsewhere(message.fields, "", capacities);
}

std::string overflow_text(const std::string& path, std::size_t capacity, std::size_t size) {
  const std::string count =
      size == 0 ? "more elements than its memory holds" : std::to_string(size) + " elements";
  return path + " has " + count + ", the resource's capacity is " + std::to_string(capacity) +
         ": write no more, or raise capacity." + path + " of the resource";
}

}  // namespace mauve
