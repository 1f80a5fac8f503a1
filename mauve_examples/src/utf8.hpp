// SPDX-License-Identifier: LGPL-3.0-or-later
#pragma once

#include <cstddef>
#include <string_view>

namespace mauve_examples {

/// Where the first byte is that is no part of a UTF-8 text; the size when there is none. [non-rt]
std::size_t first_no_utf8(std::string_view text);

}  // namespace mauve_examples
