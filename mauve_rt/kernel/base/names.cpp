// SPDX-License-Identifier: LGPL-3.0-or-later
#include "base/names.hpp"

#include <algorithm>

#include "mauve_rt/base/error.hpp"

namespace mauve {

namespace {

constexpr std::size_t kLongestName = 100;

// Not those of <cctype>, which ask the locale.
bool is_letter(char c) noexcept { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }
bool is_of_name(char c) noexcept { return is_letter(c) || (c >= '0' && c <= '9') || c == '_'; }

/// On one line, and not longer than a line.
std::string shown(const std::string& name) {
  constexpr std::size_t kShown = 60;
  std::string text = name.substr(0, kShown);
  std::replace_if(text.begin(), text.end(), [](char c) { return static_cast<unsigned char>(c) < ' '; }, '?');
  return "'" + text + (name.size() > kShown ? "...' (" + std::to_string(name.size()) + " characters)" : "'");
}

}  // namespace

void check_name(const std::string& what, const std::string& name) {
  const bool is_good = !name.empty() && name.size() <= kLongestName && is_letter(name.front()) &&
                       std::all_of(name.begin(), name.end(), is_of_name) &&
                       name.find("__") == std::string::npos;
  if (is_good) return;
  throw Error(ErrorCode::invalid_argument, "that is no name for a " + what,
              {.element = what,
               .expected = "letters, digits and single underscores that start with a letter, at most " +
                           std::to_string(kLongestName) + " characters",
               .found = shown(name),
               .remedy = "choose another name"});
}

}  // namespace mauve
