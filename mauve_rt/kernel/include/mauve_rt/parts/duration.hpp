// SPDX-License-Identifier: LGPL-3.0-or-later
// Duration: a length of time that an fsm declares, with the expression that it was computed from.
#pragma once

#include <concepts>
#include <cstdint>
#include <string>
#include <utility>

#include "mauve_rt/base/time.hpp"
#include "mauve_rt/parts/property.hpp"

namespace mauve {

/// A length of time. A plain number of ns is one without an expression.
struct Duration {
  // NOLINTBEGIN(google-explicit-constructor): a plain length of time serves wherever a Duration does
  /// [setup]
  Duration(time_ns_t length_ns) : ns(length_ns) {}
  template <PropertyType T>
    requires std::convertible_to<T, time_ns_t>
  Duration(const Property<T>& length_ns) : ns(static_cast<time_ns_t>(length_ns.value())) {}
  // NOLINTEND(google-explicit-constructor)
  /// [setup]
  Duration(time_ns_t length_ns, std::string expression) : ns(length_ns), text(std::move(expression)) {}

  time_ns_t ns;
  std::string text{};  // `5 * unit_ms`; empty: a plain number of ns
};

/// `factor` times the present value of an integer property whose unit is ns, us, ms or s; its text is `5 * unit_ms`. [setup]
/// Throws Error: invalid_argument (no such property), out_of_range (the product is longer than a time can be).
///
///   wait("W5", mauve::times(5, shell().unit_ms));
Duration times(std::int64_t factor, const PropertyBase& property);

}  // namespace mauve
