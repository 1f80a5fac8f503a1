// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_examples/map_error.hpp"

#include <algorithm>

#include "utf8.hpp"

namespace mauve_examples {

namespace {

std::string one_line(const MapError::Detail& detail) {
  const auto is_foreign = [](unsigned char c) { return c >= 0x80; };
  std::string found = detail.found;  // may quote a file that is no text at all; the message is to be text
  std::replace_if(found.begin(), found.end(), is_foreign, '?');
  std::string line = detail.what + ": " + detail.where + ": expected " + detail.expected + ", found " +
                     found + "; " + detail.remedy;
  if (first_no_utf8(line) != line.size()) std::replace_if(line.begin(), line.end(), is_foreign, '?');
  // File names and YAML values may hold control characters; the promise is one line.
  std::replace_if(line.begin(), line.end(), [](unsigned char c) { return c < 0x20 || c == 0x7F; }, ' ');
  return line;
}

}  // namespace

MapError::MapError(const Detail& detail) : std::runtime_error(one_line(detail)) {}

}  // namespace mauve_examples
