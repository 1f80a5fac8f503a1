// SPDX-License-Identifier: LGPL-3.0-or-later
// Host: what runs an architecture, on threads or in virtual time, and the way to command and change it there.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "mauve_rt/architecture/architecture.hpp"
#include "mauve_rt/architecture/runner.hpp"
#include "mauve_rt/base/realtime.hpp"
#include "mauve_rt/base/seam/mutex.hpp"
#include "mauve_rt/change/prepared_transaction.hpp"
#include "mauve_rt/change/transaction_commit.hpp"

namespace mauve {

struct StopOptions {
  time_ns_t timeout_ns{s_to_ns(1)};
  bool force{false};  // a component whose state does not end by then is given up, as Task::stop() says
  std::uint64_t expected_revision{0};  // of the architecture; 0: any
};

/// What came of an abandon().
enum class Abandoned : std::uint8_t {
  called_off,  // the change was not decided, and is not made
  faulted,     // the component was given up: it is FAULTED, its outputs are safe, its thread is left behind
  stopped,     // its state had ended that moment: it is STOPPED
};
/// "called_off", "faulted", "stopped". [rt]
const char* to_string(Abandoned abandoned) MAUVE_RT;

/// Runs one architecture, which has at most one host at a time. All functions [non-rt] unless told.
///
/// start(), stop(), shutdown() and what only looks take no part in changes: a long preparation keeps nobody from them.
///
/// | member  | written by       | read by | under         |
/// | ------- | ---------------- | ------- | ------------- |
/// | hosted_ | ordinary threads | same    | hosted_mutex_ |
class Host : public Runner {
 public:
  explicit Host(Architecture& architecture) : architecture_(architecture) {}

  Architecture& architecture() const noexcept { return architecture_; }

  /// Asks for what the host needs of the process; deploy() does it if it was not done. [setup]
  virtual void prepare_process() = 0;
  /// Gives all components one epoch and starts them; waits for a change under way. [setup]
  /// Throws Error: not_configured; already_running (deployed, or another host runs the architecture); realtime_denied.
  virtual void deploy() = 0;
  /// Stops every component (outputs written) and lets the architecture go. Waits for nobody's preparation: a commit
  /// under way is called off, and a change that comes to its commit later finds the host shut down. [non-rt]
  virtual void shutdown() noexcept = 0;

  /// As Task::start().
  void start(const std::string& component, std::optional<time_ns_t> clock_ns = std::nullopt,
             std::uint64_t expected_revision = 0);
  void stop(const std::string& component, time_ns_t timeout_ns = s_to_ns(1));
  /// As Task::stop(); true when the component was given up: it is FAULTED then, and its thread left behind.
  bool stop(const std::string& component, const StopOptions& options);
  time_ns_t get_time(const std::string& component) const;

  /// As Architecture::open_changes().
  std::vector<OpenChangeFacts> open_changes() const { return architecture_.open_changes(); }
  /// The way out of a change that waits for a component, or for a hook of a part of its own: calls the change off if that is not
  /// decided; else, where a change that is made waits for the component, or its state hangs, stops the component by force at once.
  /// A change that is being prepared can be named by what it adds, also a resource. One that acts on the parts that are in, by a
  /// promote, or a configure for want of other instances, is not called off. Waits for no change and for no hook.
  /// Throws Error: unknown_component; not_running where neither is so; faulted where it was given up before; as Task::stop().
  Abandoned abandon(const std::string& component);

  /// Carries out a transaction, deployed or not; one at a time. [non-rt]
  /// Throws Error naming the step (ErrorDetail::step); nothing was changed then.
  TransactionReport commit(Transaction transaction, const TransactionOptions& options = {});
  /// The same up to the commit: what the releases that follow tell can be asked for later, with report(). [non-rt]
  std::unique_ptr<TransactionCommit> make(Transaction transaction, const TransactionOptions& options = {});
  /// All of it but the commit, for a real-time thread to make; waits for a change under way. [non-rt] Throws as commit();
  /// Error (not_configured) unless it is deployed, and (invalid_argument) for steps that configure or resynchronise.
  std::unique_ptr<PreparedTransaction> prepare(Transaction transaction,
                                               const TransactionOptions& options = {});
  /// Replaces a core by a registered implementation that the component declares as its alternative. [non-rt]
  StepReport replace_core(const std::string& component, const std::string& core,
                          const CommitTimeouts& timeouts = {});
  StepReport set_property(const std::string& component, const std::string& name, const PropertyValue& value,
                          const CommitTimeouts& timeouts = {});

  /// Decides the probations whose time is over, and retires what they and the reverted ones have put out (probation.hpp). To be
  /// called now and then; does nothing while a change is being made, which does the same as it begins. [non-rt]
  void settle_probations() noexcept;
  /// Of each component the last verdict, then the core on probation now. [non-rt]
  std::vector<ProbationRecord> probations() const;
  /// As Component::revert_probation().
  bool revert_probation(const std::string& component, const std::string& reason,
                        time_ns_t timeout_ns = s_to_ns(1));

  /// Of each component the shadow that runs, or the last one that has ended. [non-rt]
  std::vector<ShadowRecord> shadows() const;

  /// The instant that all grids are counted from; 0 before deployment.
  time_ns_t epoch_ns() const noexcept { return architecture_.deployment_epoch_ns(); }
  /// Now, as the components see it.
  time_ns_t now_ns() const noexcept { return clock().now_ns(); }
  virtual const RealtimeStatus& realtime_status() const noexcept = 0;
  /// As Architecture::describe(); completes a change that a late component has taken since, first. [non-rt]
  ArchitectureDescription describe() const;

  /// Empties every ring. [non-rt], one thread at a time.
  TraceDrain drain_trace();
  /// Names by the numbers that trace records carry; those of removed components stay. [non-rt]
  std::vector<std::string> trace_components() const { return architecture_.trace_components(); }
  /// Words by the numbers that trace records carry. [non-rt]
  static std::vector<std::string> trace_names() { return TraceNames::all(); }
  /// Waits until a component changed its state or core after `seen`; returns the word to pass next. [non-rt]
  std::uint32_t wait_change(std::uint32_t seen, time_ns_t until_ns) noexcept;

  void attach(const std::shared_ptr<Component>& component) final;
  bool detach(Component& component, time_ns_t until_ns) noexcept final;

 protected:
  /// Throws Error: not_configured; already_running when it is deployed. [setup]
  void require_deployable() const;
  void require_deployed() const;
  /// All grids count from the instant, and every component that is stopped starts on it. [setup]
  void start_all(time_ns_t epoch_ns);
  /// Gives a parked task what it runs on, and takes it away; false when its thread would not end in time. [non-rt]
  virtual void begin_task(Task& task) = 0;
  virtual bool end_task(Task& task, time_ns_t until_ns) noexcept = 0;
  /// Notes who runs on it from now on. [non-rt]
  void note_hosted(const std::shared_ptr<Component>& component);
  /// All that run on it: components of the architecture, and those that leave it or have yet to enter it. [non-rt]
  std::vector<std::shared_ptr<Component>> hosted() const;
  /// Stops all, the last one first; who does not come to rest soon keeps none of the others running. [non-rt]
  void stop_all(time_ns_t until_ns) noexcept;
  /// After that: makes the outputs of those safe whose state does not end. [non-rt]
  void give_up_hung() noexcept;

 private:
  void require_own() const;
  std::shared_ptr<Component> find_leaving(const std::string& name, const Component* present) const;

  Architecture& architecture_;
  mutable Mutex hosted_mutex_;
  std::vector<std::weak_ptr<Component>> hosted_ MAUVE_GUARDED_BY(hosted_mutex_);
};

}  // namespace mauve
