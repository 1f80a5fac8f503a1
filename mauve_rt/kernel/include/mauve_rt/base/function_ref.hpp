// SPDX-License-Identifier: LGPL-3.0-or-later
// A non-owning reference to a callable: std::function without the allocation.
#pragma once

#include <memory>
#include <type_traits>
#include <utility>

namespace mauve {

template <typename Signature>
class FunctionRef;

/// Refers to a callable that outlives the call it is passed to. Calling it is [rt] if the callable is.
template <typename R, typename... Args>
class FunctionRef<R(Args...)> {
 public:
  template <typename Callable>
    requires(!std::is_same_v<std::remove_cvref_t<Callable>, FunctionRef> &&
             std::is_invocable_r_v<R, Callable&, Args...>)
  FunctionRef(Callable&& callable) noexcept  // NOLINT: implicit, so that a lambda can be passed where one is
                                             // asked for
      : object_(const_cast<void*>(static_cast<const void*>(std::addressof(callable)))),
        call_([](void* object, Args... args) -> R {
          return (*static_cast<std::remove_reference_t<Callable>*>(object))(std::forward<Args>(args)...);
        }) {}

  /// [rt] as far as the callable is.
  R operator()(Args... args) const { return call_(object_, std::forward<Args>(args)...); }

 private:
  void* object_;
  R (*call_)(void*, Args...);
};

}  // namespace mauve
