// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/data/resource.hpp"

#include <algorithm>

#include "mauve_rt/base/contract.hpp"
#include "mauve_rt/base/error.hpp"
#include "mauve_rt/base/seam/futex.hpp"
#include "mauve_rt/base/seam/mutex.hpp"

namespace mauve {

void Notifier::notify() noexcept {
  const std::uint32_t mine = word_.fetch_add(1, std::memory_order_seq_cst) + 1;
  std::uint64_t waiter = waiting_.load(std::memory_order_seq_cst);
  if (waiter == kNone) return;
  // A waiter that has seen this word, or a later one, waits for the next one. The thread that notifies of that wakes the waiter.
  const auto behind = static_cast<std::int32_t>(mine - static_cast<std::uint32_t>(waiter));
  if (behind <= 0) return;
  // Once for all writes until it waits again: it may not run before the component that writes has come to its wait.
  if (waiting_.compare_exchange_strong(waiter, kNone, std::memory_order_seq_cst)) futex_wake_all(word_);
}

std::uint32_t Notifier::wait(std::uint32_t seen, time_ns_t until_ns) noexcept {
  waiting_.store(kWaits | seen, std::memory_order_seq_cst);
  while (word_.load(std::memory_order_seq_cst) == seen && futex_wait_until(word_, seen, until_ns))
    waiting_.store(kWaits | seen, std::memory_order_seq_cst);
  return word();
}

void EventListeners::add(EventListener& listener, const std::string& resource) {
  const LockGuard change(change_mutex_);
  const std::size_t count = listeners_.size();
  if (count == kCapacity) {
    throw Error(ErrorCode::out_of_range, "too many wait for events of the resource",
                {.element = "resource " + resource,
                 .expected = "at most " + std::to_string(kCapacity) + " listeners",
                 .found = std::to_string(count + 1),
                 .remedy = "share the events among more resources, or let one component pass them on"});
  }
  std::vector<EventListener*> more;  // frees the old ones, once writers have left them
  if (count == listeners_.capacity()) {
    more.reserve(std::max<std::size_t>(kFirst, 2 * count));
    more.assign(listeners_.begin(), listeners_.end());
  }
  const LockGuard lock(mutex_);
  if (more.capacity() != 0) listeners_.swap(more);
  listeners_.push_back(&listener);
  count_.store(count + 1, std::memory_order_relaxed);
}

void EventListeners::remove(EventListener& listener) noexcept {
  const LockGuard change(change_mutex_);
  const LockGuard lock(mutex_);
  const auto place = std::find(listeners_.begin(), listeners_.end(), &listener);
  if (place == listeners_.end()) return;
  listeners_.erase(place);
  count_.store(listeners_.size(), std::memory_order_relaxed);
}

void EventListeners::replace(EventListener& listener, EventListener& by) noexcept {
  const LockGuard change(change_mutex_);
  const LockGuard lock(mutex_);
  const auto place = std::find(listeners_.begin(), listeners_.end(), &listener);
  MAUVE_AUDIT(place != listeners_.end());
  if (place != listeners_.end()) *place = &by;
}

void EventListeners::call_all(Call what, time_ns_t time_ns) noexcept {
  const LockGuard lock(mutex_);
  for (EventListener* const listener : listeners_) (listener->*what)(time_ns);
}

void Resource::set_longest_hold_ns(time_ns_t longest_hold_ns) {
  if (longest_hold_ns < 0 || longest_hold_ns > kLongest) {
    throw Error(ErrorCode::out_of_range, "the time for which a lock is held is out of range",
                {.element = name_.empty() ? "longest_hold_ns" : description() + ", longest_hold_ns",
                 .expected = "1 to " + std::to_string(kLongest) + " ns, or 0: not declared",
                 .found = std::to_string(longest_hold_ns)});
  }
  longest_hold_ns_ = longest_hold_ns;
}

void Resource::set_frames(const Frames& frames) {
  check_frame_names(frames, name_.empty() ? "frame" : description());
  frame_guard_.declare(frames);
}

void Resource::begin_log(std::size_t /*bytes*/) {
  throw Error(ErrorCode::invalid_argument, "the resource has no values that could be recorded",
              {.element = description(),
               .expected = "a shared_data, latest_value, ring_buffer or event",
               .found = kind_,
               .remedy = "record another resource"});
}

std::shared_ptr<const void> Resource::use() {
  const LockGuard lock(use_mutex_);
  if (auto present = use_.lock()) return present;
  const std::shared_ptr<Resource> self = weak_from_this().lock();
  if (self == nullptr) return nullptr;
  const std::shared_ptr<const void> fresh = std::make_shared<const std::shared_ptr<Resource>>(self);
  use_ = fresh;
  return fresh;
}

bool Resource::is_in_use() const {
  const LockGuard lock(use_mutex_);
  return !use_.expired();
}

void Resource::bind_input() {
  for (const ServiceBase* service : services_) {
    if (service->kind() == PortKind::write) service->check_ports(service->ports() + 1);
  }
  for (ServiceBase* service : services_) {
    if (service->kind() != PortKind::write) continue;
    service->bind_input();
    service->share();
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
