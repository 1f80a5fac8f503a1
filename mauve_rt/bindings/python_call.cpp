// SPDX-License-Identifier: LGPL-3.0-or-later
#include "python_call.hpp"

namespace mauve::bindings {

void rethrow(const py::error_already_set& error) {
  if (error.matches(mauve_error_type()) && py::hasattr(error.value(), "statement")) {
    const py::object& value = error.value();
    const auto text = [&value](const char* name) {
      const py::object held = py::getattr(value, name, py::str());
      return py::isinstance<py::str>(held) ? held.cast<std::string>() : std::string();
    };
    throw Error(error_code_of(text("code")), text("statement"),
                {.component = text("component"),
                 .element = text("element"),
                 .expected = text("expected"),
                 .found = text("found"),
                 .remedy = text("remedy")});
  }
  rethrow_as_fault(error);
}

void rethrow_as_fault(const py::error_already_set& error) {
  throw std::runtime_error(error.what());  // type, message and traceback
}

bool call_hook(const py::object& object, const char* name) {
  if (!py::hasattr(object, name)) return true;
  const py::object answer = object.attr(name)();
  return answer.is_none() || answer.cast<bool>();
}

py::bytes to_bytes(const std::vector<std::byte>& message) {
  return {reinterpret_cast<const char*>(message.data()), message.size()};
}

}  // namespace mauve::bindings
