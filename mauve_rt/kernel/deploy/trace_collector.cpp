// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/deploy/trace_collector.hpp"

#include <pthread.h>
#include <sched.h>

#include <chrono>
#include <csignal>
#include <utility>

namespace mauve {

TraceCollector::TraceCollector(Architecture& architecture, time_ns_t period_ns)
    : architecture_(architecture), period_ns_(period_ns) {
  sigset_t all;
  sigset_t callers;
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, &callers);  // signals are the process's business
  thread_ = std::thread([this] { run(); });
  pthread_sigmask(SIG_SETMASK, &callers, nullptr);
  pthread_setname_np(thread_.native_handle(), "trace");
  const sched_param after_components{.sched_priority = 1};
  pthread_setschedparam(thread_.native_handle(), SCHED_FIFO, &after_components);  // or it goes on as it is
}

TraceCollector::~TraceCollector() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  end_.notify_one();
  thread_.join();
}

TraceDrain TraceCollector::take() {
  const std::lock_guard lock(mutex_);
  TraceDrain last = architecture_.drain_trace();
  collected_.insert(collected_.end(), last.records.begin(), last.records.end());
  last.records = std::exchange(collected_, {});
  return last;
}

void TraceCollector::run() {
  std::unique_lock lock(mutex_);
  while (!end_.wait_for(lock, std::chrono::nanoseconds(period_ns_), [this] { return ending_; })) collect();
}

void TraceCollector::collect() {
  if (collected_.size() > kMostRecords) return;
  const TraceDrain drain = architecture_.drain_trace();
  collected_.insert(collected_.end(), drain.records.begin(), drain.records.end());
}

}  // namespace mauve
