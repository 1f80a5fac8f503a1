// SPDX-License-Identifier: LGPL-3.0-or-later
#include "type_support.hpp"

#include <dlfcn.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <sstream>

#include "mauve_rt/base/error.hpp"

namespace mauve::bridge {

namespace {

/// A type's name in its two parts.
class TypeName {
 public:
  /// `kind`: msg or srv. Throws Error (unknown_type) when it is no such name.
  TypeName(const std::string& full, const std::string& kind) : full_(full), kind_(kind) {
    const std::size_t package_end = full.find("/" + kind + "/");
    if (package_end == std::string::npos) throw_unknown("a name without /" + kind + "/");
    package_ = full.substr(0, package_end);
    name_ = full.substr(package_end + kind.size() + 2);
    if (!is_word(package_) || !is_word(name_)) throw_unknown("a name of other characters");
  }

  [[noreturn]] void throw_unknown(const std::string& found) const {
    throw Error(ErrorCode::unknown_type,
                kind_ == "msg" ? "the message type is not installed" : "the service type is not installed",
                {.element = "type " + full_,
                 .expected = "package/" + kind_ + "/Type of an installed interface package",
                 .found = found,
                 .remedy = "install the package, and source the setup file of its workspace"});
  }
  /// A function of one of the package's generated libraries, which stays loaded.
  template <typename Function>
  Function find(const std::string& library_suffix, const std::string& before,
                const std::string& after) const {
    void* library = dlopen(library_path(library_suffix).c_str(), RTLD_LAZY | RTLD_LOCAL);
    if (library == nullptr) throw_unknown("no library with its package's type supports");
    const std::string symbol = before + package_ + "__" + kind_ + "__" + name_ + after;
    const auto found = reinterpret_cast<Function>(dlsym(library, symbol.c_str()));
    if (found == nullptr) throw_unknown("package " + package_ + " without a " + kind_ + " " + name_);
    return found;
  }

 private:
  /// Whether it can be no more than a part of a file's name: what is opened is in the package's folder.
  static bool is_word(const std::string& text) {
    const auto is_part = [](char c) {
      return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
    };
    return !text.empty() && std::all_of(text.begin(), text.end(), is_part);
  }

  /// Its path in the first prefix that has it; its bare name, for the linker's own search, where none has.
  std::string library_path(const std::string& suffix) const {
    std::string name = "lib" + package_ + "__" + suffix + ".so";
    const char* prefixes = std::getenv("AMENT_PREFIX_PATH");
    std::istringstream stream(prefixes == nullptr ? "" : prefixes);
    for (std::string prefix; std::getline(stream, prefix, ':');) {
      std::filesystem::path path = std::filesystem::path(prefix) / "lib" / name;
      if (std::filesystem::exists(path)) return path;
    }
    return name;
  }

  std::string full_;
  std::string kind_;
  std::string package_;
  std::string name_;
};

constexpr const char* kTypeSupports = "rosidl_typesupport_c";
constexpr const char* kStructs = "rosidl_generator_c";

}  // namespace

const rosidl_message_type_support_t& message_type_support(const std::string& type) {
  using Getter = const rosidl_message_type_support_t* (*)();
  const std::string before = "rosidl_typesupport_c__get_message_type_support_handle__";
  return *TypeName(type, "msg").find<Getter>(kTypeSupports, before, "")();
}

CallTypeSupport call_type_support(const std::string& type) {
  using Getter = const rosidl_service_type_support_t* (*)();
  const TypeName name(type, "srv");
  const std::string before = "rosidl_typesupport_c__get_service_type_support_handle__";
  const rosidl_service_type_support_t* const service = name.find<Getter>(kTypeSupports, before, "")();
  const auto message = [&name](const rosidl_message_type_support_t* support, const std::string& part) {
    using Create = CallTypeSupport::Create;
    using Destroy = CallTypeSupport::Destroy;
    return CallTypeSupport::Message{.type = support,
                                    .create = name.find<Create>(kStructs, "", part + "__create"),
                                    .destroy = name.find<Destroy>(kStructs, "", part + "__destroy")};
  };
  return {.service = service,
          .request = message(service->request_typesupport, "_Request"),
          .response = message(service->response_typesupport, "_Response")};
}

}  // namespace mauve::bridge
