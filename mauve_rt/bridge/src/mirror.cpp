// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mirror.hpp"

#include "mauve_rt/base/time.hpp"
#include "mauve_rt/data/cdr.hpp"

#include "rcl_error.hpp"
#include "type_support.hpp"

namespace mauve::bridge {

namespace {

void open(rcl_publisher_t& publisher, const rcl_node_t& node, const std::string& type,
          const std::string& name, const rmw_qos_profile_t& qos, const std::string& resource) {
  rcl_publisher_options_t options = rcl_publisher_get_default_options();
  options.qos = qos;
  check(rcl_publisher_init(&publisher, &node, &message_type_support(type), name.c_str(), &options),
        "the mirror cannot be published", "resource " + resource + ", topic " + name);
}

/// An instant of CLOCK_MONOTONIC by CLOCK_REALTIME: both are read at once, unless the thread is kept from that each time.
time_ns_t by_realtime(time_ns_t time_ns) {
  constexpr time_ns_t kAtOnce = us_to_ns(20);
  time_ns_t before = monotonic_now_ns();
  for (int tries = 1;; ++tries) {
    const time_ns_t realtime = realtime_now_ns();
    const time_ns_t after = monotonic_now_ns();
    if (after - before <= kAtOnce || tries == 5) return realtime - (before - time_ns);
    before = after;
  }
}

bool publish(rcl_publisher_t& publisher, std::vector<std::byte>& message) {
  const rcl_serialized_message_t serialized = borrowed(message);
  return went_well(rcl_publish_serialized_message(&publisher, &serialized, nullptr));
}

}  // namespace

Mirror::Mirror(rcl_node_t& node, const TopicSettings& topic, std::size_t number, TopicLog& log,
               const MirrorSettings& settings)
    : BoundTopic(topic, number, log),
      settings_(settings),
      publisher_(node, rcl_get_zero_initialized_publisher()) {
  open(*publisher_.get(), node, topic.type, topic.name, topic.qos, topic.resource);
  events_.open(*publisher_.get(), topic.qos);
  if (!settings_.numbers || settings_.number) return;
  rmw_qos_profile_t latched = topic.qos;
  latched.reliability = RMW_QOS_POLICY_RELIABILITY_RELIABLE;
  latched.durability = RMW_QOS_POLICY_DURABILITY_TRANSIENT_LOCAL;
  latched.depth = 1;
  names_.emplace(node, rcl_get_zero_initialized_publisher());
  open(*names_->get(), node, "mauve_msgs/msg/ValueNames", topic.name + "/names", latched, topic.resource);
}

void Mirror::attach(std::shared_ptr<Resource> resource) {
  BoundTopic::attach(std::move(resource));
  if (!names_ || !settings_.numbers) return;
  CdrWriter writer(value_);
  writer.put(this->resource().type());
  writer.put(static_cast<std::uint32_t>(settings_.numbers->names().size()));
  for (const std::string& name : settings_.numbers->names()) writer.put(name);
  publish(*names_->get(), value_);
}

bool Mirror::send() {
  const time_ns_t now = monotonic_now_ns();
  if (now < due_ns_) return false;
  due_ns_ = now < due_ns_ + settings_.period_ns ? due_ns_ + settings_.period_ns : now + settings_.period_ns;
  time_ns_t time_ns = 0;
  std::uint64_t sequence = 0;
  if (!resource().peek_sample(message_, time_ns, sequence) || sequence == seen_) return false;
  seen_ = sequence;
  const bool passed = make_message(time_ns) && publish(*publisher_.get(), value_);
  if (names_)  // a bag of them would lack the names: it has the value itself, where that is recorded
    count(passed);
  else
    count(passed, now, value_);
  return false;
}

bool Mirror::make_message(time_ns_t time_ns) {
  if (!settings_.numbers) {
    value_.swap(message_);
    return true;
  }
  const bool is_whole = settings_.numbers->read(message_, numbers_);
  CdrWriter writer(value_);
  if (!is_whole) return false;
  if (settings_.number) {
    writer.put(numbers_[*settings_.number]);
    return true;
  }
  const time_ns_t stamp_ns = by_realtime(time_ns);
  writer.put(static_cast<std::int32_t>(stamp_ns / s_to_ns(1)));
  writer.put(static_cast<std::uint32_t>(stamp_ns % s_to_ns(1)));
  writer.put(static_cast<std::uint32_t>(numbers_.size()));
  for (const double number : numbers_) writer.put(number);
  return true;
}

}  // namespace mauve::bridge
