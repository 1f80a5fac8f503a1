// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/deploy/trace_collector.hpp"

#include <utility>

#include "mauve_rt/base/error.hpp"

namespace mauve {

TraceCollector::TraceCollector(Architecture& architecture, time_ns_t period_ns, JobWatch* watch, bool keeps)
    : architecture_(architecture), period_ns_(period_ns), watch_(watch), keeps_(keeps) {
  const auto entry = [](void* self) -> void* {
    static_cast<TraceCollector*>(self)->run();
    return nullptr;
  };
  if (thread_.start({.name = "trace", .priority = 1}, entry, this) != 0)  // after the components
    throw Error(ErrorCode::internal, "the system refuses the thread that collects the trace");
}

TraceCollector::~TraceCollector() {
  {
    const LockGuard lock(mutex_);
    ending_ = true;
  }
  end_.notify_one();
  thread_.join();
}

TraceDrain TraceCollector::take() {
  const LockGuard lock(mutex_);
  TraceDrain last = drain();
  collected_.insert(collected_.end(), last.records.begin(), last.records.end());
  last.records = std::exchange(collected_, {});
  return last;
}

void TraceCollector::run() {
  const LockGuard lock(mutex_);
  while (!ending_) {
    const time_ns_t next_ns = later_by(monotonic_now_ns(), period_ns_);
    while (!ending_ && end_.wait_until(mutex_, next_ns)) {
    }
    if (!ending_) collect();
  }
}

void TraceCollector::collect() {
  if (collected_.size() > kMostRecords) return;
  const TraceDrain collected = drain();
  if (keeps_) collected_.insert(collected_.end(), collected.records.begin(), collected.records.end());
}

TraceDrain TraceCollector::drain() {
  TraceDrain drain = architecture_.drain_trace();
  if (watch_ != nullptr) watch_->take(drain);
  return drain;
}

}  // namespace mauve
