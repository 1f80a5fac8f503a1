// SPDX-License-Identifier: LGPL-3.0-or-later
// Python objects with the type that signatures and stubs name instead of `object`.
#pragma once

#include <pybind11/pybind11.h>

#include <algorithm>
#include <cstddef>
#include <utility>

namespace mauve::bindings {

/// A type as an annotation of Python writes it.
template <std::size_t size>
struct TypeName {
  // NOLINTNEXTLINE(google-explicit-constructor): a text is given as an argument of a template
  constexpr TypeName(const char (&type)[size]) { std::copy_n(type, size, text); }
  char text[size]{};
};

/// Any Python object. Signatures say that its type is `type`; nothing checks that at run time.
template <TypeName type>
class Typed : public pybind11::object {
 public:
  using pybind11::object::object;
  // NOLINTNEXTLINE(google-explicit-constructor): what a function returns is given its type
  Typed(pybind11::object untyped) : pybind11::object(std::move(untyped)) {}
  static bool check_(pybind11::handle any) { return any.ptr() != nullptr; }
};

// A part: a registered name, or a class.
using AnyShell = Typed<"str | type[mauve_rt.parts.shells.Shell]">;
using AnyCore = Typed<"str | type[mauve_rt.parts.cores.Core[typing.Any]]">;
using AnyFsm = Typed<"str | type[mauve_rt.parts.fsms.Fsm[typing.Any, typing.Any]]">;
using AnyResource = Typed<"mauve_rt.parts.resources.AnyResource">;

using ReadMessage = Typed<"tuple[bytes, int, int]">;

}  // namespace mauve::bindings

namespace pybind11::detail {

template <mauve::bindings::TypeName type>
struct handle_type_name<mauve::bindings::Typed<type>> {
  static constexpr auto name = const_name(type.text);
};

}  // namespace pybind11::detail
