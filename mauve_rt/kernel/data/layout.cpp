// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/data/layout.hpp"

#include <dlfcn.h>

#include <algorithm>

#include "mauve_rt/data/number_place.hpp"

namespace mauve {

namespace {

std::string words(const FieldShape& field) {
  return item_text(field) + array_text(field) + " " + field.name + " at byte " + std::to_string(field.offset);
}

bool is_same(const FieldShape& one, const FieldShape& other) {
  const bool is_named_so = detail::is_field(one.name, other.name) || detail::is_field(other.name, one.name);
  return is_named_so && one.type == other.type && one.text_capacity == other.text_capacity &&
         one.arity == other.arity && one.size == other.size && one.offset == other.offset &&
         one.item_bytes == other.item_bytes;
}

std::optional<LayoutDifference> difference(const std::vector<FieldShape>& expected,
                                           const std::vector<FieldShape>& found) {
  for (std::size_t i = 0; i < std::max(expected.size(), found.size()); ++i) {
    if (i >= expected.size()) return LayoutDifference{found[i].name, "no such field", words(found[i])};
    if (i >= found.size()) return LayoutDifference{expected[i].name, words(expected[i]), "no such field"};
    if (expected[i].type == found[i].type) {  // first: where a message within has grown, the cause is there
      if (auto inner = difference(expected[i].fields, found[i].fields)) {
        inner->field = expected[i].name + "." + inner->field;
        return inner;
      }
    }
    if (!is_same(expected[i], found[i]))
      return LayoutDifference{expected[i].name, words(expected[i]), words(found[i])};
  }
  return {};
}

}  // namespace

std::optional<LayoutDifference> layout_difference(const MessageShape& expected, const MessageShape& found) {
  if (auto of_field = difference(expected.fields, found.fields)) return of_field;
  if (expected.bytes == found.bytes) return {};
  return LayoutDifference{"", std::to_string(expected.bytes) + " bytes",
                          std::to_string(found.bytes) + " bytes"};
}

std::string library_of(const void* polymorphic_object) {
  const void* const table = *static_cast<const void* const*>(polymorphic_object);  // Itanium C++ ABI, 2.4
  Dl_info info{};
  return dladdr(table, &info) != 0 && info.dli_fname != nullptr ? info.dli_fname : "";
}

}  // namespace mauve
