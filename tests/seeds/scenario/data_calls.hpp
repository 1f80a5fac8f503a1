// SPDX-License-Identifier: LGPL-3.0-or-later
// What must hold of all calls of the clients of random_data, once the run is over.
#pragma once

#include <algorithm>
#include <map>
#include <string>

#include "data_parts.hpp"

namespace mauve::testing {

/// A client is busy only with another call, and each call is counted once.
inline void check_calls(Architecture& architecture, const DataShared& shared) {
  std::map<std::string, CallCounts> counts;
  for (const Asked& one : shared.asked) {
    shared.findings.expect(one.ended != UINT64_MAX, "a call of " + one.client + " does not end");
    CallCounts& its = counts[one.client];
    switch (one.outcome) {
      case CallOutcome::answered:
        ++its.answered;
        break;
      case CallOutcome::no_server:
        ++its.no_server;
        break;
      case CallOutcome::timed_out:
        ++its.timed_out;
        break;
      default:
        ++its.other;
    }
    if (one.outcome != CallOutcome::busy) continue;
    shared.findings.expect(std::ranges::any_of(shared.asked,
                                               [&](const Asked& other) {
                                                 return &other != &one && other.client == one.client &&
                                                        other.outcome != CallOutcome::busy &&
                                                        other.began < one.ended && other.ended > one.began;
                                               }),
                           one.client + " is busy without another call");
  }
  for (const auto& [name, timeout_ns] : shared.call_timeouts) {
    const CallCounts found = architecture.resource(name).client()->counts();
    const CallCounts& expected = counts[name];
    shared.findings.expect(found.answered == expected.answered && found.no_server == expected.no_server &&
                               found.timed_out == expected.timed_out && found.other == expected.other,
                           name + " counts its calls wrongly");
  }
}

}  // namespace mauve::testing
