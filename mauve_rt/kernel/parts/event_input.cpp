// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/parts/event_input.hpp"

namespace mauve {

void EventInput::on_event(time_ns_t time_ns) noexcept {
  time_ns_t none = kNone;
  // acq_rel: the first event's time stays until it is consumed
  time_.compare_exchange_strong(none, time_ns, std::memory_order_acq_rel);
  waiter_.load(std::memory_order_relaxed)->signal_event();
}

std::optional<time_ns_t> EventInput::consume() noexcept {
  const time_ns_t time = time_.exchange(kNone, std::memory_order_acq_rel);
  return time == kNone ? std::nullopt : std::optional(time);
}

EventInput::~EventInput() { stop_listening(); }

void EventInput::stop_listening() noexcept {
  if (resource_ != nullptr) resource_->unlisten(*this);
  resource_ = nullptr;
}

void EventInput::listen() {
  Resource* const resource = port_->is_connected() ? port_->service()->resource() : nullptr;
  if (resource == resource_) return;
  if (resource != nullptr) resource->listen(*this);
  if (resource_ != nullptr) resource_->unlisten(*this);
  resource_ = resource;
}

void EventInput::listen_for(EventListener& stand_in, Resource& resource) noexcept {
  resource.relisten(stand_in, *this);
  if (resource_ != nullptr) resource_->unlisten(*this);
  resource_ = &resource;
}

}  // namespace mauve
