// SPDX-License-Identifier: LGPL-3.0-or-later
// What a C++ struct says of the message it stands for, to be held against the message's own definition.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "mauve_rt/data/cdr.hpp"

namespace mauve {

/// How many elements a field has: one; always `size`; at most `size`; as many as its memory holds.
enum class FieldArity : std::uint8_t { one, fixed, bounded, sequence };

/// One field of a struct, in the words of .msg files.
struct FieldShape {
  std::string name{};
  std::string type{};           // of an element: float64, string, geometry_msgs/msg/Point
  std::size_t text_capacity{};  // of a string: its most characters; 0: any number
  FieldArity arity{FieldArity::one};
  std::size_t size{};                // of an array
  std::size_t offset{};              // of the member within its struct
  std::size_t item_bytes{};          // of an element of a sequence
  std::vector<FieldShape> fields{};  // of a message within the message
};

/// Of an element, as in .msg files: string<=10. [non-rt]
inline std::string item_text(const FieldShape& field) {
  return field.type + (field.text_capacity == 0 ? "" : "<=" + std::to_string(field.text_capacity));
}
/// What follows it in .msg files: [3], [<=3] or []; empty: it is no array. [non-rt]
inline std::string array_text(const FieldShape& field) {
  switch (field.arity) {
    case FieldArity::one:
      return "";
    case FieldArity::fixed:
      return "[" + std::to_string(field.size) + "]";
    case FieldArity::bounded:
      return "[<=" + std::to_string(field.size) + "]";
    case FieldArity::sequence:
      return "[]";
  }
  return "";
}

/// A message as its C++ struct has it.
struct MessageShape {
  std::string type;   // geometry_msgs/msg/Point
  std::size_t bytes;  // of the struct
  std::vector<FieldShape> fields;
};

template <Described T>
std::vector<FieldShape> field_shapes();  // [non-rt]

namespace detail {

/// The word of .msg files for a number's type.
template <Primitive T>
std::string primitive_name() {
  if constexpr (std::is_same_v<T, bool>) return "bool";
  const std::string bits = std::to_string(8 * sizeof(T));
  if constexpr (std::is_floating_point_v<T>) return "float" + bits;
  return (std::is_signed_v<T> ? "int" : "uint") + bits;
}

template <typename T>
struct ShapeOf;  // of a member's type; the field's name is added by who knows it

template <Primitive T>
struct ShapeOf<T> {
  static FieldShape get() { return {.type = primitive_name<T>()}; }
};
template <>
struct ShapeOf<std::string> {
  static FieldShape get() { return {.type = "string"}; }
};
template <std::size_t N>
struct ShapeOf<BoundedString<N>> {
  static FieldShape get() { return {.type = "string", .text_capacity = N}; }
};
template <std::size_t N>
struct ShapeOf<BoundedWString<N>> {
  static FieldShape get() { return {.type = "wstring", .text_capacity = N}; }
};
template <Described T>
struct ShapeOf<T> {
  static FieldShape get() { return {.type = std::string(TypeTraits<T>::name), .fields = field_shapes<T>()}; }
};
template <typename T, std::size_t N>
struct ShapeOf<std::array<T, N>> {
  static FieldShape get() {
    FieldShape shape = ShapeOf<T>::get();
    shape.arity = FieldArity::fixed;
    shape.size = N;
    return shape;
  }
};
template <typename T, std::size_t N>
struct ShapeOf<BoundedVector<T, N>> {
  static FieldShape get() {
    FieldShape shape = ShapeOf<T>::get();
    shape.arity = FieldArity::bounded;
    shape.size = N;
    return shape;
  }
};

template <typename T>
struct ShapeOf<Sequence<T>> {
  static FieldShape get() {
    FieldShape shape = ShapeOf<T>::get();
    shape.arity = FieldArity::sequence;
    shape.item_bytes = sizeof(T);
    return shape;
  }
};

template <typename Class, typename Member>
FieldShape shape_of(Member Class::* member) {
  FieldShape shape = ShapeOf<Member>::get();
  shape.offset = static_cast<std::size_t>(std::bit_cast<std::ptrdiff_t>(member));  // Itanium C++ ABI, 2.3
  return shape;
}

/// The next name of "x, y, z", taken off its front.
inline std::string next_name(std::string_view& names) {
  const std::size_t comma = names.find(',');
  std::string_view name = names.substr(0, comma);
  names.remove_prefix(comma == std::string_view::npos ? names.size() : comma + 1);
  const std::size_t begin = name.find_first_not_of(' ');
  return begin == std::string_view::npos
             ? std::string()
             : std::string(name.substr(begin, name.find_last_not_of(' ') + 1 - begin));
}

}  // namespace detail

/// The fields of a struct in their order on the wire. [non-rt]
template <Described T>
std::vector<FieldShape> field_shapes() {
  std::vector<FieldShape> shapes;
  [[maybe_unused]] std::string_view names = TypeTraits<T>::field_names;
  const auto add = [&](auto member) {
    shapes.push_back(detail::shape_of(member));
    shapes.back().name = detail::next_name(names);
  };
  std::apply([&](auto... member) { (add(member), ...); }, TypeTraits<T>::fields());
  return shapes;
}

/// [non-rt]
template <Described T>
MessageShape message_shape() {
  return {.type = std::string(TypeTraits<T>::name), .bytes = sizeof(T), .fields = field_shapes<T>()};
}

/// Of those of the types that are messages; references are looked through. [non-rt]
template <typename... Ts>
std::vector<MessageShape> message_shapes() {
  std::vector<MessageShape> shapes;
  [[maybe_unused]] const auto add = [&]<typename T>(std::type_identity<T> /*tag*/) {
    if constexpr (Described<T>) shapes.push_back(message_shape<T>());
  };
  (add(std::type_identity<std::remove_cvref_t<Ts>>{}), ...);
  return shapes;
}

}  // namespace mauve
