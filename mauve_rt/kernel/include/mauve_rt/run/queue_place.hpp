// SPDX-License-Identifier: LGPL-3.0-or-later
// QueuePlace: a simulated task as the queue of its processor sees it.
#pragma once

#include <cstdint>

namespace mauve {

/// Whether a task is queued, and which of its entries counts.
struct QueuePlace {
  std::uint32_t entry{0};  // the number of the last one; earlier ones count no more
  bool is_queued{false};
  bool is_late{false};  // its instant has passed while others ran
};

}  // namespace mauve
