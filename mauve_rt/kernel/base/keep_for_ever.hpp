// SPDX-License-Identifier: LGPL-3.0-or-later
// keep_for_ever(): for what a thread that does not come back from user code may still use.
#pragma once

#include <deque>
#include <utility>

#include "mauve_rt/base/seam/mutex.hpp"

namespace mauve {

/// Until the process ends, and beyond the end of static objects. [non-rt]
template <typename Objects>
void keep_for_ever(Objects objects) {
  static Mutex mutex;
  static auto* const kept = new std::deque<Objects>;
  const LockGuard lock(mutex);
  kept->push_back(std::move(objects));
}

}  // namespace mauve
