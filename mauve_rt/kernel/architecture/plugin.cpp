// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/architecture/plugin.hpp"

#include <dlfcn.h>

#include "mauve_rt/base/error.hpp"
#include "mauve_rt/parts/property.hpp"

#include "base/names.hpp"

namespace mauve {

namespace {

template <typename Entries>
const auto& require_entry(const Entries& entries, const std::string& name, ErrorCode code,
                          const std::string& what) {
  if (const auto found = entries.find(name); found != entries.end()) return found->second;
  std::vector<std::string> known;
  known.reserve(entries.size());
  for (const auto& [key, entry] : entries) known.push_back(key);
  throw Error(
      code, "there is no such " + what,
      {.element = what + " " + name,
       .expected = "one of " + join(known),
       .found = name,
       .remedy = "check the name, and that its package is installed and lists it among its plug-ins"});
}

/// Makes a part by what its package registered, whatever that throws.
template <typename Make>
auto made(const std::string& what, Make&& make) -> decltype(make()) {
  const auto failed = [&what](const std::string& reason, const std::string& found = "an exception") {
    return Error(ErrorCode::plugin, "the plug-in cannot be made: " + reason,
                 {.element = what,
                  .expected = "a factory that makes one",
                  .found = found,
                  .remedy = "correct its constructor or factory, or provide what it needs"});
  };
  try {
    if (auto part = make()) return part;
  } catch (const Error&) {
    throw;
  } catch (...) {
    throw failed(caught_text());
  }
  throw failed("its factory returned no object", "nullptr");
}

/// A parameter's value in its own type. Throws Error: type_mismatch, out_of_range.
PropertyValue checked(const ResourceParameter& parameter, const PropertyValue& value) {
  try {
    return mauve::checked(
        parameter.name, parameter.initial,
        {.unit = parameter.unit, .minimum = parameter.minimum, .maximum = parameter.maximum}, value);
  } catch (const Error& error) {
    ErrorDetail detail = error.detail();
    detail.element = parameter.name;
    throw Error(error.code(), error.statement(), detail);
  }
}

[[noreturn]] void throw_twice(const std::string& shown) {
  throw Error(ErrorCode::duplicate_name, "the plug-in is registered twice", {.element = shown});
}

std::string version_of(const PluginAbi& abi) {
  const std::string version(abi.version.data());
  return version.empty() ? "an unknown version" : version;
}

/// Throws Error (plugin): compiled against headers of MAUVE RT that do not go with this kernel.
void check_abi(void* library, const std::string& path) {
  constexpr PluginAbi ours = plugin_abi();
  using Describe = void (*)(PluginAbi&);
  auto describe = reinterpret_cast<Describe>(dlsym(library, "mauve_plugin_abi"));
  PluginAbi theirs;
  if (describe != nullptr) describe(theirs);
  const bool is_of_this_version = theirs.version == ours.version || theirs.version.front() == '\0';
  if (theirs.layout == ours.layout && is_of_this_version) return;
  const bool is_of_another_version = describe != nullptr && !is_of_this_version;
  throw Error(ErrorCode::plugin, "the library was built against another version of MAUVE RT",
              {.element = path,
               .expected = version_of(ours),
               .found = is_of_another_version ? version_of(theirs) : "headers of another build",
               .remedy = "rebuild its package against this version"});
}

std::vector<std::string> names_of(const std::vector<ResourceParameter>& parameters) {
  std::vector<std::string> names;
  names.reserve(parameters.size());
  for (const ResourceParameter& parameter : parameters) names.push_back(parameter.name);
  return names;
}

}  // namespace

template <typename Made>
Made PluginRegistry::entry_of(const std::map<std::string, Made>& entries, const std::string& name,
                              ErrorCode code, const std::string& what) const {
  const LockGuard lock(mutex_);
  return require_entry(entries, name, code, what);
}

template <typename Made>
void PluginRegistry::add(std::map<std::string, Made> PluginRegistry::* entries, const std::string& name,
                         const std::string& shown, Made entry) {
  const LockGuard lock(mutex_);
  auto& all = this->*entries;
  entry.generation = generation_;
  const auto before = all.find(name);
  if (replaced_ != nullptr) {
    auto& kept = replaced_->of(all);
    if (kept.contains(name)) throw_twice(shown);
    kept.emplace(name, before == all.end() ? nullptr : std::make_unique<Made>(std::move(before->second)));
  } else if (before != all.end()) {
    throw_twice(shown);
  }
  all.insert_or_assign(name, std::move(entry));
}

PluginRegistry::PluginRegistry() {
  const auto add = [this]<typename Given>(Given) {
    const ResourceKind kind = Given::describe();
    KindEntry& entry = resources_[kind.name];
    entry.kind = kind;
    if constexpr (requires { Given::make("", {}); }) {
      entry.factories[""] = [](const ResourceParameters& given) { return Given::make("", given); };
      for (const std::string& type : kind.messages)
        entry.factories[type] = [type](const ResourceParameters& given) { return Given::make(type, given); };
    }
  };
  std::apply([&](auto... kinds) { (add(kinds), ...); }, GivenResources{});
  ports_.emplace(type_name<EventCount>(), data_ports<EventCount>());
  type<ActionGoal>();  // of the actions of any type, also where only Python knows it
}

std::vector<ResourceKind> PluginRegistry::given_resource_kinds() {
  return std::apply([](auto... kinds) { return std::vector{decltype(kinds)::describe()...}; },
                    GivenResources{});
}

/// By the loader's own words: it has no error codes.
static std::string load_remedy(const std::string& reason) {
  if (reason.find("static TLS") != std::string::npos) {
    return "start the program with GLIBC_TUNABLES=glibc.rtld.optional_static_tls=65536 (each load takes some "
           "of "
           "these bytes, and they never return), or compile without -ftls-model=initial-exec";
  }
  if (reason.find("failed to map segment") != std::string::npos)
    return "install its package in a folder that is mounted without noexec";
  return "install its package, or rebuild it against this version";
}

void PluginRegistry::load_library(const std::string& path) {
  const LockGuard lock(mutex_);
  if (libraries_.contains(path)) return;
  void* library = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (library == nullptr) {
    const std::string reason = dlerror();
    throw Error(ErrorCode::plugin, "the plug-in library does not load: " + reason,
                {.element = path, .remedy = load_remedy(reason)});
  }
  check_abi(library, path);
  using Register = void (*)(PluginRegistry&);
  auto register_plugins = reinterpret_cast<Register>(dlsym(library, "mauve_register_plugins"));
  if (register_plugins == nullptr) {
    throw Error(ErrorCode::plugin, "the library registers no plug-ins",
                {.element = path, .expected = "a MAUVE_PLUGINS(registry) function", .found = "none"});
  }
  struct Loading {
    std::string& library;
    ~Loading() { library.clear(); }
  };
  const Loading loading{loading_ = path};
  try {
    register_plugins(*this);
  } catch (const Error&) {
    throw;
  } catch (...) {
    throw Error(ErrorCode::plugin, "the library cannot register its plug-ins: " + caught_text(),
                {.element = path});
  }
  libraries_.insert(path);
}

void PluginRegistry::add_shell(const std::string& name, std::function<std::unique_ptr<Shell>()> factory,
                               std::vector<std::string> classes) {
  const LockGuard lock(mutex_);
  add(&PluginRegistry::shells_, name, "shell " + name,
      Entry<Shell>{
          .shell = "", .make = std::move(factory), .classes = std::move(classes), .library = loading_});
}
void PluginRegistry::add_core(const std::string& name, const std::string& shell_name, CoreFactory factory,
                              std::vector<std::string> classes, CoreOptions options) {
  check_core_times(name, options.wcet_ns);
  const LockGuard lock(mutex_);
  add(&PluginRegistry::cores_, name, "core " + name,
      Entry<CoreBase>{.shell = shell_name,
                      .make = std::move(factory),
                      .classes = std::move(classes),
                      .library = loading_,
                      .core = std::move(options)});
  note_builds();
}
void PluginRegistry::add_fsm(const std::string& name, const std::string& shell_name,
                             std::function<std::unique_ptr<FsmBase>()> factory,
                             std::vector<std::string> classes) {
  const LockGuard lock(mutex_);
  add(&PluginRegistry::fsms_, name, "fsm " + name,
      Entry<FsmBase>{.shell = shell_name,
                     .make = std::move(factory),
                     .classes = std::move(classes),
                     .library = loading_});
  note_builds();
}

void PluginRegistry::note_builds() {
  std::map<std::string, int>
      in_force;  // of each class, by the core, else the fsm, that was registered for it
  const auto collect = [&in_force](const auto& entries) {
    for (const auto& [name, entry] : entries)
      if (!entry.classes.empty()) in_force.emplace(entry.classes.front(), entry.generation);
  };
  collect(cores_);
  collect(fsms_);
  const auto note = [&](auto& entries) {
    for (auto& [name, entry] : entries) {
      // The parts of a generation are registered in any order: a later one may define the class of an earlier one.
      const bool is_new =
          entry.builds == nullptr || (replaced_ != nullptr && entry.generation == generation_);
      if (!is_new || entry.classes.empty()) continue;
      ClassBuilds builds{.library = entry.library, .classes = {}};
      for (const std::string& each : entry.classes) {
        const auto found = in_force.find(each);
        builds.classes.push_back({each, found != in_force.end() ? found->second : entry.generation});
      }
      entry.builds = std::make_shared<const ClassBuilds>(std::move(builds));
    }
  };
  note(cores_);
  note(fsms_);
}
void PluginRegistry::add_resource(ResourceKind kind, ResourceFactory factory) {
  const std::string name = kind.name;
  const std::set<std::string> taken{"kind",    "longest_hold_ns", "name", "resource",
                                    "service", "topic",           "type"};
  for (const std::string& parameter : names_of(kind.parameters)) {
    check_name("parameter", parameter);
    if (!taken.contains(parameter)) continue;
    throw Error(ErrorCode::plugin, "a parameter cannot have that name",
                {.element = "resource " + name, .expected = "none of " + join(taken), .found = parameter});
  }
  add(&PluginRegistry::resources_, name, "resource " + name,
      KindEntry{std::move(kind), {{"", std::move(factory)}}});
}

void PluginRegistry::begin_generation(int number, std::shared_ptr<PluginGeneration> replaced) {
  const LockGuard lock(mutex_);
  generation_ = number;
  replaced_ = std::move(replaced);
}

void PluginRegistry::end_generation() noexcept {
  const LockGuard lock(mutex_);
  generation_ = 1;
  replaced_ = nullptr;
  version_.fetch_add(1, std::memory_order_release);
}

void PluginRegistry::drop(const std::string& kind, const std::string& name) {
  const LockGuard lock(mutex_);
  const auto keep = [&](auto& entries) {
    const auto found = entries.find(name);
    if (found == entries.end() || replaced_ == nullptr) return;
    auto entry = std::make_unique<std::decay_t<decltype(found->second)>>(std::move(found->second));
    replaced_->of(entries).emplace(name, std::move(entry));
    entries.erase(found);
  };
  if (kind == "shell") keep(shells_);
  if (kind == "core") keep(cores_);
  if (kind == "fsm") keep(fsms_);
  if (kind == "resource") keep(resources_);
}

void PluginRegistry::exchange(PluginGeneration& other) {
  const LockGuard lock(mutex_);
  const auto swap = [&other]<typename Made>(std::map<std::string, Made>& entries) {
    for (auto& [name, kept] : other.of(entries)) {
      auto back = std::move(kept);
      const auto found = entries.find(name);
      kept = found == entries.end() ? nullptr : std::make_unique<Made>(std::move(found->second));
      if (back != nullptr) {
        entries.insert_or_assign(name, std::move(*back));
      } else if (found != entries.end()) {
        entries.erase(found);
      }
    }
  };
  swap(shells_);
  swap(cores_);
  swap(fsms_);
  swap(resources_);
  version_.fetch_add(1, std::memory_order_release);
}

int PluginRegistry::generation_of(const std::string& kind, const std::string& name) const {
  const LockGuard lock(mutex_);
  const auto in = [&name](const auto& entries) {
    const auto found = entries.find(name);
    return found == entries.end() ? 0 : found->second.generation;
  };
  if (kind == "shell") return in(shells_);
  if (kind == "core") return in(cores_);
  if (kind == "fsm") return in(fsms_);
  return kind == "resource" ? in(resources_) : 0;
}

std::vector<std::string> PluginRegistry::classes_of(const std::string& kind, const std::string& name) const {
  const LockGuard lock(mutex_);
  const auto in = [&name](const auto& entries) {
    const auto found = entries.find(name);
    return found == entries.end() ? std::vector<std::string>{} : found->second.classes;
  };
  if (kind == "shell") return in(shells_);
  if (kind == "core") return in(cores_);
  return kind == "fsm" ? in(fsms_) : std::vector<std::string>{};
}

std::vector<MessageShape> PluginRegistry::type_shapes() const {
  const LockGuard lock(mutex_);
  std::vector<MessageShape> shapes;
  shapes.reserve(ports_.size());
  for (const auto& [type, factories] : ports_) shapes.push_back(factories.shape());
  return shapes;
}

namespace {

/// By a copy of its entry: the factory is user code, and others may load meanwhile. Other instances are of the same build.
template <typename Entry>
auto make_part(const std::shared_ptr<const Entry>& entry, const std::string& kind, const std::string& name)
    -> decltype(entry->make()) {
  auto part = made(kind + " " + name, entry->make);
  part->set_factory([entry, kind, name] { return make_part(entry, kind, name); });
  part->set_implementation(name);
  part->set_generation(entry->generation);
  part->set_class_builds(entry->builds);
  if constexpr (requires { part->set_wcet_ns({}); }) part->set_wcet_ns(entry->core.wcet_ns);
  return part;
}

}  // namespace

std::unique_ptr<Shell> PluginRegistry::make_shell(const std::string& name) const {
  return make_part(
      std::make_shared<const Entry<Shell>>(entry_of(shells_, name, ErrorCode::unknown_shell, "shell")),
      "shell", name);
}
std::unique_ptr<CoreBase> PluginRegistry::make_core(const std::string& name) const {
  return make_part(
      std::make_shared<const Entry<CoreBase>>(entry_of(cores_, name, ErrorCode::unknown_core, "core")),
      "core", name);
}
std::unique_ptr<FsmBase> PluginRegistry::make_fsm(const std::string& name) const {
  return make_part(
      std::make_shared<const Entry<FsmBase>>(entry_of(fsms_, name, ErrorCode::unknown_fsm, "fsm")), "fsm",
      name);
}

std::unique_ptr<Resource> PluginRegistry::make_resource(const std::string& kind, const std::string& type,
                                                        const ResourceParameters& given) const {
  ResourceFactory make;
  ResourceParameters others = given;
  {
    const LockGuard lock(mutex_);
    const ResourceKind known = resource_kind(kind);
    const auto& factories = resources_.at(kind).factories;
    const auto factory = factories.find(type);
    if (factory == factories.end()) throw_not_of_type(known, type);
    make = factory->second;
    if (known.type == TypeNeed::data) {
      capacities_of(ports_.at(type).shape(), given);  // checked for the kinds that take none, too
      std::erase_if(others, [](const auto& parameter) { return is_capacity(parameter.first); });
    }
  }
  ResourceParameters parameters = checked_parameters(kind, others);
  parameters.insert(given.begin(), given.end());  // the capacities: all others are there
  return made(kind + " " + type, [&] { return make(parameters); });
}

ResourceKind PluginRegistry::resource_kind(const std::string& name) const {
  const LockGuard lock(mutex_);
  if (const auto found = resources_.find(name); found != resources_.end()) return found->second.kind;
  throw Error(ErrorCode::unknown_resource, "there is no such kind of resource",
              {.element = "kind " + name,
               .expected = "one of " + join(names("resource")),
               .found = name,
               .remedy = "check the name, and that a package registers it among its plug-ins"});
}

ResourceParameters PluginRegistry::checked_parameters(const std::string& kind,
                                                      const ResourceParameters& given) const {
  const std::vector<ResourceParameter> known = resource_kind(kind).parameters;
  ResourceParameters all;
  for (const ResourceParameter& parameter : known) {
    const auto told = given.find(parameter.name);
    if (told == given.end() && parameter.is_required) {
      throw Error(ErrorCode::invalid_argument, "a " + kind + " needs a " + parameter.name,
                  {.element = parameter.name,
                   .expected = parameter.description,
                   .found = "none",
                   .remedy = "add " + parameter.name});
    }
    all.emplace(parameter.name, told == given.end() ? parameter.initial : checked(parameter, told->second));
  }
  for (const auto& [name, value] : given) {
    if (all.contains(name)) continue;
    throw Error(ErrorCode::invalid_argument, "a resource of kind " + kind + " has no such parameter",
                {.element = name,
                 .expected = known.empty() ? "none" : "one of " + join(names_of(known)),
                 .found = name,
                 .remedy = "check the name"});
  }
  return all;
}

void PluginRegistry::throw_not_of_type(const ResourceKind& kind, const std::string& type) const {
  if (kind.type == TypeNeed::data && ports_.contains(type)) {
    throw Error(ErrorCode::type_mismatch, "the type cannot be copied without a lock",
                {.element = "type " + type,
                 .expected = "a trivially copyable type",
                 .found = "one with a copy constructor of its own, as one with sequences",
                 .remedy = "use shared_data, or bounded members in the type"});
  }
  if (kind.type == TypeNeed::data) throw_unknown_type(type);
  if (kind.type == TypeNeed::call || kind.type == TypeNeed::action) {
    const char* const what = kind.type == TypeNeed::call ? "call" : "action";
    throw Error(ErrorCode::unknown_type, "the type of " + std::string(what) + " is not registered",
                {.element = "type " + type,
                 .expected = "one of " + join(names(std::string(to_string(kind.type)))),
                 .found = type,
                 .remedy = "check the name, and that a package registers it among its plug-ins"});
  }
  if (!kind.messages.empty()) {
    throw Error(
        ErrorCode::invalid_argument, "a resource of kind " + kind.name + " cannot be said by that message",
        {.element = "type", .expected = join(kind.messages) + ", or none, which is the last", .found = type});
  }
  throw Error(
      ErrorCode::unknown_resource, "the kind of resource is of no type",
      {.element = "kind " + kind.name, .expected = "no type", .found = type, .remedy = "leave type out"});
}

std::unique_ptr<PortBase> PluginRegistry::make_port(PortKind kind, const std::string& type,
                                                    const std::string& name,
                                                    const OutputOptions& output) const {
  if (kind == PortKind::event && type.empty()) return std::make_unique<EventPort>(name);
  if (kind == PortKind::event || kind == PortKind::call) {
    throw Error(ErrorCode::invalid_argument, "no such port can be made by name",
                {.element = "port " + name,
                 .expected = "read or write with a type, or event without",
                 .found = std::string(to_string(kind)) + " of " + type,
                 .remedy = "declare call ports in a C++ shell"});
  }
  const LockGuard lock(mutex_);
  const auto found = ports_.find(type);
  if (found == ports_.end()) throw_unknown_type(type);
  return kind == PortKind::read ? found->second.read(name) : found->second.write(name, output);
}

void PluginRegistry::throw_unknown_type(const std::string& type) const {
  throw Error(ErrorCode::unknown_type, "the data type is not registered",
              {.element = "type " + type,
               .expected = "one of " + join(names("type")),
               .found = type,
               .remedy = "check the name, and that a package registers it among its plug-ins"});
}

std::string PluginRegistry::core_shell(const std::string& name) const {
  return entry_of(cores_, name, ErrorCode::unknown_core, "core").shell;
}
std::string PluginRegistry::fsm_shell(const std::string& name) const {
  return entry_of(fsms_, name, ErrorCode::unknown_fsm, "fsm").shell;
}

std::size_t PluginRegistry::value_bytes(const std::string& type, const ResourceParameters& given) const {
  const LockGuard lock(mutex_);
  const auto found = ports_.find(type);
  if (found == ports_.end()) return 0;
  const MessageShape shape = found->second.shape();
  return mauve::value_bytes(shape, capacities_of(shape, given));
}

std::vector<std::string> PluginRegistry::sequences(const std::string& type) const {
  const LockGuard lock(mutex_);
  const auto found = ports_.find(type);
  return found == ports_.end() ? std::vector<std::string>{} : sequence_paths(found->second.shape());
}

std::vector<std::string> PluginRegistry::names(const std::string& kind) const {
  const LockGuard lock(mutex_);
  std::set<std::string> found;
  const auto add_keys = [&found](const auto& entries) {
    for (const auto& [name, entry] : entries) found.insert(name);
  };
  if (kind == "shell") {
    add_keys(shells_);
  } else if (kind == "core") {
    add_keys(cores_);
  } else if (kind == "fsm") {
    add_keys(fsms_);
  } else if (kind == "resource") {
    for (const auto& [name, entry] : resources_) {
      if (!entry.factories.empty()) found.insert(name);
    }
  } else if (kind == to_string(TypeNeed::data) || kind == to_string(TypeNeed::call) ||
             kind == to_string(TypeNeed::action)) {
    for (const auto& [name, entry] : resources_) {
      if (to_string(entry.kind.type) == kind) add_keys(entry.factories);
    }
  } else {
    throw Error(ErrorCode::invalid_argument, "there is no such kind of plug-in",
                {.expected = "shell, core, fsm, resource, type, call_type or action_type", .found = kind});
  }
  return {found.begin(), found.end()};
}

}  // namespace mauve
