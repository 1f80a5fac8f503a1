// SPDX-License-Identifier: LGPL-3.0-or-later
// What shells, cores and fsms have in common.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <utility>

#include "mauve_rt/base/configurable.hpp"
#include "mauve_rt/base/rt.hpp"

namespace mauve {

/// Throws Error (prepare_failed). [non-rt]
[[noreturn]] void throw_no_object(const std::string& part);

/// A part of a component. Base: Shell, CoreBase or FsmBase.
template <typename Base>
class ComponentPart : public ConfigurablePart {
 public:
  using Factory = std::function<std::unique_ptr<Base>()>;

  /// [setup]
  void set_implementation(std::string name) { implementation_ = std::move(name); }
  /// package/Class [rt]
  const std::string& implementation() const MAUVE_RT { return implementation_; }

  /// What makes another instance of the same; it goes where the part goes. [setup]
  void set_factory(Factory make) { make_ = std::move(make); }
  /// Another instance of the same; nullptr: no factory was given. [non-rt] Throws Error (prepare_failed), or what the factory throws.
  std::unique_ptr<Base> another() const {
    if (!make_) return nullptr;
    std::unique_ptr<Base> made = make_();
    if (made == nullptr) throw_no_object(description());
    made->set_implementation(implementation_);
    made->set_factory(make_);
    if constexpr (requires { made->wcet_ns(); }) made->set_wcet_ns(static_cast<const Base*>(this)->wcet_ns());
    return made;
  }

 private:
  friend Base;
  ComponentPart() = default;

  std::string implementation_;
  Factory make_{};
};

/// A part of that type, of which others can be made, each from copies of the arguments. [non-rt]
template <typename Base, typename Type, typename... Args>
std::unique_ptr<Base> new_part(const Args&... args) {
  auto part = std::make_unique<Type>(args...);
  part->set_factory([args...] { return std::make_unique<Type>(args...); });
  return part;
}

}  // namespace mauve
