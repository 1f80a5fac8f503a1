// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/base/waiter.hpp"

namespace mauve {

namespace {

thread_local Waiter* waiter_of_this_thread = nullptr;

}  // namespace

Waiter* Waiter::of_this_thread() noexcept { return MAUVE_RT_TRUSTED(waiter_of_this_thread); }

void Waiter::set_of_this_thread(Waiter* waiter) noexcept { waiter_of_this_thread = waiter; }

}  // namespace mauve
