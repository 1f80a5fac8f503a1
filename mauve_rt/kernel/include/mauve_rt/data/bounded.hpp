// SPDX-License-Identifier: LGPL-3.0-or-later
// Sequences and strings of bounded size that live in place, for messages on component threads.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "mauve_rt/base/rt.hpp"

namespace mauve {

namespace detail {
template <typename T>
struct FindNumber;
}

/// At most N elements, stored in place; trivially copyable when T is. Not thread-safe. All functions [rt].
template <typename T, std::size_t N>
class BoundedVector {
 public:
  using value_type = T;
  static constexpr std::size_t capacity() MAUVE_RT { return N; }

  std::size_t size() const MAUVE_RT { return size_; }
  bool empty() const MAUVE_RT { return size_ == 0; }
  bool full() const MAUVE_RT { return size_ == N; }
  void clear() MAUVE_RT { size_ = 0; }
  /// Appends; false (and unchanged) when full.
  bool push_back(const T& value) MAUVE_RT {
    if (full()) return false;
    items_[size_++] = value;
    return true;
  }
  /// Grows (with whatever the places hold) or shrinks; false when over the capacity.
  bool resize(std::size_t size) MAUVE_RT {
    if (size > N) return false;
    size_ = static_cast<std::uint32_t>(size);
    return true;
  }
  T& operator[](std::size_t i) MAUVE_RT { return items_[i]; }
  const T& operator[](std::size_t i) const MAUVE_RT { return items_[i]; }
  T* data() MAUVE_RT { return items_.data(); }
  const T* data() const MAUVE_RT { return items_.data(); }
  T* begin() MAUVE_RT { return items_.data(); }
  T* end() MAUVE_RT { return items_.data() + size_; }
  const T* begin() const MAUVE_RT { return items_.data(); }
  const T* end() const MAUVE_RT { return items_.data() + size_; }

 private:
  friend struct detail::FindNumber<BoundedVector>;  // reads a length by its place

  std::uint32_t size_{0};
  std::array<T, N> items_{};
};

/// At most N characters (of a wstring: units of UTF-16), stored in place. All functions [rt].
template <typename Char, std::size_t N>
class BoundedText {
 public:
  using View = std::basic_string_view<Char>;

  BoundedText() = default;
  BoundedText(View text) MAUVE_RT { assign(text); }         // NOLINT: implicit like std::string
  BoundedText(const Char* text) MAUVE_RT { assign(text); }  // NOLINT: likewise, where one is expected
  static constexpr std::size_t capacity() MAUVE_RT { return N; }
  /// Takes the text; false (and cut to N) when it is longer.
  bool assign(View text) MAUVE_RT {
    size_ = static_cast<std::uint32_t>(std::min(text.size(), N));
    std::copy_n(text.begin(), size_, text_.begin());
    return text.size() <= N;
  }
  /// Appends; false (and unchanged) when full.
  bool push_back(Char character) MAUVE_RT {
    if (size_ == N) return false;
    text_[size_++] = character;
    return true;
  }
  View view() const MAUVE_RT { return {text_.data(), size_}; }
  bool operator==(const BoundedText& other) const MAUVE_RT { return view() == other.view(); }
  bool operator==(View other) const MAUVE_RT { return view() == other; }
  bool operator==(const Char* other) const MAUVE_RT { return view() == other; }

 private:
  std::uint32_t size_{0};
  std::array<Char, N> text_{};
};

template <std::size_t N>
using BoundedString = BoundedText<char, N>;
template <std::size_t N>
using BoundedWString = BoundedText<char16_t, N>;

}  // namespace mauve
