// SPDX-License-Identifier: LGPL-3.0-or-later
// OrdinaryThread under the seeded scheduler.
#pragma once

#include <exception>
#include <functional>
#include <memory>
#include <system_error>
#include <thread>
#include <tuple>
#include <type_traits>
#include <utility>

#include "seeds/scheduler.hpp"

namespace mauve {

/// As std::thread, as far as the kernel uses that.
class OrdinaryThread {
 public:
  OrdinaryThread() noexcept = default;
  template <typename Callable, typename... Arguments>
    requires(!std::is_same_v<std::remove_cvref_t<Callable>, OrdinaryThread>)
  explicit OrdinaryThread(Callable&& callable, Arguments&&... arguments) {
    using Call = std::tuple<std::decay_t<Callable>, std::decay_t<Arguments>...>;
    auto call =
        std::make_unique<Call>(std::forward<Callable>(callable), std::forward<Arguments>(arguments)...);
    int error = 0;
    thread_ = seeds::start({.name = "ordinary", .entry = &OrdinaryThread::run<Call>, .argument = call.get()},
                           error);
    if (thread_ == nullptr) throw std::system_error(error, std::generic_category());
    static_cast<void>(call.release());
  }
  OrdinaryThread(OrdinaryThread&& other) noexcept : thread_(std::exchange(other.thread_, nullptr)) {}
  OrdinaryThread& operator=(OrdinaryThread&& other) noexcept {
    if (thread_ != nullptr) std::terminate();
    thread_ = std::exchange(other.thread_, nullptr);
    return *this;
  }
  ~OrdinaryThread() {
    if (thread_ != nullptr) std::terminate();
  }

  bool joinable() const noexcept { return thread_ != nullptr; }
  void join() { seeds::join(*std::exchange(thread_, nullptr)); }
  void detach() noexcept { thread_ = nullptr; }
  std::thread::id get_id() const noexcept {
    return thread_ != nullptr ? std::thread::id(seeds::handle(*thread_)) : std::thread::id();
  }

 private:
  template <typename Call>
  static void* run(void* argument) {
    const std::unique_ptr<Call> call(static_cast<Call*>(argument));
    std::apply([](auto&&... parts) { std::invoke(std::move(parts)...); }, std::move(*call));
    return nullptr;
  }

  seeds::Thread* thread_{nullptr};
};

}  // namespace mauve
