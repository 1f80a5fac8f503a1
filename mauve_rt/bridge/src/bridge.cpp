// SPDX-License-Identifier: LGPL-3.0-or-later
#include "bridge.hpp"

#include <algorithm>

#include "mauve_rt/base/contract.hpp"
#include "mauve_rt/base/seam/guards.hpp"
#include "mauve_rt/base/seam/sleep.hpp"
#include "mauve_rt/base/time.hpp"

#include "thread.hpp"

namespace mauve::bridge {

namespace {

constexpr time_ns_t kLook = s_to_ns(1);  // so often the sending thread looks even when nobody wakes it
constexpr int kSentAtOnce = 64;          // of one binding before the others have their turn
constexpr int kHighestPriority = 99;

}  // namespace

Bridge::~Bridge() { close(); }

template <typename Kind, typename... Args>
std::size_t Bridge::open(const Args&... args) {
  return open(std::make_unique<Kind>(node_, args...));
}

std::size_t Bridge::open(std::unique_ptr<Binding> binding) {
  const LockGuard lock(mutex_);
  const bool is_new = bindings_.emplace(opened_, std::move(binding)).second;
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
    const LockGuard stops(stops_mutex_);
    list_stoppable();
  } catch (...) {
    start_receivers();
    throw;
  }
  start_receivers();
  architecture_.publications().notify();  // of what was written before
  architecture_.stops().notify();
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
  {
    const LockGuard lock(mutex_);
    for (const std::size_t number : numbers) {
      if (bindings_.at(number)->is_attached()) bindings_.at(number)->end();
    }
  }
  while (send_some()) {
  }
  for (time_ns_t due_ns = 0; (due_ns = send_stops()) != kForever;)
    sleep_for(std::max(due_ns - monotonic_now_ns(), time_ns_t{0}));
  stop_receivers();
  {
    const LockGuard lock(mutex_);
    const LockGuard stops(stops_mutex_);
    for (const std::size_t number : numbers) bindings_.erase(number);
    list_stoppable();
  }
  start_receivers();
}

void Bridge::start() {
  if (running_) return;
  running_ = true;
  ending_.store(false, std::memory_order_release);
  stops_ending_.store(false, std::memory_order_release);
  sender_ = start_thread("topics_out", [this] { send_all(); }, sender_place_);
  ThreadPlace stops_place = sender_place_;
  stops_place.priority = std::min(stops_place.priority + 1, kHighestPriority);
  stops_sender_ = start_thread("stops_out", [this] { send_all_stops(); }, stops_place);
  start_receivers();
}

void Bridge::stop() {
  if (!running_) return;
  stop_receivers();
  {
    const LockGuard lock(mutex_);
    for (const auto& [number, binding] : bindings_) {
      if (binding->is_attached()) binding->end();
    }
  }
  running_ = false;
  ending_.store(true, std::memory_order_release);
  architecture_.publications().notify();
  sender_.join();
  stops_ending_.store(true, std::memory_order_release);
  architecture_.stops().notify();
  stops_sender_.join();
}

void Bridge::close() {
  stop();
  const LockGuard lock(mutex_);
  const LockGuard stops(stops_mutex_);
  bindings_.clear();
  list_stoppable();
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
  for (const auto& [number, binding] : bindings_) {
    bool has_more = binding->is_attached();
    for (int sent = 0; has_more && sent < kSentAtOnce; ++sent) {
      if (has_stops()) send_stops();
      has_more = binding->send();
    }
    more = more || has_more;
  }
  return more;
}

bool Bridge::has_stops() noexcept {
  return architecture_.stops().word() != stops_sent_.load(std::memory_order_relaxed);
}

/// Returns when the next copy is due.
time_ns_t Bridge::send_stops() {
  const LockGuard lock(stops_mutex_);
  // The topics take turns, message by message. Those on which another thread is sending come last: that may take long.
  for (bool may_wait = false;;) {
    const std::uint32_t word = architecture_.stops().word();  // before the look: what comes after is noticed
    time_ns_t next_ns = kForever;
    for (Binding* const binding : stoppable_) next_ns = std::min(next_ns, binding->send_stops(may_wait));
    if (may_wait && next_ns != Binding::kAtOnce) {
      stops_sent_.store(word, std::memory_order_relaxed);
      return next_ns;
    }
    may_wait = next_ns != Binding::kAtOnce;
  }
}

/// mutex_ held, too.
void Bridge::list_stoppable() {
  stoppable_.clear();
  for (const auto& [number, binding] : bindings_) {
    if (binding->is_attached()) stoppable_.push_back(binding.get());
  }
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

void Bridge::send_all_stops() {
  Notifier& stops = architecture_.stops();
  for (;;) {
    const std::uint32_t word = stops.word();
    const bool ending = stops_ending_.load(std::memory_order_acquire);
    const time_ns_t next_ns = send_stops();
    if (ending && next_ns == kForever) return;
    stops.wait(word, next_ns);
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
