// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/parts/shell.hpp"

#include "mauve_rt/base/error.hpp"

#include "base/names.hpp"

namespace mauve {

namespace {

template <typename Item>
Item* find_named(const std::vector<std::unique_ptr<Item>>& items, std::string_view name) noexcept {
  for (const auto& item : items) {
    if (item->name() == name) return item.get();
  }
  return nullptr;
}

}  // namespace

PortBase* Shell::find_port(std::string_view name) const noexcept { return find_named(ports_, name); }
PropertyBase* Shell::find_property(std::string_view name) const noexcept {
  return find_named(properties_, name);
}

void Shell::set_context(const Context* context) noexcept {
  context_ = context;
  for (const auto& port : ports_) port->set_context(context);
}

LargestMessage largest_message(const Shell& shell) {
  LargestMessage largest;
  for (const auto& port : shell.ports()) {
    for (const MessageShape& message : port->messages()) {
      if (message.bytes > largest.bytes) largest = {port->name(), message.type, message.bytes};
    }
  }
  return largest;
}

std::size_t stack_bytes_for(const LargestMessage& largest) noexcept {
  constexpr std::size_t kForOthers = std::size_t{32} * 1024;
  return 2 * largest.bytes + kForOthers;
}

void Shell::check_new(const std::string& name) const {
  check_name("port or property", name);
  if (find_port(name) != nullptr || find_property(name) != nullptr) {
    throw Error(ErrorCode::duplicate_name, "the shell declares the name twice",
                {.element = name, .remedy = "give ports and properties names of their own"});
  }
}

}  // namespace mauve
