// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/parts/handover.hpp"

#include <algorithm>
#include <cstring>

#include "mauve_rt/parts/core.hpp"

namespace mauve {

namespace {

std::string fields_text(const std::vector<FieldShape>& fields) {
  std::string text;
  for (const FieldShape& field : fields) {
    if (!text.empty()) text += ", ";
    text += field.name + ": " + type_text(field, 0) + " at " + std::to_string(field.offset);
  }
  return text;
}

/// An old core of another generation: no user's code finds its own type in it.
class Stranger final : public CoreBase {
 public:
  explicit Stranger(const CoreBase& core) { set_implementation(core.implementation()); }
  bool bind_shell(Shell& /*shell*/) noexcept override { return false; }
};

}  // namespace

std::string type_text(const FieldShape& shape, std::size_t bytes) {
  std::string text = item_text(shape);
  if (!shape.fields.empty()) {
    text += "{" + fields_text(shape.fields) + "}";
    if (bytes != 0) text += " of " + std::to_string(bytes) + " bytes";
  }
  return text + array_text(shape);
}

std::string detail::state_name(std::string_view member) {
  constexpr std::string_view kThis = "this->";
  if (member.starts_with(kThis)) member.remove_prefix(kThis.size());
  while (member.ends_with('_')) member.remove_suffix(1);
  return std::string(member);
}

Handover::Handover(CoreBase& old, CoreBase& fresh) : old_(old), fresh_(fresh) {
  const bool is_stranger = old.generation() != fresh.generation() || find_other_build(old, fresh) != nullptr;
  if (is_stranger && !fresh.is_dynamic()) stranger_ = std::make_unique<Stranger>(old);
  const std::vector<StateField> before = old.state_fields();
  const std::vector<StateField> now = fresh.state_fields();
  const auto named = [](const std::vector<StateField>& fields, const std::string& name) {
    return std::find_if(fields.begin(), fields.end(),
                        [&name](const StateField& field) { return field.name == name; });
  };
  for (const StateField& field : now) {
    const auto from = named(before, field.name);
    if (from == before.end()) {
      left_.push_back(field.name + ": the old core has no such field");
    } else if (from->type != field.type || from->bytes != field.bytes) {
      left_.push_back(field.name + ": " + from->type + " before, " + field.type + " now");
    } else {
      taken_.push_back(field.name);
      copies_.push_back({from->value, field.value, field.bytes});
      bytes_ += field.bytes;
    }
  }
  if (stranger_ != nullptr && before.empty() && now.empty())
    left_.emplace_back("everything: the cores are of two builds, and neither declares state fields");
  for (const StateField& field : before) {
    if (named(now, field.name) == now.end()) left_.push_back(field.name + ": the new core has no such field");
  }
}

Handover::~Handover() = default;

bool Handover::adopt() const { return fresh_.adopt(stranger_ != nullptr ? *stranger_ : old_); }

void Handover::copy() noexcept {
  if (copies_.empty()) return;
  is_whole_ = old_.store_state();
  for (const Copy& copy : copies_) std::memcpy(copy.to, copy.from, copy.bytes);
  fresh_.load_state();
}

void Handover::save(std::byte* fields) noexcept {
  if (copies_.empty()) return;
  is_whole_ = old_.store_state();
  for (const Copy& copy : copies_) {
    std::memcpy(fields, copy.from, copy.bytes);
    fields += copy.bytes;
  }
}

void Handover::load(const std::byte* fields) noexcept {
  if (copies_.empty()) return;
  for (const Copy& copy : copies_) {
    std::memcpy(copy.to, fields, copy.bytes);
    fields += copy.bytes;
  }
  fresh_.load_state();
}

void Handover::take() noexcept {
  copy();
  fresh_.take(stranger_ != nullptr ? *stranger_ : old_);
}

}  // namespace mauve
