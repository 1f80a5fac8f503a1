// SPDX-License-Identifier: LGPL-3.0-or-later
// The open list of A*: cells by priority, each at most once, so that it never outgrows the map.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace mauve_examples {

/// A binary heap with decrease-key over cell indices. Not thread-safe.
class CellHeap {
 public:
  /// Allocates for cells 0 .. count-1. [setup]
  void configure(std::size_t count) {
    heap_.assign(count, 0);
    place_.assign(count, kAbsent);
    key_.assign(count, 0);
    size_ = 0;
  }

  bool empty() const noexcept { return size_ == 0; }

  /// Empties the heap. [rt]
  void clear() noexcept {
    for (std::size_t i = 0; i < size_; ++i) place_[heap_[i]] = kAbsent;
    size_ = 0;
  }

  /// Adds the cell, or moves it forward if the key is lower than the one it has. [rt]
  void push_or_decrease(std::uint32_t cell, std::uint32_t key) noexcept {
    if (place_[cell] == kAbsent) {
      place_[cell] = size_;
      heap_[size_++] = cell;
    } else if (key >= key_[cell]) {
      return;
    }
    key_[cell] = key;
    sift_up(place_[cell]);
  }

  /// Removes and returns the cell with the lowest key. [rt]
  std::uint32_t pop() noexcept {
    const std::uint32_t top = heap_[0];
    place_[top] = kAbsent;
    const std::uint32_t last = heap_[--size_];
    if (size_ > 0) {
      put(0, last);
      sift_down(0);
    }
    return top;
  }

 private:
  static constexpr std::uint32_t kAbsent = UINT32_MAX;

  void put(std::uint32_t place, std::uint32_t cell) noexcept {
    heap_[place] = cell;
    place_[cell] = place;
  }
  void sift_up(std::uint32_t place) noexcept {
    const std::uint32_t cell = heap_[place];
    while (place > 0) {
      const std::uint32_t parent = (place - 1) / 2;
      if (key_[heap_[parent]] <= key_[cell]) break;
      put(place, heap_[parent]);
      place = parent;
    }
    put(place, cell);
  }
  void sift_down(std::uint32_t place) noexcept {
    const std::uint32_t cell = heap_[place];
    for (std::uint32_t child = 2 * place + 1; child < size_; child = 2 * place + 1) {
      if (child + 1 < size_ && key_[heap_[child + 1]] < key_[heap_[child]]) ++child;
      if (key_[cell] <= key_[heap_[child]]) break;
      put(place, heap_[child]);
      place = child;
    }
    put(place, cell);
  }

  std::vector<std::uint32_t> heap_;
  std::vector<std::uint32_t> place_;  // of a cell in heap_
  std::vector<std::uint32_t> key_;    // of a cell
  std::uint32_t size_{0};
};

}  // namespace mauve_examples
