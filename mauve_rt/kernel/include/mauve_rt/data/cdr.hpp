// SPDX-License-Identifier: LGPL-3.0-or-later
// Plain little-endian CDR, the wire format of ROS 2 messages, for structs that declare their fields once.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <vector>

#include "mauve_rt/base/rt.hpp"
#include "mauve_rt/data/bounded.hpp"
#include "mauve_rt/data/sequence.hpp"

static_assert(std::endian::native == std::endian::little,
              "CDR is written little-endian as the machine holds it");

namespace mauve {

/// What MAUVE_TYPE specialises: `name` (the type's identity), `fields()` (a tuple of member pointers) and
/// `field_names` (their names, with commas between).
template <typename T>
struct TypeTraits;

template <typename T>
concept Described = requires {
  { TypeTraits<T>::name } -> std::convertible_to<std::string_view>;
  TypeTraits<T>::fields();
};

template <typename T>
concept Primitive = std::is_arithmetic_v<T>;

/// A message without fields has one byte on the wire.
template <Described T>
inline constexpr bool kIsEmpty = std::tuple_size_v<decltype(TypeTraits<T>::fields())> == 0;

/// The encapsulation header of plain CDR, little-endian.
inline constexpr std::array<std::byte, 4> kCdrHeader{std::byte{0}, std::byte{1}, std::byte{0}, std::byte{0}};

/// Serializes into a buffer that keeps its capacity between messages. All functions [non-rt].
class CdrWriter {
 public:
  explicit CdrWriter(std::vector<std::byte>& buffer) : buffer_(buffer) {
    buffer_.assign(kCdrHeader.begin(), kCdrHeader.end());
  }

  template <Primitive T>
  void put(const T& value) {
    align(sizeof(T));
    append(&value, sizeof(T));
  }
  template <std::size_t N>
  void put(const BoundedString<N>& value) {
    put_string(value.view());
  }
  template <std::size_t N>
  void put(const BoundedWString<N>& value) {
    put(static_cast<std::uint32_t>(value.view().size()));
    for (const char16_t unit : value.view()) put(std::uint32_t{unit});  // as rmw_fastrtps does
  }
  void put(const std::string& value) { put_string(value); }
  template <typename T, std::size_t N>
  void put(const std::array<T, N>& value) {
    put_items(std::span<const T>(value));
  }
  template <typename T, std::size_t N>
  void put(const BoundedVector<T, N>& value) {
    put(static_cast<std::uint32_t>(value.size()));
    put_items(std::span<const T>(value.data(), value.size()));
  }
  template <typename T>
  void put(const Sequence<T>& value) {
    put(static_cast<std::uint32_t>(value.size()));
    put_items(value.view());
  }
  template <Described T>
  void put(const T& value) {
    if constexpr (kIsEmpty<T>) put(std::uint8_t{0});
    std::apply([&](auto... member) { (put(value.*member), ...); }, TypeTraits<T>::fields());
  }

 private:
  template <typename T>
  void put_items(std::span<const T> items) {
    if constexpr (Primitive<T>) {
      if (items.empty()) return;
      align(sizeof(T));
      append(items.data(), items.size_bytes());
    } else {
      for (const T& item : items) put(item);
    }
  }
  void put_string(std::string_view text) {
    put(static_cast<std::uint32_t>(text.size() + 1));
    append(text.data(), text.size());
    buffer_.push_back(std::byte{0});
  }
  void align(std::size_t size) {
    while ((buffer_.size() - kCdrHeader.size()) % size != 0) buffer_.push_back(std::byte{0});
  }
  void append(const void* data, std::size_t size) {
    const auto* bytes = static_cast<const std::byte*>(data);
    if (size > sizeof(std::uint64_t)) {
      buffer_.insert(buffer_.end(), bytes, bytes + size);
      return;
    }
    const std::size_t begin = buffer_.size();
    buffer_.resize(begin + size);  // GCC 12 takes an insert() of one number for a write out of bounds
    std::copy_n(bytes, size, buffer_.data() + begin);
  }

  std::vector<std::byte>& buffer_;
};

/// A sequence of a message that has more elements than its place.
struct TooLong {
  std::string path;  // of the field, dotted within messages
  std::uint32_t size{0};

  /// The field is within this one of a struct. [non-rt]
  void add(std::string_view field_names, std::size_t field) {
    while (field-- > 0) field_names.remove_prefix(field_names.find(',') + 1);
    field_names = field_names.substr(0, field_names.find(','));
    field_names.remove_prefix(field_names.find_first_not_of(' '));
    path = std::string(field_names) + (path.empty() ? "" : "." + path);
  }
};

/// Deserializes in place, without allocation; every getter returns false on a short or excessive message.
/// All functions [rt].
class CdrReader {
 public:
  explicit CdrReader(std::span<const std::byte> data) MAUVE_RT : data_(data) {
    ok_ = data.size() >= kCdrHeader.size() && data[1] == std::byte{1};
    position_ = kCdrHeader.size();
  }

  template <Primitive T>
  bool get(T& value) MAUVE_RT {
    const std::byte* from = take(sizeof(T), sizeof(T));
    if (from != nullptr) std::memcpy(&value, from, sizeof(T));
    return ok_;
  }
  template <std::size_t N>
  bool get(BoundedString<N>& value) MAUVE_RT {
    std::uint32_t size = 0;
    if (!get(size)) return false;
    const std::byte* from = take(size, 1);
    if (from == nullptr) return false;
    const std::size_t length = size == 0 ? 0 : size - 1;  // the terminating zero is on the wire
    return ok_ = value.assign({reinterpret_cast<const char*>(from), length});
  }
  template <std::size_t N>
  bool get(BoundedWString<N>& value) MAUVE_RT {
    std::uint32_t size = 0;
    if (!get(size)) return false;
    value.assign({});
    std::uint32_t unit = 0;
    while (size-- > 0 && get(unit)) ok_ = unit <= 0xFFFF && value.push_back(static_cast<char16_t>(unit));
    return ok_;
  }
  template <typename T, std::size_t N>
  bool get(std::array<T, N>& value) MAUVE_RT {
    return get_items(std::span<T>(value));
  }
  template <typename T, std::size_t N>
  bool get(BoundedVector<T, N>& value) MAUVE_RT {
    return get_sized(value);
  }
  template <typename T>
  bool get(Sequence<T>& value) MAUVE_RT {
    value.clear();
    return get_sized(value);
  }
  template <Described T>
  bool get(T& value) MAUVE_RT {
    if constexpr (kIsEmpty<T>) (void)take(1, 1);
    [[maybe_unused]] std::size_t field = 0;
    [[maybe_unused]] const auto got = [&](auto member) MAUVE_RT {
      if (get(value.*member)) return ++field != 0;
      if (too_long_ != nullptr && too_long_->size != 0)
        MAUVE_RT_TRUSTED(
            too_long_->add(TypeTraits<T>::field_names, field));  // only where an ordinary thread asks
      return false;
    };
    std::apply([&](auto... member) { (void)(got(member) && ...); }, TypeTraits<T>::fields());
    return ok_;
  }
  /// From now on keeps which sequence has more elements than its place. [non-rt]
  void explain(TooLong& too_long) { too_long_ = &too_long; }

 private:
  template <typename T>
  bool get_items(std::span<T> items) {
    if constexpr (Primitive<T>) {
      if (items.empty()) return ok_;
      const std::byte* from = take(items.size_bytes(), sizeof(T));
      if (from != nullptr) std::memcpy(items.data(), from, items.size_bytes());
    } else {
      for (T& item : items) {
        if (!get(item)) return false;
      }
    }
    return ok_;
  }
  template <typename Items>
  bool get_sized(Items& value) {
    std::uint32_t size = 0;
    if (!get(size)) return false;
    if (!value.resize(size)) {
      if (too_long_ != nullptr) too_long_->size = size;
      return ok_ = false;
    }
    return get_items(std::span(value.data(), size));
  }
  const std::byte* take(std::size_t size, std::size_t alignment) {
    const std::size_t offset = position_ - kCdrHeader.size();
    const std::size_t start = kCdrHeader.size() + (offset + alignment - 1) / alignment * alignment;
    if (!ok_ || start > data_.size() || data_.size() - start < size) {
      ok_ = false;
      return nullptr;
    }
    position_ = start + size;
    return data_.data() + start;
  }

  std::span<const std::byte> data_;
  std::size_t position_{0};
  bool ok_{false};
  TooLong* too_long_{nullptr};
};

}  // namespace mauve

#define MAUVE_PARENS ()
#define MAUVE_EXPAND(...) \
  MAUVE_EXPAND1(MAUVE_EXPAND1(MAUVE_EXPAND1(MAUVE_EXPAND1(MAUVE_EXPAND1(__VA_ARGS__)))))
#define MAUVE_EXPAND1(...) \
  MAUVE_EXPAND2(MAUVE_EXPAND2(MAUVE_EXPAND2(MAUVE_EXPAND2(MAUVE_EXPAND2(__VA_ARGS__)))))
#define MAUVE_EXPAND2(...) \
  MAUVE_EXPAND3(MAUVE_EXPAND3(MAUVE_EXPAND3(MAUVE_EXPAND3(MAUVE_EXPAND3(__VA_ARGS__)))))
#define MAUVE_EXPAND3(...) __VA_ARGS__
#define MAUVE_MEMBERS(type, ...) __VA_OPT__(MAUVE_EXPAND(MAUVE_MEMBER(type, __VA_ARGS__)))
#define MAUVE_MEMBER(type, field, ...) \
  &type::field __VA_OPT__(, MAUVE_MEMBER_AGAIN MAUVE_PARENS(type, __VA_ARGS__))
#define MAUVE_MEMBER_AGAIN() MAUVE_MEMBER

/// Declares a struct's identity and its mapping to a ROS message, once, in message order, at global scope:
///   MAUVE_TYPE(my::Point, "geometry_msgs/msg/Point", x, y, z)
/// Up to 150 members, named as the message's fields, or so with one word more: cost_m for cost, class_ for class.
#define MAUVE_TYPE(type, type_name, ...)                                                         \
  template <>                                                                                    \
  struct mauve::TypeTraits<type> {                                                               \
    static constexpr std::string_view name = type_name;                                          \
    static constexpr std::string_view field_names = #__VA_ARGS__;                                \
    static constexpr auto fields() { return std::make_tuple(MAUVE_MEMBERS(type, __VA_ARGS__)); } \
  };
