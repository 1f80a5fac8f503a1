// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/parts/declared_state.hpp"

#include "mauve_rt/base/error.hpp"

namespace mauve {

void check_wcet(const std::string& state, time_ns_t wcet_ns, time_ns_t max_execution_ns,
                const std::string& component, const std::string& core) {
  if (wcet_ns < 0 || wcet_ns > kLongest) {
    throw Error(ErrorCode::out_of_range, "a state's time is out of range",
                {.component = component,
                 .element = "state " + state + ", wcet_ns",
                 .expected = "1 to " + std::to_string(kLongest) + " ns, or 0: not declared",
                 .found = std::to_string(wcet_ns)});
  }
  if (max_execution_ns == 0 || wcet_ns <= max_execution_ns) return;
  throw Error(ErrorCode::out_of_range, "the worst-case execution time of a state is longer than its bound",
              {.component = component,
               .element = "state " + state + ", wcet_ns",
               .expected = "at most max_execution_ns, which is " + std::to_string(max_execution_ns) + " ns",
               .found = std::to_string(wcet_ns) + (core.empty() ? "" : ", declared by core " + core),
               .remedy = "lower wcet_ns, or raise max_execution_ns"});
}

}  // namespace mauve
