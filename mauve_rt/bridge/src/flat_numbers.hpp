// SPDX-License-Identifier: LGPL-3.0-or-later
// All numbers of a serialized message as doubles, in one order that is known before.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace mauve {
class CdrReader;
}

namespace mauve::bridge {

/// A field of a message, in the words of .msg files.
struct FlatField {
  enum class Arity : std::uint8_t { one, fixed, sequence };

  std::string name{};
  std::string type{};  // of an element: float64, string, ...; of a message its name
  Arity arity{Arity::one};
  std::size_t size{0};              // of a fixed array
  std::vector<FlatField> fields{};  // of a message
};

/// Reads the numbers of messages of one type. A sequence has one number, its length; a text has none.
class FlatNumbers {
 public:
  static constexpr std::size_t kMost = 1000;

  /// Throws Error (unknown_type): a field's type is not known; (out_of_range): no number, or more than kMost. [non-rt]
  explicit FlatNumbers(std::vector<FlatField> fields);
  /// The one number at a path, of a sequence's element, too: position[1], path.length.
  /// Throws Error (invalid_argument): there is no number at the path. [non-rt]
  FlatNumbers(std::vector<FlatField> fields, const std::string& path);

  /// What the numbers are: position.x, ranges[3], path.length. [non-rt]
  const std::vector<std::string>& names() const noexcept { return names_; }
  /// Into `numbers`, in that order; false when the message is malformed. NaN: a sequence lacks the element of the
  /// path. [non-rt]
  bool read(std::span<const std::byte> message, std::vector<double>& numbers) const;

 private:
  /// One part of a path: a field of a message, and which element of the field.
  struct Part {
    std::size_t field{0};
    std::optional<std::size_t> element{};  // none: the field itself, or the length of a sequence
  };

  bool find(const std::vector<FlatField>& fields, std::string_view path);
  bool read_at(const std::vector<FlatField>& fields, std::size_t depth, CdrReader& reader,
               double& number) const;
  void name(const std::vector<FlatField>& fields, const std::string& before);
  void name_element(const FlatField& field, const std::string& name);

  std::vector<FlatField> fields_;
  std::vector<std::string> names_;
  std::vector<Part> path_;  // empty: all numbers
};

}  // namespace mauve::bridge
