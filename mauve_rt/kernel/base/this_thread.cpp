// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/base/this_thread.hpp"

#include <unistd.h>

namespace mauve::detail {

constinit thread_local std::uint32_t thread_id [[gnu::tls_model("initial-exec")]] = 0;

namespace {

// The child of a fork has one thread, with an id of its own.
[[maybe_unused]] const int forgets_in_children = pthread_atfork(nullptr, nullptr, [] { thread_id = 0; });

}  // namespace

std::uint32_t ask_thread_id() noexcept {
  const auto id = static_cast<std::uint32_t>(MAUVE_RT_TRUSTED(gettid()));
  MAUVE_RT_TRUSTED(thread_id = id);  // no call: in the initial block
  return id;
}

}  // namespace mauve::detail
