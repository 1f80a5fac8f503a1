// SPDX-License-Identifier: LGPL-3.0-or-later
// Keeper: what changes have put out goes here, and is cleaned up by a thread that nobody waits for without an end.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "mauve_rt/base/time.hpp"

namespace mauve {

/// Ordinary threads, one for each lane that has work. The hooks that clean a part up are user code: one that hangs costs the memory
/// of what comes after it in its lane, and holds no change, no rule, no shutdown and no other lane. All functions [non-rt].
///
/// All members of State are written and read under its mutex; the threads own it too, as they may outlive the keeper.
class Keeper {
 public:
  /// Where work enters its lane: after all that waits there, or before it.
  enum class Place : std::uint8_t { last, next };
  /// What it does now, and since when.
  struct Busy {
    std::string what;
    time_ns_t since_ns{0};  // 0: nothing
  };

  Keeper();
  /// Waits a little for what is left, then leaves the threads to themselves, with all that they hold.
  ~Keeper();
  Keeper(const Keeper&) = delete;
  Keeper& operator=(const Keeper&) = delete;

  /// Has this done, in its turn in the lane, which any address names. `what` names what hangs.
  void take(std::string what, std::function<void()> work, const void* lane = nullptr,
            Place place = Place::last);
  /// Whether work of that lane is not done yet, or the lane is held.
  bool is_at(const void* lane) const;
  bool is_held(const void* lane) const;
  /// Nothing more of that lane is begun until each who holds it has released it.
  void hold(const void* lane);
  void release(const void* lane);
  /// How much has come by now.
  std::uint64_t taken() const;
  /// Waits until all is done that came before, at most until the instant; hardly, where a lane is at something that came before the
  /// caller's own, of which `first` had come before. Not from one of its own threads.
  void wait(std::uint64_t first, time_ns_t until_ns) const;
  /// Of several the one that lasts longest.
  Busy busy() const;

 private:
  struct State;
  static void run(const std::shared_ptr<State>& state, const void* lane);
  static void run_if_idle(const std::shared_ptr<State>& state, const void* lane);

  std::shared_ptr<State> state_;
};

}  // namespace mauve
