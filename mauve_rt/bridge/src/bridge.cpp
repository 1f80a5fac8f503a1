// SPDX-License-Identifier: LGPL-3.0-or-later
#include "bridge.hpp"

#include <algorithm>

#include "mauve_rt/base/contract.hpp"
#include "mauve_rt/base/seam/guards.hpp"
#include "mauve_rt/base/time.hpp"

#include "thread.hpp"

namespace mauve::bridge {

namespace {

constexpr time_ns_t kLook = s_to_ns(1);  // so often the sending thread looks even when nobody wakes it

}  // namespace

Bridge::~Bridge() { close(); }

template <typename Kind, typename... Args>
std::size_t Bridge::open(const Args&... args) {
  auto made = std::make_unique<Kind>(node_, args...);
  const LockGuard lock(mutex_);
  const bool is_new = bindings_.emplace(opened_, std::move(made)).second;
  MAUVE_ENSURES(is_new);
  return opened_++;
}

std::size_t Bridge::publish(const TopicSettings& settings) {
  return open<OutgoingTopic>(settings, opened_, std::ref(log_));
}
std::size_t Bridge::subscribe(const TopicSettings& settings) {
  return open<IncomingTopic>(settings, opened_, std::ref(log_));
}
std::size_t Bridge::mirror(const TopicSettings& topic, const MirrorSettings& settings) {
  return open<Mirror>(topic, opened_, std::ref(log_), settings);
}
std::size_t Bridge::call(const CallSettings& settings) { return open<CalledService>(settings); }
std::size_t Bridge::offer(const CallSettings& settings, const std::string& offered) {
  return open<OfferedService>(settings, offered);
}

void Bridge::attach(const std::vector<std::size_t>& numbers) {
  stop_receivers();  // what arrives meanwhile waits in the middleware
  try {
    const LockGuard lock(mutex_);
    for (const std::size_t number : numbers) {
      Binding& binding = *bindings_.at(number);
      binding.attach(architecture_.hold_resource(binding.resource_name()));
      binding.listen_for_silence(silence_of(binding));
    }
  } catch (...) {
    start_receivers();
    throw;
  }
  start_receivers();
  architecture_.publications().notify();  // of what was written before
}

Silence Bridge::silence_of(const Binding& binding) const {
  const std::string& resource = binding.resource_name();
  if (links_.contains(resource)) return Silence::of_link;
  return silent_.contains(resource) ? Silence::of_writes : Silence::none;
}

void Bridge::listen_for_silence(std::set<std::string> resources, std::set<std::string> links) {
  silent_ = std::move(resources);
  links_ = std::move(links);
  stop_receivers();
  try {
    const LockGuard lock(mutex_);
    for (const auto& [number, binding] : bindings_) {
      if (binding->is_attached()) binding->listen_for_silence(silence_of(*binding));
    }
  } catch (...) {
    start_receivers();
    throw;
  }
  start_receivers();
}

void Bridge::close(const std::vector<std::size_t>& numbers) {
  while (send_some()) {
  }
  stop_receivers();
  {
    const LockGuard lock(mutex_);
    for (const std::size_t number : numbers) bindings_.erase(number);
  }
  start_receivers();
}

void Bridge::start() {
  if (running_) return;
  running_ = true;
  ending_.store(false, std::memory_order_release);
  sender_ = start_thread("topics_out", [this] { send_all(); }, sender_place_);
  start_receivers();
}

void Bridge::stop() {
  if (!running_) return;
  stop_receivers();
  running_ = false;
  ending_.store(true, std::memory_order_release);
  architecture_.publications().notify();
  sender_.join();
}

void Bridge::close() {
  stop();
  const LockGuard lock(mutex_);
  bindings_.clear();
}

BridgeReport Bridge::report() {
  const LockGuard lock(mutex_);
  BridgeReport all;
  for (const auto& [number, binding] : bindings_) binding->report(all);
  return all;
}

bool Bridge::send_some() {
  const LockGuard lock(mutex_);
  bool more = false;
  for (const auto& [number, binding] : bindings_) more = (binding->is_attached() && binding->send()) || more;
  return more;
}

time_ns_t Bridge::next_look_ns() {
  const LockGuard lock(mutex_);
  time_ns_t next = monotonic_now_ns() + kLook;
  for (const auto& [number, binding] : bindings_) {
    if (binding->is_attached()) next = std::min(next, binding->next_look_ns());
  }
  return next;
}

void Bridge::send_all() {
  Notifier& written = architecture_.publications();
  for (bool ending = false; !ending;) {
    const std::uint32_t word = written.word();  // before the look: what comes after is noticed
    // Read before it: one more round at the end, for the outputs of the stop.
    ending = ending_.load(std::memory_order_acquire);
    while (send_some()) {
    }
    if (!ending) written.wait(word, next_look_ns());
  }
}

void Bridge::start_receivers() {
  if (!running_) return;
  const auto arrivals = [this](Lane lane) {
    std::vector<Arrival*> all;
    for (const auto& [number, binding] : bindings_) {
      if (!binding->is_attached()) continue;
      const std::vector<Arrival*> own = binding->arrivals(lane);
      all.insert(all.end(), own.begin(), own.end());
    }
    return all;
  };
  messages_.start(arrivals(Lane::messages));
  requests_.start(arrivals(Lane::requests));
  events_.start(arrivals(Lane::events));
}

void Bridge::stop_receivers() {
  messages_.stop();
  requests_.stop();
  events_.stop();
}

}  // namespace mauve::bridge
