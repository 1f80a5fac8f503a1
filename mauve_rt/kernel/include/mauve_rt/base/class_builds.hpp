// SPDX-License-Identifier: LGPL-3.0-or-later
// Class builds: for which build of each of its classes a part was compiled.
//
// A library has a copy of each base class of its parts, compiled in: the places of members, the table of virtual functions. The
// library that defines the base class may be loaded anew, and this library not. Parts of both are then of two builds of one class,
// and must not be combined. C++ does not notice: the class has the same name.
#pragma once

#include <string>
#include <typeinfo>
#include <vector>

namespace mauve {

class ConfigurablePart;

/// One class, and the generation of the library that defines it.
struct ClassBuild {
  std::string name;  // as the compiler writes it: std::type_info::name()
  int generation{1};
};

/// For which builds of classes the code of one library's part was compiled. All functions [non-rt].
struct ClassBuilds {
  std::string library;  // empty: none, of the program itself
  std::vector<ClassBuild> classes;

  /// nullptr: the part has no such class.
  const ClassBuild* find(const std::string& name) const noexcept;
};

/// A class and its base classes, without those of MAUVE RT, whose version each library is checked for. The class itself comes
/// first, then each base before its own bases. [non-rt]
std::vector<std::string> user_classes(const std::type_info& type);

/// The class that two parts have in two builds. nullptr: there is none. [non-rt]
const ClassBuild* find_other_build(const ConfigurablePart& part, const ConfigurablePart& other) noexcept;

/// Throws Error (type_mismatch): the part was compiled for another build of one of its classes than `expected`. [non-rt]
void require_same_builds(const ConfigurablePart& expected, const ConfigurablePart& part);

}  // namespace mauve
