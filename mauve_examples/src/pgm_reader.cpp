// SPDX-License-Identifier: LGPL-3.0-or-later
// PGM, plain (P2) and raw (P5). Format: netpbm's pgm(5).
#include <cctype>
#include <fstream>
#include <iterator>
#include <optional>
#include <string>

#include "grey_image.hpp"
#include "mauve_examples/map_file.hpp"

namespace mauve_examples {

namespace {

/// Reads the whitespace-separated words of a PGM file; a '#' starts a comment that ends with the line.
class PgmWords {
 public:
  PgmWords(const std::filesystem::path& path, const std::string& bytes) : path_(path), bytes_(bytes) {}

  /// The next number; a word that is none, or a missing one, is an error.
  unsigned long long number(const std::string& what, unsigned long long limit) {
    const std::optional<char> first = skip_to_word();
    if (!first) truncated(what);
    unsigned long long value = 0;
    const std::size_t start = position_;
    while (position_ < bytes_.size() && std::isdigit(static_cast<unsigned char>(bytes_[position_])) != 0) {
      value = value * 10 + static_cast<unsigned long long>(bytes_[position_++] - '0');
      if (value > limit) refuse(what, "at most " + std::to_string(limit), "more");
    }
    if (position_ == start) refuse(what, "a number", std::string("'") + *first + "'");
    return value;
  }

  /// Skips the one whitespace character that ends a raw file's header.
  void end_header() {
    if (position_ >= bytes_.size()) truncated("pixels");
    if (std::isspace(static_cast<unsigned char>(bytes_[position_])) == 0) {
      refuse("end of the header", "one whitespace character", std::string("'") + bytes_[position_] + "'");
    }
    ++position_;
  }

  std::size_t position() const { return position_; }

  [[noreturn]] void truncated(const std::string& what) const {
    throw MapError({"map image is truncated", path_.string(), what,
                    "end of file after " + std::to_string(bytes_.size()) + " bytes",
                    "copy or write the image again"});
  }

 private:
  std::optional<char> skip_to_word() {
    while (position_ < bytes_.size()) {
      const char c = bytes_[position_];
      if (c == '#') {
        position_ = std::min(bytes_.find('\n', position_), bytes_.size());
      } else if (std::isspace(static_cast<unsigned char>(c)) != 0) {
        ++position_;
      } else {
        return c;
      }
    }
    return std::nullopt;
  }

  [[noreturn]] void refuse(const std::string& what, const std::string& expected,
                           const std::string& found) const {
    throw MapError({"map image is no valid PGM", path_.string(), what + " to be " + expected, found,
                    "save the image again as PGM or PNG"});
  }

  const std::filesystem::path& path_;
  const std::string& bytes_;
  std::size_t position_{2};  // after the magic number
};

}  // namespace

GreyImage read_pgm(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  const bool raw = bytes.starts_with("P5");
  PgmWords words(path, bytes);
  const auto width = words.number("width", 1'000'000);
  const auto height = words.number("height", 1'000'000);
  check_image_size(path, width, height);
  const auto white = words.number("maximum value", 65'535);
  if (white == 0) {
    throw MapError({"map image has another depth", path.string(), "a maximum value of 1 to 65535", "0",
                    "save the image again"});
  }

  GreyImage image{static_cast<int>(width), static_cast<int>(height)};
  const std::size_t pixels = width * height;
  const std::size_t bytes_per_pixel = white > 255 ? 2 : 1;
  image.greys.reserve(pixels);
  if (raw) {
    words.end_header();
    if (bytes.size() - words.position() < pixels * bytes_per_pixel)
      words.truncated(std::to_string(pixels * bytes_per_pixel) + " bytes of pixels");
  }
  const auto byte = [&](std::size_t at) {
    return std::uint32_t{static_cast<unsigned char>(bytes[words.position() + at])};
  };
  for (std::size_t i = 0; i < pixels; ++i) {
    unsigned long long value = 0;
    if (!raw) {
      value = words.number("pixel " + std::to_string(i), white);
    } else {
      value = bytes_per_pixel == 1 ? byte(i) : byte(2 * i) << 8U | byte(2 * i + 1);
    }
    if (value > white) {
      throw MapError({"map image is no valid PGM", path.string(),
                      "pixels of at most " + std::to_string(white), std::to_string(value),
                      "save the image again"});
    }
    image.greys.push_back(to_8_bits(static_cast<std::uint32_t>((value * 65'535 + white / 2) / white)));
  }
  return image;
}

}  // namespace mauve_examples
