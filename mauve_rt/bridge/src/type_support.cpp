// SPDX-License-Identifier: LGPL-3.0-or-later
#include "type_support.hpp"

#include <dlfcn.h>
#include <rosidl_runtime_c/action_type_support_struct.h>
#include <rosidl_typesupport_introspection_c/message_introspection.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <sstream>

#include "mauve_rt/base/error.hpp"

namespace mauve::bridge {

namespace {

constexpr const char* kTypeSupports = "rosidl_typesupport_c";
constexpr const char* kStructs = "rosidl_generator_c";
constexpr const char* kFields = "rosidl_typesupport_introspection_c";
constexpr std::uint32_t kResultField = 1;  // of a GetResult_Response, behind the status

std::string noun(const std::string& kind) {
  if (kind == "action") return "action";
  return kind == "msg" ? "message" : "service";
}

/// A type's name in its two parts.
class TypeName {
 public:
  /// `kind`: msg, srv or action. Throws Error (unknown_type) when it is no such name.
  TypeName(const std::string& full, const std::string& kind) : full_(full), kind_(kind) {
    const std::size_t package_end = full.find("/" + kind + "/");
    if (package_end == std::string::npos) throw_unknown("a name without /" + kind + "/");
    package_ = full.substr(0, package_end);
    name_ = full.substr(package_end + kind.size() + 2);
    if (!is_word(package_) || !is_word(name_)) throw_unknown("a name of other characters");
  }

  [[noreturn]] void throw_unknown(const std::string& found) const {
    throw Error(ErrorCode::unknown_type, "the " + noun(kind_) + " type is not installed",
                {.element = "type " + full_,
                 .expected = "package/" + kind_ + "/Type of an installed interface package",
                 .found = found,
                 .remedy = "install the package, and source the setup file of its workspace"});
  }
  /// The package is installed, and what its libraries need is not found.
  [[noreturn]] void throw_not_loaded(const std::filesystem::path& library, const std::string& why) const {
    const std::filesystem::path setup =
        library.parent_path().parent_path() / "share" / package_ / "local_setup.bash";
    throw Error(ErrorCode::unknown_type, "the " + noun(kind_) + " type is installed, and cannot be loaded",
                {.element = "type " + full_,
                 .expected = library,
                 .found = why,
                 .remedy = "source " + setup.string() + ", then start this program again"});
  }
  /// A function of one of the package's generated libraries, which stays loaded.
  template <typename Function>
  Function find(const std::string& library_suffix, const std::string& before,
                const std::string& after) const {
    const std::filesystem::path path = library_path(library_suffix);
    void* library = dlopen(path.c_str(), RTLD_LAZY | RTLD_LOCAL);
    if (library == nullptr) {
      const std::string why = dlerror();
      if (path.has_parent_path()) throw_not_loaded(path, why);
      throw_unknown("no library with its package's type supports");
    }
    const std::string symbol = before + package_ + "__" + kind_ + "__" + name_ + after;
    const auto found = reinterpret_cast<Function>(dlsym(library, symbol.c_str()));
    if (found == nullptr) throw_unknown("package " + package_ + " without a " + kind_ + " " + name_);
    return found;
  }
  /// The type support of a part of the type, as the libraries of this suffix have it.
  const rosidl_message_type_support_t* part_support(const std::string& suffix,
                                                    const std::string& part) const {
    using Getter = const rosidl_message_type_support_t* (*)();
    return find<Getter>(suffix, suffix + "__get_message_type_support_handle__", part)();
  }
  /// Where a field begins in the struct of a part of the type.
  std::size_t offset(const std::string& part, std::uint32_t field) const {
    const auto* const fields = static_cast<const rosidl_typesupport_introspection_c__MessageMembers*>(
        part_support(kFields, part)->data);
    if (field >= fields->member_count_) throw_unknown(part + " without a field " + std::to_string(field));
    return fields->members_[field].offset_;
  }
  /// What makes messages of a part of the type.
  MessageFunctions functions(const rosidl_message_type_support_t* support, const std::string& part) const {
    return {.type = support,
            .create = find<MessageFunctions::Create>(kStructs, "", part + "__create"),
            .destroy = find<MessageFunctions::Destroy>(kStructs, "", part + "__destroy")};
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
  return {.service = service,
          .request = name.functions(service->request_typesupport, "_Request"),
          .response = name.functions(service->response_typesupport, "_Response")};
}

ActionTypeSupport action_type_support(const std::string& type) {
  using Getter = const rosidl_action_type_support_t* (*)();
  const TypeName name(type, "action");
  const std::string before = "rosidl_typesupport_c__get_action_type_support_handle__";
  const rosidl_action_type_support_t* const action = name.find<Getter>(kTypeSupports, before, "")();
  const rosidl_service_type_support_t& goal = *action->goal_service_type_support;
  const rosidl_service_type_support_t& result = *action->result_service_type_support;
  return {.action = action,
          .goal_request = name.functions(goal.request_typesupport, "_SendGoal_Request"),
          .goal_response = name.functions(goal.response_typesupport, "_SendGoal_Response"),
          .result_request = name.functions(result.request_typesupport, "_GetResult_Request"),
          .result_response = name.functions(result.response_typesupport, "_GetResult_Response"),
          .feedback = name.functions(action->feedback_message_type_support, "_FeedbackMessage"),
          .result = name.part_support(kTypeSupports, "_Result"),
          .result_offset = name.offset("_GetResult_Response", kResultField)};
}

void require_type_support(const std::string& type) {
  if (type.find("/srv/") != std::string::npos)
    call_type_support(type);
  else if (type.find("/action/") != std::string::npos)
    action_type_support(type);
  else
    message_type_support(type);
}

}  // namespace mauve::bridge
