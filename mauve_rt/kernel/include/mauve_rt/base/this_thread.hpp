// SPDX-License-Identifier: LGPL-3.0-or-later
// Which thread is calling.
#pragma once

#include <pthread.h>

#include "mauve_rt/base/rt.hpp"

namespace mauve {

/// Whether it is the calling thread. [rt]
inline bool is_this_thread(pthread_t thread) MAUVE_RT {
  return MAUVE_RT_TRUSTED(pthread_equal(thread, pthread_self()) != 0);  // reads a register
}

}  // namespace mauve
