// SPDX-License-Identifier: LGPL-3.0-or-later
// Resources written in Python: their call services, and the ports of Python shells that call them.
#pragma once

#include "python_call.hpp"

namespace mauve::bindings {

inline constexpr std::string_view kPythonRepresentation = "Python";

/// A method of a resource in Python.
class PythonService final : public ServiceBase {
 public:
  PythonService(std::string name, std::string type, py::object method)
      : ServiceBase(std::move(name), PortKind::call, std::move(type)), method_(std::move(method)) {}

  std::string_view representation() const noexcept override { return kPythonRepresentation; }
  /// Under the interpreter's lock.
  const py::object& method() const noexcept { return method_.get(); }

 private:
  PythonObject method_;
};

/// Calls a PythonService; its lock is the interpreter's, which the caller holds.
class PythonCallPort final : public PortBase {
 public:
  PythonCallPort(std::string name, std::string type)
      : PortBase(std::move(name), PortKind::call, std::move(type)) {}

  std::string_view representation() const noexcept override { return kPythonRepresentation; }
  py::object call(const py::args& args, const py::kwargs& kwargs) const;

 protected:
  bool fits(const ServiceBase& service) const noexcept override {
    return dynamic_cast<const PythonService*>(&service) != nullptr;
  }
  void attach(ServiceBase* service, BiasedMutex::Seat* /*seat*/) noexcept override {
    service_ = static_cast<PythonService*>(service);
  }
  std::unique_ptr<PortBase> make_stand_in() const override {
    return std::make_unique<PythonCallPort>(name(), type());
  }

 private:
  const PythonService* service_{nullptr};
};

}  // namespace mauve::bindings
