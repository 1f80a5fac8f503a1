// SPDX-License-Identifier: LGPL-3.0-or-later
// State fields: the members of a core that its successor takes over by name and type.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "mauve_rt/data/message_shape.hpp"

namespace mauve {

/// One member of a core. Its type is text, so that code of another build, or of another language, can compare it.
struct StateField {
  std::string name;
  std::string type;  // float64, float64[3], float64[<=16], string<=8, or a struct with its layout
  void* value{nullptr};
  std::size_t bytes{0};
};

/// The type of a field as text: of a struct with its size and the place of each field. [non-rt]
std::string type_text(const FieldShape& shape, std::size_t bytes);

namespace detail {

/// `integral_` and `this->integral_` are both the field `integral`.
std::string state_name(std::string_view member);

template <typename T>
StateField state_field(std::string_view& names, T& member) {
  static_assert(
      std::is_trivially_copyable_v<T> && requires { ShapeOf<T>::get(); },
      "a state field is a number, an std::array, a BoundedVector, a BoundedString or a trivially copyable "
      "type of MAUVE_TYPE; move other members in take()");
  return {.name = state_name(next_name(names)),
          .type = type_text(ShapeOf<T>::get(), sizeof(T)),
          .value = &member,
          .bytes = sizeof(T)};
}

}  // namespace detail

/// By MAUVE_STATE. `names`: the members as written, with commas between. [non-rt]
template <typename... Members>
std::vector<StateField> make_state_fields(std::string_view names, Members&... members) {
  std::vector<StateField> fields;
  (fields.push_back(detail::state_field(names, members)), ...);
  return fields;
}

}  // namespace mauve

/// In a core: the members that a core which replaces it takes over, where it has a field of the same name and type. Written in
/// this build or in another one, in C++ or in Python (`state_fields`).
///
///   class Pid : public mauve::Core<ControlShell> {
///     MAUVE_STATE(integral_, previous_error_)
///     double integral_{0.0};
#define MAUVE_STATE(...)                                        \
 public:                                                        \
  std::vector<mauve::StateField> state_fields() override {      \
    return mauve::make_state_fields(#__VA_ARGS__, __VA_ARGS__); \
  }                                                             \
                                                                \
 private:
