// SPDX-License-Identifier: LGPL-3.0-or-later
// SharedMutex under the seeded scheduler.
#pragma once

#include <mutex>
#include <shared_mutex>

#include "seeds/scheduler.hpp"

namespace mauve {

using SharedMutex = seeds::SharedLock;

}  // namespace mauve
