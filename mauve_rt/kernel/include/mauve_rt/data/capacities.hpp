// SPDX-License-Identifier: LGPL-3.0-or-later
// How many elements the sequences of a resource's values hold: given once, when the resource is made.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <tuple>
#include <type_traits>
#include <vector>

#include "mauve_rt/base/rt.hpp"
#include "mauve_rt/base/seam/atomic.hpp"
#include "mauve_rt/data/message_shape.hpp"
#include "mauve_rt/data/resource_kind.hpp"

namespace mauve {

/// By the path of a sequence within the message: ranges, or markers.points for each of the markers.
using Capacities = std::map<std::string, std::size_t>;

/// The sequences of a struct by their paths, outer ones before those within. [non-rt]
std::vector<std::string> sequence_paths(const MessageShape& message);
/// From a resource's parameters, which have the path behind "capacity.". [non-rt]
/// Throws Error: invalid_argument (a sequence lacks one, or there is no such sequence), type_mismatch, out_of_range.
Capacities capacities_of(const MessageShape& message, const ResourceParameters& given);
/// Of one value, with what its sequences take. [non-rt] Throws std::out_of_range: a capacity is missing.
std::size_t value_bytes(const MessageShape& message, const Capacities& capacities);
/// Whether a resource's parameter is one of capacities_of(). [non-rt]
bool is_capacity(const std::string& parameter);
/// Why a value was refused: its sequence at a path has `size` elements; 0: more than its memory holds. [non-rt]
std::string overflow_text(const std::string& path, std::size_t capacity, std::size_t size);

namespace detail {

template <typename T>
inline constexpr bool kIsSequence = false;
template <typename T>
inline constexpr bool kIsSequence<Sequence<T>> = true;
/// How many places an array or a bounded vector has; 0: it is neither.
template <typename T>
inline constexpr std::size_t kPlaces = 0;
template <typename T, std::size_t N>
inline constexpr std::size_t kPlaces<std::array<T, N>> = N;
template <typename T, std::size_t N>
inline constexpr std::size_t kPlaces<BoundedVector<T, N>> = N;

template <typename Class, typename Member>
Member member_of(Member Class::* member);  // for its type

/// How many sequences sequence_paths() names.
template <typename T>
consteval std::size_t sequence_count() {
  if constexpr (kIsSequence<T>) {
    return 1 + sequence_count<typename T::value_type>();
  } else if constexpr (kPlaces<T> != 0) {
    return sequence_count<typename T::value_type>();
  } else if constexpr (Described<T>) {
    return std::apply(
        [](auto... member) { return (sequence_count<decltype(member_of(member))>() + ... + 0U); },
        TypeTraits<T>::fields());
  } else {
    return 0;
  }
}

}  // namespace detail

/// Whether a value has memory elsewhere than in its struct.
template <typename T>
inline constexpr bool kHasSequences = detail::sequence_count<T>() != 0;
/// Whether values are read and written in place rather than copied under a lock.
template <typename T>
inline constexpr bool kIsLarge = kHasSequences<T> || sizeof(T) > 4096;

namespace detail {

template <typename T>
void allocate(T& value, const Capacities& capacities, const std::string& path) {
  if constexpr (sequence_count<T>() == 0) {
    return;
  } else if constexpr (kIsSequence<T>) {
    value.allocate(capacities.at(path));
    for (auto& item : value.places()) allocate(item, capacities, path);
  } else if constexpr (kPlaces<T> != 0) {
    for (std::size_t i = 0; i < kPlaces<T>; ++i) allocate(value.data()[i], capacities, path);
  } else {
    std::string_view names = TypeTraits<T>::field_names;
    const auto each = [&](auto member) {
      const std::string name = next_name(names);
      allocate(value.*member, capacities, path.empty() ? name : path + "." + name);
    };
    std::apply([&](auto... member) { (each(member), ...); }, TypeTraits<T>::fields());
  }
}

/// A sequence that holds more than it may.
struct Overflow {
  std::uint32_t sequence{0};  // as sequence_paths() counts them, from 1 on; 0: there is none
  std::uint32_t size{0};      // 0: not known
};

/// The first one in a value; `limits` in the order of sequence_paths(). [rt]
template <typename T>
Overflow find_overflow(const T& value, const std::uint32_t* limits, std::uint32_t index) noexcept {
  if constexpr (sequence_count<T>() == 0) {
    return {};
  } else if constexpr (kIsSequence<T>) {
    if (value.is_overflowed()) return {index + 1, 0};
    if (value.size() > limits[index]) return {index + 1, static_cast<std::uint32_t>(value.size())};
    if constexpr (sequence_count<typename T::value_type>() != 0) {
      for (const auto& item : value) {
        if (const Overflow found = find_overflow(item, limits, index + 1); found.sequence != 0) return found;
      }
    }
    return {};
  } else if constexpr (kPlaces<T> != 0) {
    for (std::size_t i = 0; i < value.size(); ++i) {
      if (const Overflow found = find_overflow(value[i], limits, index); found.sequence != 0) return found;
    }
    return {};
  } else {
    Overflow found;
    const auto look = [&](auto member) {
      if (found.sequence != 0) return;
      found = find_overflow(value.*member, limits, index);
      index += sequence_count<decltype(member_of(member))>();
    };
    std::apply([&](auto... member) { (look(member), ...); }, TypeTraits<T>::fields());
    return found;
  }
}

/// All sequences empty, all else as it is. [rt]
template <typename T>
void clear_sequences(T& value) noexcept {
  if constexpr (sequence_count<T>() == 0) {
    return;
  } else if constexpr (kIsSequence<T>) {
    value.clear();
  } else if constexpr (kPlaces<T> != 0) {
    for (std::size_t i = 0; i < value.size(); ++i) clear_sequences(value[i]);
  } else {
    std::apply([&](auto... member) { (clear_sequences(value.*member), ...); }, TypeTraits<T>::fields());
  }
}

}  // namespace detail

/// What a resource knows of the sequences of its values; of values without any nothing.
///
/// | member   | written by       | read by | order                                              |
/// | -------- | ---------------- | ------- | -------------------------------------------------- |
/// | limits_  | the constructor  | any     | -                                                  |
/// | refused_ | who writes       | any     | relaxed: a figure that nothing depends on          |
/// | last_    | who writes       | any     | relaxed: likewise; one word, so it is never torn   |
template <typename T>
class SequenceLimits {
 public:
  SequenceLimits() = default;
  /// [setup]
  explicit SequenceLimits(Capacities capacities) : capacities_(std::move(capacities)) {
    if constexpr (kHasSequences<T>) {
      for (const std::string& path : sequence_paths(message_shape<T>()))
        limits_.push_back(static_cast<std::uint32_t>(capacities_.at(path)));
    }
  }

  /// [rt]
  const Capacities& capacities() const MAUVE_RT { return capacities_; }
  /// Memory for a value's sequences. [setup]
  void allocate(T& value) const { detail::allocate(value, capacities_, ""); }
  /// An empty value with memory. [setup]
  std::unique_ptr<T> make() const {
    auto value = std::make_unique<T>();
    allocate(*value);
    return value;
  }
  /// Whether no sequence holds more than it may; counts what is refused. [rt]
  bool admits(const T& value) MAUVE_RT {
    if constexpr (kHasSequences<T>) {
      const detail::Overflow found = detail::find_overflow(value, limits_.data(), 0);
      if (found.sequence == 0) return true;
      refused_.fetch_add(1, std::memory_order_relaxed);
      last_.store(std::uint64_t{found.sequence} << 32U | found.size, std::memory_order_relaxed);
      return false;
    }
    return true;
  }
  /// Writes that were refused. [rt]
  std::uint64_t refused() const MAUVE_RT { return refused_.load(std::memory_order_relaxed); }
  /// Why the last one was, in words; empty: none was. [non-rt]
  std::string refusal() const {
    const std::uint64_t last = last_.load(std::memory_order_relaxed);
    if (last == 0) return "";
    const std::size_t index = (last >> 32U) - 1;
    return overflow_text(sequence_paths(message_shape<T>())[index], limits_[index],
                         static_cast<std::uint32_t>(last));
  }

 private:
  Capacities capacities_;
  std::vector<std::uint32_t> limits_;  // in the order of sequence_paths()
  Atomic<std::uint64_t> refused_{0};
  Atomic<std::uint64_t> last_{0};  // sequence and size, as detail::Overflow
};

}  // namespace mauve
