// SPDX-License-Identifier: LGPL-3.0-or-later
// How a shadow executes its candidate: on the shadow's thread, or in a simulation.
#include "mauve_rt/base/pi_mutex.hpp"
#include "mauve_rt/run/shadow.hpp"
#include "mauve_rt/run/task.hpp"

#include "run/still_clock.hpp"

namespace mauve {

namespace {

/// What the candidate marks in the trace goes nowhere, and its log lines go to the queue: in a simulation the rings at hand are
/// the component's.
class WithoutRing {
 public:
  WithoutRing() noexcept {
    TraceRing::set_for_this_thread(nullptr);
    LogRing::set_for_this_thread(nullptr);
  }
  ~WithoutRing() {
    TraceRing::set_for_this_thread(before_);
    LogRing::set_for_this_thread(log_before_);
  }
  WithoutRing(const WithoutRing&) = delete;
  WithoutRing& operator=(const WithoutRing&) = delete;

 private:
  TraceRing* before_{detail::this_threads_ring};
  LogRing* log_before_{detail::this_threads_log_ring};
};

}  // namespace

bool Shadow::run_pending() noexcept {
  bool has_run = false;
  {
    const LockGuard run(run_mutex_);
    has_run = run_oldest();
  }
  // The component's thread may take the core out right away: it finds the mutex free.
  if (has_run && is_near()) awaiting_.use([](Task& task) { task.notify_commit(); });
  return has_run;
}

bool Shadow::run_oldest() noexcept {
  const ShadowCapture::Release* const release = capture_.front();
  if (phase_.load(std::memory_order_acquire) != kRunning || release == nullptr || parts_.core == nullptr)
    return false;
  const time_ns_t instant_ns = release->instant_ns;
  const auto held_before = PiMutex::held_by_this_thread();
  executing_since_ns_.store(monotonic_now_ns(), std::memory_order_relaxed);
  try {
    execute(*release);
  } catch (const std::exception& failure) {
    PiMutex::let_go_of_all_but(held_before);
    fault(failure.what(), instant_ns);
  } catch (...) {
    PiMutex::let_go_of_all_but(held_before);
    fault("an exception that is no std::exception", instant_ns);
  }
  executing_since_ns_.store(0, std::memory_order_relaxed);
  capture_.pop();
  return true;
}

void Shadow::execute(const ShadowCapture::Release& release) {
  is_anew_ = is_anew_ || release.is_anew;
  if (debt_ > 0) {
    --debt_;
    skipped_budget_.fetch_add(1, std::memory_order_relaxed);
    return;
  }
  {
    const LockGuard lock(figures_mutex_);
    take_properties();
  }
  if (const std::byte* const state = capture_.state()) handover_->load(state);
  put_inputs();
  clock_->set_now(release.instant_ns);
  const WithoutRing none;
  const time_ns_t began_ns = thread_cpu_now_ns();
  const bool has_executed = advance_to(release);
  const bool is_virtual = signal_ == nullptr;
  const time_ns_t execution_ns = is_virtual ? clock_->spent_ns() : thread_cpu_now_ns() - began_ns;
  const LockGuard lock(figures_mutex_);
  ++(has_executed ? figures_.compared : figures_.idle);
  if (has_executed) count_execution(execution_ns);
  compare(release);
}

/// Frees nothing: in a blend the component's own thread calls this.
void Shadow::take_properties() noexcept {
  for (auto& [name, value] : properties_) {
    if (PropertyBase* property = parts_.shell->find_property(name)) property->swap(value);
  }
  if (!properties_.empty()) set_properties_.swap(properties_);
}

void Shadow::put_inputs() {
  const auto& ports = parts_.shell->ports();
  for (std::size_t place = 0; place < ports.size(); ++place) {
    if (ports[place]->kind() != PortKind::read) continue;
    const ShadowCapture::PortNote& note = capture_.note(place);
    cells_[place]->put(capture_.value(place), note.status, note.time_ns);
  }
}

/// Whether the candidate's wait has ended by then, and it has executed up to its next one.
bool Shadow::advance_to(const ShadowCapture::Release& release) {
  if (is_anew_) {
    is_anew_ = false;
    if (release.from == ShadowCapture::kStart) {
      machine_.start(release.instant_ns);
    } else {
      machine_.start_in(*parts_.fsm->states()[static_cast<std::size_t>(release.from)], release.instant_ns);
    }
  }
  if (machine_.due_ns() > release.instant_ns) return false;
  execute_wait_to_wait(release.instant_ns);
  return true;
}

void Shadow::execute_wait_to_wait(time_ns_t instant_ns) {
  machine_.skip_to(instant_ns);
  machine_.release(instant_ns);
  machine_.leave_wait();
  while (machine_.enter_next() == Machine::Entered::execution) {
  }
}

// ---- a blend. No other thread uses the shell, the fsm and the machine: the shadow's thread has given the candidate's core away.

bool Shadow::begin_blend(std::unique_ptr<CoreBase>& old, std::size_t wait, time_ns_t due_ns,
                         time_ns_t instant_ns) noexcept {
  has_blended_.store(true, std::memory_order_relaxed);  // relaxed: the phase publishes it
  std::uint32_t expected = kRunning;
  if (!phase_.compare_exchange_strong(expected, kBlending, std::memory_order_acq_rel)) {
    has_blended_.store(false, std::memory_order_relaxed);
    return false;
  }
  await_outputs();
  blend_->core = std::move(old);
  blend_->core->bind_shell(*parts_.shell);  // of the class of the shell that it had
  blend_->core->set_context(&machine_.context());
  machine_.set_parts(*parts_.fsm, &blend_->binding, machine_.grid().period_ns);
  machine_.start_in(*parts_.fsm->states()[wait], due_ns);
  is_holding_.store(true, std::memory_order_release);
  blend_->begin(instant_ns);
  return true;
}

time_ns_t Shadow::execute_old(time_ns_t instant_ns) noexcept {
  const std::unique_lock executing(blend_->mutex, std::try_to_lock);  // else it has ended, and is cleaned up
  if (!executing.owns_lock() || !is_blending() || blend_->weight(instant_ns) >= 1.0) return 0;
  if (figures_mutex_.try_lock()) {  // else before the next execution: this thread waits for no other one
    const LockGuard lock(figures_mutex_, std::adopt_lock);
    take_properties();
  }
  const auto& ports = parts_.shell->ports();
  for (std::size_t place = 0; place < ports.size(); ++place) {
    if (ports[place]->kind() != PortKind::read) continue;
    const ShadowCapture::PortNote& note = capture_.present_note(place);
    cells_[place]->put(capture_.present(place), note.status, note.time_ns);
  }
  clock_->set_now(instant_ns);
  const WithoutRing none;
  const auto held_before = PiMutex::held_by_this_thread();
  const auto fault = [&](const char* what) {
    PiMutex::let_go_of_all_but(held_before);
    blend_->fault = std::string(what) + " in state " + TraceNames::word(machine_.state_name());
  };
  try {
    if (machine_.due_ns() <= instant_ns) execute_wait_to_wait(instant_ns);
  } catch (const std::exception& failure) {
    fault(failure.what());
  } catch (...) {
    fault("an exception that is no std::exception");
  }
  for (std::size_t place = 0; place < ports.size(); ++place) {
    if (ports[place]->kind() == PortKind::write) blend_->note_old(place, cells_[place]->take_written());
  }
  return clock_->spent_ns();
}

ShadowCause Shadow::write_blended(time_ns_t instant_ns, time_ns_t now_ns) noexcept {
  const double weight = blend_->weight(instant_ns);
  const ShadowCause end = !blend_->fault.empty()            ? ShadowCause::fault
                          : weight >= 1.0 || !is_blending() ? ShadowCause::promotion
                                                            : ShadowCause::none;
  if (end != ShadowCause::none) {
    end_blend(end, instant_ns, now_ns);
  } else {
    blend_->write(weight);
  }
  return end;
}

bool Shadow::give_back_old(std::unique_ptr<CoreBase>& to, time_ns_t now_ns) noexcept {
  if (blend_ == nullptr || !MAUVE_RT_TRUSTED(blend_->mutex.try_lock())) return false;
  const bool has_old = is_blending() && blend_->core != nullptr;
  if (has_old) {
    MAUVE_RT_TRUSTED(to.swap(blend_->core));
    has_blended_.store(false, std::memory_order_relaxed);  // relaxed: the phase publishes it
  }
  MAUVE_RT_TRUSTED(blend_->mutex.unlock());  // who retires the shadow needs it
  if (has_old) end_blend(ShadowCause::reverted, now_ns, now_ns);
  return has_old;
}

void Shadow::end_blend(ShadowCause why, time_ns_t instant_ns, time_ns_t now_ns) noexcept {
  if (!is_holding_.exchange(false, std::memory_order_acq_rel)) return;
  const bool drops = why == ShadowCause::live_fault || why == ShadowCause::reverted;
  if (drops) {
    blend_->drop();
  } else {
    blend_->write(why == ShadowCause::stop ? blend_->weight(instant_ns) : 1.0);
  }
  blend_->end();
  if (drops || why == ShadowCause::stop) awaits_outputs_.store(false, std::memory_order_release);
  conclude(why, now_ns);
}

void Shadow::compare(const ShadowCapture::Release& release) {
  for (auto& [place, comparison] : comparisons_) {
    const void* const live = capture_.note(place).is_noted ? capture_.value(place) : nullptr;
    const void* const candidate = cells_[place]->take_written();
    comparison.add(release.number, live, candidate);
    if (steps_ != nullptr) steps_->note(place, live, candidate);
  }
  if (steps_ == nullptr || !steps_->compare(release.instant_ns)) return;
  near_.store(release.number + 1, std::memory_order_release);
}

void Shadow::count_execution(time_ns_t execution_ns) {
  figures_.largest_execution_ns = std::max(figures_.largest_execution_ns, execution_ns);
  if (execution_ns <= options_.budget_ns) return;
  ++figures_.over_budget;
  debt_ = (execution_ns - 1) / options_.budget_ns;
}

void Shadow::fault(const std::string& what, time_ns_t instant_ns) {
  {
    const LockGuard lock(figures_mutex_);
    fault_ = what + " in state " + TraceNames::word(machine_.state_name());
  }
  conclude(ShadowCause::fault, signal_ == nullptr ? instant_ns : monotonic_now_ns());
}

}  // namespace mauve
