// SPDX-License-Identifier: LGPL-3.0-or-later
// What ordinary threads do with a component's shadow (shadow.hpp).
#include "mauve_rt/run/component.hpp"

namespace mauve {

std::shared_ptr<Shadow> Component::last_shadow() const {
  const LockGuard lock(shown_mutex_);
  return shadow_;
}

void Component::keep_shadow(std::shared_ptr<Shadow> shadow) {
  const LockGuard lock(shown_mutex_);
  shadow_.swap(shadow);
}

void Component::conclude_shadow() noexcept {
  if (const auto shadow = last_shadow()) shadow->conclude(ShadowCause::closed, task_.clock().now_ns());
}

void Component::settle_shadow() noexcept {
  const auto shadow = last_shadow();
  if (shadow == nullptr || !shadow->has_ended()) return;
  task_.forget_shadow(*shadow);
  shadow->detach();
  retire_shadow(shadow);
}

void Component::retire_shadow(const std::shared_ptr<Shadow>& shadow) noexcept {
  if (shadow->begin_retirement()) dispose("cleanup of the shadow", [shadow] { shadow->retire(); });
}

}  // namespace mauve
