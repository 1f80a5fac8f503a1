// SPDX-License-Identifier: LGPL-3.0-or-later
#include "bridge.hpp"

#include "mauve_rt/time.hpp"

#include "thread.hpp"

namespace mauve::bridge {

namespace {

constexpr time_ns_t kLook = s_to_ns(1);  // so often the sending thread looks even when nobody wakes it

}  // namespace

Bridge::~Bridge() { close(); }

std::size_t Bridge::publish(const std::string& resource, const std::string& topic, const std::string& type,
                            const rmw_qos_profile_t& qos) {
  const TopicSettings settings{.name = topic, .type = type, .qos = qos, .number = topic_count_};
  auto made = std::make_unique<OutgoingTopic>(node_, architecture_.resource(resource), settings, log_);
  stop_receivers();
  {
    const std::lock_guard lock(topics_mutex_);
    outgoing_.push_back(std::move(made));
  }
  start_receivers();
  return topic_count_++;
}

std::size_t Bridge::subscribe(const std::string& resource, const std::string& topic, const std::string& type,
                              const rmw_qos_profile_t& qos) {
  const TopicSettings settings{.name = topic, .type = type, .qos = qos, .number = topic_count_};
  auto made = std::make_unique<IncomingTopic>(node_, architecture_.resource(resource), settings, log_);
  stop_receivers();  // what arrives meanwhile waits in the middleware
  {
    const std::lock_guard lock(topics_mutex_);
    incoming_.push_back(std::move(made));
  }
  start_receivers();
  return topic_count_++;
}

void Bridge::start() {
  if (running_) return;
  running_ = true;
  ending_.store(false, std::memory_order_release);
  sender_ = start_thread("topics_out", [this] { send_all(); });
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
  const std::lock_guard lock(topics_mutex_);
  outgoing_.clear();
  incoming_.clear();
}

std::vector<TopicReport> Bridge::reports() {
  const std::lock_guard lock(topics_mutex_);
  std::vector<TopicReport> all;
  const auto add = [&all](const auto& topic) {
    all.push_back({.resource = topic->resource().name(),
                   .topic = topic->full_name(),
                   .counts = topic->counts(),
                   .troubles = topic->events().troubles()});
  };
  for (const auto& topic : outgoing_) add(topic);
  for (const auto& topic : incoming_) add(topic);
  return all;
}

void Bridge::send_all() {
  Notifier& written = architecture_.publications();
  for (bool ending = false; !ending;) {
    const std::uint32_t word = written.word();  // before the look: what comes after is noticed
    ending =
        ending_.load(std::memory_order_acquire);  // one more round then: outputs of the stop are sent too
    for (bool more = true; more;) {
      more = false;
      const std::lock_guard lock(topics_mutex_);
      for (const auto& topic : outgoing_) more = topic->send() || more;
    }
    if (!ending) written.wait(word, monotonic_now_ns() + kLook);
  }
}

void Bridge::start_receivers() {
  if (!running_) return;
  std::vector<Arrival*> messages;
  std::vector<Arrival*> events;
  const auto add_events = [&events](const auto& topic) {
    const std::vector<Arrival*> all = topic->events().arrivals();
    events.insert(events.end(), all.begin(), all.end());
  };
  for (const auto& topic : outgoing_) add_events(topic);
  for (const auto& topic : incoming_) {
    messages.push_back(topic.get());
    add_events(topic);
  }
  receiver_.start(std::move(messages));
  events_.start(std::move(events));
}

void Bridge::stop_receivers() {
  receiver_.stop();
  events_.stop();
}

}  // namespace mauve::bridge
