// SPDX-License-Identifier: LGPL-3.0-or-later
// Waiter: what data and parts ask of the thread that runs a component, when it is to wait or to be woken.
#pragma once

#include <cstdint>

#include "mauve_rt/base/rt.hpp"
#include "mauve_rt/base/seam/atomic.hpp"
#include "mauve_rt/base/time.hpp"

namespace mauve {

/// A component's wait, as a call inside its states and an event see it.
class Waiter {
 public:
  /// The one whose thread this is, or nullptr. [rt]
  static Waiter* of_this_thread() MAUVE_RT;

  /// Sleeps until the word holds the number, at most until the instant, or until the component is to stop. [rt],
  /// its own thread. Who sets the word calls signal_awaited() then.
  virtual void await(const Atomic<std::uint32_t>& word, std::uint32_t number, time_ns_t until_ns)
      MAUVE_RT = 0;
  virtual void signal_awaited() MAUVE_RT = 0;
  /// Whether the state under way is the last before a park. [rt]
  virtual bool is_to_stop() const MAUVE_RT = 0;
  /// An event that it may wait for has come. [rt]
  virtual void signal_event() MAUVE_RT = 0;

 protected:
  ~Waiter() = default;
  /// By its own thread at its start. [setup]
  static void set_of_this_thread(Waiter* waiter) noexcept;
};

}  // namespace mauve
