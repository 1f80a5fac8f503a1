// SPDX-License-Identifier: LGPL-3.0-or-later
// Text between C++ and Python. What users' code writes into an exception or a name may be any bytes; Python's
// text, and with it ROS messages and bags, is valid UTF-8. This is the one place where the one becomes the other:
// every std::string and const char* that goes to Python or comes from it takes this way.
#pragma once

#include <pybind11/cast.h>

#include <string>

template <>
struct pybind11::detail::type_caster<std::string> : string_caster<std::string> {
  /// Text and bytes; a lone surrogate, which UTF-8 has not, as `\udcff`.
  // NOLINTNEXTLINE(bugprone-derived-method-shadowing-base-method): pybind11 calls a caster by its type.
  bool load(handle source, bool convert) {
    if (string_caster<std::string>::load(source, convert)) return true;
    if (!source || PyUnicode_Check(source.ptr()) == 0) return false;
    const auto bytes =
        reinterpret_steal<object>(PyUnicode_AsEncodedString(source.ptr(), "utf-8", "backslashreplace"));
    if (bytes) return string_caster<std::string>::load(bytes, convert);
    PyErr_Clear();
    return false;
  }

  /// Each byte that is no UTF-8 becomes U+FFFD, the sign for it.
  static handle cast(const std::string& source, return_value_policy /*policy*/, handle /*parent*/) {
    const handle text =
        PyUnicode_DecodeUTF8(source.data(), static_cast<Py_ssize_t>(source.size()), "replace");
    if (!text) throw error_already_set();
    return text;
  }
};
