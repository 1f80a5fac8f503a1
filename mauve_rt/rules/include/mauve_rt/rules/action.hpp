// SPDX-License-Identifier: LGPL-3.0-or-later
// Actions: what a rule does or undoes, kept ready while it may be wished.
#pragma once

#include <atomic>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "mauve_rt/architecture/description.hpp"
#include "mauve_rt/base/rt.hpp"
#include "mauve_rt/base/value.hpp"
#include "mauve_rt/deploy/host.hpp"
#include "mauve_rt/rules/engine.hpp"

namespace mauve::rules {

/// One step of a rule's transaction: all in names and plain values, so that it can be made again and again.
struct ActionStep {
  std::string kind{};  // as Transaction::add() takes it
  std::string target{};
  std::string name{};
  std::optional<PropertyValue> value{};
};
using ActionSteps = std::vector<ActionStep>;

/// The transaction of such steps. [non-rt] Throws Error: there is no such kind.
Transaction make_transaction(const ActionSteps& steps);
/// Whether the components of which they replace or set something are there and run. [non-rt]
bool can_begin(const ActionSteps& steps, const ArchitectureDescription& description);
/// Whether all that the steps ask for is so; nothing: they leave nothing behind that a description tells. [non-rt]
std::optional<bool> is_in_place(const ActionSteps& steps, const ArchitectureDescription& description);

/// What came of an action that was begun.
struct ActionReport {
  std::optional<TransactionReport> report{};  // of one that is in force
  std::string failure{};                      // of one that is not: why, in words
};

/// One transaction of a rule, made anew for each time that it is carried out.
///
/// "tender": the ordinary thread that makes ready; "stepper": the one that decides.
///
/// | member       | written by                                       | read by | order                                         |
/// | ------------ | ------------------------------------------------ | ------- | --------------------------------------------- |
/// | stage_       | tender: idle <-> ready, begun -> over; stepper: ready -> begun, over -> idle | both | acq_rel: whose turn it is, and hands over how_ |
/// | how_         | who ends it                                      | stepper | by stage_                                     |
/// | the rest     | tender                                           | tender  | -                                             |
class Action {
 public:
  /// No steps: the rule has no such action. [setup]
  explicit Action(ActionSteps steps = {}, const TransactionOptions& options = {})
      : steps_(std::move(steps)), options_(options) {}
  Action(const Action&) = delete;
  Action& operator=(const Action&) = delete;

  bool exists() const noexcept { return !steps_.empty(); }
  const ActionSteps& steps() const noexcept { return steps_; }

  // ---- the tender

  /// Makes it ready, where it is not or was at another revision; whether that changed anything. [non-rt]
  bool tend(Host& host, std::uint64_t revision);
  /// Finds out whether it could be made ready once `before` is done. [non-rt]
  void try_after(const ActionSteps& before, Host& host, std::uint64_t revision);
  /// It is not to be wished now; whether it was ready. [non-rt]
  bool put_away();
  /// Carries it out if it was begun; whether it was. [non-rt]
  bool carry_out(Host& host);
  /// What came of it, once; waits for the releases that follow. [non-rt]
  std::optional<ActionReport> complete();
  /// Why it could not be made ready; empty: it could be, or that was not tried. [non-rt]
  const std::string& problem() const noexcept { return problem_; }

  // ---- the stepper

  /// Whether it could begin. [rt]
  bool is_ready() const MAUVE_RT { return stage_.load(std::memory_order_acquire) == Stage::ready; }
  /// Lets it be carried out; false: it was not ready any more. [rt]
  bool begin() MAUVE_RT;
  /// How it has ended, once. [rt]
  std::optional<Ended> ended() MAUVE_RT;

 private:
  enum class Stage : std::uint8_t { idle, ready, begun, over };

  bool try_steps(const ActionSteps& steps, Host& host);

  const ActionSteps steps_;
  const TransactionOptions options_;
  std::unique_ptr<TransactionCommit> committed_;
  std::optional<ActionReport> report_;
  std::string problem_;
  std::uint64_t tried_at_{0};        // the revision; 0: not yet
  std::uint64_t tried_after_at_{0};  // the same of try_after()
  Ended how_{Ended::done};
  std::atomic<Stage> stage_{Stage::idle};
};

}  // namespace mauve::rules
