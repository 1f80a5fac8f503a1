// SPDX-License-Identifier: LGPL-3.0-or-later
// Properties: typed parameters of a shell, with default, unit, description and range.
#pragma once

#include <concepts>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>

namespace mauve {

using PropertyValue = std::variant<bool, std::int64_t, double, std::string>;

template <typename T>
concept PropertyType = std::same_as<T, bool> || std::same_as<T, std::int64_t> || std::same_as<T, double> ||
                       std::same_as<T, std::string>;

/// "bool", "int", "float" or "str", as architecture files have them. [rt]
std::string_view property_type_name(const PropertyValue& value) noexcept;
/// The value as an architecture file would show it. [non-rt]
std::string to_string(const PropertyValue& value);

struct PropertyOptions {
  std::string unit{};
  std::string description{};
  std::optional<double> minimum{};
  std::optional<double> maximum{};
  bool operator==(const PropertyOptions&) const = default;
};

/// A property seen without its type.
///
/// | member           | written by                                                  | read by            |
/// |------------------|-------------------------------------------------------------|--------------------|
/// | the value        | assign(): the component's thread inside a wait, or [setup]  | component's thread |
/// | name_, options_  | constructor                                                 | anyone             |
class PropertyBase {
 public:
  PropertyBase(std::string name, PropertyOptions options)
      : name_(std::move(name)), options_(std::move(options)) {}
  virtual ~PropertyBase() = default;

  const std::string& name() const noexcept { return name_; }
  const PropertyOptions& options() const noexcept { return options_; }
  /// The present value; of a running component ask Component::property_values(). [setup]
  virtual PropertyValue boxed() const = 0;
  /// The value converted to the property's type (an integer serves where a float is asked for). [non-rt]
  /// Throws Error: type_mismatch, out_of_range.
  virtual PropertyValue checked(const PropertyValue& value) const = 0;
  /// Takes a value that checked() returned, by swapping it with the present one. [rt]
  virtual void swap(PropertyValue& value) noexcept = 0;

 protected:
  void check_range(double value) const;

 private:
  std::string name_;
  PropertyOptions options_;
};

template <PropertyType T>
class Property final : public PropertyBase {
 public:
  Property(std::string name, T initial, PropertyOptions options)
      : PropertyBase(std::move(name), std::move(options)), value_(std::move(initial)) {}

  /// The value in force since the component last left a wait. [rt]
  const T& value() const noexcept { return value_; }
  operator const T&() const noexcept {
    return value_;
  }  // NOLINT: reads like the value, as in the paper's listings

  PropertyValue boxed() const override { return value_; }
  PropertyValue checked(const PropertyValue& value) const override;
  void swap(PropertyValue& value) noexcept override { std::swap(std::get<T>(value), value_); }

 private:
  T value_;
};

extern template class Property<bool>;
extern template class Property<std::int64_t>;
extern template class Property<double>;
extern template class Property<std::string>;

}  // namespace mauve
