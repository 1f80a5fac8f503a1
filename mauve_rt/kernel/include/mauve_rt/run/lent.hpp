// SPDX-License-Identifier: LGPL-3.0-or-later
// An object lent to other threads, which is theirs to use until it is recalled.
#pragma once

#include <atomic>
#include <cstdint>
#include <utility>

#include "mauve_rt/base/futex.hpp"
#include "mauve_rt/base/time.hpp"

namespace mauve {

/// Lends an object for a while: who uses it is counted, and recall() returns once nobody does any more.
///
/// | member         | written by   | read by    | order                                                                |
/// | -------------- | ------------ | ---------- | -------------------------------------------------------------------- |
/// | object_        | who lends it | its users  | seq_cst with users_: either a user finds nothing, or it is counted   |
/// | users_ (futex) | its users    | who lends  | seq_cst: as above; hands over what the users have written            |
template <typename T>
class Lent {
 public:
  /// [rt]
  void lend(T& object) MAUVE_RT { object_.store(&object, std::memory_order_seq_cst); }
  bool is_lent() const MAUVE_RT { return object_.load(std::memory_order_seq_cst) != nullptr; }

  /// Calls the function with the object, if there is one; any number of threads. [rt] as far as that is.
  template <typename Function>
  void use(Function&& function) noexcept {
    users_.fetch_add(1, std::memory_order_seq_cst);
    if (T* const object = object_.load(std::memory_order_seq_cst)) std::forward<Function>(function)(*object);
    users_.fetch_sub(1, std::memory_order_seq_cst);
    if (!is_lent()) futex_wake_all(users_);
  }

  /// Lets nobody begin to use it; whether all have ended by the instant. [rt]
  bool recall(time_ns_t until_ns) MAUVE_RT {
    forget();
    for (;;) {
      const std::uint32_t users = users_.load(std::memory_order_seq_cst);
      if (users == 0) return true;
      if (!futex_wait_until(users_, users, until_ns)) return users_.load(std::memory_order_seq_cst) == 0;
    }
  }
  /// Lets nobody begin to use it, and waits for nobody. [rt]
  void forget() MAUVE_RT { object_.store(nullptr, std::memory_order_seq_cst); }

 private:
  std::atomic<T*> object_{nullptr};
  std::atomic<std::uint32_t> users_{0};
};

}  // namespace mauve
