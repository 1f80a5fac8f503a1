// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/plugin.hpp"

#include <dlfcn.h>

#include "mauve_rt/error.hpp"

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

}  // namespace

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
  register_plugins(*this);
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
  auto shell = require_entry(shells_, name, ErrorCode::unknown_shell, "shell").make();
  shell->set_implementation(name);
  return shell;
}
std::unique_ptr<CoreBase> PluginRegistry::make_core(const std::string& name) const {
  auto core = require_entry(cores_, name, ErrorCode::unknown_core, "core").make();
  core->set_implementation(name);
  return core;
}
std::unique_ptr<FsmBase> PluginRegistry::make_fsm(const std::string& name) const {
  auto fsm = require_entry(fsms_, name, ErrorCode::unknown_fsm, "fsm").make();
  fsm->set_implementation(name);
  return fsm;
}

std::unique_ptr<Resource> PluginRegistry::make_resource(const std::string& kind, const std::string& type,
                                                        const ResourceParameters& parameters) const {
  if (kind == "ring_buffer" && parameters.capacity == 0) {
    throw Error(ErrorCode::invalid_argument, "a ring_buffer needs a capacity",
                {.element = "capacity", .expected = "> 0", .found = "0", .remedy = "add capacity: N"});
  }
  if (const auto found = resources_.find({kind, type}); found != resources_.end())
    return found->second(parameters);
  const bool known_kind = kind == "shared_data" || kind == "ring_buffer";
  throw Error(known_kind ? ErrorCode::unknown_type : ErrorCode::unknown_resource,
              known_kind ? "the data type is not registered" : "there is no such kind of resource",
              {.element = known_kind ? "type " + type : "kind " + kind,
               .expected = "one of " + join(names(known_kind ? "type" : "resource")),
               .found = known_kind ? type : kind,
               .remedy = "check the name, and that a package registers it among its plug-ins"});
}

const std::string& PluginRegistry::core_shell(const std::string& name) const {
  return require_entry(cores_, name, ErrorCode::unknown_core, "core").shell;
}
const std::string& PluginRegistry::fsm_shell(const std::string& name) const {
  return require_entry(fsms_, name, ErrorCode::unknown_fsm, "fsm").shell;
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
  } else if (kind == "resource" || kind == "type") {
    for (const auto& [key, factory] : resources_) found.insert(kind == "type" ? key.second : key.first);
    found.erase("");
  } else {
    throw Error(ErrorCode::invalid_argument, "there is no such kind of plug-in",
                {.expected = "shell, core, fsm, resource or type", .found = kind});
  }
  return {found.begin(), found.end()};
}

}  // namespace mauve
