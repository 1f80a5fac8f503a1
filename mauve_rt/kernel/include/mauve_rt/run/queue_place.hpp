// SPDX-License-Identifier: LGPL-3.0-or-later
// QueuePlace: where a simulated task stands in the queue of its processor.
#pragma once

#include <cstddef>
#include <cstdint>

namespace mauve {

/// Where a task stands in its queue.
struct QueuePlace {
  static constexpr std::size_t kNone = SIZE_MAX;

  std::size_t index{kNone};
  bool is_late{false};  // which of the two heaps
};

}  // namespace mauve
