// SPDX-License-Identifier: LGPL-3.0-or-later
// The work of one transaction, from its draft to its report.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "mauve_rt/change/transaction_commit.hpp"
#include "mauve_rt/run/commit.hpp"

#include "change/actions.hpp"
#include "change/draft.hpp"

namespace mauve {

class TransactionCommit::Work : public std::enable_shared_from_this<TransactionCommit::Work> {
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
    bool is_structural{false};
    std::uint32_t structure{0};
    std::uint32_t code{0};  // the registry's version
  };
  /// All up to the commit. [non-rt], the change lock held. Throws Error; all is let go then.
  Basis prepare_for_later(Transaction transaction);
  /// All components of the basis claimed, the basis checked. [rt] as far as the actions are.
  Commit::Outcome commit_prepared(time_ns_t until_ns) noexcept;
  /// Calls off commit_prepared(), before or while it runs. [rt]
  void call_off() MAUVE_RT { commit_->call_off(Commit::Off::preempted); }
  /// Sleeps until all components have taken the change that was committed, at most until the instant. [non-rt]
  bool wait_passed(time_ns_t until_ns) const noexcept;
  /// Has the architecture complete a prepared change that was committed. [non-rt], the change lock held.
  void keep_open(std::vector<std::shared_ptr<Component>> unsettled);
  /// Whether it adds a component or resource of that name. [non-rt], before it is completed.
  bool has_added(const std::string& name) const noexcept;
  /// What follows the commit, once all components have taken the change. [non-rt], the change lock held.
  void settle_committed();
  /// Throws why it was not made. [non-rt]
  [[noreturn]] void throw_not_made();
  /// [non-rt], the change lock held.
  void discard() noexcept;

 private:
  /// A component that takes part in the commit.
  struct Change {
    DraftComponent* draft;
    std::unique_ptr<PartsChange> parts{};
    Retreat* retreat{nullptr};  // of a removed one
  };

  // draft
  void begin(Transaction transaction);
  void begin_alone();
  EarlierChange look_at_earlier() const;
  bool is_structural() const noexcept;
  void claim_whole() noexcept;
  void release_whole() noexcept;
  [[nodiscard]] std::unique_ptr<ChangeLock::Pause> let_others_in();
  void draft_steps();
  void require_preparable() const;
  // prepare
  void prepare();
  void prepare_resource(DraftResource& added);
  void prepare_added(DraftComponent& added);
  void prepare_change(DraftComponent& changed);
  void prepare_removed(DraftComponent& removed);
  void prepare_parts(Change& change);
  void prepare_shadow(const DraftComponent& changed);
  void configure_anew(DraftComponent& changed);
  void prepare_repair(const DraftComponent& changed);
  void prepare_wiring(Change& change);
  void prepare_floor(const Component& component, ServiceBase& service);
  void prepare_properties(Change& change);
  void prefault_parts();
  void prepare_listening(const Change& change, const PortBase& port, ServiceBase& service);
  // commit
  void gather();
  void commit_by_force_if_asked();
  bool force_hung();
  bool stop_by_force(const Change& change);
  void carry_out_commit();
  void require_same_structure() const;
  void finish();
  void require_host_open() const;
  [[noreturn]] void throw_refused(const std::string& what) const;
  // after it
  void publish();
  void settle_with_host();
  void retire();
  void set_epoch();
  void keep_for_report();
  static void renew_fallback(Change& change);
  static void settle_shadow(const DraftComponent& changed);
  void give_back_candidates() noexcept;
  void leave_behind();
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
  std::uint32_t structure_{0};                       // of a structural one: as it was when this began to look
  std::vector<std::shared_ptr<Resource>> in_reach_;  // of a prepared one: outlive what refers to them
  std::unique_ptr<Draft> draft_;

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
      actions_;                                    // in the order they are taken in; the new parts come after
  std::vector<ListenerChange*> listener_changes_;  // among the actions
  StateGuard guard_;
  std::vector<std::shared_ptr<Component>> touched_;  // outlive the commit, which refers to their tasks
  std::unique_ptr<Commit> commit_;
  std::map<std::string, Participant*> places_;  // by component
  bool committed_{false};

  class Late;
};

/// A change that a late component has not taken yet.
class TransactionCommit::Work::Late final : public OpenChange {
 public:
  Late(std::shared_ptr<Work> work, std::vector<std::shared_ptr<Component>> unsettled)
      : work_(std::move(work)), unsettled_(std::move(unsettled)) {}
  bool settle() noexcept override;
  const Task* find_late() const noexcept override;
  bool has_added(const std::string& name) const noexcept override { return work_->has_added(name); }

 private:
  std::shared_ptr<Work> work_;
  std::vector<std::shared_ptr<Component>> unsettled_;
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
