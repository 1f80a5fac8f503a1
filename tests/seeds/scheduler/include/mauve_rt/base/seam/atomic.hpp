// SPDX-License-Identifier: LGPL-3.0-or-later
// Atomic under the seeded scheduler: each operation is a possible switch.
#pragma once

#include <atomic>

#include "seeds/atomic_step.hpp"
#include "seeds/happens_before.hpp"

namespace mauve {

/// As std::atomic, as far as the kernel uses that. Threads may switch before an operation, and after it: what a thread does
/// without atomics next to an operation is then seen by others between the two, too. As one thread runs at a time, each sees all
/// that others did, whatever the memory order; ThreadSanitizer sees what the orders promise.
template <typename T>
class Atomic {
 public:
  using value_type = T;
  static constexpr bool is_always_lock_free = std::atomic<T>::is_always_lock_free;

  constexpr Atomic() noexcept = default;
  constexpr Atomic(T value) noexcept
      : system_(value) {}  // NOLINT(google-explicit-constructor): as std::atomic
  Atomic(const Atomic&) = delete;
  Atomic& operator=(const Atomic&) = delete;

  T load(std::memory_order order = std::memory_order_seq_cst) const noexcept {
    const Operation operation(this, order);
    return system_.load(order);
  }
  void store(T value, std::memory_order order = std::memory_order_seq_cst) noexcept {
    const Operation operation(this, order);
    system_.store(value, order);
  }
  T exchange(T value, std::memory_order order = std::memory_order_seq_cst) noexcept {
    const Operation operation(this, order);
    return system_.exchange(value, order);
  }
  bool compare_exchange_strong(T& expected, T value,
                               std::memory_order order = std::memory_order_seq_cst) noexcept {
    const Operation operation(this, order);
    return system_.compare_exchange_strong(expected, value, order);
  }
  bool compare_exchange_strong(T& expected, T value, std::memory_order order,
                               std::memory_order otherwise) noexcept {
    const Operation operation(this, order);
    return system_.compare_exchange_strong(expected, value, order, otherwise);
  }
  template <typename... Orders>
  bool compare_exchange_weak(T& expected, T value, Orders... orders) noexcept {
    return compare_exchange_strong(expected, value, orders...);
  }
  template <typename Operand>
  T fetch_add(Operand operand, std::memory_order order = std::memory_order_seq_cst) noexcept {
    const Operation operation(this, order);
    return system_.fetch_add(operand, order);
  }
  template <typename Operand>
  T fetch_sub(Operand operand, std::memory_order order = std::memory_order_seq_cst) noexcept {
    const Operation operation(this, order);
    return system_.fetch_sub(operand, order);
  }
  T fetch_and(T operand, std::memory_order order = std::memory_order_seq_cst) noexcept {
    const Operation operation(this, order);
    return system_.fetch_and(operand, order);
  }
  T fetch_or(T operand, std::memory_order order = std::memory_order_seq_cst) noexcept {
    const Operation operation(this, order);
    return system_.fetch_or(operand, order);
  }

  operator T() const noexcept { return load(); }  // NOLINT(google-explicit-constructor): as std::atomic
  T operator=(T value) noexcept {  // NOLINT(misc-unconventional-assign-operator): as std::atomic
    store(value);
    return value;
  }
  T operator++() noexcept { return fetch_add(1) + 1; }
  T operator--() noexcept { return fetch_sub(1) - 1; }
  T operator++(int) noexcept { return fetch_add(1); }
  T operator--(int) noexcept { return fetch_sub(1); }
  T operator+=(T operand) noexcept { return fetch_add(operand) + operand; }
  T operator-=(T operand) noexcept { return fetch_sub(operand) - operand; }

  /// Without a possible switch, for the scheduler.
  std::atomic<T>& system() noexcept { return system_; }
  const std::atomic<T>& system() const noexcept { return system_; }

 private:
  /// In a source that ThreadSanitizer does not compile, the seam reports to it what the operation promises.
  class Operation {
   public:
    Operation(const Atomic* atomic, std::memory_order order) noexcept : atomic_(atomic), order_(order) {
      seeds::atomic_step();
      if (kIsAnnotated && order != std::memory_order_relaxed && order != std::memory_order_acquire)
        seeds::released(atomic);
    }
    ~Operation() {
      if (kIsAnnotated && order_ != std::memory_order_relaxed && order_ != std::memory_order_release)
        seeds::acquired(atomic_);
      seeds::atomic_step();
    }
    Operation(const Operation&) = delete;
    Operation& operator=(const Operation&) = delete;

   private:
#if defined(__SANITIZE_THREAD__)
    static constexpr bool kIsAnnotated = false;
#else
    static constexpr bool kIsAnnotated = true;
#endif
    const Atomic* atomic_;
    std::memory_order order_;
  };

  std::atomic<T> system_{};
};

}  // namespace mauve
