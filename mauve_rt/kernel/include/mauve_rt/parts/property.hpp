// SPDX-License-Identifier: LGPL-3.0-or-later
// Properties: typed parameters of a shell, with default, unit, description and range.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "mauve_rt/base/previews.hpp"
#include "mauve_rt/base/rt.hpp"
#include "mauve_rt/base/value.hpp"

namespace mauve {

/// "bool", "int", "float" or "str", as architecture files have them. [rt]
std::string_view property_type_name(const PropertyValue& value) MAUVE_RT;
/// The value as an architecture file would show it. [non-rt]
std::string to_string(const PropertyValue& value);

/// The parts of a component that read a property only when they are configured: `ReadBy::core | ReadBy::fsm`.
enum class ReadBy : std::uint8_t { none = 0, shell = 1, core = 2, fsm = 4 };

/// [rt]
constexpr ReadBy operator|(ReadBy a, ReadBy b) MAUVE_RT {
  return static_cast<ReadBy>(static_cast<unsigned>(a) | static_cast<unsigned>(b));
}
/// Those of `a` that are not in `b`. [rt]
constexpr ReadBy without(ReadBy a, ReadBy b) MAUVE_RT {
  return static_cast<ReadBy>(static_cast<unsigned>(a) & ~static_cast<unsigned>(b));
}
/// "shell", "core", "fsm", as many as there are. [non-rt]
std::vector<std::string> names_of(ReadBy parts);

struct PropertyOptions {
  std::string unit{};
  std::string description{};
  std::optional<double> minimum{};
  std::optional<double> maximum{};
  /// Who reads it in configure or define, such as the length of a wait or a size: once the component is configured
  /// it is set only beside the replacement of these parts, in one transaction.
  ReadBy structural{};
  bool operator==(const PropertyOptions&) const = default;
};

/// The value as a property of `example`'s type has it: an integer serves where a float is asked for. The one check of
/// whatever a property is set to, by a file, a request or a program. [non-rt]
/// Throws Error: type_mismatch, out_of_range.
PropertyValue checked(const std::string& name, const PropertyValue& example, const PropertyOptions& options,
                      const PropertyValue& value);

/// Refuses a range that no value fits, and an initial value out of it. [setup] Throws Error: invalid_argument, out_of_range.
void check_declaration(const std::string& name, const PropertyValue& initial, const PropertyOptions& options);

/// A property seen without its type.
///
/// | member           | written by                                                  | read by            |
/// |------------------|-------------------------------------------------------------|--------------------|
/// | the value        | swap(): the component's thread inside a wait, or [setup]    | component's thread |
/// | previews_        | preview(), end_preview(): who prepares parts                | each its own: base/previews.hpp |
/// | name_, options_  | constructor                                                 | anyone             |
class PropertyBase {
 public:
  PropertyBase(std::string name, PropertyOptions options)
      : name_(std::move(name)), options_(std::move(options)) {}
  virtual ~PropertyBase() = default;

  /// [rt]
  const std::string& name() const MAUVE_RT { return name_; }
  const PropertyOptions& options() const MAUVE_RT { return options_; }
  /// The present value; of a running component ask Component::shown(). [setup]
  virtual PropertyValue boxed() const = 0;
  /// The value converted to the property's type, as checked() above. [non-rt]
  virtual PropertyValue checked(const PropertyValue& value) const = 0;
  /// Takes a value that checked() returned, by swapping it with the present one. [rt]
  virtual void swap(PropertyValue& value) MAUVE_RT = 0;
  /// Until end_preview() the calling thread reads this value, which checked() returned; all others read the present
  /// one. So the parts that a transaction puts in are configured with what it sets. [non-rt]
  virtual void preview(const PropertyValue& value) = 0;
  virtual void end_preview() noexcept = 0;

 private:
  std::string name_;
  PropertyOptions options_;
};

template <PropertyType T>
class Property final : public PropertyBase {
 public:
  /// [setup] Throws Error as check_declaration().
  Property(std::string name, T initial, PropertyOptions options)
      : PropertyBase(std::move(name), std::move(options)), value_(std::move(initial)) {
    check_declaration(this->name(), value_, this->options());
  }

  /// The value in force since the component last left a wait. [rt]
  const T& value() const MAUVE_RT {
    const T* const preview = previews_.find();
    return preview != nullptr ? *preview : value_;
  }
  operator const T&() const MAUVE_RT {
    return value();
  }  // NOLINT: reads like the value, as in the paper's listings

  PropertyValue boxed() const override { return value(); }
  PropertyValue checked(const PropertyValue& value) const override {
    return mauve::checked(name(), T{}, options(), value);
  }
  void swap(PropertyValue& value) noexcept override {
    if (T* const other = std::get_if<T>(&value))
      MAUVE_RT_TRUSTED(std::swap(*other, value_));  // texts change places
  }
  void preview(const PropertyValue& value) override { previews_.begin() = std::get<T>(value); }
  void end_preview() noexcept override { previews_.end(); }

 private:
  T value_;
  Previews<T> previews_;
};

extern template class Property<bool>;
extern template class Property<std::int64_t>;
extern template class Property<double>;
extern template class Property<std::string>;

}  // namespace mauve
