// SPDX-License-Identifier: LGPL-3.0-or-later
// PNG of any colour type, through libpng's simplified interface.
#include <png.h>

#include "grey_image.hpp"
#include "mauve_examples/map_file.hpp"

namespace mauve_examples {

namespace {

/// Frees what libpng holds, also when an error leaves the reader.
struct PngHandle {
  png_image image{};
  PngHandle() { image.version = PNG_IMAGE_VERSION; }
  ~PngHandle() { png_image_free(&image); }
  PngHandle(const PngHandle&) = delete;
  PngHandle& operator=(const PngHandle&) = delete;
};

[[noreturn]] void refuse(const std::filesystem::path& path, const PngHandle& png) {
  throw MapError({"map image cannot be read", path.string(), "a complete PNG image", png.image.message,
                  "copy or save the image again"});
}

}  // namespace

GreyImage read_png(const std::filesystem::path& path) {
  PngHandle png;
  if (png_image_begin_read_from_file(&png.image, path.c_str()) == 0) refuse(path, png);
  check_image_size(path, png.image.width, png.image.height);
  const bool has_alpha = (png.image.format & PNG_FORMAT_FLAG_ALPHA) != 0U;
  // Without the flag, 16 bit images would be taken as linear light and come out brighter than they were
  // painted.
  png.image.flags |= PNG_IMAGE_FLAG_16BIT_sRGB;
  png.image.format = PNG_FORMAT_RGBA;

  std::vector<png_byte> bytes(PNG_IMAGE_SIZE(png.image));
  if (png_image_finish_read(&png.image, nullptr, bytes.data(), 0, nullptr) == 0) refuse(path, png);

  GreyImage image{static_cast<int>(png.image.width), static_cast<int>(png.image.height), {}};
  const std::size_t pixels = bytes.size() / 4;
  image.shades.reserve(pixels);
  for (std::size_t i = 0; i < pixels; ++i) {
    const png_byte* pixel = &bytes[i * 4];
    const int colours = pixel[0] + pixel[1] + pixel[2];
    image.shades.push_back(has_alpha ? (colours + pixel[3]) / (4 * 255.0) : colours / (3 * 255.0));
  }
  return image;
}

}  // namespace mauve_examples
