// SPDX-License-Identifier: LGPL-3.0-or-later
#include "topic_events.hpp"

#include <rcl/error_handling.h>
#include <rmw/events_statuses/events_statuses.h>

#include "rcl_error.hpp"

namespace mauve::bridge {

namespace {

bool is_set(const rmw_time_t& time) { return time.sec != 0 || time.nsec != 0; }

void count_qos(const rmw_qos_incompatible_event_status_t& status, TopicTroubleCounts& counts) {
  counts.incompatible_qos.store(static_cast<std::uint64_t>(status.total_count), std::memory_order_relaxed);
  counts.policy.store(status.last_policy_kind, std::memory_order_relaxed);
}

template <typename Status>
void count_deadline(const Status& status, TopicTroubleCounts& counts) {
  counts.deadlines_missed.store(static_cast<std::uint64_t>(status.total_count), std::memory_order_relaxed);
}

void count_own_liveliness(const rmw_liveliness_lost_status_t& status, TopicTroubleCounts& counts) {
  counts.liveliness_lost.store(static_cast<std::uint64_t>(status.total_count), std::memory_order_relaxed);
}

void count_liveliness(const rmw_liveliness_changed_status_t& status, TopicTroubleCounts& counts) {
  if (status.not_alive_count_change <= 0) return;
  const auto lost = static_cast<std::uint64_t>(status.not_alive_count_change);
  counts.liveliness_lost.fetch_add(lost, std::memory_order_relaxed);
}

}  // namespace

TopicTroubles TopicTroubleCounts::read() const noexcept {
  return {.deadlines_missed = deadlines_missed.load(std::memory_order_relaxed),
          .liveliness_lost = liveliness_lost.load(std::memory_order_relaxed),
          .incompatible_qos = incompatible_qos.load(std::memory_order_relaxed),
          .policy = policy.load(std::memory_order_relaxed)};
}

template <typename Status>
class TopicEvents::Event final : public Arrival {
 public:
  using Count = void (*)(const Status&, TopicTroubleCounts&);

  Event(const rcl_event_t& event, Count count, TopicTroubleCounts& counts)
      : event_(event), count_(count), counts_(counts) {}
  ~Event() override {
    if (rcl_event_fini(&event_) != RCL_RET_OK) rcl_reset_error();
  }
  void join(rcl_wait_set_t& set) override {
    if (rcl_wait_set_add_event(&set, &event_, &place_) != RCL_RET_OK) rcl_reset_error();
  }
  bool has_arrived(const rcl_wait_set_t& set) const override { return set.events[place_] != nullptr; }
  void take() override {
    Status status;  // filled by rcl
    if (rcl_take_event(&event_, &status) == RCL_RET_OK) return count_(status, counts_);
    rcl_reset_error();
  }

 private:
  rcl_event_t event_;
  std::size_t place_{0};
  Count count_;
  TopicTroubleCounts& counts_;
};

template <typename Status, typename Init>
void TopicEvents::add(Init init, void (*count)(const Status&, TopicTroubleCounts&)) {
  rcl_event_t event = rcl_get_zero_initialized_event();
  const rcl_ret_t outcome = init(event);
  if (outcome == RCL_RET_UNSUPPORTED) return rcl_reset_error();
  check(outcome, "the topic's events cannot be received", "event");
  events_.push_back(std::make_unique<Event<Status>>(event, count, counts_));
}

void TopicEvents::open(const rcl_publisher_t& publisher, const rmw_qos_profile_t& qos) {
  const auto of = [&publisher](rcl_publisher_event_type_t kind) {
    return
        [&publisher, kind](rcl_event_t& event) { return rcl_publisher_event_init(&event, &publisher, kind); };
  };
  add<rmw_qos_incompatible_event_status_t>(of(RCL_PUBLISHER_OFFERED_INCOMPATIBLE_QOS), count_qos);
  if (is_set(qos.deadline)) {
    add<rmw_offered_deadline_missed_status_t>(of(RCL_PUBLISHER_OFFERED_DEADLINE_MISSED),
                                              count_deadline<rmw_offered_deadline_missed_status_t>);
  }
  if (is_set(qos.liveliness_lease_duration))
    add<rmw_liveliness_lost_status_t>(of(RCL_PUBLISHER_LIVELINESS_LOST), count_own_liveliness);
}

void TopicEvents::open(const rcl_subscription_t& subscription, const rmw_qos_profile_t& qos) {
  const auto of = [&subscription](rcl_subscription_event_type_t kind) {
    return [&subscription, kind](rcl_event_t& event) {
      return rcl_subscription_event_init(&event, &subscription, kind);
    };
  };
  add<rmw_qos_incompatible_event_status_t>(of(RCL_SUBSCRIPTION_REQUESTED_INCOMPATIBLE_QOS), count_qos);
  if (is_set(qos.deadline)) {
    add<rmw_requested_deadline_missed_status_t>(of(RCL_SUBSCRIPTION_REQUESTED_DEADLINE_MISSED),
                                                count_deadline<rmw_requested_deadline_missed_status_t>);
  }
  if (is_set(qos.liveliness_lease_duration))
    add<rmw_liveliness_changed_status_t>(of(RCL_SUBSCRIPTION_LIVELINESS_CHANGED), count_liveliness);
}

std::vector<Arrival*> TopicEvents::arrivals() const {
  std::vector<Arrival*> all;
  all.reserve(events_.size());
  for (const auto& event : events_) all.push_back(event.get());
  return all;
}

}  // namespace mauve::bridge
