// SPDX-License-Identifier: LGPL-3.0-or-later
#pragma once

#include <string>
#include <type_traits>
#include <vector>

namespace mauve {

/// The names of items, of what they point to, or that they are: what an error message offers instead. [non-rt]
template <typename Items>
std::vector<std::string> names_of(const Items& items) {
  std::vector<std::string> names;
  names.reserve(items.size());
  for (const auto& item : items) {
    if constexpr (std::is_convertible_v<decltype(item), std::string>) {
      names.push_back(item);
    } else if constexpr (requires { item->name(); }) {
      names.push_back(item->name());
    } else {
      names.push_back(item.name());
    }
  }
  return names;
}

}  // namespace mauve
