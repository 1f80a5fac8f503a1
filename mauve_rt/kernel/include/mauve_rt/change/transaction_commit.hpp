// SPDX-License-Identifier: LGPL-3.0-or-later
// How a transaction is carried out: drafted, prepared, committed in one, retired.
#pragma once

#include <memory>

#include "mauve_rt/architecture/architecture.hpp"
#include "mauve_rt/change/transaction.hpp"

namespace mauve {

class Runner;

/// Carries out one transaction; made by Architecture::make(). Ordinary threads. make() is called once, under the
/// architecture's change lock. report() takes no part in that: while it waits, others may change what this one did.
class TransactionCommit {
 public:
  /// `host`: who runs the architecture, if anybody does; used by make() only.
  TransactionCommit(Architecture& architecture, Runner* host, const TransactionOptions& options);
  ~TransactionCommit();
  TransactionCommit(const TransactionCommit&) = delete;
  TransactionCommit& operator=(const TransactionCommit&) = delete;

  /// Drafts, prepares, commits, retires; a dry run stops after preparing. Where a component is late beyond the commit's
  /// timeout the next change retires, or report(). [non-rt]
  /// Throws Error naming the step (ErrorDetail::step); the architecture is then as it was.
  void make(Transaction transaction);
  /// What it cost, step by step; waits up to so long for the releases that follow. May be called again. [non-rt]
  TransactionReport report(time_ns_t phase_timeout_ns);

 private:
  friend class PreparedTransaction;
  class Work;
  std::shared_ptr<Work>
      work_;  // shared with the architecture while a late component has not taken the change
};

}  // namespace mauve
