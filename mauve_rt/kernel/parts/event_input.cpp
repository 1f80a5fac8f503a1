// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/parts/event_input.hpp"

#include <algorithm>

#include "mauve_rt/base/seam/mutex.hpp"
#include "mauve_rt/parts/fsm.hpp"

namespace mauve {

void EventInput::on_event(time_ns_t time_ns) noexcept {
  if (is_live_.load(std::memory_order_relaxed)) heed(time_ns);
}

void EventInput::heed(time_ns_t time_ns) noexcept {
  keep(time_ns);
  waiter_.load(std::memory_order_relaxed)->signal_event();
}

std::optional<time_ns_t> EventInput::consume() noexcept {
  const time_ns_t time = time_.exchange(kNone, std::memory_order_acq_rel);
  return time == kNone ? std::nullopt : std::optional(time);
}

void EventInput::keep(time_ns_t time_ns) noexcept {
  time_ns_t none = kNone;
  // acq_rel: the first event's time stays until it is consumed
  time_.compare_exchange_strong(none, time_ns, std::memory_order_acq_rel);
}

/// An event is unused only if no wait there has consumed it: each of them is told of all.
time_ns_t EventInput::unconsumed_by_all(std::span<const std::unique_ptr<State>> before) const noexcept {
  time_ns_t latest = kNone;
  for (const auto& state : before) {
    if (state->event == nullptr || !is_for_the_same(*state->event)) continue;
    const time_ns_t time = state->event->time_.load(std::memory_order_acquire);
    if (time == kNone) return kNone;
    latest = std::max(latest, time);
  }
  return latest;
}

/// The shell may be another, so that the ports are.
bool EventInput::is_for_the_same(const EventInput& other) const noexcept {
  return resource_ != nullptr && other.resource_ == resource_ && other.port_->name() == port_->name();
}

void EventInput::take_over(std::span<const std::unique_ptr<State>> before) noexcept {
  if (resource_ == nullptr) return is_live_.store(true, std::memory_order_relaxed);
  const LockGuard lock(resource_->events_mutex());  // a write reaches both inputs, or the one that counts
  if (const time_ns_t time = unconsumed_by_all(before); time != kNone) keep(time);
  is_live_.store(true, std::memory_order_relaxed);
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
  if (resource_ != nullptr) resource_->unlisten(*this);  // first: it heeds events from the next line on
  is_live_.store(true, std::memory_order_relaxed);
  resource.relisten(stand_in, *this);
  resource_ = &resource;
}

}  // namespace mauve
