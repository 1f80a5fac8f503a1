// SPDX-License-Identifier: LGPL-3.0-or-later
// Quality of service of a topic, from the numbers that Python passes.
#pragma once

#include <rmw/types.h>

#include <cstddef>
#include <cstdint>

#include "mauve_rt/base/time.hpp"

namespace mauve::bridge {

/// [setup]
inline rmw_time_t duration(time_ns_t time_ns) {
  return {.sec = static_cast<std::uint64_t>(time_ns / s_to_ns(1)),
          .nsec = static_cast<std::uint64_t>(time_ns % s_to_ns(1))};
}

/// [setup]
inline rmw_qos_profile_t make_qos(int reliability, int durability, std::size_t depth, time_ns_t deadline_ns,
                                  time_ns_t lifespan_ns, int liveliness, time_ns_t lease_ns) {
  rmw_qos_profile_t qos{};
  qos.history = RMW_QOS_POLICY_HISTORY_KEEP_LAST;
  qos.depth = depth;
  qos.reliability = static_cast<rmw_qos_reliability_policy_t>(reliability);
  qos.durability = static_cast<rmw_qos_durability_policy_t>(durability);
  qos.deadline = duration(deadline_ns);
  qos.lifespan = duration(lifespan_ns);
  qos.liveliness = static_cast<rmw_qos_liveliness_policy_t>(liveliness);
  qos.liveliness_lease_duration = duration(lease_ns);
  return qos;
}

}  // namespace mauve::bridge
