// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/architecture/plugin.hpp"

#include <dlfcn.h>

#include "mauve_rt/base/error.hpp"
#include "mauve_rt/data/event_counter.hpp"

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
  const auto failed = [&what](const std::string& reason) {
    return Error(ErrorCode::plugin, "the plug-in cannot be made: " + reason,
                 {.element = what, .remedy = "mend its constructor, or what it needs"});
  };
  try {
    if (auto part = make()) return part;
  } catch (const Error&) {
    throw;
  } catch (...) {
    throw failed(caught_text());
  }
  throw failed("its factory made nothing");
}

EventMessage event_message(const std::string& type) {
  for (const EventMessage said : {EventMessage::empty, EventMessage::truth, EventMessage::count}) {
    if (type == type_of(said)) return said;
  }
  throw Error(
      ErrorCode::invalid_argument, "an event cannot be said by that message",
      {.element = "type",
       .expected = "std_msgs/msg/Empty, std_msgs/msg/Bool, std_msgs/msg/UInt64, or none, which is the last",
       .found = type});
}

}  // namespace

PluginRegistry::PluginRegistry() {
  add_resource("event", "", [](const ResourceParameters&) { return std::make_unique<EventCounter>(); });
  ports_.emplace(type_name<EventCount>(), data_ports<EventCount>());
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
void PluginRegistry::add_resource(const std::string& kind, const std::string& type, ResourceFactory factory) {
  // Packages share data types: the first registration of one serves all.
  if (!type.empty() && resources_.contains({kind, type})) return;
  add_entry(resources_, std::pair(kind, type), kind + " " + type, std::move(factory));
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
                                                        const ResourceParameters& parameters) const {
  if (const auto found = resources_.find({kind, type}); found != resources_.end())
    return made(kind + " " + type, [&] { return found->second(parameters); });
  if (kind == "event") return std::make_unique<EventCounter>(event_message(type));
  if (kind == "latest_value" && resources_.contains({"shared_data", type})) {
    throw Error(ErrorCode::type_mismatch, "the type cannot be copied without a lock",
                {.element = "type " + type,
                 .expected = "a trivially copyable type",
                 .found = "one with a copy constructor of its own",
                 .remedy = "use shared_data, or bounded members in the type"});
  }
  if (kind == "client") {
    throw Error(ErrorCode::unknown_type, "the type of call is not registered",
                {.element = "type " + type,
                 .expected = "one of " + join(names("call_type")),
                 .found = type,
                 .remedy = "check the name, and that a package registers it among its plug-ins"});
  }
  if (kind == "shared_data" || kind == "ring_buffer" || kind == "latest_value") throw_unknown_type(type);
  throw Error(ErrorCode::unknown_resource, "there is no such kind of resource",
              {.element = "kind " + kind,
               .expected = "one of " + join(names("resource")),
               .found = kind,
               .remedy = "check the name, and that a package registers it among its plug-ins"});
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
    for (const auto& [key, factory] : resources_) found.insert(key.first);
  } else if (kind == "type" || kind == "call_type") {
    for (const auto& [key, factory] : resources_) {
      if ((key.first == "client") == (kind == "call_type")) found.insert(key.second);
    }
    found.erase("");
  } else {
    throw Error(ErrorCode::invalid_argument, "there is no such kind of plug-in",
                {.expected = "shell, core, fsm, resource, type or call_type", .found = kind});
  }
  return {found.begin(), found.end()};
}

}  // namespace mauve
