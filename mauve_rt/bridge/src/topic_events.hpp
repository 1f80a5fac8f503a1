// SPDX-License-Identifier: LGPL-3.0-or-later
// What the middleware tells of a topic besides its messages.
#pragma once

#include <rcl/event.h>
#include <rcl/publisher.h>
#include <rcl/subscription.h>

#include <cstdint>
#include <memory>
#include <vector>

#include "mauve_rt/base/seam/atomic.hpp"

#include "receiver.hpp"

namespace mauve::bridge {

/// Counts since the topic was opened.
struct TopicTroubles {
  std::uint64_t deadlines_missed{0};
  std::uint64_t liveliness_lost{0};  // by us as a publisher, or by a publisher heard of
  std::uint64_t incompatible_qos{0};
  int policy{0};  // the last one that did not fit, as rmw_qos_policy_kind_t
};

/// The counts while the receiving thread counts and others look.
///
/// | member | written by           | order                                    |
/// | ------ | -------------------- | ---------------------------------------- |
/// | all    | the receiving thread | relaxed: figures that nothing depends on |
struct TopicTroubleCounts {
  Atomic<std::uint64_t> deadlines_missed{0};
  Atomic<std::uint64_t> liveliness_lost{0};
  Atomic<std::uint64_t> incompatible_qos{0};
  Atomic<int> policy{0};

  TopicTroubles read() const noexcept;
};

/// The events of one publisher or subscription, which outlives them. The middleware may not know all kinds.
class TopicEvents {
 public:
  /// Throws Error when rcl refuses for another reason than that. [non-rt]
  void open(const rcl_publisher_t& publisher, const rmw_qos_profile_t& qos);
  void open(const rcl_subscription_t& subscription, const rmw_qos_profile_t& qos);
  /// What to wait for. [non-rt]
  std::vector<Arrival*> arrivals() const;
  TopicTroubles troubles() const noexcept { return counts_.read(); }

 private:
  template <typename Status>
  class Event;
  template <typename Status, typename Init>
  void add(Init init, void (*count)(const Status&, TopicTroubleCounts&));

  TopicTroubleCounts counts_;
  std::vector<std::unique_ptr<Arrival>> events_;
};

}  // namespace mauve::bridge
