// SPDX-License-Identifier: LGPL-3.0-or-later
// An image as shares of white, and its two readers.
#pragma once

#include <filesystem>
#include <vector>

namespace mauve_examples {

/// Pixels row by row from the top, 0 black to 1 white.
struct GreyImage {
  int width{0};
  int height{0};
  std::vector<double> shades;
};

/// Reads a PGM file, plain (P2) or raw (P5), of at most 8 bits a pixel. Throws MapError. [non-rt]
GreyImage read_pgm(const std::filesystem::path& path);

/// Reads a PNG file; a pixel's shade is the mean of its channels, alpha included, as in nav2_map_server's
/// trinary mode. Throws MapError. [non-rt]
GreyImage read_png(const std::filesystem::path& path);

/// Refuses images that hold nothing or more than kMaxMapCells. Throws MapError. [non-rt]
void check_image_size(const std::filesystem::path& path, unsigned long long width, unsigned long long height);

}  // namespace mauve_examples
