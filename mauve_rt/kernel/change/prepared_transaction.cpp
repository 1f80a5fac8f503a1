// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/change/prepared_transaction.hpp"

#include <malloc.h>

#include <algorithm>
#include <exception>
#include <optional>

#include "mauve_rt/architecture/runner.hpp"
#include "mauve_rt/base/contract.hpp"
#include "mauve_rt/base/error.hpp"
#include "mauve_rt/base/seam/atomic.hpp"
#include "mauve_rt/base/seam/mutex.hpp"

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
/// | phase      | who commits, first within a look at the table; then who holds the change lock | both | release/acquire: hands over the work |
/// | outcome    | who commits                             | who completes | relaxed: phase, or its caller, hands it over |
/// | is_called_off | who calls off, within a look         | who commits   | relaxed: within a look, or a hint            |
/// | is_dropped | who holds the change lock, within a look | anyone       | release/acquire                              |
/// | work       | who commits; else who holds the change lock | the same  | phase: committing; is_dropped                |
/// | failure    | who holds the change lock               | the same      | -                                            |
class PreparedTransaction::State {
 public:
  State(Architecture& its_architecture, Runner& its_host, const TransactionOptions& options)
      : architecture(its_architecture),
        host(its_host),
        deployment(its_host.deployments()),
        work(std::make_shared<TransactionCommit::Work>(its_architecture, &its_host, options)) {}

  /// Once false, false for ever.
  bool is_unchanged() const MAUVE_RT {
    if (basis.is_structural && architecture.commit_gate().structure() != basis.structure) return false;
    if (const PluginRegistry* registry = architecture.registry(); registry != nullptr) {
      if (registry->version() != basis.code)
        return false;  // its new parts may be of code that was loaded anew
    }
    return basis.is_run_only ||
           std::all_of(basis.touched.begin(), basis.touched.end(), [](const auto& touched) {
             return touched.component->change_mark().changes() == touched.changes;
           });
  }
  bool is_current() const MAUVE_RT {
    if (is_dropped.load(std::memory_order_acquire)) return false;
    if (!host.is_deployed() || host.deployments() != deployment) return false;
    return is_unchanged() && std::all_of(basis.touched.begin(), basis.touched.end(), [](const auto& touched) {
             return touched.component->task().state() == touched.state;
           });
  }
  /// Why not. An ordinary change that is open was called off; another prepared one, or one that acts on the parts that are in,
  /// comes before this one. CommitGate::structural held where it is structural.
  std::optional<PreparedOutcome> begin() noexcept {
    CommitGate& gate = architecture.commit_gate();
    const CommitGate::Look table(gate);
    if (is_called_off.load(std::memory_order_relaxed) || !host.is_deployed())
      return PreparedOutcome::withdrawn;
    for (const auto& touched : basis.touched) {
      if (touched.component->change_mark().is_held() || gate.has_open_about(touched.component->task()))
        return PreparedOutcome::stale;
    }
    if (!is_current()) return PreparedOutcome::stale;
    MAUVE_EXPECTS(phase.load(std::memory_order_relaxed) == kReady);  // relaxed: within a look
    phase.store(kCommitting, std::memory_order_release);
    return std::nullopt;
  }
  bool lock_structure(time_ns_t until_ns) noexcept {
    return lock_unless(architecture.commit_gate().structural, until_ns,
                       [this]() MAUVE_RT { return is_called_off.load(std::memory_order_relaxed); });
  }
  void call_off() MAUVE_RT {
    const CommitGate::Look table(architecture.commit_gate());
    is_called_off.store(true, std::memory_order_relaxed);
    if (phase.load(std::memory_order_relaxed) == kCommitting) work->call_off();  // relaxed: within a look
  }
  void end(bool is_made) noexcept {
    const CommitGate::Look table(architecture.commit_gate());
    MAUVE_EXPECTS(phase.load(std::memory_order_relaxed) == kCommitting);  // relaxed: this thread wrote it
    phase.store(is_made ? kCommitted : kNotMade, std::memory_order_release);
  }
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
      case Outcome::stale:
        return PreparedOutcome::stale;
      case Outcome::off:
        return PreparedOutcome::withdrawn;
    }
    return PreparedOutcome::committed;
  }

  Architecture& architecture;
  Runner& host;
  const std::uint32_t deployment;
  std::shared_ptr<TransactionCommit::Work> work;  // nullptr: let go of
  TransactionCommit::Work::Basis basis{};
  time_ns_t phase_ns{0};
  std::size_t memory_bytes{0};

  UrgentCommit urgent{};

  enum Phase : std::uint8_t { kReady, kCommitting, kCommitted, kNotMade, kSettled };
  Atomic<bool> used{false};
  Atomic<Phase> phase{kReady};
  Atomic<PreparedOutcome> outcome{PreparedOutcome::stale};
  Atomic<bool> is_dropped{false};
  Atomic<bool> is_called_off{false};
  std::exception_ptr failure{};  // why it was not made; or what went wrong in the retirement of one that was
};

PreparedTransaction::PreparedTransaction(Architecture& architecture, Runner& host, Transaction transaction,
                                         const TransactionOptions& options) {
  const LockGuard change(architecture.change_lock());
  const auto use = host.use();
  const std::size_t before = allocated_bytes();
  state_ = std::make_unique<State>(architecture, host, options);
  state_->phase_ns = options.timeouts.phase_ns;
  state_->basis = state_->work->prepare_for_later(std::move(transaction));
  state_->urgent.is_structural = state_->basis.is_structural;
  for (const auto& touched : state_->basis.touched)
    state_->urgent.tasks.push_back(&touched.component->task());
  architecture.enlist(*this);
  const std::size_t after = allocated_bytes();
  state_->memory_bytes = sizeof(*this) + sizeof(State) + (after > before ? after - before : 0);
}

PreparedTransaction::~PreparedTransaction() {
  const auto change = state_->architecture.change_lock().join();
  state_->architecture.delist(*this);
  // One that is made and that a component has not taken is kept by the architecture.
  if (!settle() && state_->phase.load(std::memory_order_acquire) != State::kCommitted) let_go();
}

bool PreparedTransaction::is_current() const noexcept {
  return !state_->used.load(std::memory_order_acquire) && state_->is_current();
}

PreparedOutcome PreparedTransaction::commit(time_ns_t timeout_ns) noexcept {
  State& state = *state_;
  if (state.used.exchange(true, std::memory_order_acq_rel)) return PreparedOutcome::stale;
  const time_ns_t until_ns = later_by(monotonic_now_ns(), timeout_ns);
  CommitGate& gate = state.architecture.commit_gate();
  gate.press(state.urgent);
  const bool has_gate = !state.basis.is_structural || state.lock_structure(until_ns);
  const std::optional<PreparedOutcome> why_not = has_gate ? state.begin() : PreparedOutcome::timed_out;
  // The structure is free again at the decision, before the components have taken the change.
  std::unique_lock structural(gate.structural, std::defer_lock);
  if (has_gate && state.basis.is_structural) structural = std::unique_lock(gate.structural, std::adopt_lock);
  const PreparedOutcome outcome = why_not ? *why_not : state.commit(until_ns);
  state.outcome.store(outcome, std::memory_order_relaxed);  // relaxed: phase, or its caller, hands it on
  if (!why_not) state.end(outcome == PreparedOutcome::committed);
  gate.relax(state.urgent);  // only now: an ordinary commit that is installed meanwhile would come in its way
  if (structural.owns_lock()) structural.unlock();
  if (outcome == PreparedOutcome::committed) state.work->await_passes(until_ns);
  return outcome;
}

void PreparedTransaction::call_off() noexcept { state_->call_off(); }

bool PreparedTransaction::settle() noexcept {
  State& state = *state_;
  MAUVE_AUDIT(state.architecture.change_lock().is_held_here());
  const State::Phase phase = state.phase.load(std::memory_order_acquire);
  if (phase != State::kCommitted) return phase == State::kSettled;
  const bool is_settled = state.work->settle();
  state.failure = state.work->failure();
  if (is_settled) {
    state.architecture.forget_open(*state.work);
    state.phase.store(State::kSettled, std::memory_order_release);
  }
  return is_settled;
}

void PreparedTransaction::drop_if_stale() noexcept {
  MAUVE_AUDIT(state_->architecture.change_lock().is_held_here());
  {
    const CommitGate::Look table(state_->architecture.commit_gate());
    const State::Phase phase = state_->phase.load(std::memory_order_acquire);
    const bool is_in_use =
        phase == State::kCommitting || phase == State::kCommitted || phase == State::kSettled;
    if (is_in_use || state_->is_unchanged()) return;
    state_->is_dropped.store(true, std::memory_order_release);
  }
  note_failure();
  let_go();
}

void PreparedTransaction::note_failure() noexcept {
  State& state = *state_;
  MAUVE_AUDIT(state.architecture.change_lock().is_held_here());
  if (state.phase.load(std::memory_order_acquire) != State::kNotMade || state.failure ||
      state.work == nullptr)
    return;
  try {
    state.work->throw_not_made();
  } catch (...) {
    state.failure = std::current_exception();
  }
}

void PreparedTransaction::let_go() noexcept {
  State& state = *state_;
  MAUVE_AUDIT(state.architecture.change_lock().is_held_here());
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
  const std::uint64_t first = state.architecture.disposed();
  const PreparedOutcome outcome = state.outcome.load(std::memory_order_relaxed);
  if (outcome == PreparedOutcome::committed)
    state.work->wait_passed(later_by(monotonic_now_ns(), state.phase_ns));
  std::exception_ptr failure;
  {
    const LockGuard change(state.architecture.change_lock());
    settle();
    note_failure();
    failure = state.failure;  // written again when changes are settled, as long as one component is late
  }
  state.architecture.wait_disposed(first);
  if (outcome == PreparedOutcome::stale) {
    throw Error(ErrorCode::wrong_revision,
                "what the change was prepared against has changed, or is being changed; nothing was changed",
                {.remedy = "prepare it again"});
  }
  if (failure) std::rethrow_exception(failure);
  if (outcome == PreparedOutcome::committed) return state.work->report(state.phase_ns);
  if (outcome == PreparedOutcome::withdrawn && state.host.is_deployed()) {
    throw Error(ErrorCode::wrong_revision, "the change was called off before it began; nothing was changed",
                {.remedy = "prepare it again"});
  }
  if (outcome == PreparedOutcome::withdrawn) {
    throw Error(ErrorCode::not_configured, "the architecture was shut down before the change was made",
                {.remedy = "deploy it, then prepare the change again"});
  }
  throw Error(ErrorCode::timeout, "another commit did not end in time; nothing was changed",
              {.remedy = "try again, or allow a longer commit timeout"});
}

std::size_t PreparedTransaction::memory_bytes() const noexcept { return state_->memory_bytes; }

}  // namespace mauve
