// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/rules/action.hpp"

#include <utility>

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

}  // namespace

Transaction make_transaction(const ActionSteps& steps) {
  Transaction transaction;
  for (const ActionStep& step : steps)
    transaction.add(step.kind, step.target, step.name, step.value ? StepValue(*step.value) : StepValue());
  return transaction;
}

// ---- the tender

bool Action::try_steps(const ActionSteps& steps, Host& host) {
  problem_.clear();
  try {
    TransactionOptions options = options_;
    options.dry_run = true;
    host.make(make_transaction(steps), options);
    return true;
  } catch (const std::exception& failure) {
    problem_ = failure.what();
    return false;
  }
}

bool Action::tend(Host& host, std::uint64_t revision) {
  if (tried_at_ == revision) return false;
  Stage stage = stage_.load(std::memory_order_acquire);
  if (stage == Stage::begun || stage == Stage::over) return false;
  tried_at_ = revision;
  if (try_steps(steps_, host)) {
    // acq_rel: a stepper that took it meanwhile has it
    return stage_.compare_exchange_strong(stage = Stage::idle, Stage::ready, std::memory_order_acq_rel);
  }
  return stage_.compare_exchange_strong(stage = Stage::ready, Stage::idle, std::memory_order_acq_rel);
}

void Action::try_after(const ActionSteps& before, Host& host, std::uint64_t revision) {
  if (std::exchange(tried_after_at_, revision) == revision) return;
  ActionSteps both = before;
  both.insert(both.end(), steps_.begin(), steps_.end());
  try_steps(both, host);
}

bool Action::put_away() {
  Stage ready = Stage::ready;
  tried_at_ = 0;
  return stage_.compare_exchange_strong(ready, Stage::idle, std::memory_order_acq_rel);
}

bool Action::carry_out(Host& host) {
  if (stage_.load(std::memory_order_acquire) != Stage::begun) return false;
  report_.emplace();
  tried_at_ = 0;
  try {
    committed_ = host.make(make_transaction(steps_), options_);
    how_ = Ended::done;
  } catch (const Error& failure) {
    how_ = how_ended(failure.code());
    report_->failure = failure.what();
  } catch (const std::exception& failure) {
    how_ = Ended::refused;
    report_->failure = failure.what();
  }
  stage_.store(Stage::over, std::memory_order_release);
  return true;
}

std::optional<ActionReport> Action::complete() {
  if (!report_) return std::nullopt;
  if (committed_ != nullptr) report_->report = committed_->report(options_.timeouts.phase_ns);
  committed_.reset();
  return std::exchange(report_, std::nullopt);
}

// ---- the stepper

bool Action::begin() noexcept {
  Stage ready = Stage::ready;
  return stage_.compare_exchange_strong(ready, Stage::begun, std::memory_order_acq_rel);
}

std::optional<Ended> Action::ended() noexcept {
  if (stage_.load(std::memory_order_acquire) != Stage::over) return std::nullopt;
  const Ended how = how_;
  stage_.store(Stage::idle, std::memory_order_release);
  return how;
}

}  // namespace mauve::rules
