// SPDX-License-Identifier: LGPL-3.0-or-later
// Keeper: what changes have put out goes here, and is cleaned up by a thread that nobody waits for without an end.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "mauve_rt/base/time.hpp"

namespace mauve {

/// One ordinary thread, made for the first work. The hooks that clean a part up are user code: one that hangs costs the memory of
/// what comes after it, and holds no change, no rule and no shutdown. All functions [non-rt].
///
/// All members of State are written and read under its mutex; the thread owns it too, as it may outlive the keeper.
class Keeper {
 public:
  /// What it does now, and since when.
  struct Busy {
    std::string what;
    time_ns_t since_ns{0};  // 0: nothing
  };

  Keeper();
  /// Waits a little for what is left, then leaves the thread to itself, with all that it holds.
  ~Keeper();
  Keeper(const Keeper&) = delete;
  Keeper& operator=(const Keeper&) = delete;

  /// Has this done, after all that came before. `what` tells what hangs.
  void take(std::string what, std::function<void()> work);
  /// How much has come by now.
  std::uint64_t taken() const;
  /// Waits until all is done that came before, at most until the instant; hardly, where it is at something that came before the
  /// caller's own, of which `first` had come before. Not from its own thread.
  void wait(std::uint64_t first, time_ns_t until_ns) const;
  Busy busy() const;

 private:
  struct State;
  static void run(const std::shared_ptr<State>& state);

  std::shared_ptr<State> state_;
  std::thread thread_;
};

}  // namespace mauve
