// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/parts/property.hpp"

#include <array>
#include <charconv>
#include <cmath>

#include "mauve_rt/base/error.hpp"

namespace mauve {

namespace {

std::string number(double value) {
  std::array<char, 32> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value).ptr;
  std::string shown(text.data(), end);
  return shown.find_first_of(".en") == std::string::npos ? shown + ".0" : shown;
}

/// The value as T, or nothing when it is of another type; an integer serves as a float.
template <typename T>
std::optional<T> convert(const PropertyValue& value) {
  if (const T* same = std::get_if<T>(&value)) return *same;
  if constexpr (std::same_as<T, double>) {
    if (const auto* integer = std::get_if<std::int64_t>(&value)) return static_cast<double>(*integer);
  }
  return std::nullopt;
}

}  // namespace

std::string_view property_type_name(const PropertyValue& value) noexcept {
  constexpr std::array<std::string_view, 4> kNames{"bool", "int", "float", "str"};
  return kNames[value.index()];
}

std::string to_string(const PropertyValue& value) {
  if (const auto* boolean = std::get_if<bool>(&value)) return *boolean ? "true" : "false";
  if (const auto* integer = std::get_if<std::int64_t>(&value)) return std::to_string(*integer);
  if (const auto* real = std::get_if<double>(&value)) return number(*real);
  return std::get<std::string>(value);
}

std::vector<std::string> names_of(ReadBy parts) {
  std::vector<std::string> names;
  for (const auto& [part, name] :
       {std::pair{ReadBy::shell, "shell"}, std::pair{ReadBy::core, "core"}, std::pair{ReadBy::fsm, "fsm"}}) {
    if (without(part, parts) == ReadBy::none) names.emplace_back(name);
  }
  return names;
}

void PropertyBase::check_range(double value) const {
  const bool below = options_.minimum && !(value >= *options_.minimum);
  const bool above = options_.maximum && !(value <= *options_.maximum);
  if (!below && !above && !std::isnan(value)) return;
  const std::string low = options_.minimum ? number(*options_.minimum) : "-inf";
  const std::string high = options_.maximum ? number(*options_.maximum) : "inf";
  throw Error(ErrorCode::out_of_range, "the value is out of range",
              {.element = "property " + name_,
               .expected = low + " to " + high + (options_.unit.empty() ? "" : " " + options_.unit),
               .found = number(value),
               .remedy = "choose a value in the range"});
}

template <PropertyType T>
PropertyValue Property<T>::checked(const PropertyValue& value) const {
  const std::optional<T> converted = convert<T>(value);
  if (!converted) {
    throw Error(ErrorCode::type_mismatch, "the value is of another type",
                {.element = "property " + name(),
                 .expected = std::string(property_type_name(PropertyValue(value_))),
                 .found = std::string(property_type_name(value)) + " " + to_string(value),
                 .remedy = "write the value as the property's type"});
  }
  if constexpr (std::same_as<T, double> || std::same_as<T, std::int64_t>)
    check_range(static_cast<double>(*converted));
  return *converted;
}

template class Property<bool>;
template class Property<std::int64_t>;
template class Property<double>;
template class Property<std::string>;

}  // namespace mauve
