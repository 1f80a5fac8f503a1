// SPDX-License-Identifier: LGPL-3.0-or-later
// PreparedTransaction: a transaction of which only the commit is left, for a real-time thread to make.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

#include "mauve_rt/architecture/open_change.hpp"
#include "mauve_rt/base/rt.hpp"
#include "mauve_rt/base/time.hpp"
#include "mauve_rt/change/transaction.hpp"

namespace mauve {

class Architecture;
class Runner;

enum class PreparedOutcome : std::uint8_t {
  committed,  // it is in force
  stale,      // what it was prepared against has changed, or it was committed already
  refused,    // by the adopt of a new core
  timed_out,  // a component did not come to a wait in time, or what commit() waits for lasted
  withdrawn,  // a component was stopped or faulted meanwhile, or the host was shut down
};
/// [rt]
const char* to_string(PreparedOutcome outcome) MAUVE_RT;

/// One transaction on a deployed architecture, drafted, built, configured and prefaulted; made by Host::prepare(). The host
/// and the architecture outlive it. Unless commit() answers `committed` nothing was changed.
///
/// It is stale once another change of a component that it touches was committed, unless it only starts and stops; once one of
/// these was started, stopped or faulted; where it adds, removes, wires, or replaces a shell or an fsm, once any change did that;
/// once code was loaded anew; and once the host was shut down. An ordinary change that is being prepared, and a dry run, keep it
/// off nothing: they are refused when this one comes first. Only one that configures a component anew
/// acts on parts that are in, and keeps it off that component.
///
/// commit() waits for nobody's preparation. It waits, until its time-out, for no more than: an ordinary commit under way,
/// which it calls off, to end (an adopt that has begun ends first); another prepared commit, up to its decision; a start() of a
/// component that it touches, or the end of such a one's thread; its own components to take an earlier change, to come to their
/// waits, and to take the change. Beyond the time-out it waits for its own adopt and take, and for the threads of components that
/// it starts, no longer than Commit::kPatience. It allocates only where it gives up a component whose adopt or take does not end.
///
/// With its decision it is in force: lists and wiring are those that it makes. What it has put out is retired, and properties are
/// described anew, by complete(), by a description, or by the next change of the architecture; until then a component with a new
/// shell or fsm has no fallback.
class PreparedTransaction final : private OpenChange {
 public:
  /// By Host::prepare(). [non-rt] Throws as Architecture::make().
  PreparedTransaction(Architecture& architecture, Runner& host, Transaction transaction,
                      const TransactionOptions& options);
  /// Completes what was committed, lets go of what was not; waits for a change under way. [non-rt]
  ~PreparedTransaction() override;
  PreparedTransaction(const PreparedTransaction&) = delete;
  PreparedTransaction& operator=(const PreparedTransaction&) = delete;

  /// Whether nothing that it was prepared against has changed. [rt]
  bool is_current() const MAUVE_RT;
  /// Makes the change, once, whatever it answers; the second call answers stale. [rt] as far as adopt and take are.
  PreparedOutcome commit(time_ns_t timeout_ns) noexcept;
  /// Lets commit() end without the change, now or once it begins, unless that is made already; it answers withdrawn. What it
  /// waits for is left at once, a start() of a component within 20 ms, an adopt or take as after a time-out. Any thread, until
  /// complete(). [rt]
  void call_off() MAUVE_RT;
  /// Publishes and retires what was committed, unless the next change did; returns its report, or throws Error in words
  /// where commit() did not answer `committed`. Waits for a change under way. After commit(); may be called again. [non-rt]
  TransactionReport complete();
  /// What the calling thread allocated for it and still holds, as far as the allocator's figures tell. [non-rt]
  std::size_t memory_bytes() const noexcept;

 private:
  class State;

  bool settle() noexcept override;
  void drop_if_stale() noexcept override;
  void note_failure() noexcept;
  void let_go() noexcept;

  std::unique_ptr<State> state_;
};

}  // namespace mauve
