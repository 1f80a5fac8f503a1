// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/base/class_builds.hpp"

#include <cxxabi.h>

#include <algorithm>
#include <cstdlib>
#include <memory>
#include <string_view>

#include "mauve_rt/base/configurable.hpp"
#include "mauve_rt/base/error.hpp"

namespace mauve {

namespace {

/// As the compiler writes "a class in namespace mauve".
constexpr std::string_view kOwnNamespace = "N5mauve";

/// By the Itanium C++ ABI, which gcc and clang share.
void add_classes(const std::type_info& type, std::vector<std::string>& found) {
  const std::string_view name = type.name();
  const bool is_known = std::find(found.begin(), found.end(), name) != found.end();
  if (is_known || name.starts_with(kOwnNamespace)) return;
  found.emplace_back(name);
  if (const auto* single = dynamic_cast<const abi::__si_class_type_info*>(&type)) {
    add_classes(*single->__base_type, found);
  } else if (const auto* several = dynamic_cast<const abi::__vmi_class_type_info*>(&type)) {
    for (unsigned int i = 0; i < several->__base_count; ++i)
      add_classes(*several->__base_info[i].__base_type, found);
  }
}

std::string readable(const std::string& name) {
  int status = 0;
  const std::unique_ptr<char, decltype(&std::free)> text(
      abi::__cxa_demangle(name.c_str(), nullptr, nullptr, &status), &std::free);
  return status == 0 && text != nullptr ? text.get() : name;
}

/// Without its folder: a library that was loaded anew is a copy in a folder that is gone.
std::string library_of(const ConfigurablePart& part) {
  const ClassBuilds* builds = part.class_builds();
  if (builds == nullptr || builds->library.empty()) return {};
  return " of " + builds->library.substr(builds->library.rfind('/') + 1);
}

}  // namespace

const ClassBuild* ClassBuilds::find(const std::string& name) const noexcept {
  const auto found = std::find_if(classes.begin(), classes.end(),
                                  [&name](const ClassBuild& each) { return each.name == name; });
  return found != classes.end() ? &*found : nullptr;
}

std::vector<std::string> user_classes(const std::type_info& type) {
  std::vector<std::string> found;
  add_classes(type, found);
  return found;
}

const ClassBuild* find_other_build(const ConfigurablePart& part, const ConfigurablePart& other) noexcept {
  const ClassBuilds* own = part.class_builds();
  const ClassBuilds* others = other.class_builds();
  if (own == nullptr || others == nullptr) return nullptr;
  for (const ClassBuild& each : own->classes) {
    const ClassBuild* same = others->find(each.name);
    if (same != nullptr && same->generation != each.generation) return &each;
  }
  return nullptr;
}

void require_same_builds(const ConfigurablePart& expected, const ConfigurablePart& part) {
  const ClassBuild* build = find_other_build(expected, part);
  if (build == nullptr) return;
  const ClassBuild* found = part.class_builds()->find(build->name);
  throw Error(ErrorCode::type_mismatch,
              "the parts were compiled for two builds of the class " + readable(build->name),
              {.element = part.description() + library_of(part),
               .expected = "generation " + std::to_string(build->generation) + ", as " +
                           expected.description() + library_of(expected),
               .found = "generation " + std::to_string(found->generation),
               .remedy = "build the packages of both, and reload both in one request"});
}

}  // namespace mauve
