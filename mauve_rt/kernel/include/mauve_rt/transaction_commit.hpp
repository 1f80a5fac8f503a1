// SPDX-License-Identifier: LGPL-3.0-or-later
// How a transaction is carried out: drafted, prepared, committed in one, retired.
#pragma once

#include <functional>
#include <memory>

#include "mauve_rt/architecture.hpp"
#include "mauve_rt/transaction.hpp"

namespace mauve {

/// Where an architecture runs, as far as a transaction needs to know.
struct TransactionHost {
  bool deployed{false};
  Conductor* conductor{nullptr};  // nullptr: the calling thread conducts
  std::function<void(Task&)>
      attach{};  // gives a task its thread, or takes it into a simulation; it is parked then
  std::function<bool(Task&)>
      detach{};  // the reverse, of a parked task; false when its thread would not end in time
};

/// Carries out one transaction. Ordinary threads; between architecture changes by others: one make() at a time.
/// report() takes no part in that: while it waits, others may change what this one did.
class TransactionCommit {
 public:
  TransactionCommit(Architecture& architecture, TransactionHost host, const TransactionOptions& options);
  ~TransactionCommit();
  TransactionCommit(const TransactionCommit&) = delete;
  TransactionCommit& operator=(const TransactionCommit&) = delete;

  /// Drafts, prepares, commits, retires; a dry run stops after preparing. [non-rt]
  /// Throws Error naming the step (ErrorDetail::step); the architecture is then as it was.
  void make(Transaction transaction);
  /// What it cost, step by step; waits up to so long for the releases that follow. May be called again. [non-rt]
  TransactionReport report(time_ns_t phase_timeout_ns);

 private:
  class Work;
  std::unique_ptr<Work> work_;
};

}  // namespace mauve
