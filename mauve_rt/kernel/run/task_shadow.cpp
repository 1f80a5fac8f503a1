// SPDX-License-Identifier: LGPL-3.0-or-later
// A task's part in the shadow of its component (shadow.hpp): it has each release captured.
#include "mauve_rt/run/probation.hpp"
#include "mauve_rt/run/shadow.hpp"
#include "mauve_rt/run/task.hpp"

namespace mauve {

void Task::set_shadow(Shadow& shadow) noexcept {
  if (shadow_.is_set()) leave_shadow();  // the curves of a promoted candidate end here
  shadow.begin(machine_.present_wait(), machine_.core(), clock().now_ns());
  shadow_.set(shadow);
}

void Task::end_shadow(ShadowCause why) noexcept {
  if (!shadow_.is_set()) return;
  bool is_over = true;
  shadow_.use([&](Shadow& shadow) {
    shadow.conclude(why, clock().now_ns());
    is_over = why != ShadowCause::promotion || !machine_.is_started() || !shadow.await_outputs();
  });
  if (is_over) leave_shadow();
}

void Task::leave_shadow() noexcept {
  bool was_blending = false;
  shadow_.use([&](Shadow& shadow) {
    was_blending = shadow.is_holding();
    shadow.detach();
  });
  shadow_.revoke(kForever);  // waits for no thread: who runs the machine is the only user
  if (was_blending) end_probation(ProbationCause::blend_ended);
}

void Task::note_swap(time_ns_t instant_ns) noexcept {
  shadow_.use([&](Shadow& shadow) { shadow.note_swap(instant_ns); });
}

void Task::start_shadow() noexcept {
  shadow_.use([](Shadow& shadow) { shadow.start(); });
}

bool Task::begin_blend(Shadow& shadow, std::unique_ptr<CoreBase>& old, time_ns_t instant_ns) noexcept {
  const State* const wait = machine_.present_wait();
  return wait != nullptr && shadow.begin_blend(old, wait->index, machine_.due_ns(), instant_ns);
}

/// A release is about to reach its next wait: the old core of a blend executes, and the outputs of both are written.
void Task::blend_release() noexcept {
  Shadow* blending = nullptr;
  shadow_.use([&](Shadow& shadow) { blending = shadow.is_holding() ? &shadow : nullptr; });
  if (blending == nullptr) return;
  // Not within use(): who removes the component waits for no state of the old core. The shadow lives as long as the component has no other.
  if (machine_.is_late()) return end_blend(ShadowCause::overrun);
  machine_.clock().spend(blending->execute_old(machine_.clock_ns()));
  const time_ns_t now_ns = machine_.look_at_clock();
  if (machine_.is_late()) return end_blend(ShadowCause::overrun);
  const ShadowCause end = blending->write_blended(machine_.clock_ns(), now_ns);
  if (end == ShadowCause::none) return;
  end_probation(end == ShadowCause::promotion ? ProbationCause::none : ProbationCause::blend_ended);
}

void Task::end_blend(ShadowCause why) noexcept {
  bool was_blending = false;
  shadow_.use([&](Shadow& shadow) {
    was_blending = shadow.is_holding();
    shadow.end_blend(why, machine_.clock_ns(), clock().now_ns());
  });
  if (was_blending) end_probation(ProbationCause::blend_ended);
}

/// A release has reached its next wait.
void Task::capture_release() noexcept {
  bool is_over = false;
  shadow_.use([&](Shadow& shadow) {
    is_over = shadow.end_release(machine_.entered_ns(), machine_.present_wait(), machine_.core());
  });
  if (is_over) leave_shadow();
}

}  // namespace mauve
