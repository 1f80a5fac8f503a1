// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/base/this_thread.hpp"

#include <unistd.h>

namespace mauve::detail {

constinit thread_local std::uint32_t thread_id [[gnu::tls_model("initial-exec")]] = 0;

std::uint32_t ask_thread_id() noexcept {
  // The child of a fork has one thread, with an id of its own.
  static const int forgets_in_children =
      MAUVE_RT_TRUSTED(pthread_atfork(nullptr, nullptr, [] { thread_id = 0; }));
  static_cast<void>(forgets_in_children);
  thread_id = static_cast<std::uint32_t>(MAUVE_RT_TRUSTED(gettid()));
  return thread_id;
}

}  // namespace mauve::detail
