// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/architecture.hpp"

#include <algorithm>

#include "mauve_rt/error.hpp"
#include "mauve_rt/futex.hpp"
#include "mauve_rt/plugin.hpp"

namespace mauve {

namespace {

template <typename Items>
std::vector<std::string> names_of(const Items& items) {
  std::vector<std::string> names;
  names.reserve(items.size());
  for (const auto& item : items) names.push_back(item->name());
  return names;
}

template <typename Item>
Item* find_in(const std::vector<std::unique_ptr<Item>>& items, const std::string& name) {
  for (const auto& item : items) {
    if (item->name() == name) return item.get();
  }
  return nullptr;
}

void require_new(bool known, const std::string& what, const std::string& name) {
  if (!known) return;
  throw Error(ErrorCode::duplicate_name, "the name is taken",
              {.element = what + " " + name, .remedy = "give each " + what + " a name of its own"});
}

}  // namespace

Architecture::~Architecture() {
  for (const auto& component : components_) component->task().end_thread(kForever);
  cleanup();
}

PluginRegistry& Architecture::require_registry() const {
  if (registry_ != nullptr) return *registry_;
  throw Error(ErrorCode::invalid_argument, "the architecture has no plug-in registry",
              {.remedy = "give one to its constructor, or add parts by type"});
}

Component& Architecture::add_component(const std::string& name, std::unique_ptr<Shell> shell,
                                       std::unique_ptr<CoreBase> core, std::unique_ptr<FsmBase> fsm,
                                       const TaskSettings& settings) {
  require_new(find_in(components_, name) != nullptr, "component", name);
  auto component =
      std::make_unique<Component>(name, static_cast<std::uint16_t>(components_.size()), changes_);
  component->set_settings(settings);
  component->set_parts(std::move(shell), std::move(core), std::move(fsm));
  components_.push_back(std::move(component));
  return *components_.back();
}

Component& Architecture::add_component(const std::string& name, const std::string& shell,
                                       const std::string& core, const std::string& fsm,
                                       const TaskSettings& settings) {
  const PluginRegistry& registry = require_registry();
  return add_component(name, registry.make_shell(shell), registry.make_core(core), registry.make_fsm(fsm),
                       settings);
}

void Architecture::add_resource(const std::string& name, std::unique_ptr<Resource> resource) {
  require_new(find_in(resources_, name) != nullptr, "resource", name);
  resource->set_name(name);
  resources_.push_back(std::move(resource));
}

void Architecture::connect(Component& component, const std::string& port_name, Resource& resource,
                           const std::string& service_name) {
  PortBase* port = component.shell().find_port(port_name);
  if (port == nullptr) {
    throw Error(ErrorCode::unknown_port, "the shell has no such port",
                {.component = component.name(),
                 .element = "port " + port_name,
                 .expected = "one of " + join(names_of(component.shell().ports())),
                 .found = port_name});
  }
  if (port->is_connected()) {
    throw Error(ErrorCode::duplicate_name, "the port is connected already",
                {.component = component.name(),
                 .element = "port " + port_name,
                 .found = "a connection to " + port->resource_name() + "." + port->service()->name(),
                 .remedy = "connect each port once"});
  }
  ServiceBase* service = resource.find_service(service_name);
  if (service == nullptr) {
    std::vector<std::string> known;
    for (const ServiceBase* offered : resource.services()) known.push_back(offered->name());
    throw Error(ErrorCode::unknown_service, "the resource has no such service",
                {.component = component.name(),
                 .element = "connection of " + port_name + " to " + resource.name(),
                 .expected = "one of " + join(known),
                 .found = service_name});
  }
  try {
    port->connect(*service, resource.name());
  } catch (const Error& failure) {
    ErrorDetail detail = failure.detail();
    detail.component = component.name();
    throw Error(failure.code(), failure.statement(), detail);
  }
}

void Architecture::connect(const std::string& component_name, const std::string& port,
                           const std::string& resource_name, const std::string& service) {
  connect(component(component_name), port, resource(resource_name), service);
}

void Architecture::publish(const std::string& name) {
  Resource& published = resource(name);
  if (!published.is_serializable()) {
    throw Error(
        ErrorCode::invalid_argument, "the resource cannot be bound to a topic",
        {.element = "resource " + name, .expected = "shared_data or ring_buffer", .found = published.kind()});
  }
  published.set_notifier(&publications_);
  published_.push_back({&published, 0});
}

Component& Architecture::component(const std::string& name) const {
  if (Component* found = find_in(components_, name)) return *found;
  throw Error(
      ErrorCode::unknown_component, "there is no such component",
      {.element = "component " + name, .expected = "one of " + join(names_of(components_)), .found = name});
}

Resource& Architecture::resource(const std::string& name) const {
  if (Resource* found = find_in(resources_, name)) return *found;
  throw Error(
      ErrorCode::unknown_resource, "there is no such resource",
      {.element = "resource " + name, .expected = "one of " + join(names_of(resources_)), .found = name});
}

std::unique_ptr<CoreBase> Architecture::make_core(const std::string& implementation) const {
  return require_registry().make_core(implementation);
}

bool Architecture::next_published(std::string& resource, std::vector<std::byte>& message,
                                  time_ns_t& time_ns) {
  for (Published& published : published_) {
    if (!published.resource->next_sample(message, time_ns, published.seen)) continue;
    resource = published.resource->name();
    return true;
  }
  return false;
}

bool Architecture::configure_hook() {
  try {
    for (const auto& resource : resources_) resource->configure();
    for (const auto& component : components_) component->configure();
  } catch (...) {
    cleanup_hook();
    throw;
  }
  return true;
}

void Architecture::check_cleanup() const {
  for (const auto& component : components_) {
    if (component->task().is_parked()) continue;
    throw Error(ErrorCode::already_running, "the component still executes a state",
                {.component = component->name(),
                 .element = "state " + component->task().current_state(),
                 .expected = "a parked component",
                 .found = std::string(to_string(component->task().state())),
                 .remedy = "stop it, and wait for the state's end"});
  }
}

void Architecture::cleanup_hook() {
  for (auto component = components_.rbegin(); component != components_.rend(); ++component)
    (*component)->cleanup();
  for (auto resource = resources_.rbegin(); resource != resources_.rend(); ++resource) (*resource)->cleanup();
}

}  // namespace mauve
