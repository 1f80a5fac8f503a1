// SPDX-License-Identifier: LGPL-3.0-or-later
// Runner: what a change asks of whom that runs the architecture.
#pragma once

#include <memory>

#include "mauve_rt/base/rt.hpp"
#include "mauve_rt/base/seam/atomic.hpp"
#include "mauve_rt/base/seam/guards.hpp"
#include "mauve_rt/base/seam/shared_mutex.hpp"
#include "mauve_rt/base/time.hpp"

namespace mauve {

class Component;
class Shadow;

/// A host, as architectures and changes see it. All functions [non-rt].
///
/// | member    | written by           | read by | under                                                  |
/// | --------- | -------------------- | ------- | ------------------------------------------------------ |
/// | deployed_ | deploy(), shutdown() | anyone  | seq_cst: a commit that shutdown() does not see, sees it |
/// | deployments_ | deploy()          | anyone  | as deployed_                                           |
/// | in_use_   | changes, shared      | the end | -                                                      |
class Runner {
 public:
  Runner() = default;
  virtual ~Runner() = default;
  Runner(const Runner&) = delete;
  Runner& operator=(const Runner&) = delete;

  /// How often it was deployed. [rt]
  std::uint32_t deployments() const MAUVE_RT { return deployments_.load(std::memory_order_seq_cst); }
  /// [rt]
  bool is_deployed() const MAUVE_RT { return deployed_.load(std::memory_order_seq_cst); }
  /// [non-rt]
  virtual const Clock& clock() const noexcept = 0;
  /// Whether nothing happens while the caller waits: time is virtual, and the caller's thread is the one that it passes on.
  virtual bool is_simulated() const noexcept = 0;

  /// In virtual time: what comes next happens, if it comes by the instant; else time passes up to the instant. False: it is reached,
  /// or time passes by itself. [non-rt]
  virtual bool pass_time(time_ns_t /*until_ns*/) noexcept { return false; }

  /// Gives a parked component what it runs on. [non-rt] Throws Error.
  virtual void attach(const std::shared_ptr<Component>& component) = 0;
  /// How long the end of a thread is waited for.
  static constexpr time_ns_t kThreadEnd = ms_to_ns(500);
  /// The reverse; false when its thread has not ended by the instant. [non-rt]
  virtual bool detach(Component& component, time_ns_t until_ns) noexcept = 0;
  /// Executes the releases of a shadow, once it has begun, until it has ended. [non-rt] Throws Error.
  virtual void run_shadow(const std::shared_ptr<Shadow>& shadow) = 0;
  /// Held while a change uses the runner, which may end meanwhile where this owns nothing. [non-rt], the architecture's change
  /// lock held.
  std::shared_lock<SharedMutex> use() { return std::shared_lock(in_use_, std::try_to_lock); }

 protected:
  /// From here on nobody starts anything, and no change of a running architecture is made.
  void set_deployed(bool deployed) noexcept {
    if (deployed) deployments_.fetch_add(1, std::memory_order_seq_cst);
    deployed_.store(deployed, std::memory_order_seq_cst);
  }
  /// Waits for the changes that use the runner; after shutdown(), at its end. [non-rt]
  void wait_unused() noexcept { const LockGuard lock(in_use_); }

 private:
  Atomic<bool> deployed_{false};
  Atomic<std::uint32_t> deployments_{0};
  SharedMutex in_use_;
};

}  // namespace mauve
