// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/data/resource.hpp"

#include <algorithm>
#include <mutex>

#include "mauve_rt/base/error.hpp"
#include "mauve_rt/base/futex.hpp"

namespace mauve {

void Notifier::notify() noexcept {
  word_.fetch_add(1, std::memory_order_seq_cst);
  // Once for all writes until it waits again: it may not run before the component that writes has come to its wait.
  if (waiting_.load(std::memory_order_seq_cst) && waiting_.exchange(false, std::memory_order_seq_cst))
    futex_wake_all(word_);
}

std::uint32_t Notifier::wait(std::uint32_t seen, time_ns_t until_ns) noexcept {
  waiting_.store(true, std::memory_order_seq_cst);
  while (word_.load(std::memory_order_seq_cst) == seen && futex_wait_until(word_, seen, until_ns))
    waiting_.store(true, std::memory_order_seq_cst);
  return word();
}

void EventListeners::add(EventListener& listener, const std::string& resource) {
  const std::lock_guard lock(mutex_);
  const std::size_t count = count_.load(std::memory_order_relaxed);
  if (count == kCapacity) {
    throw Error(ErrorCode::out_of_range, "too many wait for events of the resource",
                {.element = "resource " + resource,
                 .expected = "at most " + std::to_string(kCapacity) + " listeners",
                 .found = "one more",
                 .remedy = "share the events among more resources, or let one component pass them on"});
  }
  listeners_[count] = &listener;
  count_.store(count + 1, std::memory_order_relaxed);
}

void EventListeners::remove(EventListener& listener) noexcept {
  const std::lock_guard lock(mutex_);
  const std::size_t count = count_.load(std::memory_order_relaxed);
  for (std::size_t i = 0; i < count; ++i) {
    if (listeners_[i] != &listener) continue;
    listeners_[i] = listeners_[count - 1];
    count_.store(count - 1, std::memory_order_relaxed);
    return;
  }
}

void EventListeners::replace(EventListener& listener, EventListener& by) noexcept {
  const std::lock_guard lock(mutex_);
  const auto end = listeners_.begin() + static_cast<std::ptrdiff_t>(count_.load(std::memory_order_relaxed));
  const auto place = std::find(listeners_.begin(), end, &listener);
  if (place != end) *place = &by;
}

void EventListeners::call_all(time_ns_t time_ns) noexcept {
  const std::lock_guard lock(mutex_);
  const std::size_t count = count_.load(std::memory_order_relaxed);
  for (std::size_t i = 0; i < count; ++i) listeners_[i]->on_event(time_ns);
}

void Resource::bind_input() {
  for (const ServiceBase* service : services_) {
    if (service->kind() == PortKind::write) service->check_ports(service->ports() + 1);
  }
  for (ServiceBase* service : services_) {
    if (service->kind() == PortKind::write) service->add_port();
  }
}

ServiceBase* Resource::find_service(std::string_view name) const noexcept {
  for (ServiceBase* service : services_) {
    if (service->name() == name) return service;
  }
  return nullptr;
}

std::string Resource::why_refused(std::span<const std::byte> message) const {
  return "its " + std::to_string(message.size()) + " bytes are no whole " + type_ +
         ", or one with longer lists or texts than are declared here";
}

}  // namespace mauve
