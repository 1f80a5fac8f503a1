// SPDX-License-Identifier: LGPL-3.0-or-later
// RevocableReference: a reference to an object for other threads, until its owner revokes it.
#pragma once

#include <cstdint>
#include <utility>

#include "mauve_rt/base/contract.hpp"
#include "mauve_rt/base/seam/atomic.hpp"
#include "mauve_rt/base/seam/futex.hpp"
#include "mauve_rt/base/time.hpp"

namespace mauve {

/// The users of the object are counted: revoke() returns once no thread uses it any more.
///
/// | member         | written by   | read by    | order                                                                |
/// | -------------- | ------------ | ---------- | -------------------------------------------------------------------- |
/// | object_        | owners       | its users  | seq_cst with users_: either a user finds nothing, or it is counted   |
/// | users_ (futex) | its users    | owners     | seq_cst: as above; hands over what the users have written            |
/// | waiting_       | owners       | its users  | seq_cst with users_: either a user finds it, or it finds the user gone |
template <typename T>
class RevocableReference {
 public:
  /// [rt]
  void set(T& object) MAUVE_RT { object_.store(&object, std::memory_order_seq_cst); }
  bool is(const T& object) const MAUVE_RT { return object_.load(std::memory_order_seq_cst) == &object; }
  bool is_set() const MAUVE_RT { return object_.load(std::memory_order_seq_cst) != nullptr; }

  /// Calls the function with the object, if there is one; any number of threads. [rt] as far as that is.
  template <typename Function>
  void use(Function&& function) noexcept {
    users_.fetch_add(1, std::memory_order_seq_cst);
    if (T* const object = object_.load(std::memory_order_seq_cst)) std::forward<Function>(function)(*object);
    const std::uint32_t users = users_.fetch_sub(1, std::memory_order_seq_cst);
    MAUVE_AUDIT(users != 0);
    if (waiting_.load(std::memory_order_seq_cst) != 0) futex_wake_all(users_);
  }

  /// No thread begins to use the object any more, whichever it is; whether all have ended by the instant. [rt]
  bool revoke(time_ns_t until_ns) MAUVE_RT {
    object_.store(nullptr, std::memory_order_seq_cst);
    return await_users(until_ns);
  }
  /// As above, of this object: another one that was set since then stays. [rt]
  bool revoke(const T& object, time_ns_t until_ns) MAUVE_RT {
    T* own = const_cast<T*>(&object);  // NOLINT(cppcoreguidelines-pro-type-const-cast): only compared
    object_.compare_exchange_strong(own, nullptr, std::memory_order_seq_cst);
    return await_users(until_ns);
  }

 private:
  bool await_users(time_ns_t until_ns) MAUVE_RT {
    waiting_.fetch_add(1, std::memory_order_seq_cst);
    bool is_unused = true;
    for (;;) {
      const std::uint32_t users = users_.load(std::memory_order_seq_cst);
      if (users == 0) break;
      if (futex_wait_until(users_, users, until_ns)) continue;
      is_unused = users_.load(std::memory_order_seq_cst) == 0;
      break;
    }
    waiting_.fetch_sub(1, std::memory_order_seq_cst);
    return is_unused;
  }

  Atomic<T*> object_{nullptr};
  Atomic<std::uint32_t> users_{0};
  Atomic<std::uint32_t> waiting_{0};
};

}  // namespace mauve
