// SPDX-License-Identifier: LGPL-3.0-or-later
// Deployer: maps components to threads, starts them on one epoch, and changes them while they run.
#pragma once

#include <memory>

#include "mauve_rt/base/barrier.hpp"
#include "mauve_rt/base/seam/atomic.hpp"
#include "mauve_rt/base/seam/mutex.hpp"
#include "mauve_rt/deploy/host.hpp"
#include "mauve_rt/run/shadow_thread.hpp"

namespace mauve {

struct DeployerOptions {
  bool require_realtime{false};  // refuse to deploy without every right
  bool trace{true};
};

/// The host of threads: one for each component. Ordinary threads.
///
/// All members are written and read by deploy(), shutdown(), end() and run_shadow(), under life_mutex_.
class Deployer final : public Host {
 public:
  /// How long a state may go on after a stop of all, before its component is given up.
  static constexpr time_ns_t kStopTimeout = ms_to_ns(500);

  explicit Deployer(Architecture& architecture, DeployerOptions options = {});
  /// Shuts down, and waits for a change that is being prepared.
  ~Deployer() override;

  /// Asks for the real-time rights; deploy() does it if it was not done. [setup]
  void prepare_process() override;
  /// Creates the threads, meets them at a barrier, publishes epoch = now + 20 ms,
  /// starts all. [setup] Throws Error as Host::deploy(); no thread is left then.
  void deploy() override;
  /// Also ends the threads, of all that run on it: those that execute a state for longer than kStopTimeout are given up - their
  /// outputs are safe on return - and left behind. [non-rt]
  void shutdown() noexcept override;
  /// The same, for good: it cannot be deployed again. [non-rt]
  void end() noexcept;
  /// end() of every deployer of the process, those to come included. [non-rt]
  static void end_all() noexcept;
  /// Whether end_all() was called: nothing is deployed any more. [non-rt]
  static bool all_ended() noexcept;

  const RealtimeStatus& realtime_status() const noexcept override { return process_.status(); }
  const Clock& clock() const noexcept override { return MonotonicClock::instance(); }
  bool is_simulated() const noexcept override { return false; }

  void run_shadow(const std::shared_ptr<Shadow>& shadow) override;
  /// What watches the components' executions while it is deployed; nullptr otherwise. [setup]
  const Watchdog* watchdog() const noexcept { return watchdog_.get(); }

 protected:
  void begin_task(Task& task) override;
  bool end_task(Task& task, time_ns_t until_ns) noexcept override;

 private:
  void create_threads();
  void shut_down() noexcept;

  DeployerOptions options_;
  RealtimeProcess process_;
  Mutex life_mutex_;
  bool has_ended_ MAUVE_GUARDED_BY(life_mutex_){false};
  std::unique_ptr<Barrier> barrier_;  // outlives the threads that met at it
  std::shared_ptr<Watchdog> watchdog_;
  ShadowThreads shadow_threads_;
};

}  // namespace mauve
