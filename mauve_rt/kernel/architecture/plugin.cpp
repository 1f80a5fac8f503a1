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

template <typename Entries, typename Key, typename Entry>
void add_entry(Entries& entries, const Key& key, const std::string& shown, Entry entry) {
  if (entries.emplace(key, std::move(entry)).second) return;
  throw Error(ErrorCode::duplicate_name, "the plug-in is registered twice", {.element = shown});
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

std::vector<std::string> names_of(const std::vector<ResourceParameter>& parameters) {
  std::vector<std::string> names;
  names.reserve(parameters.size());
  for (const ResourceParameter& parameter : parameters) names.push_back(parameter.name);
  return names;
}

}  // namespace

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
}

std::vector<ResourceKind> PluginRegistry::given_resource_kinds() {
  return std::apply([](auto... kinds) { return std::vector{decltype(kinds)::describe()...}; },
                    GivenResources{});
}

void PluginRegistry::load_library(const std::string& path) {
  if (libraries_.contains(path)) return;
  void* library = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (library == nullptr) {
    throw Error(ErrorCode::plugin, std::string("the plug-in library does not load: ") + dlerror(),
                {.element = path, .remedy = "install its package, or rebuild it against this version"});
  }
  using Register = void (*)(PluginRegistry&);
  auto register_plugins = reinterpret_cast<Register>(dlsym(library, "mauve_register_plugins"));
  if (register_plugins == nullptr) {
    throw Error(ErrorCode::plugin, "the library registers no plug-ins",
                {.element = path, .expected = "a MAUVE_PLUGINS(registry) function", .found = "none"});
  }
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

void PluginRegistry::add_shell(const std::string& name, std::function<std::unique_ptr<Shell>()> factory) {
  add_entry(shells_, name, "shell " + name, Entry<Shell>{"", std::move(factory)});
}
void PluginRegistry::add_core(const std::string& name, const std::string& shell_name, CoreFactory factory) {
  add_entry(cores_, name, "core " + name, Entry<CoreBase>{shell_name, std::move(factory)});
}
void PluginRegistry::add_fsm(const std::string& name, const std::string& shell_name,
                             std::function<std::unique_ptr<FsmBase>()> factory) {
  add_entry(fsms_, name, "fsm " + name, Entry<FsmBase>{shell_name, std::move(factory)});
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
  add_entry(resources_, name, "resource " + name, KindEntry{std::move(kind), {{"", std::move(factory)}}});
}

std::unique_ptr<Shell> PluginRegistry::make_shell(const std::string& name) const {
  auto shell = made("shell " + name, require_entry(shells_, name, ErrorCode::unknown_shell, "shell").make);
  shell->set_implementation(name);
  return shell;
}
std::unique_ptr<CoreBase> PluginRegistry::make_core(const std::string& name) const {
  auto core = made("core " + name, require_entry(cores_, name, ErrorCode::unknown_core, "core").make);
  core->set_implementation(name);
  return core;
}
std::unique_ptr<FsmBase> PluginRegistry::make_fsm(const std::string& name) const {
  auto fsm = made("fsm " + name, require_entry(fsms_, name, ErrorCode::unknown_fsm, "fsm").make);
  fsm->set_implementation(name);
  return fsm;
}

std::unique_ptr<Resource> PluginRegistry::make_resource(const std::string& kind, const std::string& type,
                                                        const ResourceParameters& given) const {
  const ResourceKind& known = resource_kind(kind);
  const auto& factories = resources_.at(kind).factories;
  const auto factory = factories.find(type);
  if (factory == factories.end()) throw_not_of_type(known, type);
  const ResourceParameters parameters = checked_parameters(kind, given);
  return made(kind + " " + type, [&] { return factory->second(parameters); });
}

const ResourceKind& PluginRegistry::resource_kind(const std::string& name) const {
  if (const auto found = resources_.find(name); found != resources_.end()) return found->second.kind;
  throw Error(ErrorCode::unknown_resource, "there is no such kind of resource",
              {.element = "kind " + name,
               .expected = "one of " + join(names("resource")),
               .found = name,
               .remedy = "check the name, and that a package registers it among its plug-ins"});
}

ResourceParameters PluginRegistry::checked_parameters(const std::string& kind,
                                                      const ResourceParameters& given) const {
  const auto& known = resource_kind(kind).parameters;
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
                 .found = "one with a copy constructor of its own",
                 .remedy = "use shared_data, or bounded members in the type"});
  }
  if (kind.type == TypeNeed::data) throw_unknown_type(type);
  if (kind.type == TypeNeed::call) {
    throw Error(ErrorCode::unknown_type, "the type of call is not registered",
                {.element = "type " + type,
                 .expected = "one of " + join(names("call_type")),
                 .found = type,
                 .remedy = "check the name, and that a package registers it among its plug-ins"});
  }
  if (!kind.messages.empty()) {
    throw Error(
        ErrorCode::invalid_argument, "an " + kind.name + " cannot be said by that message",
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

const std::string& PluginRegistry::core_shell(const std::string& name) const {
  return require_entry(cores_, name, ErrorCode::unknown_core, "core").shell;
}
const std::string& PluginRegistry::fsm_shell(const std::string& name) const {
  return require_entry(fsms_, name, ErrorCode::unknown_fsm, "fsm").shell;
}

std::size_t PluginRegistry::value_bytes(const std::string& type) const {
  const auto found = ports_.find(type);
  return found != ports_.end() ? found->second.value_bytes : 0;
}

std::vector<std::string> PluginRegistry::names(const std::string& kind) const {
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
  } else if (kind == "type" || kind == "call_type") {
    for (const auto& [name, entry] : resources_) {
      if (entry.kind.type == (kind == "type" ? TypeNeed::data : TypeNeed::call)) add_keys(entry.factories);
    }
  } else {
    throw Error(ErrorCode::invalid_argument, "there is no such kind of plug-in",
                {.expected = "shell, core, fsm, resource, type or call_type", .found = kind});
  }
  return {found.begin(), found.end()};
}

}  // namespace mauve
