// SPDX-License-Identifier: LGPL-3.0-or-later
// For tests: reads a message into its C++ struct and writes it again, by the name of its type.
#pragma once

#include <algorithm>
#include <cstddef>
#include <functional>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <mauve_rt/data/capacities.hpp>

namespace round_trip {

/// Writes what it has read; false where the reader refuses the message.
using Function = bool (*)(std::span<const std::byte> in, std::vector<std::byte>& out, std::size_t capacity);

inline std::map<std::string, Function, std::less<>>& functions() {
  static std::map<std::string, Function, std::less<>> all;
  return all;
}

/// Memory for `capacity` elements in each sequence.
template <typename T>
void allocate(T& value, std::size_t capacity) {
  using mauve::detail::kIsSequence;
  using mauve::detail::kPlaces;
  if constexpr (mauve::detail::sequence_count<T>() == 0) {
    return;
  } else if constexpr (kIsSequence<T>) {
    value.allocate(capacity);
    for (auto& item : value.places()) allocate(item, capacity);
  } else if constexpr (kPlaces<T> != 0) {
    for (std::size_t i = 0; i < kPlaces<T>; ++i) allocate(value.data()[i], capacity);
  } else {
    std::apply([&](auto... member) { (allocate(value.*member, capacity), ...); },
               mauve::TypeTraits<T>::fields());
  }
}

template <typename T>
bool go(std::span<const std::byte> in, std::vector<std::byte>& out, std::size_t capacity) {
  const auto value = std::make_unique<T>();
  allocate(*value, capacity);
  if (!mauve::CdrReader(in).get(*value)) return false;
  mauve::CdrWriter(out).put(*value);
  return true;
}

template <typename T>
bool add() {
  return functions().emplace(mauve::TypeTraits<T>::name, &go<T>).second;
}

}  // namespace round_trip
