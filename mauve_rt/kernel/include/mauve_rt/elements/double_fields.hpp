// SPDX-License-Identifier: LGPL-3.0-or-later
// Messages of doubles only, such as a Twist: the same calculation for each number of them.
#pragma once

#include <cmath>
#include <tuple>
#include <type_traits>
#include <utility>

#include "mauve_rt/data/cdr.hpp"

namespace mauve {

namespace detail {

template <typename T>
consteval bool has_only_doubles() {
  if constexpr (Described<T>) {
    return std::apply(
        [](auto... member) {
          return (has_only_doubles<std::remove_cvref_t<decltype(std::declval<T&>().*member)>>() && ...);
        },
        TypeTraits<T>::fields());
  } else {
    return std::is_same_v<T, double>;
  }
}

}  // namespace detail

/// A type of MAUVE_TYPE whose fields, and their fields, are doubles.
template <typename T>
concept DoubleFields = Described<T> && detail::has_only_doubles<T>();

/// Calls `use` with each double of `first` and the double at the same place of each of the others, which are of the same type.
/// [rt] as far as `use` is.
template <typename Use, typename First, typename... Others>
constexpr void for_each_double(const Use& use, First& first, Others&... others) {
  if constexpr (std::is_same_v<std::remove_const_t<First>, double>) {
    use(first, others...);
  } else {
    const auto visit = [&](auto member) { for_each_double(use, first.*member, others.*member...); };
    std::apply([&](auto... member) { (visit(member), ...); },
               TypeTraits<std::remove_const_t<First>>::fields());
  }
}

/// Whether no double of the value is infinite or NaN. [rt]
template <DoubleFields T>
bool is_finite(const T& value) MAUVE_RT {
  bool all = true;
  for_each_double([&](double number) { all = all && std::isfinite(number); }, value);
  return all;
}

}  // namespace mauve
