// SPDX-License-Identifier: LGPL-3.0-or-later
// Actions: what a rule does or undoes, kept ready while it may be wanted.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "mauve_rt/architecture/description.hpp"
#include "mauve_rt/base/rt.hpp"
#include "mauve_rt/base/seam/atomic.hpp"
#include "mauve_rt/base/value.hpp"
#include "mauve_rt/change/prepared_transaction.hpp"
#include "mauve_rt/deploy/host.hpp"
#include "mauve_rt/rules/engine.hpp"

namespace mauve::rules {

/// One step of a rule's transaction.
using ActionStep = Assignment;
using ActionSteps = std::vector<ActionStep>;

/// The transaction of such steps, by a rule of that name. [non-rt] Throws Error: there is no such kind.
Transaction make_transaction(const ActionSteps& steps, const std::string& rule = {});
/// The author of what a rule does: Authored::author. [non-rt]
std::string rule_author(const std::string& rule);
/// The steps with the elements that they set. [non-rt] Throws Error: there is no such kind.
std::vector<Assigned> assigned(const ActionSteps& steps);
/// Which of the components of which they replace or set something is not there, or does not run, in words; empty: none. One
/// that they start or stop may be stopped. [non-rt]
std::string hindrance(const ActionSteps& steps, const ArchitectureDescription& description);

/// What came of an action that was begun.
struct ActionReport {
  ActionSteps steps{};                        // what was to be done
  std::optional<TransactionReport> report{};  // of one that is in force
  std::string failure{};                      // of one that is not: why, in words
};

/// One transaction of a rule, prepared anew for each time that it is carried out. Its steps are those that lead to what is
/// wanted, which others have a say in (Overlays): who prepares it brings them along.
///
/// "decision thread", "preparation thread", "commit thread": see RuleRunner. Steps that cannot be prepared (configure,
/// resynchronise) are tried beforehand, and carried out by the preparation thread.
///
/// | member    | written by                                                   | read by         | order     |
/// | --------- | ------------------------------------------------------------ | --------------- | --------- |
/// | stage_    | decision thread: ready -> begun, over -> heard; who carries it out: begun -> over; preparation thread: the others | all | acq_rel: whose turn it is, and hands over prepared_ and how_ |
/// | prepared_ | preparation thread; commit thread while begun                | decision thread while begun | by stage_ |
/// | how_      | who carries it out                                           | decision thread | by stage_ |
/// | is_preparable_ | preparation thread                                      | decision thread, commit thread while begun | by stage_ |
/// | based_on_ | preparation thread                                           | decision thread | release/acquire: the steps are of then or later |
/// | the rest  | preparation thread                                           | preparation thread | -      |
class Action {
 public:
  /// [setup]
  Action(bool exists, const TransactionOptions& options, std::string rule);
  Action(const Action&) = delete;
  Action& operator=(const Action&) = delete;

  /// Whether the rule has such an action. [rt]
  bool exists() const MAUVE_RT { return exists_; }
  /// Whether a real-time thread commits it, once it was begun; else the preparation thread carries it out. [rt]
  bool is_preparable() const MAUVE_RT { return is_preparable_; }
  /// Whether it was begun, and what came of it is not in the architecture's description yet. [rt]
  bool is_unsettled() const MAUVE_RT { return stage_.load(std::memory_order_acquire) > Stage::ready; }

  // ---- the preparation thread

  /// Whether it is not prepared, or was before something changed. [non-rt]
  bool is_wanting(std::uint64_t revision, std::uint32_t based_on) const;
  /// Prepares it anew; no steps: nothing is to be done. Whether it was or is ready. [non-rt]
  bool prepare(Host& host, std::uint64_t revision, ActionSteps steps, std::uint32_t based_on);
  /// Finds out whether the steps could be prepared once `before` is done. [non-rt]
  void try_after(const ActionSteps& before, const ActionSteps& steps, Host& host);
  /// It is not to be wanted now; whether it was ready. [non-rt]
  bool put_away();
  /// Completes what was committed; carries out what was begun and cannot be prepared: whether there was such a thing. [non-rt]
  bool settle(Host& host);
  /// What came of it, once, after settle(); waits for the releases that follow. [non-rt]
  std::optional<ActionReport> report();
  /// Whether there was nothing to prepare, as all is so. [non-rt]
  bool has_no_steps() const noexcept { return tried_at_ != 0 && steps_.empty(); }
  /// Why it could not be prepared; empty: it could be, or that was not tried. [non-rt]
  const std::string& problem() const noexcept { return problem_; }
  /// Whether another preparation may go better although nothing changes: one of others was in its way. [non-rt]
  bool may_pass() const noexcept { return may_pass_; }
  /// What is kept prepared. [non-rt]
  std::size_t memory_bytes() const noexcept { return prepared_ != nullptr ? prepared_->memory_bytes() : 0; }

  // ---- the decision thread

  /// Whether it could begin, with steps of this number or later. [rt]
  bool is_ready(std::uint32_t based_on) const MAUVE_RT {
    return stage_.load(std::memory_order_acquire) == Stage::ready &&
           based_on_.load(std::memory_order_acquire) == based_on;
  }
  /// Posts it to who carries it out; false: it was not ready any more. [rt]
  bool begin() MAUVE_RT;
  /// Lets a commit under way end soon, without the change where that is not made. [rt]
  void call_off() MAUVE_RT;
  /// How it has ended, once. [rt]
  std::optional<Ended> ended() MAUVE_RT;

  // ---- the commit thread

  /// Commits it, where it was begun; whether it was. [rt] as far as adopt and take are.
  bool commit() noexcept;

 private:
  enum class Stage : std::uint8_t { idle, ready, begun, over, heard };

  void complete();
  void carry_out(Host& host);

  const bool exists_;
  const TransactionOptions options_;
  const std::string rule_;
  ActionSteps steps_;
  bool is_preparable_{true};
  std::unique_ptr<PreparedTransaction> prepared_;
  std::unique_ptr<TransactionCommit> committed_;
  std::optional<ActionReport> report_;
  std::string problem_;
  bool may_pass_{false};       // the problem
  std::uint64_t tried_at_{0};  // the revision; 0: not yet
  Ended how_{Ended::done};
  Atomic<std::uint32_t> based_on_{0};
  Atomic<Stage> stage_{Stage::idle};
};

}  // namespace mauve::rules
