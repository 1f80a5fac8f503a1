// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/architecture.hpp"

#include <algorithm>

#include "mauve_rt/error.hpp"
#include "mauve_rt/futex.hpp"
#include "mauve_rt/plugin.hpp"

#include "lookup.hpp"
#include "prefault.hpp"

namespace mauve {

namespace {

template <typename Item>
std::shared_ptr<Item> find_in(const std::vector<std::shared_ptr<Item>>& items, const std::string& name) {
  for (const auto& item : items) {
    if (item->name() == name) return item;
  }
  return nullptr;
}

void require_new(bool known, const std::string& what, const std::string& name) {
  if (!known) return;
  throw Error(ErrorCode::duplicate_name, "the name is taken",
              {.element = what + " " + name, .remedy = "give each " + what + " a name of its own"});
}

}  // namespace

Architecture::Architecture(PluginRegistry* registry) : registry_(registry) {
  note_allocated_before();  // whatever comes after may be what its components own
}

Architecture::~Architecture() {
  for (const auto& component : components_) {
    component->task().end_thread(kForever);
    component->task().changes().set_listener(nullptr);
  }
  cleanup();
}

PluginRegistry& Architecture::require_registry() const {
  if (registry_ != nullptr) return *registry_;
  throw Error(ErrorCode::invalid_argument, "the architecture has no plug-in registry",
              {.remedy = "give one to its constructor, or add parts by type"});
}

Component& Architecture::add_component(const std::string& name, std::unique_ptr<Shell> shell,
                                       std::unique_ptr<CoreBase> core, std::unique_ptr<FsmBase> fsm,
                                       const TaskSettings& settings, Component::FsmFactory make_fsm) {
  require_new(find_in(components(), name) != nullptr, "component", name);
  const std::size_t numbers_before = numbers();
  std::shared_ptr<Component> component = make_unlisted(name);
  try {
    component->set_settings(settings);
  } catch (const Error&) {
    give_back_numbers(numbers_before);
    throw;
  }
  component->set_parts({.shell = std::move(shell), .core = std::move(core), .fsm = std::move(fsm)},
                       std::move(make_fsm));
  change_lists({.added_components = {component}});
  return *component;
}

Component& Architecture::add_component(const std::string& name, const std::string& shell,
                                       const std::string& core, const std::string& fsm,
                                       const TaskSettings& settings) {
  const PluginRegistry& registry = require_registry();
  return add_component(name, registry.make_shell(shell), registry.make_core(core), registry.make_fsm(fsm),
                       settings, [&registry, fsm] { return registry.make_fsm(fsm); });
}

void Architecture::add_resource(const std::string& name, std::unique_ptr<Resource> resource) {
  require_new(find_in(resources(), name) != nullptr, "resource", name);
  resource->set_name(name);
  prepare_outward(*resource, TopicBinding::none);
  change_lists({.added_resources = {std::move(resource)}});
}

void Architecture::connect(Component& component, const std::string& port_name, Resource& resource,
                           const std::string& service_name) {
  PortBase& port = find_port(component.shell(), port_name, component.name());
  if (port.is_connected()) {
    throw Error(ErrorCode::duplicate_name, "the port is connected already",
                {.component = component.name(),
                 .element = "port " + port_name,
                 .found = "a connection to " + port.resource_name() + "." + port.service()->name(),
                 .remedy = "connect each port once"});
  }
  ServiceBase& service = find_service(resource, service_name, component.name(), port_name);
  try {
    port.connect(service, resource.name());
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
  prepare_outward(resource(name), TopicBinding::publish);
}

void Architecture::prepare_outward(Resource& resource, TopicBinding topic) {
  if (topic != TopicBinding::none && !resource.is_serializable()) {
    throw Error(ErrorCode::invalid_argument, "the resource cannot be bound to a topic",
                {.element = "resource " + resource.name(),
                 .expected = "shared_data, ring_buffer, latest_value or event",
                 .found = resource.kind()});
  }
  if (topic == TopicBinding::subscribe) resource.bind_input();
  if (topic == TopicBinding::publish || resource.client() != nullptr) resource.set_notifier(&publications_);
}

std::vector<std::shared_ptr<Component>> Architecture::components() const {
  const std::lock_guard lock(list_mutex_);
  return components_;
}

std::vector<std::shared_ptr<Resource>> Architecture::resources() const {
  const std::lock_guard lock(list_mutex_);
  return resources_;
}

std::shared_ptr<Component> Architecture::hold_component(const std::string& name) const {
  const auto present = components();
  if (auto found = find_in(present, name)) return found;
  throw_no_component(name, present);
}

std::shared_ptr<Resource> Architecture::hold_resource(const std::string& name) const {
  const auto present = resources();
  if (auto found = find_in(present, name)) return found;
  throw_no_resource(name, present);
}

Component& Architecture::component(const std::string& name) const { return *hold_component(name); }
Resource& Architecture::resource(const std::string& name) const { return *hold_resource(name); }

std::unique_ptr<CoreBase> Architecture::make_core(const std::string& implementation) const {
  return require_registry().make_core(implementation);
}

bool Architecture::next_published(std::string& resource, std::vector<std::byte>& message,
                                  time_ns_t& time_ns) {
  for (const auto& published : resources()) {
    if (!published->next_published(message, time_ns)) continue;
    resource = published->name();
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
  for (const auto& component : components()) {
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
