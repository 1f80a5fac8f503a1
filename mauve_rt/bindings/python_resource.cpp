// SPDX-License-Identifier: LGPL-3.0-or-later
#include "python_resource.hpp"

#include "log.hpp"

namespace mauve::bindings {

namespace {

class PythonResource final : public Resource {
 public:
  PythonResource(const PartFactory& factory, const ResourceParameters& parameters)
      : Resource(factory.name, "") {
    in_python([&] {
      object_.set(factory.make->get()());
      link_->resource_log = &log_source();
      py::setattr(object_.get(), "_log", py::cast(PyLog(link_)));
      for (const auto& [name, value] : parameters) py::setattr(object_.get(), name.c_str(), to_python(value));
      for (const auto& item : object_.get().attr("_services")()) {
        const auto service = item.cast<py::tuple>();
        const auto name = service[0].cast<std::string>();
        const auto type = service[1].cast<std::string>();
        services_.push_back(std::make_unique<PythonService>(name, type, object_.get().attr(name.c_str())));
        offer(*services_.back());
      }
    });
  }
  ~PythonResource() override {
    const InterpreterLocked lock;
    link_->resource_log = nullptr;
  }

 protected:
  bool configure_hook() override {
    return in_python([&] { return call_hook(object_.get(), "configure"); });
  }
  void cleanup_hook() override {
    in_python([&] { call_hook(object_.get(), "cleanup"); });
  }

 private:
  PythonObject object_;
  std::shared_ptr<ShellLink> link_{std::make_shared<ShellLink>()};
  std::vector<std::unique_ptr<PythonService>> services_;
};

}  // namespace

py::object PythonCallPort::call(const py::args& args, const py::kwargs& kwargs) const {
  if (is_previewed()) return stand_in<PythonCallPort>().call(args, kwargs);
  const PythonService* service = service_;  // another thread may change the connection while Python runs
  if (service == nullptr) {
    throw Error(ErrorCode::not_configured, "the call port is not connected",
                {.element = "port " + name(), .remedy = "connect it, or ask is_connected first"});
  }
  const py::object method = service->method();
  const ServiceSpan span(trace_id());
  return method(*args, **kwargs);
}

std::unique_ptr<Resource> make_python_resource(const PartFactory& factory,
                                               const ResourceParameters& parameters) {
  return std::make_unique<PythonResource>(factory, parameters);
}

}  // namespace mauve::bindings
