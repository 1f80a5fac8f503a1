// SPDX-License-Identifier: LGPL-3.0-or-later
// Makes a part of the calling thread's stack present.
#pragma once

#include <alloca.h>

#include <cstddef>

namespace mauve {

/// Touches so much of the calling thread's stack that none of it faults later. [setup]
[[gnu::noinline]] inline void touch_stack(std::size_t bytes) noexcept {
  constexpr std::size_t kPage = 4096;
  auto* pages = static_cast<volatile char*>(alloca(bytes));
  for (std::size_t offset = 0; offset < bytes; offset += kPage) pages[offset] = 0;
}

}  // namespace mauve
