// SPDX-License-Identifier: LGPL-3.0-or-later
// An image in shades of grey, and its readers, one for each format. Greys and alphas are those that the ROS map
// server has from GraphicsMagick with 16 bits a channel: deeper channels lose their lower bits.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

namespace mauve_examples {

/// Pixels row by row from the top.
struct GreyImage {
  int width{0};
  int height{0};
  std::vector<std::uint8_t> greys{};   // 0 black to 255 white
  std::vector<std::uint8_t> alphas{};  // 0 clear to 255 opaque; empty: the image has no alpha
};

/// A channel of 16 bits in 8 bits. [rt]
inline std::uint8_t to_8_bits(std::uint32_t channel) noexcept {
  return static_cast<std::uint8_t>(channel / 257);
}

/// The grey of a colour whose channels have 16 bits: luma of Rec. 601, in float as GraphicsMagick. [rt]
inline std::uint8_t grey_of(std::uint32_t red, std::uint32_t green, std::uint32_t blue) noexcept {
  if (red == green && green == blue) return to_8_bits(red);
  const float luma = 0.299F * static_cast<float>(red) + 0.587F * static_cast<float>(green) +
                     0.114F * static_cast<float>(blue);
  return to_8_bits(static_cast<std::uint32_t>(static_cast<double>(luma) + 0.5));
}

/// Reads a PGM file, plain (P2) or raw (P5), of at most 16 bits a pixel. Throws MapError. [non-rt]
GreyImage read_pgm(const std::filesystem::path& path);

/// Reads a PNG file of any colour type and depth. Gamma and colour profiles have no effect. Throws MapError. [non-rt]
GreyImage read_png(const std::filesystem::path& path);

/// Reads a BMP file without compression, of 1, 4, 8, 24 or 32 bits a pixel. Throws MapError. [non-rt]
GreyImage read_bmp(const std::filesystem::path& path);

/// Refuses maps that have no cells or more than kMaxMapCells. Throws MapError. [non-rt]
void check_image_size(const std::filesystem::path& path, unsigned long long width, unsigned long long height);

}  // namespace mauve_examples
