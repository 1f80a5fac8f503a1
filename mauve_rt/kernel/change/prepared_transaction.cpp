// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/change/prepared_transaction.hpp"

#include <malloc.h>

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>

#include "mauve_rt/architecture/runner.hpp"
#include "mauve_rt/base/error.hpp"

#include "change/work.hpp"

namespace mauve {

const char* to_string(PreparedOutcome outcome) noexcept {
  switch (outcome) {
    case PreparedOutcome::committed:
      return "committed";
    case PreparedOutcome::stale:
      return "stale";
    case PreparedOutcome::refused:
      return "refused";
    case PreparedOutcome::timed_out:
      return "timed_out";
    case PreparedOutcome::withdrawn:
      return "withdrawn";
  }
  return "unknown";
}

namespace {

std::size_t allocated_bytes() noexcept {
  const struct mallinfo2 info = mallinfo2();
  return info.uordblks + info.hblkhd;
}

}  // namespace

/// | member     | written by                              | read by       | order                                        |
/// | ---------- | --------------------------------------- | ------------- | -------------------------------------------- |
/// | the rest   | [setup]                                 | anyone        | -                                            |
/// | used       | who commits first                       | anyone        | acq_rel: one commits                         |
/// | phase      | who commits; then who holds the change lock | both      | release/acquire: hands over the work         |
/// | outcome    | who commits                             | who completes | relaxed: phase, or its caller, hands it over |
/// | is_dropped | who holds the change lock, under the gate | anyone      | release/acquire                              |
/// | work       | who commits, under the gate while it is current; else who holds the change lock | the same | phase, is_dropped |
/// | failure    | who holds the change lock               | the same      | -                                            |
class PreparedTransaction::State {
 public:
  State(Architecture& its_architecture, Runner& its_host, const TransactionOptions& options)
      : architecture(its_architecture),
        host(its_host),
        deployment(its_host.deployments()),
        work(std::make_shared<TransactionCommit::Work>(its_architecture, &its_host, options)) {}

  /// Once false, false for ever, but for a change under way that is refused.
  bool is_untouched() const MAUVE_RT {
    if (basis.is_structural && architecture.commit_gate().structure() != basis.structure) return false;
    return std::all_of(basis.touched.begin(), basis.touched.end(), [](const auto& touched) {
      return touched.component->change_mark().count() == touched.count;
    });
  }
  bool is_current() const MAUVE_RT {
    if (is_dropped.load(std::memory_order_acquire)) return false;
    if (!host.is_deployed() || host.deployments() != deployment) return false;
    return is_untouched() && std::all_of(basis.touched.begin(), basis.touched.end(), [](const auto& touched) {
             return touched.component->task().state() == touched.state;
           });
  }
  /// The gate held, all current.
  PreparedOutcome commit(time_ns_t until_ns) noexcept {
    using Outcome = Commit::Outcome;
    switch (work->commit_prepared(until_ns)) {
      case Outcome::made:
        break;
      case Outcome::refused:
        return PreparedOutcome::refused;
      case Outcome::timed_out:
        return PreparedOutcome::timed_out;
      case Outcome::changed:
        return PreparedOutcome::stale;
      case Outcome::off:
        return PreparedOutcome::withdrawn;
    }
    for (const auto& touched : basis.touched) touched.component->change_mark().commit();
    if (basis.is_structural) architecture.commit_gate().restructured();
    return PreparedOutcome::committed;
  }

  Architecture& architecture;
  Runner& host;
  const std::uint32_t deployment;
  std::shared_ptr<TransactionCommit::Work> work;  // nullptr: let go of
  TransactionCommit::Work::Basis basis{};
  time_ns_t phase_ns{0};
  std::size_t memory_bytes{0};

  enum Phase : std::uint8_t { kReady, kCommitted, kNotMade, kSettled };
  std::atomic<bool> used{false};
  std::atomic<Phase> phase{kReady};
  std::atomic<PreparedOutcome> outcome{PreparedOutcome::stale};
  std::atomic<bool> is_dropped{false};
  std::exception_ptr failure{};  // why it was not made; or what went wrong in the retirement of one that was
};

PreparedTransaction::PreparedTransaction(Architecture& architecture, Runner& host, Transaction transaction,
                                         const TransactionOptions& options) {
  const std::lock_guard change(architecture.change_lock());
  const std::unique_lock<std::mutex> use = host.use();
  const std::size_t before = allocated_bytes();
  state_ = std::make_unique<State>(architecture, host, options);
  state_->phase_ns = options.timeouts.phase_ns;
  state_->basis = state_->work->prepare_for_later(std::move(transaction));
  architecture.enlist(*this);
  const std::size_t after = allocated_bytes();
  state_->memory_bytes = sizeof(*this) + sizeof(State) + (after > before ? after - before : 0);
}

PreparedTransaction::~PreparedTransaction() {
  const auto change = state_->architecture.change_lock().join();
  state_->architecture.delist(*this);
  if (settle()) return;
  if (state_->phase.load(std::memory_order_acquire) == State::kCommitted) {
    std::vector<std::shared_ptr<Component>> unsettled;
    for (const auto& touched : state_->basis.touched) unsettled.push_back(touched.component);
    state_->work->keep_open(std::move(unsettled));
  } else {
    let_go();
  }
}

bool PreparedTransaction::is_current() const noexcept {
  return !state_->used.load(std::memory_order_acquire) && state_->is_current();
}

PreparedOutcome PreparedTransaction::commit(time_ns_t timeout_ns) noexcept {
  State& state = *state_;
  if (state.used.exchange(true, std::memory_order_acq_rel)) return PreparedOutcome::stale;
  const time_ns_t until_ns = later_by(monotonic_now_ns(), timeout_ns);
  CommitGate& commit_gate = state.architecture.commit_gate();
  PiMutex& gate = commit_gate.mutex;
  commit_gate.press();
  const bool has_gate = gate.try_lock_until(until_ns);
  commit_gate.relax();
  PreparedOutcome outcome = PreparedOutcome::timed_out;
  if (has_gate) {
    const bool is_current = state.is_current();
    outcome = is_current ? state.commit(until_ns) : PreparedOutcome::stale;
    if (!state.host.is_deployed() && outcome == PreparedOutcome::stale) outcome = PreparedOutcome::withdrawn;
    state.outcome.store(outcome, std::memory_order_relaxed);  // relaxed: phase publishes it
    const bool is_made = outcome == PreparedOutcome::committed;
    if (is_made || is_current)  // else the work may be gone
      state.phase.store(is_made ? State::kCommitted : State::kNotMade, std::memory_order_release);
    gate.unlock();
  } else {
    state.outcome.store(outcome, std::memory_order_relaxed);  // relaxed: its caller hands it on
  }
  return outcome;
}

/// The change lock held.
bool PreparedTransaction::settle() noexcept {
  State& state = *state_;
  const State::Phase phase = state.phase.load(std::memory_order_acquire);
  if (phase != State::kCommitted) return phase == State::kSettled;
  if (!state.work->wait_passed(0)) return false;
  try {
    state.work->settle_committed();
  } catch (...) {
    state.failure = std::current_exception();
  }
  const std::lock_guard gate(state.architecture.commit_gate().mutex);
  for (const auto& touched : state.basis.touched) touched.component->change_mark().settle();
  state.phase.store(State::kSettled, std::memory_order_release);
  return true;
}

/// The change lock held.
void PreparedTransaction::drop_if_stale() noexcept {
  {
    const std::lock_guard gate(state_->architecture.commit_gate().mutex);
    const State::Phase phase = state_->phase.load(std::memory_order_acquire);
    if (phase == State::kCommitted || phase == State::kSettled || state_->is_untouched()) return;
    state_->is_dropped.store(true, std::memory_order_release);
  }
  note_failure();
  let_go();
}

/// The change lock held.
void PreparedTransaction::note_failure() noexcept {
  State& state = *state_;
  if (state.phase.load(std::memory_order_acquire) != State::kNotMade || state.failure ||
      state.work == nullptr)
    return;
  try {
    state.work->throw_not_made();
  } catch (...) {
    state.failure = std::current_exception();
  }
}

/// The change lock held.
void PreparedTransaction::let_go() noexcept {
  State& state = *state_;
  if (state.work == nullptr || state.phase.load(std::memory_order_acquire) == State::kSettled) return;
  state.work->discard();
  state.work.reset();
}

TransactionReport PreparedTransaction::complete() {
  State& state = *state_;
  if (!state.used.load(std::memory_order_acquire)) {
    throw Error(ErrorCode::invalid_argument, "the prepared change was not committed",
                {.remedy = "commit it first"});
  }
  const PreparedOutcome outcome = state.outcome.load(std::memory_order_relaxed);
  if (outcome == PreparedOutcome::committed)
    state.work->wait_passed(later_by(monotonic_now_ns(), state.phase_ns));
  {
    const std::lock_guard change(state.architecture.change_lock());
    settle();
    note_failure();
  }
  if (outcome == PreparedOutcome::stale) {
    throw Error(ErrorCode::wrong_revision,
                "what the change was prepared against has changed, or is being changed; nothing was changed",
                {.remedy = "prepare it anew"});
  }
  if (state.failure) std::rethrow_exception(state.failure);
  if (outcome == PreparedOutcome::committed) return state.work->report(state.phase_ns);
  if (outcome == PreparedOutcome::withdrawn) {
    throw Error(ErrorCode::not_configured, "the architecture was shut down meanwhile",
                {.remedy = "deploy it, then prepare the change anew"});
  }
  throw Error(ErrorCode::timeout, "another commit did not end in time; nothing was changed",
              {.remedy = "try again, or allow a longer commit timeout"});
}

std::size_t PreparedTransaction::memory_bytes() const noexcept { return state_->memory_bytes; }

}  // namespace mauve
