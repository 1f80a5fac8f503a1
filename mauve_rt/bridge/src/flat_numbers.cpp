// SPDX-License-Identifier: LGPL-3.0-or-later
#include "flat_numbers.hpp"

#include <algorithm>
#include <charconv>
#include <limits>
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

/// How many elements come next; false when the message is malformed.
bool read_count(const FlatField& field, CdrReader& reader, std::size_t& count) {
  count = field.arity == FlatField::Arity::fixed ? field.size : 1;
  if (field.arity != FlatField::Arity::sequence) return true;
  std::uint32_t length = 0;
  if (!reader.get(length)) return false;
  count = length;
  return true;
}

bool read_field(const FlatField& field, CdrReader& reader, std::vector<double>* numbers) {
  std::size_t count = 0;
  if (!read_count(field, reader, count)) return false;
  std::vector<double>* into = numbers;
  if (field.arity == FlatField::Arity::sequence) {
    if (numbers != nullptr) numbers->push_back(static_cast<double>(count));
    into = nullptr;
  }
  for (std::size_t i = 0; i < count; ++i) {
    if (!read_element(field, reader, into)) return false;
  }
  return true;
}

bool read_fields(const std::vector<FlatField>& fields, CdrReader& reader, std::vector<double>* numbers) {
  if (fields.empty()) {  // a message without fields has one byte on the wire
    std::uint8_t nothing = 0;
    return reader.get(nothing);
  }
  return std::all_of(fields.begin(), fields.end(),
                     [&](const FlatField& field) { return read_field(field, reader, numbers); });
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

FlatNumbers::FlatNumbers(std::vector<FlatField> fields, const std::string& path)
    : fields_(std::move(fields)), names_{path} {
  if (find(fields_, path)) return;
  throw Error(ErrorCode::invalid_argument, "the value has no number there",
              {.element = "field " + path,
               .expected = "the path of a number, such as position.x, ranges[3] or ranges.length",
               .found = path,
               .remedy = "correct the path"});
}

bool FlatNumbers::find(const std::vector<FlatField>& fields, std::string_view path) {
  const std::size_t end = std::min(path.find('.'), path.size());
  std::string_view name = path.substr(0, end);
  const std::string_view rest = path.substr(std::min(end + 1, path.size()));
  Part part;
  if (const std::size_t bracket = name.find('['); bracket != std::string_view::npos) {
    const std::string_view index = name.substr(bracket + 1);
    std::size_t element = 0;
    const auto [last, error] = std::from_chars(index.data(), index.data() + index.size(), element);
    if (error != std::errc() || last + 1 != index.data() + index.size() || *last != ']') return false;
    part.element = element;
    name = name.substr(0, bracket);
  }
  const auto field =
      std::find_if(fields.begin(), fields.end(), [&](const FlatField& each) { return each.name == name; });
  if (field == fields.end() || is_text(*field)) return false;
  part.field = static_cast<std::size_t>(field - fields.begin());
  path_.push_back(part);
  if (field->arity == FlatField::Arity::sequence && !part.element) return rest == "length";
  if ((field->arity == FlatField::Arity::one) == part.element.has_value()) return false;
  if (field->arity == FlatField::Arity::fixed && part.element.value_or(0) >= field->size) return false;
  if (number_types().contains(field->type)) return end == path.size();
  return end < path.size() && find(field->fields, rest);
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
  if (path_.empty()) return read_fields(fields_, reader, &numbers);
  return read_at(fields_, 0, reader, numbers.emplace_back());
}

bool FlatNumbers::read_at(const std::vector<FlatField>& fields, std::size_t depth, CdrReader& reader,
                          double& number) const {
  const Part& part = path_[depth];
  for (std::size_t i = 0; i < part.field; ++i) {
    if (!read_field(fields[i], reader, nullptr)) return false;
  }
  const FlatField& field = fields[part.field];
  std::size_t count = 0;
  if (!read_count(field, reader, count)) return false;
  if (field.arity == FlatField::Arity::sequence && !part.element) {
    number = static_cast<double>(count);
    return true;
  }
  const std::size_t element = part.element.value_or(0);
  if (element >= count) {
    number = std::numeric_limits<double>::quiet_NaN();
    return true;
  }
  for (std::size_t i = 0; i < element; ++i) {
    if (!read_element(field, reader, nullptr)) return false;
  }
  const auto number_type = number_types().find(field.type);
  if (number_type != number_types().end()) return number_type->second(reader, number);
  return read_at(field.fields, depth + 1, reader, number);
}

}  // namespace mauve::bridge
