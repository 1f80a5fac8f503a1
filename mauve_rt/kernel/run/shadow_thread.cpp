// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/run/shadow_thread.hpp"

#include <sys/resource.h>
#include <unistd.h>

#include <cstring>

#include "mauve_rt/base/error.hpp"
#include "mauve_rt/run/shadow.hpp"

namespace mauve {

namespace {

/// The lowest there is.
constexpr int kNice = 19;

}  // namespace

class ShadowThreads::One {
 public:
  /// Throws Error (internal): no thread.
  explicit One(const std::shared_ptr<Shadow>& shadow) {
    work_->shadow = shadow;
    shadow->set_signal(work_->signal);
    auto handed = std::make_unique<std::shared_ptr<Work>>(work_);
    if (const int failure = thread_.start({.name = "shadow"}, &Work::entry, handed.get()); failure != 0) {
      throw Error(ErrorCode::internal, "the shadow thread cannot be created",
                  {.found = std::strerror(failure), .remedy = "raise the limit of threads (ulimit -u)"});
    }
    [[maybe_unused]] const auto* owned_by_thread = handed.release();
  }
  void ask_to_end() noexcept {
    work_->is_to_end.store(true, std::memory_order_release);
    work_->signal->bump();
  }
  bool has_ended() const noexcept { return work_->has_ended.load(std::memory_order_acquire) != 0; }
  void end(time_ns_t until_ns) noexcept {
    while (!has_ended()) {
      if (!futex_wait_until(work_->has_ended, 0, until_ns)) break;
    }
    if (has_ended()) {
      thread_.join();
    } else {
      thread_.detach();
    }
  }

 private:
  /// The thread owns it too: it may outlive its host.
  ///
  /// | member           | written by            | read by | order                          |
  /// | ---------------- | --------------------- | ------- | ------------------------------ |
  /// | shadow, signal   | [setup]               | thread  | the thread's creation          |
  /// | is_to_end        | hosts                 | thread  | release/acquire, then signal   |
  /// | has_ended (futex)| thread                | hosts   | release/acquire                |
  struct Work {
    std::shared_ptr<Shadow> shadow;
    std::shared_ptr<ShadowSignal> signal{std::make_shared<ShadowSignal>()};
    Atomic<bool> is_to_end{false};
    Atomic<std::uint32_t> has_ended{0};

    void run() noexcept {
      for (;;) {
        const std::uint32_t seen = signal->word.load(std::memory_order_seq_cst);  // before each look
        if (is_to_end.load(std::memory_order_acquire) || shadow->has_ended()) break;
        if (!shadow->run_pending() && !shadow->has_ended()) sleep(seen);
      }
      if (shadow->has_ended()) shadow->retire();
      has_ended.store(1, std::memory_order_release);
      futex_wake_all(has_ended);
    }
    void sleep(std::uint32_t seen) noexcept {
      signal->is_asleep.store(true, std::memory_order_seq_cst);
      futex_wait_until(signal->word, seen, kForever);
      signal->is_asleep.store(false, std::memory_order_seq_cst);
    }
    static void* entry(void* work) noexcept {
      const std::unique_ptr<std::shared_ptr<Work>> handed(static_cast<std::shared_ptr<Work>*>(work));
      setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), kNice);  // of this thread alone, on Linux
      (*handed)->run();
      return nullptr;
    }
  };

  std::shared_ptr<Work> work_{std::make_shared<Work>()};
  Thread thread_;
};

ShadowThreads::ShadowThreads() = default;
ShadowThreads::~ShadowThreads() { end(kForever); }

void ShadowThreads::add(const std::shared_ptr<Shadow>& shadow) {
  std::erase_if(threads_, [](const auto& one) {
    if (one->has_ended()) one->end(0);
    return one->has_ended();
  });
  threads_.push_back(std::make_unique<One>(shadow));
}

void ShadowThreads::end(time_ns_t until_ns) noexcept {
  for (const auto& one : threads_) one->ask_to_end();
  for (const auto& one : threads_) one->end(until_ns);
  threads_.clear();
}

}  // namespace mauve
