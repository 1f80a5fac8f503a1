// SPDX-License-Identifier: LGPL-3.0-or-later
// A thread that waits for what arrives.
#pragma once

#include <rcl/node.h>
#include <rcl/wait.h>

#include <vector>

#include "mauve_rt/base/seam/atomic.hpp"
#include "mauve_rt/base/time.hpp"

#include "thread.hpp"

namespace mauve::bridge {

/// Something of rcl that a wait set can wait for.
class Arrival {
 public:
  Arrival() = default;
  virtual ~Arrival() = default;
  Arrival(const Arrival&) = delete;
  Arrival& operator=(const Arrival&) = delete;

  /// How much room it needs in a wait set, of each kind of entity. [non-rt]
  virtual std::size_t entities() const { return 1; }
  /// Puts itself into a cleared wait set with room for it. [non-rt]
  virtual void join(rcl_wait_set_t& set) = 0;
  /// Whether something arrived, after the wait. [non-rt]
  virtual bool has_arrived(const rcl_wait_set_t& set) const = 0;
  /// Takes all that arrived. [non-rt]
  virtual void take() = 0;
  /// Whether it wants to know, every few ms, that nothing waits. [non-rt]
  virtual bool wants_idle() const { return false; }
  /// Nothing that had arrived by then waits. [non-rt]
  virtual void idle(time_ns_t /*until_ns*/) {}
};

/// Waits on a thread of its own while it runs.
///
/// | member    | written by                     | read by    | order                                            |
/// | --------- | ------------------------------ | ---------- | ------------------------------------------------ |
/// | arrivals_ | start(), while no thread runs  | the thread | -                                                |
/// | ending_   | stop()                         | the thread | release/acquire; the guard condition wakes after |
class Receiver {
 public:
  /// The thread gets the name, and waits for arrivals only after a pause. Throws Error when rcl refuses. The node outlives the
  /// receiver. [non-rt]
  Receiver(const rcl_node_t& node, const char* name, time_ns_t pause_ns = 0);
  ~Receiver();
  Receiver(const Receiver&) = delete;
  Receiver& operator=(const Receiver&) = delete;

  /// From now on these are taken as they arrive; they stay alive until stop(). [non-rt]
  void start(std::vector<Arrival*> arrivals);
  /// Returns when the thread is gone. May be called again. [non-rt]
  void stop();

 private:
  void run();
  void pause(rcl_wait_set_t& set);
  rcl_ret_t wait(rcl_wait_set_t& set);
  time_ns_t longest_wait_ns() const;

  rcl_context_t& context_;
  const char* name_;
  time_ns_t pause_ns_;
  rcl_guard_condition_t wake_{rcl_get_zero_initialized_guard_condition()};
  std::vector<Arrival*> arrivals_;
  Atomic<bool> ending_{false};
  WorkerThread thread_;
};

}  // namespace mauve::bridge
