// SPDX-License-Identifier: LGPL-3.0-or-later
// Plug-ins: shells, cores, fsms, resources and data types by name, from libraries opened at run time.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "mauve_rt/architecture/given_resources.hpp"
#include "mauve_rt/base/seam/atomic.hpp"
#include "mauve_rt/base/seam/mutex.hpp"
#include "mauve_rt/data/message_shape.hpp"
#include "mauve_rt/data/port.hpp"
#include "mauve_rt/parts/core.hpp"
#include "mauve_rt/parts/fsm.hpp"
#include "mauve_rt/parts/property.hpp"
#include "mauve_rt/run/component.hpp"

namespace mauve {

/// By which a library was compiled: what it and the kernel have to agree on.
struct PluginAbi {
  std::array<char, 32> version{};  // of MAUVE RT; empty: compiled without its CMake target
  std::uint64_t layout{0};         // of the classes that a part derives from and uses
};

/// As the including code is compiled. [non-rt]
consteval PluginAbi plugin_abi() {
#ifdef MAUVE_RT_VERSION
  constexpr std::string_view version = MAUVE_RT_VERSION;
#else
  constexpr std::string_view version;
#endif
  PluginAbi abi;
  for (std::size_t i = 0; i + 1 < abi.version.size() && i < version.size(); ++i) abi.version[i] = version[i];
  for (const std::size_t size :
       {sizeof(Shell), sizeof(CoreBase), sizeof(FsmBase), sizeof(Resource), sizeof(PortBase), sizeof(State),
        sizeof(PropertyBase), sizeof(ServiceBase), sizeof(CoreBinding), sizeof(Component)}) {
    abi.layout = abi.layout * 1099511628211U + size;
  }
  return abi;
}

/// Facts about a core that its class does not say.
struct CoreOptions {
  CoreTimes wcet_ns{};  // worst-case execution times of its methods, enforced where enforce_wcet is set
};

/// Entries of a registry that others have taken the place of, and the names that there were not before. Keep it as long as
/// the registry: parts of the old code may still be in force.
class PluginGeneration;

/// What the process knows how to make. Filled by libraries, asked by architectures. All functions [non-rt], from any thread;
/// who loads and who exchanges: one at a time.
///
/// | member       | written by           | read by | under  |
/// | ------------ | -------------------- | ------- | ------ |
/// | version_     | who loads, exchanges | anyone  | its own |
/// | the others   | who loads, exchanges | anyone  | mutex_ |
class PluginRegistry {
 public:
  using CoreFactory = std::function<std::unique_ptr<CoreBase>()>;
  using ResourceFactory = std::function<std::unique_ptr<Resource>(const ResourceParameters&)>;

  /// Knows the given kinds of resources; of those that need a type none can be made yet.
  PluginRegistry();

  /// Opens a library (RTLD_NOW | RTLD_LOCAL) and registers what it has; it is never closed. A second call
  /// does nothing. Throws Error (plugin) with the loader's words.
  void load_library(const std::string& path);
  /// From now on what is added takes the place of entries of the same kind and name, which `replaced` keeps; until
  /// end_generation(). `number` is the generation() of what the new entries make. Types that are known stay as they are: their
  /// layouts must be equal.
  void begin_generation(int number, std::shared_ptr<PluginGeneration> replaced);
  void end_generation() noexcept;
  /// Within a generation: a shell, core, fsm or resource that the new code has no more.
  void drop(const std::string& kind, const std::string& name);
  /// Puts the kept entries back in force and keeps those that go out; a second time undoes that.
  void exchange(PluginGeneration& other);
  /// Grows with each generation and exchange: what was made before may be of other code. [rt]
  std::uint32_t version() const MAUVE_RT { return version_.load(std::memory_order_acquire); }
  /// Of the entry: 1, or that of begin_generation(); 0: there is none. `kind`: "shell", "core", "fsm" or "resource".
  int generation_of(const std::string& kind, const std::string& name) const;
  /// Of the entry's class and its bases, of an fsm those of the core that it runs: user_classes(). Empty: it was written in
  /// another language, or is of a class of MAUVE RT. `kind`: "shell", "core" or "fsm".
  std::vector<std::string> classes_of(const std::string& kind, const std::string& name) const;
  /// The structs of the registered data types, as this process holds them.
  std::vector<MessageShape> type_shapes() const;

  template <typename ShellType>
  void shell(const std::string& name) {
    add_shell(
        name,
        [] {
          auto shell = std::make_unique<ShellType>();
          shell->set_bytes(sizeof(ShellType));
          return shell;
        },
        user_classes(typeid(ShellType)));
  }
  /// `shell_name`: the shell it was written for. `options`: {.wcet_ns = {{"compute_path", mauve::ms_to_ns(5)}}}.
  /// Throws Error (out_of_range) as check_core_times().
  template <typename CoreType>
  void core(const std::string& name, const std::string& shell_name, CoreOptions options = {}) {
    add_core(
        name, shell_name, [] { return std::make_unique<CoreType>(); }, user_classes(typeid(CoreType)),
        std::move(options));
  }
  template <typename FsmType>
  void fsm(const std::string& name, const std::string& shell_name) {
    std::vector<std::string> classes;
    if constexpr (requires { typename FsmType::core_type; })
      classes = user_classes(typeid(typename FsmType::core_type));
    add_fsm(name, shell_name, [] { return std::make_unique<FsmType>(); }, std::move(classes));
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
    const LockGuard lock(mutex_);
    // Ports of the C++ type that the resources are of, whoever else registers the name later.
    if (add_given<T>(type_name<T>())) ports_.insert_or_assign(type_name<T>(), data_ports<T>());
  }

  /// The type of a ROS service: makes clients of it possible. Ports and offered calls need no registration.
  template <DescribedCall S>
  void call_type() {
    const LockGuard lock(mutex_);
    add_given<S>(std::string(CallTraits<S>::name));
  }

  /// The type of a ROS action: makes its servers and clients possible, and ports of its parts by name.
  template <DescribedAction A>
  void action_type() {
    type<typename A::Goal>();
    type<typename A::Result>();
    type<typename A::Feedback>();
    const LockGuard lock(mutex_);
    add_given<A>(std::string(ActionTraits<A>::name));
  }

  // The same with a factory, for parts that are no C++ class of their own. `classes`: as of classes_of().

  void add_shell(const std::string& name, std::function<std::unique_ptr<Shell>()> factory,
                 std::vector<std::string> classes = {});
  /// Throws Error (out_of_range) as check_core_times().
  void add_core(const std::string& name, const std::string& shell_name, CoreFactory factory,
                std::vector<std::string> classes = {}, CoreOptions options = {});
  void add_fsm(const std::string& name, const std::string& shell_name,
               std::function<std::unique_ptr<FsmBase>()> factory, std::vector<std::string> classes = {});
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
  ResourceKind resource_kind(const std::string& name) const;
  /// All parameters of a kind: as given, else as they are unless told.
  /// Throws Error: unknown_resource, invalid_argument (one is missing, or the kind has none such), type_mismatch,
  /// out_of_range.
  ResourceParameters checked_parameters(const std::string& kind, const ResourceParameters& given) const;

  /// A read or write port of a registered type, or an event port (`type` is empty).
  /// Throws Error: unknown_type, invalid_argument (a call port, whose signature only C++ knows).
  std::unique_ptr<PortBase> make_port(PortKind kind, const std::string& type, const std::string& name,
                                      const OutputOptions& output = {}) const;

  std::string core_shell(const std::string& name) const;
  std::string fsm_shell(const std::string& name) const;
  /// What a value of a registered data type takes, in bytes, with its sequences of these capacities; 0 when it is none.
  /// Throws Error as capacities_of().
  std::size_t value_bytes(const std::string& type, const ResourceParameters& given) const;
  /// The sequences of a registered data type, whose capacities its resources need: sequence_paths(). Empty when it is none.
  std::vector<std::string> sequences(const std::string& type) const;
  /// Registered names of "shell", "core", "fsm", "resource", "type", "call_type" or "action_type", sorted. Throws Error
  /// (invalid_argument).
  std::vector<std::string> names(const std::string& kind) const;

 private:
  friend class PluginGeneration;

  template <typename Product>
  struct Entry {
    std::string shell;
    std::function<std::unique_ptr<Product>()> make;
    std::vector<std::string> classes{};
    std::string library{};  // empty: none
    int generation{1};
    std::shared_ptr<const ClassBuilds> builds{};  // of the classes, as they were in force at its registration
    CoreOptions core{};                           // of a core
  };
  template <typename Product>
  using Entries = std::map<std::string, Entry<Product>>;
  struct PortFactories {
    std::unique_ptr<PortBase> (*read)(const std::string& name);
    std::unique_ptr<PortBase> (*write)(const std::string& name, const OutputOptions& output);
    MessageShape (*shape)();
  };
  template <Described T>
  static PortFactories data_ports() {
    return {[](const std::string& name) -> std::unique_ptr<PortBase> {
              return std::make_unique<ReadPort<T>>(name);
            },
            [](const std::string& name, const OutputOptions& output) -> std::unique_ptr<PortBase> {
              return std::make_unique<WritePort<T>>(name, output);
            },
            message_shape<T>};
  }

  struct KindEntry {
    ResourceKind kind;
    std::map<std::string, ResourceFactory> factories;  // by type
    int generation{1};
  };
  using Kinds = std::map<std::string, KindEntry>;

  /// A copy: others may be put in its place meanwhile. Throws Error.
  template <typename Made>
  Made entry_of(const std::map<std::string, Made>& entries, const std::string& name, ErrorCode code,
                const std::string& what) const;
  /// Registers it; within a generation in the place of the one there was.
  template <typename Made>
  void add(std::map<std::string, Made> PluginRegistry::* entries, const std::string& name,
           const std::string& shown, Made entry);

  /// Every given kind that can be of the type, of data, calls or actions; false: it was registered before.
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
  /// For which builds of their classes new cores and fsms were compiled: those in force, or of the same generation.
  void note_builds();
  [[noreturn]] void throw_unknown_type(const std::string& type) const;
  [[noreturn]] void throw_not_of_type(const ResourceKind& kind, const std::string& type) const
      MAUVE_REQUIRES(mutex_);

  mutable RecursiveMutex mutex_;  // a library registers its parts under it
  std::set<std::string> libraries_ MAUVE_GUARDED_BY(mutex_);
  std::string loading_ MAUVE_GUARDED_BY(mutex_);  // the library that registers its parts now
  Entries<Shell> shells_;
  Entries<CoreBase> cores_;
  Entries<FsmBase> fsms_;
  Kinds resources_;                                                      // by kind
  std::map<std::string, PortFactories> ports_ MAUVE_GUARDED_BY(mutex_);  // by type
  // acquire/release: who sees the new number finds the new entries
  Atomic<std::uint32_t> version_{0};
  int generation_{1};                           // of what is added
  std::shared_ptr<PluginGeneration> replaced_;  // while a generation is loaded
};

class PluginGeneration {
 private:
  friend class PluginRegistry;

  template <typename Made>
  using Kept = std::map<std::string, std::unique_ptr<Made>>;  // nullptr: there is none of the name

  Kept<PluginRegistry::Entry<Shell>>& of(PluginRegistry::Entries<Shell>& /*kind*/) { return shells_; }
  Kept<PluginRegistry::Entry<CoreBase>>& of(PluginRegistry::Entries<CoreBase>& /*kind*/) { return cores_; }
  Kept<PluginRegistry::Entry<FsmBase>>& of(PluginRegistry::Entries<FsmBase>& /*kind*/) { return fsms_; }
  Kept<PluginRegistry::KindEntry>& of(PluginRegistry::Kinds& /*kind*/) { return resources_; }

  Kept<PluginRegistry::Entry<Shell>> shells_;
  Kept<PluginRegistry::Entry<CoreBase>> cores_;
  Kept<PluginRegistry::Entry<FsmBase>> fsms_;
  Kept<PluginRegistry::KindEntry> resources_;
};

}  // namespace mauve

/// Opens the registration function of a plug-in library, once a library:
///   MAUVE_PLUGINS(registry) { registry.core<MyCore>("my_package/MyCore", "my_package/MyShell"); }
// NOLINTBEGIN(bugprone-macro-parentheses): a parameter's name cannot stand in parentheses
#define MAUVE_PLUGINS(registry)                                                                    \
  extern "C" __attribute__((visibility("default"))) void mauve_plugin_abi(mauve::PluginAbi& abi) { \
    abi = mauve::plugin_abi();                                                                     \
  }                                                                                                \
  extern "C" __attribute__((visibility("default"))) void mauve_register_plugins(                   \
      mauve::PluginRegistry& registry)
// NOLINTEND(bugprone-macro-parentheses)
