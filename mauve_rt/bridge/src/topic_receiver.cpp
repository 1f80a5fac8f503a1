// SPDX-License-Identifier: LGPL-3.0-or-later
#include "topic_receiver.hpp"

#include <rcl/error_handling.h>
#include <rmw/events_statuses/events_statuses.h>
#include <rmw/features.h>

#include <algorithm>
#include <cstring>
#include <limits>

#include "mauve_rt/base/contract.hpp"
#include "mauve_rt/base/seam/guards.hpp"

#include "rcl_error.hpp"
#include "type_support.hpp"

namespace mauve::bridge {

namespace {

constexpr int kMessagesATurn = 5000;       // of one topic before the others have their turn
constexpr std::size_t kMostWriters = 256;  // of one topic: more have come and gone
// Between two waits: at 20 kHz a wait for each message costs more than the messages. The middleware notes when each came.
constexpr time_ns_t kPause = ms_to_ns(5);
constexpr std::size_t kMostTopics = std::numeric_limits<std::uint16_t>::max();

template <typename Status>
bool take_event(rcl_event_t& event, Status& status) {
  return went_well(rcl_take_event(&event, &status));
}

}  // namespace

std::uint64_t SequenceGaps::follow(const rmw_gid_t& writer, std::uint64_t sequence) {
  ++calls_;
  const auto is_it = [&writer](const Writer& known) {
    return std::memcmp(known.gid.data(), writer.data, known.gid.size()) == 0;
  };
  const auto known = std::find_if(writers_.begin(), writers_.end(), is_it);
  if (known == writers_.end()) {
    if (writers_.size() == kMostWriters)
      writers_.erase(std::min_element(writers_.begin(), writers_.end(),
                                      [](const Writer& a, const Writer& b) { return a.used < b.used; }));
    Writer added{.gid = {}, .last = sequence, .used = calls_};
    std::memcpy(added.gid.data(), writer.data, added.gid.size());
    writers_.push_back(added);
    return lost_;
  }
  known->used = calls_;
  if (sequence > known->last) {
    lost_ += sequence - known->last - 1;
    known->last = sequence;
  } else if (lost_ > 0) {
    --lost_;  // it was overtaken, and counted as lost then
  }
  return lost_;
}

std::size_t ReceivedQueue::add_topic() {
  const LockGuard lock(mutex_);
  MAUVE_EXPECTS(waiting_.counts.size() < kMostTopics);
  return waiting_.add_topic();
}

void ReceivedQueue::add(std::size_t topic, time_ns_t time_ns, std::span<const std::byte> message) {
  const LockGuard lock(mutex_);
  ReceivedCounts& counts = waiting_.counts[topic];
  ++counts.received;
  if (waiting_.bytes() + MessageBatch::room_for(message.size()) > limit_bytes_) {
    ++counts.lost;
    return;
  }
  waiting_.append(topic, time_ns, message);
}

void ReceivedQueue::set_lost_before(std::size_t topic, std::uint64_t count) {
  const LockGuard lock(mutex_);
  waiting_.counts[topic].lost_before = count;
}

MessageBatch ReceivedQueue::take() {
  const LockGuard lock(mutex_);
  MessageBatch next(waiting_.counts.size());
  next.counts = waiting_.counts;
  next.reserve(waiting_.bytes());  // the next one is about as large
  return std::exchange(waiting_, std::move(next));
}

ReceivedTopic::ReceivedTopic(rcl_node_t& node, const std::string& name, const std::string& type,
                             const rmw_qos_profile_t& qos, ReceivedQueue& queue)
    : queue_(queue),
      subscription_(node, rcl_get_zero_initialized_subscription()),
      caught_up_ns_(monotonic_now_ns()) {
  rcl_subscription_options_t options = rcl_subscription_get_default_options();
  options.qos = qos;
  check(
      rcl_subscription_init(subscription_.get(), &node, &message_type_support(type), name.c_str(), &options),
      "the topic cannot be subscribed to", "topic " + name);
  const auto has = [this](rcl_event_t& event, rcl_subscription_event_type_t kind) {
    return went_well(rcl_subscription_event_init(&event, subscription_.get(), kind));
  };
  has_lost_ = !TopicReceiver::numbered() && has(lost_, RCL_SUBSCRIPTION_MESSAGE_LOST);
  has_misfit_ = has(misfit_, RCL_SUBSCRIPTION_REQUESTED_INCOMPATIBLE_QOS);
  number_ = queue_.add_topic();
}

ReceivedTopic::~ReceivedTopic() {
  if (has_lost_) went_well(rcl_event_fini(&lost_));
  if (has_misfit_) went_well(rcl_event_fini(&misfit_));
}

void ReceivedTopic::join(rcl_wait_set_t& set) {
  if (rcl_wait_set_add_subscription(&set, subscription_.get(), &place_) != RCL_RET_OK) rcl_reset_error();
}

void ReceivedTopic::take() {
  for (int taken = 0; taken < kMessagesATurn; ++taken) {
    const time_ns_t now_ns = monotonic_now_ns();
    rmw_message_info_t about = rmw_get_zero_initialized_message_info();
    if (!went_well(rcl_take_serialized_message(subscription_.get(), message_.get(), &about, nullptr))) {
      caught_up_ns_ = now_ns;
      return;  // nothing left, which is no error
    }
    follow(about);
  }
}

void ReceivedTopic::follow(const rmw_message_info_t& about) {
  const bool is_ignored = is_ignored_.load(std::memory_order_relaxed);
  if (about.publication_sequence_number != RMW_MESSAGE_INFO_SEQUENCE_NUMBER_UNSUPPORTED &&
      TopicReceiver::numbered()) {
    const std::uint64_t lost = gaps_.follow(about.publisher_gid, about.publication_sequence_number);
    if (!is_ignored) queue_.set_lost_before(number_, lost);
  }
  if (!is_ignored) queue_.add(number_, arrival_ns(about, monotonic_now_ns()), message_.bytes());
}

/// When the middleware received the message, as far as it says; else now. Never before what was taken earlier.
time_ns_t ReceivedTopic::arrival_ns(const rmw_message_info_t& about, time_ns_t now_ns) const {
  if (about.received_timestamp <= 0) return now_ns;
  const time_ns_t age_ns = std::max(realtime_now_ns() - about.received_timestamp, time_ns_t{0});
  return std::max(now_ns - age_ns, caught_up_ns_);  // that clock may have been set in between
}

void ReceivedTopic::count_lost() {
  rmw_message_lost_status_t status{};
  if (has_lost_ && take_event(lost_, status)) queue_.set_lost_before(number_, status.total_count);
}

int ReceivedTopic::take_misfit() {
  rmw_qos_incompatible_event_status_t status;  // filled by rcl
  if (!has_misfit_ || !take_event(misfit_, status) || status.total_count_change <= 0) return 0;
  return status.last_policy_kind;
}

TopicReceiver::TopicReceiver(rcl_node_t& node, std::size_t limit_bytes) : node_(node), queue_(limit_bytes) {}

TopicReceiver::~TopicReceiver() { close(); }

bool TopicReceiver::numbered() {
  static const bool is = rmw_feature_supported(RMW_FEATURE_MESSAGE_INFO_PUBLICATION_SEQUENCE_NUMBER);
  return is;
}

std::size_t TopicReceiver::subscribe(const std::string& name, const std::string& type,
                                     const rmw_qos_profile_t& qos) {
  const LockGuard lock(mutex_);
  auto topic = std::make_unique<ReceivedTopic>(node_, name, type, qos, queue_);
  if (receiver_ != nullptr) receiver_->stop();  // its thread reads the topics
  topics_.push_back(std::move(topic));
  if (receiver_ != nullptr) receiver_->start(arrivals());
  return topics_.size() - 1;
}

void TopicReceiver::start() {
  const LockGuard lock(mutex_);
  receiver_ = std::make_unique<Receiver>(node_, "recorded_in", kPause);
  receiver_->start(arrivals());
}

std::vector<Arrival*> TopicReceiver::arrivals() const {
  std::vector<Arrival*> all;
  all.reserve(topics_.size());
  for (const auto& topic : topics_) all.push_back(topic.get());
  return all;
}

void TopicReceiver::stop() {
  const LockGuard lock(mutex_);
  if (receiver_ == nullptr) return;
  receiver_.reset();
  for (const auto& topic : topics_) topic->take();
}

void TopicReceiver::close() {
  stop();
  const LockGuard lock(mutex_);
  topics_.clear();
}

MessageBatch TopicReceiver::take() {
  {
    const LockGuard lock(mutex_);
    for (const auto& topic : topics_) topic->count_lost();
  }
  return queue_.take();
}

void TopicReceiver::ignore(std::size_t number, bool on) {
  const LockGuard lock(mutex_);
  if (number < topics_.size()) topics_[number]->ignore(on);
}

std::vector<int> TopicReceiver::take_misfits() {
  const LockGuard lock(mutex_);
  std::vector<int> all;
  all.reserve(topics_.size());
  for (const auto& topic : topics_) all.push_back(topic->take_misfit());
  return all;
}

}  // namespace mauve::bridge
