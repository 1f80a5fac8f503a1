// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/run/shadow_thread.hpp"

#include <sys/resource.h>
#include <unistd.h>

#include <cstring>
#include <vector>

#include "mauve_rt/base/error.hpp"
#include "mauve_rt/run/shadow.hpp"

namespace mauve {

namespace {

/// The lowest there is.
constexpr int kNice = 19;

}  // namespace

/// The thread owns it too: it may outlive its host.
///
/// | member           | written by            | read by | under                          |
/// | ---------------- | --------------------- | ------- | ------------------------------ |
/// | shadows          | hosts, the thread     | same    | mutex                          |
/// | is_to_end        | hosts                 | thread  | release/acquire, then signal   |
/// | has_ended (futex)| thread                | hosts   | release/acquire                |
struct ShadowThread::Work {
  std::mutex mutex;
  std::vector<std::shared_ptr<Shadow>> shadows;
  std::shared_ptr<ShadowSignal> signal{std::make_shared<ShadowSignal>()};
  std::atomic<bool> is_to_end{false};
  std::atomic<std::uint32_t> has_ended{0};

  std::vector<std::shared_ptr<Shadow>> present() {
    const std::lock_guard lock(mutex);
    return shadows;
  }
  void remove(const Shadow& shadow) {
    const std::lock_guard lock(mutex);
    std::erase_if(shadows, [&](const auto& each) { return each.get() == &shadow; });
  }
  /// One release of each; whether there was one.
  bool run_all() {
    bool has_run = false;
    for (const auto& shadow : present()) {
      has_run = shadow->run_pending() || has_run;
      if (!shadow->has_ended()) continue;
      shadow->retire();
      remove(*shadow);
    }
    return has_run;
  }
  void sleep(std::uint32_t seen) noexcept {
    signal->is_asleep.store(true, std::memory_order_seq_cst);
    futex_wait_until(signal->word, seen, kForever);
    signal->is_asleep.store(false, std::memory_order_seq_cst);
  }
};

ShadowThread::ShadowThread() : work_(std::make_shared<Work>()) {}

ShadowThread::~ShadowThread() { end(kForever); }

void* ShadowThread::run(void* work) noexcept {
  const std::unique_ptr<std::shared_ptr<Work>> handed(static_cast<std::shared_ptr<Work>*>(work));
  Work& own = **handed;
  setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), kNice);  // of this thread alone, on Linux
  while (!own.is_to_end.load(std::memory_order_acquire)) {
    const std::uint32_t seen = own.signal->word.load(std::memory_order_seq_cst);  // before the look
    if (!own.run_all()) own.sleep(seen);
  }
  own.run_all();  // retires those that have ended
  own.has_ended.store(1, std::memory_order_release);
  futex_wake_all(own.has_ended);
  return nullptr;
}

void ShadowThread::add(const std::shared_ptr<Shadow>& shadow) {
  if (!has_thread_) {
    auto handed = std::make_unique<std::shared_ptr<Work>>(work_);
    if (const int failure = thread_.start({.name = "shadow"}, &run, handed.get()); failure != 0) {
      throw Error(ErrorCode::internal, "the shadow thread cannot be created",
                  {.found = std::strerror(failure), .remedy = "raise the limit of threads (ulimit -u)"});
    }
    [[maybe_unused]] const auto* owned_by_thread = handed.release();
    has_thread_ = true;
  }
  shadow->set_signal(work_->signal);
  const std::lock_guard lock(work_->mutex);
  work_->shadows.push_back(shadow);
}

void ShadowThread::end(time_ns_t until_ns) noexcept {
  if (!has_thread_) return;
  has_thread_ = false;
  work_->is_to_end.store(true, std::memory_order_release);
  work_->signal->bump();
  while (work_->has_ended.load(std::memory_order_acquire) == 0) {
    if (!futex_wait_until(work_->has_ended, 0, until_ns)) break;
  }
  if (work_->has_ended.load(std::memory_order_acquire) != 0) {
    thread_.join();
  } else {
    thread_.detach();
  }
  work_ = std::make_shared<Work>();  // for the next deployment
}

}  // namespace mauve
