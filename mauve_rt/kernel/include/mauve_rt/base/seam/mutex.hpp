// SPDX-License-Identifier: LGPL-3.0-or-later
// Mutex: for ordinary threads. Where a thread of a component may come, PiMutex.
#pragma once

#include <mutex>

namespace mauve {

using Mutex = std::mutex;
using RecursiveMutex = std::recursive_mutex;

}  // namespace mauve
