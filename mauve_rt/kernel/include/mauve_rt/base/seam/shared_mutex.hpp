// SPDX-License-Identifier: LGPL-3.0-or-later
// SharedMutex: one writer or any number of readers, ordinary threads.
#pragma once

#include <mutex>
#include <shared_mutex>

namespace mauve {

using SharedMutex = std::shared_mutex;

}  // namespace mauve
