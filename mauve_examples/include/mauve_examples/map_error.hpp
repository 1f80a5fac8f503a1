// SPDX-License-Identifier: LGPL-3.0-or-later
// The one error of map files: a single line that says what, where, what was expected and found, and the
// remedy.
#pragma once

#include <stdexcept>
#include <string>

namespace mauve_examples {

/// A map that cannot be used. what() is one line.
class MapError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;

  /// The fields become "what: where: expected ..., found ...; remedy". [non-rt]
  struct Detail {
    std::string what;
    std::string where;  // file, with the line where one is known
    std::string expected;
    std::string found;
    std::string remedy;
  };
  explicit MapError(const Detail& detail);
};

}  // namespace mauve_examples
