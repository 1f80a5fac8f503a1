// SPDX-License-Identifier: LGPL-3.0-or-later
// Sequence: elements of a message whose number no message definition bounds, in memory that comes once.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <utility>

#include "mauve_rt/base/rt.hpp"

namespace mauve {

/// At most capacity() elements, in one block that is allocated when its owner is configured. A value goes by copy assignment between
/// sequences that have memory; there is no copy constructor, as that would allocate. What asks for more than the capacity leaves
/// a mark: a port refuses to write a message with a marked sequence. Not thread-safe. All functions [rt], but for those marked.
template <typename T>
class Sequence {
 public:
  using value_type = T;

  Sequence() = default;
  Sequence(const Sequence&) = delete;
  Sequence(Sequence&& other) noexcept { swap(other); }
  ~Sequence() = default;
  /// Takes the elements; where they do not fit, none and the mark.
  Sequence& operator=(const Sequence& other) MAUVE_RT {
    if (this == &other) return *this;
    if (other.is_overflowed_ || !assign(other.view())) {
      size_ = 0;
      is_overflowed_ = true;
    }
    return *this;
  }
  /// Takes the other's block where that is the larger one, as of a member that gets its memory; else the elements.
  Sequence& operator=(Sequence&& other) MAUVE_RT {
    if (other.capacity_ > capacity_) {
      swap(other);
    } else {
      *this = std::as_const(other);
    }
    return *this;
  }

  /// Gives it memory for so many elements; what it held is gone. [setup]
  void allocate(std::size_t capacity) {
    items_ = capacity == 0 ? nullptr : std::make_unique<T[]>(capacity);
    capacity_ = static_cast<std::uint32_t>(capacity);
    clear();
  }

  std::size_t capacity() const MAUVE_RT { return capacity_; }
  std::size_t size() const MAUVE_RT { return size_; }
  bool empty() const MAUVE_RT { return size_ == 0; }
  bool full() const MAUVE_RT { return size_ == capacity_; }
  /// Whether more was asked for than it holds, since it was last cleared, or assigned what fits.
  bool is_overflowed() const MAUVE_RT { return is_overflowed_; }

  void clear() MAUVE_RT {
    size_ = 0;
    is_overflowed_ = false;
  }
  /// Appends; false, unchanged and marked when full.
  bool push_back(const T& value) MAUVE_RT {
    if (full()) return refuse();
    items_[size_++] = value;
    return true;
  }
  /// Grows (with whatever the places hold) or shrinks; false, unchanged and marked when over the capacity.
  bool resize(std::size_t size) MAUVE_RT {
    if (size > capacity_) return refuse();
    size_ = static_cast<std::uint32_t>(size);
    return true;
  }
  /// Copies; false, unchanged and marked when there are more than the capacity.
  bool assign(std::span<const T> items) MAUVE_RT {
    if (items.size() > capacity_) return refuse();
    std::copy(items.begin(), items.end(), items_.get());
    size_ = static_cast<std::uint32_t>(items.size());
    is_overflowed_ = false;
    return true;
  }

  T& operator[](std::size_t i) MAUVE_RT { return items_[i]; }
  const T& operator[](std::size_t i) const MAUVE_RT { return items_[i]; }
  T* data() MAUVE_RT { return items_.get(); }
  const T* data() const MAUVE_RT { return items_.get(); }
  T* begin() MAUVE_RT { return items_.get(); }
  T* end() MAUVE_RT { return items_.get() + size_; }
  const T* begin() const MAUVE_RT { return items_.get(); }
  const T* end() const MAUVE_RT { return items_.get() + size_; }
  std::span<const T> view() const MAUVE_RT { return {items_.get(), size_}; }
  /// All places, also those that hold no element now.
  std::span<T> places() MAUVE_RT { return {items_.get(), capacity_}; }

 private:
  bool refuse() noexcept {
    is_overflowed_ = true;
    return false;
  }
  void swap(Sequence& other) noexcept {
    std::swap(items_, other.items_);
    std::swap(size_, other.size_);
    std::swap(capacity_, other.capacity_);
    std::swap(is_overflowed_, other.is_overflowed_);
  }

  std::unique_ptr<T[]> items_;
  std::uint32_t size_{0};
  std::uint32_t capacity_{0};
  bool is_overflowed_{false};
};

}  // namespace mauve
