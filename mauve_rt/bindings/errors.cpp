// SPDX-License-Identifier: LGPL-3.0-or-later
#include "translate.hpp"

namespace mauve::bindings {

void bind_errors(py::module_& module) {
  // Static: exceptions are translated for as long as the interpreter lives, and it never unloads the module.
  static const py::handle mauve_error = PyErr_NewExceptionWithDoc(
      "mauve_rt._kernel.MauveError",
      "An error of the kernel: code, component, element, expected, found, remedy.", nullptr, nullptr);
  module.attr("MauveError") = mauve_error;
  // NOLINTNEXTLINE(performance-unnecessary-value-param): the signature is pybind11's
  py::register_exception_translator([](std::exception_ptr pending) {
    try {
      if (pending) std::rethrow_exception(pending);
    } catch (const Error& error) {
      py::object exception = mauve_error(error.what());
      exception.attr("code") = std::string(to_string(error.code()));
      exception.attr("component") = error.detail().component;
      exception.attr("element") = error.detail().element;
      exception.attr("expected") = error.detail().expected;
      exception.attr("found") = error.detail().found;
      exception.attr("remedy") = error.detail().remedy;
      PyErr_SetObject(mauve_error.ptr(), exception.ptr());
    }
  });
}

}  // namespace mauve::bindings
