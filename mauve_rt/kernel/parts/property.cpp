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

/// In no more digits than people read.
std::string rounded(double value) {
  std::array<char, 32> text{};
  constexpr int kDigits = 6;
  const auto end =
      std::to_chars(text.data(), text.data() + text.size(), value, std::chars_format::general, kDigits).ptr;
  return {text.data(), end};
}

/// "at least 0 m and at most 10 m".
std::string range_of(const PropertyOptions& options) {
  const std::string unit = options.unit.empty() || options.unit == "1" ? "" : " " + options.unit;
  std::string words;
  if (options.minimum) words = "at least " + rounded(*options.minimum) + unit;
  if (options.maximum)
    words += (words.empty() ? "at most " : " and at most ") + rounded(*options.maximum) + unit;
  return words.empty() ? "a number" : words;  // NaN is none
}

bool is_in_range(const PropertyOptions& options, double value) noexcept {
  const bool below = options.minimum && !(value >= *options.minimum);
  const bool above = options.maximum && !(value <= *options.maximum);
  return !below && !above;
}

void check_range(const std::string& name, const PropertyOptions& options, double value) {
  if (is_in_range(options, value) && !std::isnan(value)) return;
  throw Error(ErrorCode::out_of_range, "the value is out of range",
              {.element = "property " + name, .expected = range_of(options), .found = rounded(value)});
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

PropertyValue checked(const std::string& name, const PropertyValue& example, const PropertyOptions& options,
                      const PropertyValue& value) {
  constexpr std::array<std::string_view, 4> kTypes{"true or false", "a whole number", "a number", "text"};
  const auto* integer = std::get_if<std::int64_t>(&value);
  const bool is_float = std::holds_alternative<double>(example);
  PropertyValue converted = is_float && integer != nullptr ? static_cast<double>(*integer) : value;
  if (converted.index() != example.index()) {
    throw Error(ErrorCode::type_mismatch, "the value is of another type",
                {.element = "property " + name,
                 .expected = std::string(kTypes[example.index()]),
                 .found = std::string(property_type_name(value)) + " " + to_string(value),
                 .remedy = std::holds_alternative<std::string>(example) ? "put it in quotes" : ""});
  }
  if (const auto* real = std::get_if<double>(&converted)) check_range(name, options, *real);
  if (integer != nullptr && !is_float) check_range(name, options, static_cast<double>(*integer));
  return converted;
}

void check_declaration(const std::string& name, const PropertyValue& initial,
                       const PropertyOptions& options) {
  const auto refuse = [&name](const char* what, const std::string& expected, const std::string& found) {
    throw Error(ErrorCode::invalid_argument, what,
                {.element = "property " + name,
                 .expected = expected,
                 .found = found,
                 .remedy = "correct its minimum and maximum"});
  };
  for (const std::optional<double>& limit : {options.minimum, options.maximum}) {
    if (limit && std::isnan(*limit)) refuse("a limit of the range is no number", "numbers", "nan");
  }
  if (options.minimum && options.maximum && *options.minimum > *options.maximum) {
    refuse("the minimum is above the maximum", "minimum <= maximum",
           "minimum " + rounded(*options.minimum) + ", maximum " + rounded(*options.maximum));
  }
  const auto* integer = std::get_if<std::int64_t>(&initial);
  const auto* real = std::get_if<double>(&initial);
  if (integer == nullptr && real == nullptr) return;
  const double value = real != nullptr ? *real : static_cast<double>(*integer);
  if (is_in_range(options, value)) return;
  throw Error(ErrorCode::out_of_range, "the initial value is out of the property's own range",
              {.element = "property " + name,
               .expected = range_of(options),
               .found = rounded(value),
               .remedy = "correct the initial value, or its minimum and maximum"});
}

template class Property<bool>;
template class Property<std::int64_t>;
template class Property<double>;
template class Property<std::string>;

}  // namespace mauve
