// SPDX-License-Identifier: LGPL-3.0-or-later
// BMP without compression: palettes of 1, 4 and 8 bits a pixel, colours of 24 and 32. Format: BITMAPFILEHEADER and
// BITMAPINFOHEADER up to BITMAPV5HEADER of Windows. OS/2's headers, 16 bits a pixel and run lengths are refused.
#include <array>
#include <bit>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <string>

#include "grey_image.hpp"
#include "mauve_examples/map_file.hpp"

namespace mauve_examples {

namespace {

/// One BMP file in memory. Each read is checked against the end of the file.
class BmpFile {
 public:
  explicit BmpFile(const std::filesystem::path& path) : path_(path) {
    std::ifstream file(path, std::ios::binary);
    bytes_.assign(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>());
    read_header();
  }

  GreyImage read() const {
    GreyImage image{width_, height_};
    image.greys.reserve(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_));
    for (int row = 0; row < height_; ++row) {
      const std::size_t begin =
          pixels_ + row_bytes_ * static_cast<std::size_t>(top_down_ ? row : height_ - 1 - row);
      for (std::size_t column = 0; column < static_cast<std::size_t>(width_); ++column) {
        if (bits_ <= 8) {
          image.greys.push_back(palette_grey(begin, column));
        } else if (bits_ == 24) {
          image.greys.push_back(colour_grey(begin + 3 * column));
        } else {
          const std::uint32_t pixel = u32(begin + 4 * column);
          image.greys.push_back(
              grey_of(masked(pixel, masks_[0]), masked(pixel, masks_[1]), masked(pixel, masks_[2])));
          if (masks_[3] != 0) image.alphas.push_back(to_8_bits(masked(pixel, masks_[3])));
        }
      }
    }
    return image;
  }

 private:
  static constexpr std::size_t kHeader = 14;  // the header of the image, after that of the file
  static constexpr std::size_t kMasks = kHeader + 40;
  static constexpr std::uint32_t kPlain = 0;  // values of the field compression
  static constexpr std::uint32_t kWithMasks = 3;

  void read_header() {
    pixels_ = u32(10);
    const std::uint32_t header_bytes = u32(kHeader);
    if (header_bytes != 40 && header_bytes != 56 && header_bytes != 108 && header_bytes != 124)
      refuse("a header of 40, 56, 108 or 124 bytes", std::to_string(header_bytes) + " bytes");
    const auto width = static_cast<std::int32_t>(u32(kHeader + 4));
    const auto height = static_cast<std::int32_t>(u32(kHeader + 8));
    check_image_size(path_, width < 0 ? 0 : static_cast<unsigned long long>(width),
                     static_cast<unsigned long long>(std::llabs(height)));
    width_ = width;
    height_ = std::abs(height);
    top_down_ = height < 0;
    bits_ = u16(kHeader + 14);
    const std::uint32_t compression = u32(kHeader + 16);
    if (bits_ != 1 && bits_ != 4 && bits_ != 8 && bits_ != 24 && bits_ != 32)
      refuse("1, 4, 8, 24 or 32 bits a pixel", std::to_string(bits_));
    if (compression != kPlain && !(compression == kWithMasks && bits_ == 32))
      refuse("no compression", "compression " + std::to_string(compression));
    if (compression == kWithMasks) read_masks(header_bytes >= 56);
    if (bits_ <= 8) read_palette(kHeader + header_bytes);
    row_bytes_ = (static_cast<std::size_t>(width_) * bits_ + 31) / 32 * 4;
    const std::size_t size = row_bytes_ * static_cast<std::size_t>(height_);
    if (pixels_ > bytes_.size() || bytes_.size() - pixels_ < size)
      truncated(std::to_string(size) + " bytes of pixels");
  }

  void read_masks(bool has_alpha) {
    for (std::size_t channel = 0; channel < 4; ++channel)
      masks_[channel] = channel < 3 || has_alpha ? u32(kMasks + 4 * channel) : 0;
    if (masks_[0] == 0 || masks_[1] == 0 || masks_[2] == 0) refuse("a mask for each colour", "a mask of 0");
  }

  void read_palette(std::size_t begin) {
    const std::uint32_t most = 1U << bits_;
    const std::uint32_t declared = u32(kHeader + 32);
    if (declared > most) refuse("at most " + std::to_string(most) + " colours", std::to_string(declared));
    palette_size_ = declared == 0 ? most : declared;
    for (std::size_t i = 0; i < palette_size_; ++i) palette_[i] = colour_grey(begin + 4 * i);
  }

  std::uint8_t palette_grey(std::size_t row, std::size_t column) const {
    const std::size_t bit = column * bits_;
    const std::uint32_t index = u8(row + bit / 8) >> (8 - bits_ - bit % 8) & ((1U << bits_) - 1);
    if (index >= palette_size_)
      refuse("pixels of at most " + std::to_string(palette_size_ - 1), std::to_string(index));
    return palette_[index];
  }

  /// The grey of blue, green and red, a byte each.
  std::uint8_t colour_grey(std::size_t at) const {
    return grey_of(u8(at + 2) * 257, u8(at + 1) * 257, u8(at) * 257);
  }

  /// The channel of a mask with 16 bits; one of at most 8 bits is repeated in the lower half.
  static std::uint32_t masked(std::uint32_t pixel, std::uint32_t mask) {
    const int shift = std::countl_zero(mask);
    const std::uint32_t value = (pixel & mask) << shift >> 16U;
    return std::countl_one(mask << shift) <= 8 ? value | value >> 8U : value;
  }

  std::uint32_t u8(std::size_t at) const {
    if (at >= bytes_.size()) truncated("a byte at " + std::to_string(at));
    return static_cast<unsigned char>(bytes_[at]);
  }
  std::uint32_t u16(std::size_t at) const { return u8(at) | u8(at + 1) << 8U; }
  std::uint32_t u32(std::size_t at) const { return u16(at) | u16(at + 2) << 16U; }

  [[noreturn]] void truncated(const std::string& expected) const {
    throw MapError({"map image is truncated", path_.string(), expected,
                    "end of file after " + std::to_string(bytes_.size()) + " bytes",
                    "copy or write the image again"});
  }

  [[noreturn]] void refuse(const std::string& expected, const std::string& found) const {
    throw MapError({"map image is a BMP of another kind", path_.string(), expected, found,
                    "save the image as PGM or PNG"});
  }

  std::filesystem::path path_;
  std::string bytes_;
  int width_{0};
  int height_{0};
  bool top_down_{false};
  std::uint32_t bits_{0};
  std::size_t pixels_{0};
  std::size_t row_bytes_{0};
  std::array<std::uint32_t, 4> masks_{0xFF0000, 0xFF00, 0xFF, 0xFF000000};  // red, green, blue, alpha
  std::array<std::uint8_t, 256> palette_{};
  std::size_t palette_size_{0};
};

}  // namespace

GreyImage read_bmp(const std::filesystem::path& path) { return BmpFile(path).read(); }

}  // namespace mauve_examples
