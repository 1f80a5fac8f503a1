// SPDX-License-Identifier: LGPL-3.0-or-later
#include "draft.hpp"

#include <algorithm>

#include "lookup.hpp"

namespace mauve {

namespace {

DraftComponent present(std::shared_ptr<Component> component) {
  DraftComponent draft;
  draft.state = settled(component->task().state());
  draft.ran = draft.runs = draft.state == ComponentState::running;
  for (const auto& port : component->shell().ports()) {
    if (!port->is_connected()) continue;
    draft.wires.emplace(port->name(),
                        Wire{.resource = port->resource_name(), .service = port->service(), .step = 0});
  }
  draft.wires_before = draft.wires;
  draft.component = std::move(component);
  return draft;
}

bool leads_to(const Wire& wire, const Resource& resource) {
  const auto& services = resource.services();
  return std::find(services.begin(), services.end(), wire.service) != services.end();
}

[[noreturn]] void throw_taken(const std::string& what, const std::string& name) {
  throw Error(ErrorCode::duplicate_name, "the name is taken",
              {.element = what + " " + name, .remedy = "give each " + what + " a name of its own"});
}

}  // namespace

Draft::Draft(Architecture& architecture, bool deployed) : architecture_(architecture), deployed_(deployed) {
  for (auto& component : architecture.components()) components_.push_back(present(component));
  for (auto& resource : architecture.resources()) resources_.push_back({.resource = resource});
}

DraftComponent& Draft::touch(const std::string& name) {
  for (DraftComponent& component : components_) {
    if (component.name() != name) continue;
    if (component.state == ComponentState::stopping) {
      component.component->task().throw_state_running("the component is STOPPING", 0,
                                                      "try again when it has stopped");
    }
    if (component.first_step == 0) component.first_step = step_;
    return component;
  }
  throw_no_component(name, components_);
}

DraftComponent& Draft::change(const std::string& name) {
  DraftComponent& component = touch(name);
  if (component.is_added) return component;  // whoever adds it decides on all of it
  if (component.component->is_configured()) component.component->check_reconfigurable();
  if (component.state == ComponentState::faulted) {
    throw Error(ErrorCode::faulted, "the component is FAULTED: " + component.component->task().fault().what,
                {.component = name, .remedy = "clean it up and configure it first, or remove it"});
  }
  return component;
}

Resource& Draft::resource(const std::string& name) {
  for (const DraftResource& each : resources_) {
    if (each.name() == name) return *each.resource;
  }
  throw_no_resource(name, resources_);
}

DraftComponent& Draft::add_component(const std::string& name, const TaskSettings& settings) {
  const auto names = names_of(components_);
  if (std::find(names.begin(), names.end(), name) != names.end()) throw_taken("component", name);
  DraftComponent added;
  added.component = architecture_.make_unlisted(name);
  added.component->set_settings(settings);
  added.is_added = true;
  added.state = ComponentState::stopped;
  added.first_step = step_;
  components_.push_back(std::move(added));
  return components_.back();
}

void Draft::remove_component(const std::string& name) {
  DraftComponent& component = touch(name);
  if (!component.is_added && component.component->is_configured())
    component.component->check_reconfigurable();
  const auto place = std::find_if(components_.begin(), components_.end(),
                                  [&](const DraftComponent& each) { return &each == &component; });
  if (component.is_added) {
    components_.erase(place);
  } else {
    removed_components_.splice(removed_components_.end(), components_, place);
  }
}

void Draft::add_resource(const std::string& name, std::shared_ptr<Resource> resource, TopicBinding topic) {
  const auto names = names_of(resources_);
  if (std::find(names.begin(), names.end(), name) != names.end()) throw_taken("resource", name);
  resource->set_name(name);
  architecture_.prepare_outward(*resource, topic);
  resources_.push_back({.resource = std::move(resource), .added_step = step_});
}

void Draft::remove_resource(const std::string& name) {
  const Resource& removed = resource(name);
  std::vector<std::string> ports;
  for (const DraftComponent& component : components_) {
    for (const auto& [port, wire] : component.wires) {
      if (leads_to(wire, removed)) ports.push_back(component.name() + "." + port);
    }
  }
  if (!ports.empty()) {
    throw Error(ErrorCode::invalid_argument, "the resource is still connected",
                {.element = "resource " + name,
                 .expected = "no port",
                 .found = join(ports),
                 .remedy = "disconnect these in a step before"});
  }
  const auto place = std::find_if(resources_.begin(), resources_.end(),
                                  [&](const DraftResource& each) { return each.resource.get() == &removed; });
  if (place->added_step == 0) removed_resources_.push_back(place->resource);
  resources_.erase(place);
}

void Draft::connect(DraftComponent& component, const std::string& port_name, const std::string& resource_name,
                    const std::string& service_name) {
  const PortBase& port = find_port(component.shell(), port_name, component.name());
  if (const auto wired = component.wires.find(port_name); wired != component.wires.end()) {
    throw Error(ErrorCode::duplicate_name, "the port is connected already",
                {.component = component.name(),
                 .element = "port " + port_name,
                 .found = "a connection to " + wired->second.resource + "." + wired->second.service->name(),
                 .remedy = "disconnect it in a step before"});
  }
  ServiceBase& service = find_service(resource(resource_name), service_name, component.name(), port_name);
  try {
    port.check(service);
  } catch (const Error& failure) {
    rethrow_as_of(failure, component.name(), step_);
  }
  component.wires.emplace(port_name, Wire{.resource = resource_name, .service = &service, .step = step_});
}

void Draft::disconnect(DraftComponent& component, const std::string& port) {
  if (component.wires.erase(port) != 0) {
    component.disconnected.insert_or_assign(port, step_);
    return;
  }
  find_port(component.shell(), port, component.name());
  throw Error(ErrorCode::invalid_argument, "the port is not connected",
              {.component = component.name(), .element = "port " + port, .remedy = "leave the step out"});
}

void Draft::set_property(DraftComponent& component, const std::string& name, const PropertyValue& value) {
  const PropertyBase& property = find_property(component.shell(), name, component.name());
  try {
    component.properties.insert_or_assign(name,
                                          DraftProperty{.value = property.checked(value), .step = step_});
  } catch (const Error& failure) {
    rethrow_as_of(failure, component.name(), step_);
  }
}

}  // namespace mauve
