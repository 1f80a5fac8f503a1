// SPDX-License-Identifier: LGPL-3.0-or-later
#include "type_support.hpp"

#include <dlfcn.h>

#include <cstdlib>
#include <filesystem>
#include <sstream>

#include "mauve_rt/error.hpp"

namespace mauve::bridge {

namespace {

[[noreturn]] void throw_unknown(const std::string& type, const std::string& found) {
  throw Error(ErrorCode::unknown_type, "the message type is not installed",
              {.element = "type " + type,
               .expected = "package/msg/Type of an installed interface package",
               .found = found,
               .remedy = "install the package, and source the setup file of its workspace"});
}

/// Its path in the first prefix that has it; its bare name, for the linker's own search, where none has.
std::string library_of(const std::string& package) {
  std::string name = "lib" + package + "__rosidl_typesupport_c.so";
  const char* prefixes = std::getenv("AMENT_PREFIX_PATH");
  std::istringstream stream(prefixes == nullptr ? "" : prefixes);
  for (std::string prefix; std::getline(stream, prefix, ':');) {
    std::filesystem::path path = std::filesystem::path(prefix) / "lib" / name;
    if (std::filesystem::exists(path)) return path;
  }
  return name;
}

}  // namespace

const rosidl_message_type_support_t& message_type_support(const std::string& type) {
  const std::size_t package_end = type.find("/msg/");
  if (package_end == std::string::npos) throw_unknown(type, "a name without /msg/");
  const std::string package = type.substr(0, package_end);
  const std::string name = type.substr(package_end + 5);
  void* library = dlopen(library_of(package).c_str(), RTLD_LAZY | RTLD_LOCAL);
  if (library == nullptr) throw_unknown(type, "no library with its package's type supports");
  const std::string symbol =
      "rosidl_typesupport_c__get_message_type_support_handle__" + package + "__msg__" + name;
  using Getter = const rosidl_message_type_support_t* (*)();
  const auto get = reinterpret_cast<Getter>(dlsym(library, symbol.c_str()));
  if (get == nullptr) throw_unknown(type, "package " + package + " without a message " + name);
  return *get();
}

}  // namespace mauve::bridge
