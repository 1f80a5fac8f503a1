// SPDX-License-Identifier: LGPL-3.0-or-later
// Worker: a thread that does one job each time that it is asked to, and again when the job says so.
#pragma once

#include <cstdint>
#include <functional>

#include "mauve_rt/base/rt.hpp"
#include "mauve_rt/base/seam/atomic.hpp"
#include "mauve_rt/base/seam/thread.hpp"
#include "mauve_rt/base/time.hpp"

namespace mauve::rules {

/// | member         | written by     | read by    | order                                                   |
/// | -------------- | -------------- | ---------- | ------------------------------------------------------- |
/// | asked_ (futex) | ask(), end()   | the thread | release/acquire: the job sees what was before ask()     |
/// | job_           | start()        | the thread | the thread's creation                                   |
class Worker {
 public:
  Worker() = default;
  ~Worker();
  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;

  /// The job throws nothing, and returns when it is to begin again at the latest. [setup] Throws Error (internal): the system refuses the thread.
  void start(const ThreadSettings& settings, std::function<time_ns_t()> job);
  /// The job begins once more after this. [rt]
  void ask() MAUVE_RT;
  /// The job under way is the last one. [rt]
  void end() MAUVE_RT;
  /// Waits for it, after end(). [non-rt]
  void join() noexcept;

 private:
  static constexpr std::uint32_t kEnding = 1;
  static constexpr std::uint32_t kOnce = 2;

  void run() noexcept;

  Thread thread_;
  std::function<time_ns_t()> job_;
  Atomic<std::uint32_t> asked_{0};
  bool runs_{false};
};

}  // namespace mauve::rules
