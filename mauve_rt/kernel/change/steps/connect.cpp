// SPDX-License-Identifier: LGPL-3.0-or-later
// A port's connection to a service of a resource; its value is "resource.service".
#include "change/steps/step_kind.hpp"
#include "parts/lookup.hpp"

namespace mauve {

namespace {

void connect_port(Draft& draft, DraftComponent& component, const std::string& port_name,
                  const std::string& resource_name, const std::string& service_name) {
  const PortBase& port = find_port(component.shell(), port_name, component.name());
  if (const auto wired = component.wires.find(port_name); wired != component.wires.end()) {
    throw Error(ErrorCode::duplicate_name, "the port is connected already",
                {.component = component.name(),
                 .element = "port " + port_name,
                 .found = "a connection to " + wired->second.resource + "." + wired->second.service->name(),
                 .remedy = "disconnect it in a step before"});
  }
  ServiceBase& service =
      find_service(draft.resource(resource_name), service_name, component.name(), port_name);
  try {
    port.check(service);
  } catch (const Error& failure) {
    rethrow_as_of(failure, component.name(), draft.step());
  }
  component.wires.emplace(port_name, Wire{.resource = resource_name,
                                          .service = &service,
                                          .step = draft.step(),
                                          .use = draft.resource(resource_name).use(),
                                          .frames = port.frames()});
}

}  // namespace

constexpr StepKind steps::connect{
    .name = "connect",
    .element = "port",
    .is_structural = true,
    .words = element_words,
    .draft = [](Draft& draft, TransactionStep& step) {
      const auto& value = plain_value_of<std::string>(step);
      const std::size_t dot = value.find('.');
      const std::string service = dot != std::string::npos ? value.substr(dot + 1) : "";
      connect_port(draft, draft.change(step.target), step.name, value.substr(0, dot), service);
    }};

}  // namespace mauve
