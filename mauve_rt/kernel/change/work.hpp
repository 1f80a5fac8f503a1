// SPDX-License-Identifier: LGPL-3.0-or-later
// The work of one transaction, from its draft to its report.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "mauve_rt/base/seam/atomic.hpp"
#include "mauve_rt/base/seam/condition_variable.hpp"
#include "mauve_rt/base/seam/ordinary_thread.hpp"
#include "mauve_rt/change/transaction_commit.hpp"
#include "mauve_rt/run/commit.hpp"

#include "change/actions.hpp"
#include "change/draft.hpp"

namespace mauve {

/// Its record: what it was drafted from, what it puts in, what it has put out. It is held by who asked for it, and by the
/// architecture from its draft on until nothing of it is left to be done: no component is to take it, or to come back to it, and
/// what it has put out is retired. Ordinary threads, with the architecture's change lock, but for these:
///
/// | member                | written by                     | read by | order                                          |
/// | --------------------- | ------------------------------ | ------- | ---------------------------------------------- |
/// | phase_                | who publishes, who asked       | anyone  | release/acquire: the decision, and all before it |
/// | lists_ ... services_  | who asked, before the commit   | who publishes, once | the gate's mutex                   |
/// | reports_              | who asked, then who settles    | who asked | reports_mutex_, from the commit on           |
/// | commit_, touched_     | who asked, before the commit   | who tells of it | facts_mutex_                           |
/// | step_texts_, author   | who asked                      | who tells of it | before the architecture keeps it       |
/// | thread_               | who asked, who prepares        | anyone  | relaxed: a lone fact                           |
/// | preparation_          | who asked, who prepares        | the same | its mutex                                     |
/// | begun_ns_             | who asked, who commits a prepared one | who tells of it | relaxed: a lone number          |
/// | is_armed_             | who prepared, who commits      | who tells of it | release/acquire: begun_ns_             |
/// | is_preparing_, is_called_off_ | who asked; who calls off, at a hook | same | relaxed: RunningHook's mutex         |
/// | claimed_              | who asked, who calls off       | who asked | the gate's mutex                             |
class TransactionCommit::Work final : public std::enable_shared_from_this<TransactionCommit::Work>,
                                      public OpenChange,
                                      private Publication {
 public:
  Work(Architecture& architecture, Runner* host, const TransactionOptions& options);

  void make(Transaction transaction);
  TransactionReport report(time_ns_t phase_timeout_ns);

  // ---- the same as make() in parts, for a prepared transaction

  /// What it was prepared against; read without the work itself, which may be gone.
  struct Basis {
    struct Touched {
      std::shared_ptr<Component> component;
      std::uint32_t changes;
      ComponentState state;
    };
    std::vector<Touched> touched{};
    bool is_run_only{
        false};  // it starts and stops, and assigns nothing else: other changes do not make it stale
    bool is_structural{false};
    std::uint32_t structure{0};
    std::uint32_t code{0};  // the registry's version
  };
  /// All up to the commit. [non-rt], the change lock held, once. Throws Error; all is let go then.
  Basis prepare_for_later(Transaction transaction);
  /// The basis checked. [rt] as far as the actions are.
  Commit::Outcome commit_prepared(time_ns_t until_ns) noexcept;
  /// Of one that was committed: waits until all components have taken it, at most until the instant and a little longer. [rt]
  void await_passes(time_ns_t until_ns) noexcept { commit_->await_passes(until_ns); }
  /// Calls off commit_prepared(), before or while it runs. [rt]
  void call_off() MAUVE_RT { commit_->call_off(Commit::Off::preempted); }
  /// Sleeps until all components have taken the change that was committed, at most until the instant. [non-rt]
  bool wait_passed(time_ns_t until_ns) const noexcept;
  bool settle() noexcept override;
  /// What went wrong when what it has put out was retired, first; the change is in. [non-rt]
  const std::exception_ptr& failure() const noexcept { return failure_; }
  const Task* find_late() const noexcept override;
  bool is_under_way() const noexcept override;
  void tell(std::vector<OpenChangeFacts>& all) const override;
  std::shared_ptr<Component> find_awaited(const std::string& component) const override;
  bool awaits_parts(const std::string& component) const override;
  bool is_about(const std::string& target) const noexcept override;
  bool is_overdue() const override;
  bool call_off_preparation() override;
  /// Throws why it was not made. [non-rt]
  [[noreturn]] void throw_not_made();
  /// [non-rt], the change lock held.
  void discard() noexcept;

 private:
  /// A component that takes part in the commit.
  struct Change {
    DraftComponent* draft;
    std::unique_ptr<PartsChange> parts{};
    Retreat* retreat{nullptr};                 // of a removed one
    std::vector<ListenerChange*> listeners{};  // among the actions
    Participant* place{nullptr};
    bool is_settled{false};
  };
  enum class Phase : std::uint8_t { being_made, made, off, settled };
  void advance(Phase to);

  // the table
  time_ns_t since_ns() const noexcept override;
  bool is_current() const noexcept override;
  void publish(time_ns_t instant_ns) noexcept override;
  void prepare_publication();
  void prepare_lists();
  void forget_wires();

  // draft
  void begin(Transaction transaction);
  void begin_alone();
  EarlierChange look_at_earlier() const;
  bool is_structural() const noexcept;
  void claim_whole() noexcept;
  void release_whole() noexcept;
  [[nodiscard]] std::unique_ptr<ChangeLock::Pause> let_others_in();
  void draft_steps();
  bool acts_on_present_parts() const noexcept;
  [[noreturn]] void throw_called_off() const;
  [[noreturn]] void rethrow_not_made();
  void require_preparable() const;
  // prepare
  bool has_hooks() const noexcept;
  void prepare_beside_others();
  void prepare_interruptibly();
  void run_preparation(ArchitecturePresence& presence);
  void end_left_behind(ArchitecturePresence& presence);
  void prepare();
  void prepare_resource(DraftResource& added);
  void prepare_added(DraftComponent& added);
  void prepare_change(DraftComponent& changed);
  void prepare_removed(DraftComponent& removed);
  void prepare_parts(Change& change);
  void prepare_shadow(const DraftComponent& changed);
  std::shared_ptr<Shadow> prepare_candidate(DraftComponent& changed);
  void note_fields(int step, const Handover* handover);
  bool make_anew(DraftComponent& changed);
  void configure_anew(DraftComponent& changed);
  void prepare_repair(const DraftComponent& changed);
  void prepare_wiring(Change& change);
  void prepare_floor(const Component& component, ServiceBase& service);
  void prepare_properties(Change& change);
  void prefault_parts();
  void prepare_listening(Change& change, const PortBase& port, ServiceBase* service);
  // commit
  void gather();
  std::vector<std::shared_ptr<Component>> find_silent() const;
  void commit_by_force_if_asked();
  bool force_hung();
  bool stop_by_force(const Change& change);
  void carry_out_commit();
  void require_host_open() const;
  [[noreturn]] void throw_refused(const std::string& what) const;
  void throw_if_not_near(const Change& change) const;
  // after it
  void settle_with_host();
  void note_made() noexcept;
  bool settle_if_over(Change& change) noexcept;
  void settle_place(Change& change);
  void dispose(Change& change);
  void note_handover(const Change& change);
  void retire_removed(const std::shared_ptr<Component>& component);
  void end_settlement() noexcept;
  void discard_rest() noexcept;
  void release_parts() noexcept;
  void note_configured_anew() noexcept;
  void set_epoch();
  void keep_for_report();
  std::vector<OutputStep> measured_steps(time_ns_t until_ns) const;
  static void renew_fallback(Change& change);
  static void settle_shadow(const DraftComponent& changed);
  void give_back_candidates() noexcept;
  void give_back_candidate(const DraftComponent& changed) noexcept;
  std::unique_ptr<CoreBase> core_not_taken(const DraftComponent& changed) noexcept;
  void give_back_comebacks() noexcept;
  void let_go(const std::shared_ptr<Component>& component, bool was_listed);

  template <typename Part>
  void at_step(int step, Part&& part);
  [[noreturn]] void rethrow_at(int step, const Error& failure) const;
  int step_of(const std::string& component) const;
  Afterwards afterwards_of(const Change& change) const;
  const std::string& text_of(int step) const;
  template <typename Action>
  Action& keep(const Component& component, std::unique_ptr<Action> action);

  Architecture& architecture_;
  Runner* host_;  // while it is made; nullptr: nobody runs the architecture
  bool deployed_;
  bool is_simulated_;
  TransactionOptions options_;
  Transaction transaction_;
  std::size_t numbers_before_{0};
  std::size_t numbers_after_{0};
  ArchitectureClaims claimed_{};
  std::uint32_t structure_{0};  // of a structural one: as it was when this began to look
  std::unique_ptr<Draft> draft_;

  Mutex reports_mutex_;
  std::vector<StepReport> reports_;  // by step
  time_ns_t prepare_ns_{0};
  std::vector<std::shared_ptr<Resource>> prepared_resources_;
  std::vector<DraftComponent*> prepared_added_;
  struct ConfiguredAnew {
    Component* component;
    ComponentState before;
    FaultNote fault;
  };
  std::vector<ConfiguredAnew> configured_anew_;
  std::vector<std::unique_ptr<Repair>> repairs_;  // taken in last: the new parts are in
  std::vector<Change> changes_;
  std::vector<std::unique_ptr<CommitAction>>
      actions_;  // in the order they are taken in; the new parts come after
  StateGuard guard_;
  std::vector<std::string> step_texts_;
  Atomic<std::thread::id> thread_{std::this_thread::get_id()};  // that prepares
  Atomic<time_ns_t> begun_ns_{0};
  Atomic<bool> is_armed_{false};       // prepared, and not being committed
  Atomic<bool> is_preparing_{false};   // beside other changes: each hook that it is at can be called off
  Atomic<bool> is_called_off_{false};  // the claims are free, and the parts of its components are held
  struct Preparation {
    Mutex mutex;
    ConditionVariable changed;
    bool is_over MAUVE_GUARDED_BY(mutex){false};
    // It was called off, and the requester has returned: the thread that prepares does what is left to be done.
    bool is_left{false};
    std::exception_ptr failure{};
  };
  Preparation preparation_;
  bool is_prepared_{false};  // for a prepared transaction, which lets go of it if it is not made
  /// Of touched_ the one of that name that has yet to take the change that is made; its size: there is none. [non-rt]
  std::size_t awaited_place(const std::string& component) const MAUVE_REQUIRES(facts_mutex_);

  mutable Mutex facts_mutex_;                        // for a moment: no hook, and no other lock
  std::vector<std::shared_ptr<Component>> touched_;  // outlive the commit, which refers to their tasks
  std::unique_ptr<Commit> commit_;
  std::map<std::string, Participant*> places_;  // by component
  bool committed_{false};
  struct Swapped {
    std::shared_ptr<Shadow> candidate{};
    int step{0};
  };
  Swapped swapped_{};  // of a bumpless change
  Atomic<Phase> phase_{Phase::being_made};
  Atomic<bool> is_noted_{false};
  std::exception_ptr failure_{};  // of its retirement
  bool resynchronises_{false};

  // what it makes of the table
  struct Element {
    Component* component;
    std::uint32_t changes;  // as the draft found it
    bool has_place;         // it takes part in the commit
  };
  bool is_structural_{false};
  bool is_run_only_{false};
  Lists lists_{};
  std::vector<Element> elements_{};  // of the components that were there
  std::vector<std::pair<Component*, std::shared_ptr<const Wires>>> wires_{};
  std::vector<Component*> added_{};
  std::vector<std::pair<FrameGuard*, const Frames*>> frames_{};  // that change
  std::vector<ServiceBase*> services_{};  // to which a port is connected or disconnected
};

/// Takes the time of a part of a step's preparation, and says of its errors whose they are.
template <typename Part>
void TransactionCommit::Work::at_step(int step, Part&& part) {
  const time_ns_t began = monotonic_now_ns();
  try {
    part();
  } catch (const Error& failure) {
    rethrow_at(step, failure);
  } catch (...) {
    rethrow_at(step, Error(ErrorCode::prepare_failed, caught_text()));
  }
  reports_[static_cast<std::size_t>(step - 1)].prepare_ns += monotonic_now_ns() - began;
}

}  // namespace mauve
