// SPDX-License-Identifier: LGPL-3.0-or-later
// One number within a value, found by its path once and read without looking for it again.
#pragma once

#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "mauve_rt/base/rt.hpp"
#include "mauve_rt/data/message_shape.hpp"

namespace mauve {

/// Where in a struct the number lies, and as what.
struct NumberPlace {
  /// Of a BoundedVector that has the number: where its length is, and the index of the element.
  struct Element {
    std::size_t length_offset{0};
    std::size_t index{0};
  };

  std::size_t offset{0};
  double (*convert)(const std::byte* at) noexcept {nullptr};
  /// nullptr: the number is a bool, or in a BoundedVector, and cannot be limited.
  void (*store)(std::byte* at, double number, double toward) noexcept {nullptr};
  std::optional<Element> element{};  // none: the number is always there

  /// NaN where the list is too short. [rt]
  double of(const void* value) const MAUVE_RT {
    const auto* const begin = static_cast<const std::byte*>(value);
    if (element) {
      std::uint32_t length = 0;
      std::memcpy(&length, begin + element->length_offset, sizeof(length));
      if (element->index >= length) return std::numeric_limits<double>::quiet_NaN();
    }
    return MAUVE_RT_TRUSTED(convert(begin + offset));  // one of those below
  }
  /// Writes a finite number into the value, rounded toward the second one, which its type can hold. [rt]
  void set(void* value, double number, double toward) const MAUVE_RT {
    MAUVE_RT_TRUSTED(store(static_cast<std::byte*>(value) + offset, number, toward));  // one of those below
  }
};

namespace detail {

/// "x" and "y[2]" of "x.y[2]": the first part of a path, taken off its front.
inline std::string_view next_part(std::string_view& path) {
  const std::size_t end = path.find_first_of(".[", 1);
  const std::string_view part = path.substr(0, end);
  path.remove_prefix(part.size());
  if (!path.empty() && path.front() == '.') path.remove_prefix(1);
  return part;
}

/// Whether a member is named as the message's field, or so with one word more: cost_m for cost.
inline bool is_field(std::string_view member, std::string_view field) {
  return member == field || (member.starts_with(field) && member.find('_', field.size()) == field.size() &&
                             member.find('_', field.size() + 1) == std::string_view::npos);
}

template <typename T>
struct FindNumber {  // texts, and lists without a bound, have no number at a fixed place
  static std::optional<NumberPlace> in(const T& /*value*/, std::string_view /*path*/) { return {}; }
};

/// The nearest number of the type between the two.
template <Primitive T>
T rounded(double number, double toward) noexcept {
  const bool is_above = number > toward;
  if constexpr (std::is_floating_point_v<T>) {
    const T near = static_cast<T>(number);
    const bool is_beyond = is_above ? near > number : near < number;
    return is_beyond ? std::nextafter(near, static_cast<T>(toward)) : near;
  } else {
    const double whole = is_above ? std::floor(number) : std::ceil(number);
    // What a double has for the largest number of 64 bits is one more.
    if (whole >= static_cast<double>(std::numeric_limits<T>::max())) return std::numeric_limits<T>::max();
    if (whole <= static_cast<double>(std::numeric_limits<T>::min())) return std::numeric_limits<T>::min();
    return static_cast<T>(whole);
  }
}

template <Primitive T>
struct FindNumber<T> {
  static std::optional<NumberPlace> in(const T& /*value*/, std::string_view path) {
    if (!path.empty()) return {};
    NumberPlace place{.convert = [](const std::byte* at) noexcept {
      T number;
      std::memcpy(&number, at, sizeof(T));
      return static_cast<double>(number);
    }};
    if constexpr (!std::is_same_v<T, bool>) {
      place.store = [](std::byte* at, double number, double toward) noexcept {
        const T stored = rounded<T>(number, toward);
        std::memcpy(at, &stored, sizeof(T));
      };
    }
    return place;
  }
};

template <typename Outer, typename Inner>
std::size_t offset_within(const Outer& outer, const Inner& inner) {
  return static_cast<std::size_t>(reinterpret_cast<const std::byte*>(&inner) -
                                  reinterpret_cast<const std::byte*>(&outer));
}

template <typename Outer, typename Inner>
std::optional<NumberPlace> find_inner(const Outer& outer, const Inner& inner, std::string_view path) {
  std::optional<NumberPlace> found = FindNumber<Inner>::in(inner, path);
  if (found) {
    found->offset += offset_within(outer, inner);
    if (found->element) found->element->length_offset += offset_within(outer, inner);
  }
  return found;
}

/// The index of "[3]", the first part of a path, which is taken off its front; nothing: it is none below `count`.
inline std::optional<std::size_t> next_index(std::string_view& path, std::size_t count) {
  const std::string_view part = next_part(path);
  if (part.size() < 3 || part.front() != '[' || part.back() != ']') return {};
  std::size_t index = 0;
  const auto [end, error] = std::from_chars(part.data() + 1, part.data() + part.size() - 1, index);
  if (error != std::errc() || end != part.data() + part.size() - 1 || index >= count) return {};
  return index;
}

template <typename T, std::size_t N>
struct FindNumber<std::array<T, N>> {
  static std::optional<NumberPlace> in(const std::array<T, N>& value, std::string_view path) {
    const std::optional<std::size_t> index = next_index(path, N);
    return index ? find_inner(value, value[*index], path) : std::nullopt;
  }
};

template <typename T, std::size_t N>
struct FindNumber<BoundedVector<T, N>> {
  static std::optional<NumberPlace> in(const BoundedVector<T, N>& value, std::string_view path) {
    if (path == "length") {
      std::optional<NumberPlace> length = find_inner(value, value.size_, "");
      if (length) length->store = nullptr;
      return length;
    }
    const std::optional<std::size_t> index = next_index(path, N);
    if (!index) return {};
    std::optional<NumberPlace> found = find_inner(value, value[*index], path);
    if (!found || found->element) return {};  // in a list within this one
    found->store = nullptr;
    found->element = {.length_offset = offset_within(value, value.size_), .index = *index};
    return found;
  }
};

template <Described T>
struct FindNumber<T> {
  static std::optional<NumberPlace> in(const T& value, std::string_view path) {
    const std::string_view part = next_part(path);
    std::optional<NumberPlace> found;
    [[maybe_unused]] std::string_view names = TypeTraits<T>::field_names;
    [[maybe_unused]] const auto look = [&](auto member) {
      const std::string name = next_name(names);
      if (!found && is_field(name, part)) found = find_inner(value, value.*member, path);
    };
    std::apply([&](auto... member) { (look(member), ...); }, TypeTraits<T>::fields());
    return found;
  }
};

inline void add_number_paths(const std::vector<FieldShape>& fields, const std::string& before,
                             std::size_t most, std::vector<std::string>& paths) {
  for (const FieldShape& field : fields) {
    const bool is_text = field.type == "string" || field.type == "wstring";
    if (is_text || field.arity == FieldArity::bounded || field.arity == FieldArity::sequence)
      continue;  // at no fixed place
    const bool is_array = field.arity == FieldArity::fixed;
    for (std::size_t index = 0; index < (is_array ? field.size : 1); ++index) {
      if (paths.size() > most) return;
      const std::string path = before + field.name + (is_array ? "[" + std::to_string(index) + "]" : "");
      if (field.fields.empty()) {
        paths.push_back(path);
      } else {
        add_number_paths(field.fields, path + ".", most, paths);
      }
    }
  }
}

}  // namespace detail

/// The paths of the numbers of a message that lie at a fixed place; of too many, one more than `most`. [non-rt]
inline std::vector<std::string> number_paths(const MessageShape& message, std::size_t most) {
  std::vector<std::string> paths;
  detail::add_number_paths(message.fields, "", most, paths);
  return paths;
}

/// The number at a path such as twist.linear.x, ranges[3] or ranges.length; nothing: there is none at a fixed
/// place. An element of a BoundedVector is found up to the vector's capacity. [non-rt]
template <Described T>
std::optional<NumberPlace> find_number(std::string_view path) {
  const auto value = std::make_unique<T>();
  return path.empty() ? std::nullopt : detail::FindNumber<T>::in(*value, path);
}

}  // namespace mauve
