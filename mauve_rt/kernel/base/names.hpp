// SPDX-License-Identifier: LGPL-3.0-or-later
#pragma once

#include <string>
#include <type_traits>
#include <vector>

namespace mauve {

/// What components, resources, ports, properties and states may be called, in files and in code alike: letters, digits and
/// single underscores, a letter first, at most 100 characters. [non-rt] Throws Error (invalid_argument) naming `what`.
void check_name(const std::string& what, const std::string& name);

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
