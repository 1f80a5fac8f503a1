// SPDX-License-Identifier: LGPL-3.0-or-later
// Log lines of parts written in Python, and of an architecture.
#pragma once

#include "python_call.hpp"

namespace mauve::bindings {

/// What log() of a part in Python returns.
class PyLog {
 public:
  explicit PyLog(std::shared_ptr<ShellLink> link) : link_(std::move(link)) {}

  /// Under the interpreter's lock.
  void write(LogLevel level, const py::str& format, const py::args& arguments) const;
  bool is_on(LogLevel level) const { return Log(link_->log()).is_on(level); }

 private:
  std::shared_ptr<ShellLink> link_;
};

void bind_log(py::module_& module);
/// take_log() and the levels, for the class of architectures.
void add_log_methods(py::class_<PyArchitecture>& architecture);

}  // namespace mauve::bindings
