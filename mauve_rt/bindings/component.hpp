// SPDX-License-Identifier: LGPL-3.0-or-later
// A component of an architecture, as Python holds it.
#pragma once

#include "translate.hpp"

namespace mauve::bindings {

/// By name: it keeps the architecture, and is refused (unknown_component) once the component is removed.
class PyComponent {
 public:
  PyComponent(py::object architecture, std::string name)
      : architecture_(std::move(architecture)),
        held_(architecture_.cast<PyArchitecture*>()),
        name_(std::move(name)) {}

  const std::string& name() const noexcept { return name_; }
  PyArchitecture& architecture() const noexcept { return *held_; }
  std::recursive_mutex& describing() const noexcept { return held_->describing; }
  Component& get() const { return architecture().architecture.component(name_); }

 private:
  py::object architecture_;  // keeps it
  PyArchitecture* held_;
  std::string name_;
};

void bind_component(py::module_& module);

}  // namespace mauve::bindings
