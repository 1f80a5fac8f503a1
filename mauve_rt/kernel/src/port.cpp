// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/port.hpp"

#include "mauve_rt/error.hpp"

namespace mauve {

std::string_view to_string(PortKind kind) noexcept {
  switch (kind) {
    case PortKind::read:
      return "read";
    case PortKind::write:
      return "write";
    case PortKind::call:
      return "call";
    case PortKind::event:
      return "event";
  }
  return "unknown";
}

void PortBase::connect(ServiceBase& service, const std::string& resource_name) {
  if (service.kind() != kind_ || service.type() != type_) {
    const auto shown = [](PortKind kind, const std::string& type) {
      return std::string(to_string(kind)) + (type.empty() ? "" : " of " + type);
    };
    throw Error(
        ErrorCode::type_mismatch, "the port does not fit the service",
        {.element = "port " + name_,
         .expected = shown(kind_, type_),
         .found = shown(service.kind(), service.type()) + " at " + resource_name + "." + service.name(),
         .remedy = "connect it to a service of equal kind and type"});
  }
  base_ = &service;
  resource_name_ = resource_name;
  attach(&service);
}

void PortBase::disconnect() noexcept {
  base_ = nullptr;
  resource_name_.clear();
  attach(nullptr);
}

}  // namespace mauve
