// SPDX-License-Identifier: LGPL-3.0-or-later
// Plug-ins: shells, cores, fsms, resources and data types by name, from libraries opened at run time.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "mauve_rt/architecture/given_resources.hpp"
#include "mauve_rt/data/port.hpp"
#include "mauve_rt/run/component.hpp"

namespace mauve {

/// What the process knows how to make. Filled by libraries, asked by architectures. One thread at a
/// time. All functions [non-rt].
class PluginRegistry {
 public:
  using CoreFactory = std::function<std::unique_ptr<CoreBase>()>;
  using ResourceFactory = std::function<std::unique_ptr<Resource>(const ResourceParameters&)>;

  /// Knows the given kinds of resources; of those that need a type none can be made yet.
  PluginRegistry();

  /// Opens a library (RTLD_NOW | RTLD_LOCAL) and registers what it has; it is never closed. A second call
  /// does nothing. Throws Error (plugin) with the loader's words.
  void load_library(const std::string& path);

  template <typename ShellType>
  void shell(const std::string& name) {
    add_shell(name, [] { return std::make_unique<ShellType>(); });
  }
  /// `shell_name`: the shell it was written for.
  template <typename CoreType>
  void core(const std::string& name, const std::string& shell_name) {
    add_core(name, shell_name, [] { return std::make_unique<CoreType>(); });
  }
  template <typename FsmType>
  void fsm(const std::string& name, const std::string& shell_name) {
    add_fsm(name, shell_name, [] { return std::make_unique<FsmType>(); });
  }
  /// A resource of the plug-in's own; `name` is its kind in architecture files. It is made of its parameters, where
  /// a static parameters() says which they are.
  template <typename ResourceType>
  void resource(const std::string& name) {
    if constexpr (requires { ResourceType::parameters(); }) {
      add_resource({.name = name, .parameters = ResourceType::parameters()},
                   [](const ResourceParameters& given) { return std::make_unique<ResourceType>(given); });
    } else {
      add_resource({.name = name},
                   [](const ResourceParameters&) { return std::make_unique<ResourceType>(); });
    }
  }
  /// A data type: makes ports possible, and the given kinds of resources that can be of it.
  template <Described T>
  void type() {
    // Ports of the C++ type that the resources are of, whoever else registers the name later.
    if (add_given<T>(type_name<T>())) ports_.insert_or_assign(type_name<T>(), data_ports<T>());
  }

  /// The type of a ROS service: makes clients of it possible. Ports and offered calls need no registration.
  template <DescribedCall S>
  void call_type() {
    add_given<S>(std::string(CallTraits<S>::name));
  }

  // The same with a factory, for parts that are no C++ class of their own.

  void add_shell(const std::string& name, std::function<std::unique_ptr<Shell>()> factory);
  void add_core(const std::string& name, const std::string& shell_name, CoreFactory factory);
  void add_fsm(const std::string& name, const std::string& shell_name,
               std::function<std::unique_ptr<FsmBase>()> factory);
  /// A kind without types.
  void add_resource(ResourceKind kind, ResourceFactory factory);

  std::unique_ptr<Shell> make_shell(const std::string& name) const;
  std::unique_ptr<CoreBase> make_core(const std::string& name) const;
  std::unique_ptr<FsmBase> make_fsm(const std::string& name) const;
  /// Throws Error: unknown_resource (kind), unknown_type, type_mismatch (latest_value of a type that cannot be
  /// copied as bytes), invalid_argument (an event of a type that cannot say it); of its parameters as
  /// checked_parameters().
  std::unique_ptr<Resource> make_resource(const std::string& kind, const std::string& type,
                                          const ResourceParameters& given) const;
  /// The given kinds, in their order. [non-rt]
  static std::vector<ResourceKind> given_resource_kinds();
  /// Throws Error: unknown_resource.
  const ResourceKind& resource_kind(const std::string& name) const;
  /// All parameters of a kind: as given, else as they are unless told.
  /// Throws Error: unknown_resource, invalid_argument (one is missing, or the kind has none such), type_mismatch,
  /// out_of_range.
  ResourceParameters checked_parameters(const std::string& kind, const ResourceParameters& given) const;

  /// A read or write port of a registered type, or an event port (`type` is empty).
  /// Throws Error: unknown_type, invalid_argument (a call port, whose signature only C++ knows).
  std::unique_ptr<PortBase> make_port(PortKind kind, const std::string& type, const std::string& name,
                                      const OutputOptions& output = {}) const;

  const std::string& core_shell(const std::string& name) const;
  const std::string& fsm_shell(const std::string& name) const;
  /// What a value of a registered data type takes, in bytes; 0 when it is none.
  std::size_t value_bytes(const std::string& type) const;
  /// Registered names of "shell", "core", "fsm", "resource", "type" or "call_type", sorted. Throws Error
  /// (invalid_argument).
  std::vector<std::string> names(const std::string& kind) const;

 private:
  template <typename Product>
  struct Entry {
    std::string shell;
    std::function<std::unique_ptr<Product>()> make;
  };
  struct PortFactories {
    std::unique_ptr<PortBase> (*read)(const std::string& name);
    std::unique_ptr<PortBase> (*write)(const std::string& name, const OutputOptions& output);
    std::size_t value_bytes;
  };
  template <Described T>
  static PortFactories data_ports() {
    return {[](const std::string& name) -> std::unique_ptr<PortBase> {
              return std::make_unique<ReadPort<T>>(name);
            },
            [](const std::string& name, const OutputOptions& output) -> std::unique_ptr<PortBase> {
              return std::make_unique<WritePort<T>>(name, output);
            },
            sizeof(T)};
  }

  struct KindEntry {
    ResourceKind kind;
    std::map<std::string, ResourceFactory> factories;  // by type
  };

  /// Every given kind that can be of the type, of data or of calls; false: it was registered before.
  template <typename Type>
  bool add_given(const std::string& type) {
    return std::apply([&](auto... kinds) { return ((add_given<Type>(kinds, type) ? 1U : 0U) | ...) != 0U; },
                      GivenResources{});
  }
  template <typename Type, typename Given>
  bool add_given(Given, const std::string& type) {
    if constexpr (requires(ResourceParameters given) { Given::template make<Type>(given); }) {
      auto& factories = resources_.at(Given::describe().name).factories;
      return factories.emplace(type, Given::template make<Type>).second;
    }
    return false;
  }
  [[noreturn]] void throw_unknown_type(const std::string& type) const;
  [[noreturn]] void throw_not_of_type(const ResourceKind& kind, const std::string& type) const;

  std::set<std::string> libraries_;
  std::map<std::string, Entry<Shell>> shells_;
  std::map<std::string, Entry<CoreBase>> cores_;
  std::map<std::string, Entry<FsmBase>> fsms_;
  std::map<std::string, KindEntry> resources_;  // by kind
  std::map<std::string, PortFactories> ports_;  // by type
};

}  // namespace mauve

/// Opens the registration function of a plug-in library, once a library:
///   MAUVE_PLUGINS(registry) { registry.core<MyCore>("my_package/MyCore", "my_package/MyShell"); }
// NOLINTBEGIN(bugprone-macro-parentheses): a parameter's name cannot stand in parentheses
#define MAUVE_PLUGINS(registry)                                                  \
  extern "C" __attribute__((visibility("default"))) void mauve_register_plugins( \
      mauve::PluginRegistry& registry)
// NOLINTEND(bugprone-macro-parentheses)
