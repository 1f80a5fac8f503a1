// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/rules/action.hpp"

#include <algorithm>
#include <utility>

#include "mauve_rt/base/contract.hpp"
#include "mauve_rt/base/error.hpp"

namespace mauve::rules {

namespace {

Ended how_ended(ErrorCode code) noexcept {
  switch (code) {
    case ErrorCode::wrong_revision:
      return Ended::stale;
    case ErrorCode::timeout:
      return Ended::timed_out;
    default:
      return Ended::refused;
  }
}

Ended how_ended(PreparedOutcome outcome) noexcept {
  switch (outcome) {
    case PreparedOutcome::committed:
      return Ended::done;
    case PreparedOutcome::stale:
      return Ended::stale;
    case PreparedOutcome::timed_out:
      return Ended::timed_out;
    case PreparedOutcome::withdrawn:
      return Ended::withdrawn;
    case PreparedOutcome::refused:
      break;
  }
  return Ended::refused;
}

bool can_be_prepared(const ActionSteps& steps) {
  return std::none_of(steps.begin(), steps.end(), [](const ActionStep& step) {
    return step.kind == "configure" || step.kind == "resynchronise";
  });
}

/// Their transaction, prepared; nullptr: they cannot be, and were tried. Throws Error: they would be refused.
std::unique_ptr<PreparedTransaction> try_steps(const ActionSteps& steps, TransactionOptions options,
                                               Host& host, const std::string& rule) {
  if (can_be_prepared(steps)) return host.prepare(make_transaction(steps, rule), options);
  options.dry_run = true;
  host.make(make_transaction(steps), options);
  return nullptr;
}

}  // namespace

std::string rule_author(const std::string& rule) { return rule.empty() ? "" : std::string(kByRule) + rule; }

std::vector<Assigned> assigned(const ActionSteps& steps) {
  std::vector<Assigned> all;
  const Transaction transaction = make_transaction(steps);
  for (std::size_t i = 0; i < steps.size(); ++i) {
    const TransactionStep& step = *transaction.steps()[i];
    const bool is_kept = step.element() != "shadow" && steps[i].kind != "configure" &&
                         steps[i].kind != "promote" && steps[i].kind != "revert_core";
    all.push_back({.element = step.is_for_all() || !is_kept
                                  ? Element()
                                  : Element{.target = step.target, .name = step.element()},
                   .step = steps[i]});
  }
  return all;
}

Transaction make_transaction(const ActionSteps& steps, const std::string& rule) {
  Transaction transaction;
  transaction.by(rule_author(rule));
  for (const ActionStep& step : steps)
    transaction.add(step.kind, step.target, step.name, step.value ? StepValue(*step.value) : StepValue());
  return transaction;
}

Action::Action(bool exists, const TransactionOptions& options, std::string rule)
    : exists_(exists), options_(options), rule_(std::move(rule)) {}

// ---- the preparation thread

bool Action::is_wanting(std::uint64_t revision, std::uint32_t based_on) const {
  const Stage stage = stage_.load(std::memory_order_acquire);
  if (stage > Stage::ready) return false;
  // relaxed: this thread wrote it
  if (based_on_.load(std::memory_order_relaxed) != based_on || tried_at_ == 0 || may_pass_) return true;
  if (stage == Stage::ready && is_preparable_) return !prepared_->is_current();
  return tried_at_ != revision;
}

bool Action::prepare(Host& host, std::uint64_t revision, ActionSteps steps, std::uint32_t based_on) {
  const bool is_same =
      stage_.load(std::memory_order_acquire) == Stage::ready && is_preparable_ && steps == steps_;
  if (is_same && prepared_->is_current()) {
    based_on_.store(based_on, std::memory_order_release);
    return true;
  }
  const bool was_ready = put_away();
  if (stage_.load(std::memory_order_acquire) != Stage::idle) return false;  // it has just begun
  tried_at_ = revision;
  steps_ = std::move(steps);
  is_preparable_ = can_be_prepared(steps_);
  based_on_.store(based_on, std::memory_order_release);
  problem_.clear();
  may_pass_ = false;
  if (steps_.empty()) return was_ready;
  try {
    prepared_ = try_steps(steps_, options_, host, rule_);
    stage_.store(Stage::ready, std::memory_order_release);
    return true;
  } catch (const std::exception& failure) {
    problem_ = failure.what();
    const auto* const error = dynamic_cast<const Error*>(&failure);
    may_pass_ = error != nullptr &&
                (error->code() == ErrorCode::wrong_revision || error->code() == ErrorCode::timeout);
    return was_ready;
  }
}

void Action::try_after(const ActionSteps& before, const ActionSteps& steps, Host& host) {
  ActionSteps both = before;
  both.insert(both.end(), steps.begin(), steps.end());
  try {
    problem_.clear();
    if (!both.empty()) try_steps(both, options_, host, rule_);
  } catch (const std::exception& failure) {
    problem_ = failure.what();
  }
}

bool Action::put_away() {
  Stage ready = Stage::ready;
  // acq_rel: one that the decision thread has taken meanwhile is its
  if (!stage_.compare_exchange_strong(ready, Stage::idle, std::memory_order_acq_rel)) return false;
  prepared_.reset();
  tried_at_ = 0;
  may_pass_ = false;
  return true;
}

bool Action::settle(Host& host) {
  const Stage stage = stage_.load(std::memory_order_acquire);
  if (stage == Stage::begun && !is_preparable_) {
    carry_out(host);
    return true;
  }
  if (stage != Stage::heard) return false;
  complete();
  return true;
}

void Action::complete() {
  MAUVE_EXPECTS(stage_.load(std::memory_order_relaxed) == Stage::heard);  // relaxed: this thread has seen it
  if (prepared_ != nullptr) {
    report_.emplace();
    report_->steps = steps_;
    try {
      report_->report = prepared_->complete();
    } catch (const std::exception& failure) {
      report_->failure = failure.what();
    }
    prepared_.reset();
  }
  tried_at_ = 0;
  stage_.store(Stage::idle, std::memory_order_release);
}

void Action::carry_out(Host& host) {
  MAUVE_EXPECTS(!is_preparable_ && committed_ == nullptr);
  report_.emplace();
  report_->steps = steps_;
  how_ = Ended::refused;
  try {
    committed_ = host.make(make_transaction(steps_, rule_), options_);
    how_ = Ended::done;
  } catch (const Error& failure) {
    how_ = how_ended(failure.code());
    report_->failure = failure.what();
  } catch (const std::exception& failure) {
    report_->failure = failure.what();
  }
  stage_.store(Stage::over, std::memory_order_release);
}

std::optional<ActionReport> Action::report() {
  if (report_ && committed_ != nullptr) report_->report = committed_->report(options_.timeouts.phase_ns);
  committed_.reset();
  return std::exchange(report_, std::nullopt);
}

// ---- the decision thread

bool Action::begin() noexcept {
  Stage ready = Stage::ready;
  return stage_.compare_exchange_strong(ready, Stage::begun, std::memory_order_acq_rel);
}

void Action::call_off() noexcept {
  if (stage_.load(std::memory_order_acquire) == Stage::begun && is_preparable_) prepared_->call_off();
}

std::optional<Ended> Action::ended() noexcept {
  if (stage_.load(std::memory_order_acquire) != Stage::over) return std::nullopt;
  const Ended how = how_;
  stage_.store(Stage::heard, std::memory_order_release);
  return how;
}

// ---- the commit thread

bool Action::commit() noexcept {
  // The stage first: until it is begun, the preparation thread writes the rest.
  if (stage_.load(std::memory_order_acquire) != Stage::begun || !is_preparable_) return false;
  MAUVE_EXPECTS(prepared_ != nullptr);
  how_ = how_ended(prepared_->commit(options_.timeouts.commit_ns));
  stage_.store(Stage::over, std::memory_order_release);
  return true;
}

}  // namespace mauve::rules
