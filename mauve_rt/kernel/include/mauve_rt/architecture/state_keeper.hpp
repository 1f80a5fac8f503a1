// SPDX-License-Identifier: LGPL-3.0-or-later
// StateKeeper: writes what rules and persons decided to a file, as soon as it changes.
#pragma once

#include <filesystem>
#include <string>

#include "mauve_rt/architecture/architecture.hpp"
#include "mauve_rt/base/seam/atomic.hpp"
#include "mauve_rt/base/seam/mutex.hpp"
#include "mauve_rt/base/seam/thread.hpp"

namespace mauve {

/// An ordinary thread that waits for changes of the overlays. The thread that decides waits neither for it nor for the file.
///
/// | member     | written by         | read by    | order or lock                                              |
/// | ---------- | ------------------ | ---------- | ---------------------------------------------------------- |
/// | ending_    | stop()             | the thread | release/acquire: before the change word is bumped          |
/// | written_   | start(), then the thread | the same | the thread's creation                                  |
/// | problem_   | start(), then the thread | anyone | mutex_                                                    |
/// | runs_      | start(), stop()    | the same   | one thread                                                 |
class StateKeeper {
 public:
  /// Bases are compared with what the architecture is now, as its file made it. [setup]
  StateKeeper(Architecture& architecture, std::filesystem::path path);
  ~StateKeeper();
  StateKeeper(const StateKeeper&) = delete;
  StateKeeper& operator=(const StateKeeper&) = delete;

  /// Writes the present state, then follows it. [setup] Throws Error (internal): the system refuses a thread.
  void start();
  /// The last state is written then, where it can be. [non-rt]
  void stop() noexcept;
  /// Why the present state is not in the file; empty: it is. [non-rt]
  std::string problem() const;

 private:
  void run() noexcept;
  bool write();
  Overlays& overlays() const noexcept { return architecture_.overlays(); }

  Architecture& architecture_;
  const ArchitectureDescription file_;
  const std::filesystem::path path_;
  Thread thread_;
  bool runs_{false};
  Atomic<bool> ending_{false};
  std::string written_;
  mutable Mutex mutex_;
  std::string problem_ MAUVE_GUARDED_BY(mutex_);
};

}  // namespace mauve
