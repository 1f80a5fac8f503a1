// SPDX-License-Identifier: LGPL-3.0-or-later
#include "flat_numbers.hpp"

#include <map>
#include <utility>

#include "mauve_rt/base/error.hpp"
#include "mauve_rt/data/cdr.hpp"

namespace mauve::bridge {

namespace {

using ReadNumber = bool (*)(CdrReader& reader, double& number);

template <typename T>
bool read_number(CdrReader& reader, double& number) {
  T value{};
  if (!reader.get(value)) return false;
  number = static_cast<double>(value);
  return true;
}

const std::map<std::string, ReadNumber, std::less<>>& number_types() {
  static const std::map<std::string, ReadNumber, std::less<>> types{
      {"bool", read_number<std::uint8_t>},    {"byte", read_number<std::uint8_t>},
      {"char", read_number<std::uint8_t>},    {"int8", read_number<std::int8_t>},
      {"uint8", read_number<std::uint8_t>},   {"int16", read_number<std::int16_t>},
      {"uint16", read_number<std::uint16_t>}, {"int32", read_number<std::int32_t>},
      {"uint32", read_number<std::uint32_t>}, {"int64", read_number<std::int64_t>},
      {"uint64", read_number<std::uint64_t>}, {"float32", read_number<float>},
      {"float64", read_number<double>}};
  return types;
}

bool is_text(const FlatField& field) { return field.type == "string"; }

bool skip_text(CdrReader& reader) {
  std::uint32_t size = 0;
  if (!reader.get(size)) return false;
  std::uint8_t letter = 0;
  for (std::uint32_t i = 0; i < size; ++i) {
    if (!reader.get(letter)) return false;
  }
  return true;
}

bool read_fields(const std::vector<FlatField>& fields, CdrReader& reader, std::vector<double>* numbers);

/// `numbers`: nullptr to go past it.
bool read_element(const FlatField& field, CdrReader& reader, std::vector<double>* numbers) {
  if (is_text(field)) return skip_text(reader);
  const auto number_type = number_types().find(field.type);
  if (number_type == number_types().end()) return read_fields(field.fields, reader, numbers);
  double number = 0;
  if (!number_type->second(reader, number)) return false;
  if (numbers != nullptr) numbers->push_back(number);
  return true;
}

bool read_fields(const std::vector<FlatField>& fields, CdrReader& reader, std::vector<double>* numbers) {
  if (fields.empty()) {  // a message without fields has one byte on the wire
    std::uint8_t nothing = 0;
    return reader.get(nothing);
  }
  for (const FlatField& field : fields) {
    std::size_t count = field.arity == FlatField::Arity::fixed ? field.size : 1;
    std::vector<double>* into = numbers;
    if (field.arity == FlatField::Arity::sequence) {
      std::uint32_t length = 0;
      if (!reader.get(length)) return false;
      if (numbers != nullptr) numbers->push_back(length);
      count = length;
      into = nullptr;
    }
    for (std::size_t i = 0; i < count; ++i) {
      if (!read_element(field, reader, into)) return false;
    }
  }
  return true;
}

}  // namespace

FlatNumbers::FlatNumbers(std::vector<FlatField> fields) : fields_(std::move(fields)) {
  name(fields_, "");
  if (!names_.empty() && names_.size() <= kMost) return;
  throw Error(ErrorCode::out_of_range, "the value has too many or no numbers",
              {.element = "numbers of the value",
               .expected = "1 to " + std::to_string(kMost),
               .found = names_.empty() ? "none" : "more",
               .remedy = "name one field of it, or use a type that is a ROS message"});
}

void FlatNumbers::name(const std::vector<FlatField>& fields, const std::string& before) {
  for (const FlatField& field : fields) {
    const std::string name = before + field.name;
    switch (field.arity) {
      case FlatField::Arity::one:
        name_element(field, name);
        break;
      case FlatField::Arity::fixed:
        for (std::size_t i = 0; i < field.size && names_.size() <= kMost; ++i)
          name_element(field, name + "[" + std::to_string(i) + "]");
        break;
      case FlatField::Arity::sequence:
        names_.push_back(name + ".length");
    }
  }
}

void FlatNumbers::name_element(const FlatField& field, const std::string& name) {
  if (number_types().contains(field.type)) {
    names_.push_back(name);
  } else if (!is_text(field)) {
    if (field.type.find('/') == std::string::npos) {
      throw Error(
          ErrorCode::unknown_type, "the value has a field whose type cannot be read",
          {.element = "field " + name, .expected = "a number, a string or a message", .found = field.type});
    }
    this->name(field.fields, name + ".");
  }
}

bool FlatNumbers::read(std::span<const std::byte> message, std::vector<double>& numbers) const {
  numbers.clear();
  CdrReader reader(message);
  return read_fields(fields_, reader, &numbers);
}

}  // namespace mauve::bridge
