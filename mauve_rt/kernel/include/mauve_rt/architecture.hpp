// SPDX-License-Identifier: LGPL-3.0-or-later
// Architecture: components and resources, connected.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "mauve_rt/component.hpp"
#include "mauve_rt/resource.hpp"

namespace mauve {

class PluginRegistry;

/// Components and resources by name. Ordinary threads; one at a time.
class Architecture final : public Configurable {
 public:
  /// With a registry, parts can be named as well as given by type.
  explicit Architecture(PluginRegistry* registry = nullptr) : registry_(registry) {}
  ~Architecture() override;

  std::string description() const override { return "architecture"; }

  /// Adds a component made of the given types. [setup] Throws Error: duplicate_name, out_of_range (settings).
  template <typename ShellType, typename CoreType, typename FsmType>
  Component& add_component(const std::string& name, const TaskSettings& settings = {}) {
    return add_component(name, std::make_unique<ShellType>(), std::make_unique<CoreType>(),
                         std::make_unique<FsmType>(), settings);
  }
  Component& add_component(const std::string& name, std::unique_ptr<Shell> shell,
                           std::unique_ptr<CoreBase> core, std::unique_ptr<FsmBase> fsm,
                           const TaskSettings& settings);
  /// Adds a component of registered parts. [setup] Throws Error: unknown_shell, unknown_core, unknown_fsm
  /// besides.
  Component& add_component(const std::string& name, const std::string& shell, const std::string& core,
                           const std::string& fsm, const TaskSettings& settings);

  /// Adds a resource of a given type: add_resource<SharedData<Point>>("goal"). [setup]
  template <typename ResourceType, typename... Args>
  ResourceType& add_resource(const std::string& name, Args&&... args) {
    auto resource = std::make_unique<ResourceType>(std::forward<Args>(args)...);
    ResourceType& added = *resource;
    add_resource(name, std::unique_ptr<Resource>(std::move(resource)));
    return added;
  }
  void add_resource(const std::string& name, std::unique_ptr<Resource> resource);

  /// Connects a port to a service. [setup] Throws Error: unknown_port, unknown_service, type_mismatch,
  /// duplicate_name.
  void connect(Component& component, const std::string& port, Resource& resource, const std::string& service);
  void connect(const std::string& component, const std::string& port, const std::string& resource,
               const std::string& service);

  /// Marks a resource as bound to an outgoing topic. [setup]
  void publish(const std::string& resource);

  Component& component(const std::string& name) const;  // Throws Error: unknown_component
  Resource& resource(const std::string& name) const;    // Throws Error: unknown_resource
  const std::vector<std::unique_ptr<Component>>& components() const noexcept { return components_; }
  const std::vector<std::unique_ptr<Resource>>& resources() const noexcept { return resources_; }

  /// A new, unconfigured core of a registered implementation. Throws Error: unknown_core.
  std::unique_ptr<CoreBase> make_core(const std::string& implementation) const;

  ChangeSignal& changes() noexcept { return changes_; }

  /// The next sample of the published resources not handed out yet; false when there is none. [non-rt], one
  /// thread.
  bool next_published(std::string& resource, std::vector<std::byte>& message, time_ns_t& time_ns);
  Notifier& publications() noexcept { return publications_; }

 private:
  struct Published {
    Resource* resource;
    std::uint64_t seen;
  };

  bool configure_hook() override;
  void check_cleanup() const override;
  void cleanup_hook() override;
  PluginRegistry& require_registry() const;

  PluginRegistry* registry_;
  ChangeSignal changes_;
  Notifier publications_;
  std::vector<Published> published_;
  std::vector<std::unique_ptr<Resource>> resources_;
  std::vector<std::unique_ptr<Component>>
      components_;  // after the resources: ports go before what they connect to
};

}  // namespace mauve
