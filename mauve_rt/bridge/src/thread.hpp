// SPDX-License-Identifier: LGPL-3.0-or-later
// The threads of the bridge: each has a name, blocks all signals, and is placed as far as the system grants that.
#pragma once

#include <exception>
#include <functional>
#include <memory>
#include <system_error>
#include <utility>
#include <vector>

#include "mauve_rt/base/seam/thread.hpp"

namespace mauve::bridge {

/// Where and how urgently a thread runs.
struct ThreadPlace {
  int priority{1};          // SCHED_FIFO, where the system grants that; the lowest: after the components
  std::vector<int> cpus{};  // empty: any
};

/// As std::thread, as far as the bridge uses that.
class WorkerThread {
 public:
  WorkerThread() noexcept = default;
  /// Throws std::system_error where there is no thread to be had. [non-rt]
  WorkerThread(const char* name, std::function<void()> work, const ThreadPlace& where) {
    auto owned = std::make_unique<std::function<void()>>(std::move(work));
    ThreadSettings settings{.name = name, .priority = where.priority, .cpus = where.cpus};
    int error = thread_.start(settings, &run, owned.get());
    if (error != 0 && !settings.cpus.empty()) {  // these processors are not granted
      settings.cpus.clear();
      error = thread_.start(settings, &run, owned.get());
    }
    if (error != 0) throw std::system_error(error, std::generic_category(), name);
    [[maybe_unused]] const auto* taken = owned.release();  // by the thread
    is_joinable_ = true;
  }
  WorkerThread(WorkerThread&& other) noexcept
      : thread_(other.thread_), is_joinable_(std::exchange(other.is_joinable_, false)) {}
  WorkerThread& operator=(WorkerThread&& other) noexcept {
    if (is_joinable_) std::terminate();
    thread_ = other.thread_;
    is_joinable_ = std::exchange(other.is_joinable_, false);
    return *this;
  }
  ~WorkerThread() {
    if (is_joinable_) std::terminate();
  }

  bool joinable() const noexcept { return is_joinable_; }
  /// [non-rt]
  void join() noexcept {
    is_joinable_ = false;
    thread_.join();
  }
  void detach() noexcept {
    is_joinable_ = false;
    thread_.detach();
  }

 private:
  static void* run(void* work) {
    const std::unique_ptr<std::function<void()>> owned(static_cast<std::function<void()>*>(work));
    (*owned)();
    return nullptr;
  }

  Thread thread_;
  bool is_joinable_{false};
};

/// An ordinary thread of that name, unless it has a place. [non-rt]
inline WorkerThread start_thread(const char* name, std::function<void()> work,
                                 const ThreadPlace& where = {.priority = 0}) {
  return {name, std::move(work), where};
}

}  // namespace mauve::bridge
