// SPDX-License-Identifier: LGPL-3.0-or-later
// PNG of any colour type and depth, through libpng. libpng's simplified interface would apply the gamma chunk,
// which the map server does not.
#include <png.h>

#include <array>
#include <csetjmp>
#include <cstdio>
#include <fstream>
#include <memory>
#include <string>

#include "grey_image.hpp"
#include "mauve_examples/map_file.hpp"

namespace mauve_examples {

namespace {

/// The memory of libpng for one image, freed also when an error leaves the reader.
class PngMemory {
 public:
  PngMemory() : png(png_create_read_struct(PNG_LIBPNG_VER_STRING, &problem, &leave, &ignore)) {
    if (png != nullptr) info = png_create_info_struct(png);
    if (info == nullptr) problem = "no memory";
  }
  ~PngMemory() { png_destroy_read_struct(&png, &info, nullptr); }
  PngMemory(const PngMemory&) = delete;
  PngMemory& operator=(const PngMemory&) = delete;

  std::string problem;
  png_structp png;
  png_infop info{nullptr};

 private:
  static void leave(png_structp png, png_const_charp text) {
    static_cast<std::string*>(png_get_error_ptr(png))->assign(text);
    png_longjmp(png, 1);
  }
  static void ignore(png_structp /*png*/, png_const_charp /*text*/) {}
};

/// Decodes the file to 16 bits a channel, RGB or RGBA. A function of its own: libpng's errors jump back into it.
bool decode(png_structp png, png_infop info, std::FILE* file) {
  if (setjmp(png_jmpbuf(png)) != 0) return false;  // NOLINT(cert-err52-cpp): libpng has no other way
  png_init_io(png, file);
  png_read_png(png, info, PNG_TRANSFORM_EXPAND_16 | PNG_TRANSFORM_GRAY_TO_RGB, nullptr);
  return true;
}

/// Checks the size that the header declares, before libpng allocates the rows.
void check_png_size(const std::filesystem::path& path) {
  std::array<png_byte, 24> head{};
  std::ifstream file(path, std::ios::binary);
  if (!file.read(reinterpret_cast<char*>(head.data()), head.size())) return;  // libpng tells what is missing
  check_image_size(path, png_get_uint_32(&head[16]), png_get_uint_32(&head[20]));
}

}  // namespace

GreyImage read_png(const std::filesystem::path& path) {
  check_png_size(path);
  PngMemory memory;
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(path.c_str(), "rb"), &std::fclose);
  if (file == nullptr || memory.info == nullptr || !decode(memory.png, memory.info, file.get())) {
    throw MapError({"map image cannot be read", path.string(), "a complete PNG image",
                    file == nullptr ? "a file that cannot be opened" : memory.problem,
                    "copy or save the image again"});
  }

  GreyImage image{static_cast<int>(png_get_image_width(memory.png, memory.info)),
                  static_cast<int>(png_get_image_height(memory.png, memory.info))};
  const bool has_alpha = png_get_channels(memory.png, memory.info) == 4;
  const int bytes_per_pixel = has_alpha ? 8 : 6;
  png_bytepp rows = png_get_rows(memory.png, memory.info);
  for (int row = 0; row < image.height; ++row) {
    for (int column = 0; column < image.width; ++column) {
      const png_byte* pixel = rows[row] + std::ptrdiff_t{column} * bytes_per_pixel;
      image.greys.push_back(
          grey_of(png_get_uint_16(pixel), png_get_uint_16(pixel + 2), png_get_uint_16(pixel + 4)));
      if (has_alpha) image.alphas.push_back(to_8_bits(png_get_uint_16(pixel + 6)));
    }
  }
  return image;
}

}  // namespace mauve_examples
