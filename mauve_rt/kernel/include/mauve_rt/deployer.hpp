// SPDX-License-Identifier: LGPL-3.0-or-later
// Deployer: maps components to threads, starts them on one epoch, and changes them while they run.
#pragma once

#include <atomic>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "mauve_rt/architecture.hpp"
#include "mauve_rt/realtime.hpp"
#include "mauve_rt/transaction_commit.hpp"

namespace mauve {

struct DeployerOptions {
  bool require_realtime{false};  // refuse to deploy without every right
  bool trace{true};
};

/// The threads of an architecture. Ordinary threads.
///
/// | member       | written by           | read by  | under            |
/// | ------------ | -------------------- | -------- | ---------------- |
/// | conductor_   | deploy(), shutdown() | make()   | structure_mutex_ |
/// | architecture | these three          | anyone   | structure_mutex_ |
///
/// start(), stop() and what only looks take no part in that: a long preparation keeps nobody from stopping a component.
class Deployer {
 public:
  explicit Deployer(Architecture& architecture, DeployerOptions options = {});
  /// Shuts down.
  ~Deployer();
  Deployer(const Deployer&) = delete;
  Deployer& operator=(const Deployer&) = delete;

  /// Asks for the real-time rights; deploy() does it if it was not done. [setup]
  void prepare_process();
  /// Creates the threads, meets them at a barrier, publishes epoch = now + max(20 ms, 1 ms x components),
  /// starts all. [setup] Throws Error: not_configured, realtime_denied; no thread is left then.
  void deploy();
  /// Stops every component (outputs written) in reverse order and ends the threads. [non-rt]
  void shutdown() noexcept;

  void start(const std::string& component, std::optional<time_ns_t> clock_ns = std::nullopt);
  void stop(const std::string& component, time_ns_t timeout_ns = s_to_ns(1));
  time_ns_t get_time(const std::string& component) const;
  /// Carries out a transaction, deployed or not; one at a time. [non-rt]
  /// Throws Error naming the step (ErrorDetail::step); nothing was changed then.
  TransactionReport commit(Transaction transaction, const TransactionOptions& options = {});
  /// The same up to the commit: what the releases that follow tell can be asked for later, with report(). [non-rt]
  /// The deployer must outlive what it returns.
  std::unique_ptr<TransactionCommit> make(Transaction transaction, const TransactionOptions& options = {});
  /// Replaces a core by a registered implementation that the component declares as its alternative. [non-rt]
  StepReport replace_core(const std::string& component, const std::string& core,
                          const CommitTimeouts& timeouts = {});
  StepReport set_property(const std::string& component, const std::string& name, const PropertyValue& value,
                          const CommitTimeouts& timeouts = {});

  bool is_deployed() const noexcept { return deployed_; }
  /// The instant that all grids are counted from; 0 before deployment.
  time_ns_t epoch_ns() const noexcept { return architecture_.deployment_epoch_ns(); }
  const RealtimeStatus& realtime_status() const noexcept { return process_.status(); }

  /// Empties every ring. [non-rt], one thread at a time.
  TraceDrain drain_trace() { return architecture_.drain_trace(); }
  /// Waits until a component changed its state or core after `seen`; returns the word to pass next. [non-rt]
  std::uint32_t wait_change(std::uint32_t seen, time_ns_t until_ns) noexcept;

 private:
  class Barrier;

  void require_deployed() const;
  void watch() noexcept;
  TransactionHost host();
  StepReport commit_one(Transaction transaction, const CommitTimeouts& timeouts);

  Architecture& architecture_;
  DeployerOptions options_;
  RealtimeProcess process_;
  std::mutex structure_mutex_;
  std::atomic<bool> deployed_{
      false};  // seq_cst: set and cleared under the mutex, read by commands without it
  std::unique_ptr<Conductor> conductor_;
  std::unique_ptr<Barrier> barrier_;  // outlives the threads that met at it
  std::thread watchdog_;
  std::atomic<std::uint32_t> watchdog_stop_{0};
};

}  // namespace mauve
