// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/parts/duration.hpp"

#include <array>
#include <string_view>

#include "mauve_rt/base/error.hpp"

namespace mauve {

namespace {

struct TimeUnit {
  std::string_view name;
  time_ns_t ns;
};
constexpr std::array<TimeUnit, 4> kUnits{
    {{"ns", 1}, {"us", us_to_ns(1)}, {"ms", ms_to_ns(1)}, {"s", s_to_ns(1)}}};

}  // namespace

Duration times(std::int64_t factor, const PropertyBase& property) {
  const PropertyValue value = property.boxed();
  const auto* const count = std::get_if<std::int64_t>(&value);
  const std::string& unit = property.options().unit;
  const TimeUnit* found = nullptr;
  for (const TimeUnit& known : kUnits)
    if (known.name == unit) found = &known;
  if (count == nullptr || found == nullptr) {
    throw Error(ErrorCode::invalid_argument, "the property is no length of time",
                {.element = "property " + property.name(),
                 .expected = "an int property whose unit is ns, us, ms or s",
                 .found = std::string(property_type_name(value)) + " of " +
                          (unit.empty() ? "no unit" : "unit " + unit),
                 .remedy = "give the property type and unit of a time, or compute the time in ns"});
  }
  std::string text = std::to_string(factor) + " * " + property.name();
  time_ns_t units = 0;
  time_ns_t length_ns = 0;
  if (__builtin_mul_overflow(factor, *count, &units) ||
      __builtin_mul_overflow(units, found->ns, &length_ns)) {
    throw Error(ErrorCode::out_of_range, "the time is longer than a time can be",
                {.element = text,
                 .expected = "at most " + std::to_string(kLongest) + " ns",
                 .found = std::to_string(factor) + " * " + std::to_string(*count) + " " + unit,
                 .remedy = "lower the factor or the property, and give the property a maximum"});
  }
  return {length_ns, std::move(text)};
}

}  // namespace mauve
