// SPDX-License-Identifier: LGPL-3.0-or-later
// Atomic under the seeded scheduler: each operation is a possible switch.
#pragma once

#include <atomic>

#include "seeds/atomic_step.hpp"

namespace mauve {

/// As std::atomic, as far as the kernel uses that. Threads may switch before an operation, and after it: what a thread does
/// without atomics next to an operation is then seen by others between the two, too. Memory orders are ignored: one thread runs
/// at a time, so each sees all that others did.
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

  T load(std::memory_order /*order*/ = std::memory_order_seq_cst) const noexcept {
    const Switches around;
    return system_.load();
  }
  void store(T value, std::memory_order /*order*/ = std::memory_order_seq_cst) noexcept {
    const Switches around;
    system_.store(value);
  }
  T exchange(T value, std::memory_order /*order*/ = std::memory_order_seq_cst) noexcept {
    const Switches around;
    return system_.exchange(value);
  }
  template <typename... Orders>
  bool compare_exchange_strong(T& expected, T value, Orders... /*orders*/) noexcept {
    const Switches around;
    return system_.compare_exchange_strong(expected, value);
  }
  template <typename... Orders>
  bool compare_exchange_weak(T& expected, T value, Orders... orders) noexcept {
    return compare_exchange_strong(expected, value, orders...);
  }
  template <typename Operand>
  T fetch_add(Operand operand, std::memory_order /*order*/ = std::memory_order_seq_cst) noexcept {
    const Switches around;
    return system_.fetch_add(operand);
  }
  template <typename Operand>
  T fetch_sub(Operand operand, std::memory_order /*order*/ = std::memory_order_seq_cst) noexcept {
    const Switches around;
    return system_.fetch_sub(operand);
  }
  T fetch_and(T operand, std::memory_order /*order*/ = std::memory_order_seq_cst) noexcept {
    const Switches around;
    return system_.fetch_and(operand);
  }
  T fetch_or(T operand, std::memory_order /*order*/ = std::memory_order_seq_cst) noexcept {
    const Switches around;
    return system_.fetch_or(operand);
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
  struct Switches {
    Switches() noexcept { seeds::atomic_step(); }
    ~Switches() { seeds::atomic_step(); }
    Switches(const Switches&) = delete;
    Switches& operator=(const Switches&) = delete;
  };

  std::atomic<T> system_{};
};

}  // namespace mauve
