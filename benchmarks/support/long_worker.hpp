// SPDX-License-Identifier: LGPL-3.0-or-later
// A component that is in its execution state for most of its period: no transaction reaches it then.
#pragma once

#include <chrono>
#include <thread>

#include "support/components.hpp"

namespace bench {

/// Whether a LongWorker is in its state, and until when; release/acquire, 0: it is not.
using EndOfState = std::atomic<mauve::time_ns_t>;

/// Sleeps in its execution state.
struct LongWorker : Worker {
  LongWorker(EndOfState& shared_end, mauve::time_ns_t state) : end(shared_end), state_ns(state) {}
  void work() override {
    const mauve::time_ns_t until = mauve::monotonic_now_ns() + state_ns;
    end.store(until, std::memory_order_release);
    sleep_until(until);
    end.store(0, std::memory_order_release);
  }

  EndOfState& end;
  mauve::time_ns_t state_ns;
};

inline void add_long_worker(mauve::Architecture& architecture, const std::string& name, int priority, int cpu,
                            EndOfState& end, std::int64_t state_ms, std::int64_t period_ms) {
  mauve::Component& component = architecture.add_component(
      name, std::make_unique<WorkerShell>(), std::make_unique<LongWorker>(end, mauve::ms_to_ns(state_ms)),
      std::make_unique<WorkerFsm>(), mauve::TaskSettings{.priority = priority, .cpus = {cpu}});
  component.set_property("period_us", period_ms * 1000);
}

/// Returns with at least so much of the state still to come.
inline void await_state(const EndOfState& end, mauve::time_ns_t left_ns) {
  while (end.load(std::memory_order_acquire) < mauve::monotonic_now_ns() + left_ns)
    std::this_thread::sleep_for(std::chrono::microseconds(100));
}

}  // namespace bench
