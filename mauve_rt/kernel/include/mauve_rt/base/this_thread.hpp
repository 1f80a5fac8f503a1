// SPDX-License-Identifier: LGPL-3.0-or-later
// Which thread is calling.
#pragma once

#include <pthread.h>

#include <cstdint>

#include "mauve_rt/base/rt.hpp"

namespace mauve {

/// Whether it is the calling thread. [rt] Only while that thread has not ended: a later one may have the same pthread_t.
inline bool is_this_thread(pthread_t thread) MAUVE_RT {
  return MAUVE_RT_TRUSTED(pthread_equal(thread, pthread_self()) != 0);  // reads a register
}

namespace detail {

/// The system's id of the calling thread; 0: not asked for yet. In the block of the initial libraries: read by one instruction.
extern constinit thread_local std::uint32_t thread_id [[gnu::tls_model("initial-exec")]];
std::uint32_t ask_thread_id() MAUVE_RT;

}  // namespace detail

/// The system's id of the calling thread, as futexes with priority inheritance know it. [rt]
inline std::uint32_t this_thread_id() MAUVE_RT {
  const std::uint32_t id = MAUVE_RT_TRUSTED(detail::thread_id);  // no call: in the initial block
  return id != 0 ? id : detail::ask_thread_id();
}

}  // namespace mauve
