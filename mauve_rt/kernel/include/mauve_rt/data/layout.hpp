// SPDX-License-Identifier: LGPL-3.0-or-later
// How a struct lies in memory: whether two that bear one name are the same, whatever library declares them.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "mauve_rt/data/message_shape.hpp"

namespace mauve {

/// The first place in which two structs of one name differ.
struct LayoutDifference {
  std::string field;     // dotted within messages; empty: the structs as wholes
  std::string expected;  // as in a .msg file, and where it lies
  std::string found;
};

/// Nothing: a pointer to one may be used as a pointer to the other. Names may have one word more, such as a unit. [non-rt]
std::optional<LayoutDifference> layout_difference(const MessageShape& expected, const MessageShape& found);

/// The file of the library whose class this object is of; empty: not known. [non-rt]
std::string library_of(const void* polymorphic_object);

}  // namespace mauve
