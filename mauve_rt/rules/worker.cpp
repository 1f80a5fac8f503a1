// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/rules/worker.hpp"

#include <utility>

#include "mauve_rt/base/contract.hpp"
#include "mauve_rt/base/error.hpp"
#include "mauve_rt/base/seam/futex.hpp"

namespace mauve::rules {

Worker::~Worker() {
  end();
  join();
}

void Worker::start(const ThreadSettings& settings, std::function<time_ns_t()> job) {
  MAUVE_EXPECTS(!runs_);
  job_ = std::move(job);
  asked_.store(0, std::memory_order_relaxed);  // the thread's creation publishes it
  const auto entry = [](void* self) -> void* {
    static_cast<Worker*>(self)->run();
    return nullptr;
  };
  if (thread_.start(settings, entry, this) != 0)
    throw Error(ErrorCode::internal, "the system refuses a thread of the rules", {.element = settings.name});
  runs_ = true;
  if (settings.priority != 0) thread_.prefault_stack();
}

void Worker::ask() noexcept {
  asked_.fetch_add(kOnce, std::memory_order_release);
  futex_wake_all(asked_);
}

void Worker::end() noexcept {
  asked_.fetch_or(kEnding, std::memory_order_release);
  futex_wake_all(asked_);
}

void Worker::join() noexcept {
  if (std::exchange(runs_, false)) thread_.join();
}

void Worker::run() noexcept {
  std::uint32_t done = 0;
  time_ns_t again_ns = kForever;
  for (;;) {
    const std::uint32_t asked = asked_.load(std::memory_order_acquire);
    if ((asked & kEnding) != 0) return;
    if (asked == done && (again_ns == kForever || monotonic_now_ns() < again_ns)) {
      futex_wait_until(asked_, asked, again_ns);
      continue;
    }
    done = asked;
    again_ns = job_();
  }
}

}  // namespace mauve::rules
