// SPDX-License-Identifier: LGPL-3.0-or-later
#include "translate.hpp"

namespace mauve::bindings {

// Static: exceptions are translated for as long as the interpreter lives, and it never unloads the module.
py::handle mauve_error_type() {
  static const py::handle type = PyErr_NewExceptionWithDoc(
      "mauve_rt._kernel.MauveError",
      R"(An error of the kernel. str() is one line: what, where, expected, found, remedy.

`code` is a key of ERROR_REPLIES, `statement` says what alone. `step` is the number of the step of a transaction, from
1; 0: none.)",
      nullptr, nullptr);
  return type;
}

ErrorCode error_code_of(std::string_view name) noexcept {
  for (const ErrorWords& words : kErrors)
    if (words.name == name) return words.code;
  return ErrorCode::internal;
}

namespace {

/// What pybind11 makes an exception of the standard library: it refuses a text that is no UTF-8.
py::handle python_type_of(const std::exception& error) {
  const auto is_a = [&error](auto* example) { return dynamic_cast<decltype(example)>(&error) != nullptr; };
  if (is_a(static_cast<const std::bad_alloc*>(nullptr))) return PyExc_MemoryError;
  if (is_a(static_cast<const std::out_of_range*>(nullptr))) return PyExc_IndexError;
  if (is_a(static_cast<const std::overflow_error*>(nullptr))) return PyExc_OverflowError;
  if (is_a(static_cast<const std::logic_error*>(nullptr)) ||
      is_a(static_cast<const std::range_error*>(nullptr)))
    return PyExc_ValueError;
  return PyExc_RuntimeError;
}

void annotate(py::handle type) {
  py::dict attributes;
  for (const char* text :
       {"code", "statement", "component", "element", "expected", "found", "remedy", "step_name"})
    attributes[text] = "str";
  attributes["step"] = "int";
  type.attr("__annotations__") = attributes;
}

}  // namespace

void bind_errors(py::module_& module) {
  annotate(mauve_error_type());
  module.attr("MauveError") = mauve_error_type();
  py::dict replies;
  for (const ErrorWords& words : kErrors) replies[std::string(words.name).c_str()] = std::string(words.reply);
  module.attr("ERROR_REPLIES") = replies;
  // NOLINTNEXTLINE(performance-unnecessary-value-param): the signature is pybind11's
  py::register_exception_translator([](std::exception_ptr pending) {
    try {
      if (pending) std::rethrow_exception(pending);
    } catch (const Error& error) {
      py::object exception = mauve_error_type()(error.what());
      exception.attr("code") = std::string(to_string(error.code()));
      exception.attr("statement") = error.statement();
      exception.attr("component") = error.detail().component;
      exception.attr("element") = error.detail().element;
      exception.attr("expected") = error.detail().expected;
      exception.attr("found") = error.detail().found;
      exception.attr("remedy") = error.detail().remedy;
      exception.attr("step") = error.detail().step;
      exception.attr("step_name") = error.detail().step_name;
      PyErr_SetObject(mauve_error_type().ptr(), exception.ptr());
    } catch (const py::error_already_set&) {
      throw;  // Python's own
    } catch (const py::builtin_exception&) {
      throw;  // pybind11 knows which of Python's it stands for
    } catch (const std::exception& error) {
      PyErr_SetObject(python_type_of(error).ptr(), py::cast(error.what()).ptr());
    }
  });
}

}  // namespace mauve::bindings
