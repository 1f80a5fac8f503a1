// SPDX-License-Identifier: LGPL-3.0-or-later
// Cells of maps in every mode and image format, held to the rule of nav2_map_server (Jazzy), which is written out
// here a second time; turned maps; and images with random damage.
#include <gtest/gtest.h>
#include <png.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "mauve_examples/map_file.hpp"
#include "test_maps.hpp"

namespace mauve_examples::test_map_server_rule {

using testing::TemporaryFolder;
using Bytes = std::string;

std::string yaml(const std::string& more, const std::string& image = "map.img") {
  return "image: " + image + "\nresolution: 0.5\n" + more;
}

GridMap load(const std::string& description, const Bytes& image) {
  const TemporaryFolder folder;
  folder.write("map.img", image);
  return load_map(folder.write("map.yaml", description));
}

Bytes little(std::uint32_t value, int bytes) {
  Bytes text;
  for (int i = 0; i < bytes; ++i) text.push_back(static_cast<char>(value >> (8 * i) & 0xFFU));
  return text;
}

Bytes pgm(int width, int height, int white, const std::vector<int>& pixels) {
  Bytes text =
      "P5 " + std::to_string(width) + " " + std::to_string(height) + " " + std::to_string(white) + "\n";
  for (const int pixel : pixels) {
    if (white > 255) text.push_back(static_cast<char>(pixel >> 8));
    text.push_back(static_cast<char>(pixel));
  }
  return text;
}

/// All greys from 0 to 255, one row.
std::vector<int> all_greys() {
  std::vector<int> greys(256);
  for (int i = 0; i < 256; ++i) greys[static_cast<std::size_t>(i)] = i;
  return greys;
}

struct Bmp {
  int width{1};
  int height{1};  // negative: top row first
  int bits{24};
  Bytes pixels{};
  Bytes palette{};
  std::uint32_t compression{0};
  std::uint32_t colours{0};
  std::vector<std::uint32_t> masks{};

  Bytes bytes() const {
    const std::uint32_t header_bytes = masks.size() == 4 ? 56 : 40;
    Bytes header = little(header_bytes, 4) + little(static_cast<std::uint32_t>(width), 4) +
                   little(static_cast<std::uint32_t>(height), 4) + little(1, 2) +
                   little(static_cast<std::uint32_t>(bits), 2) + little(compression, 4) + Bytes(12, '\0') +
                   little(colours, 4) + Bytes(4, '\0');
    for (const std::uint32_t mask : masks) header += little(mask, 4);
    const auto begin = static_cast<std::uint32_t>(14 + header.size() + palette.size());
    return "BM" + little(begin + static_cast<std::uint32_t>(pixels.size()), 4) + Bytes(4, '\0') +
           little(begin, 4) + header + palette + pixels;
  }
};

/// Greys of a map in mode raw, in which they are its cells.
std::vector<std::int8_t> raw_cells(const Bytes& image) {
  return load(yaml("origin: [0, 0, 0]\nmode: raw\n"), image).cells;
}

using Cells = std::vector<std::int8_t>;

/// The map server's rule for an opaque pixel.
int expected_cell(const std::string& mode, int grey, bool negate, float free, float occupied, float span) {
  if (mode == "raw") return grey > 100 ? -1 : grey;
  const float white = static_cast<float>(grey) / 255.0F;
  const float share = negate ? white : 1.0F - white;
  int cell = -1;
  if (share >= occupied) cell = 100;
  if (share <= free) cell = 0;
  if (mode == "scale" && share > free && share < occupied)
    cell = static_cast<int>(std::round((share - free) / span * 100.0F));
  return cell;
}

TEST(MapServerRule, EveryGreyBecomesTheMapServersCell) {
  const std::vector<std::pair<double, double>> thresholds{
      {0.25, 0.65}, {0.196, 0.65}, {0.2, 0.8}, {0.5, 0.5}, {0.0, 1.0}};  // 0.2 and 0.8 are greys themselves
  for (const auto& [free, occupied] : thresholds) {
    for (const char* written : {"trinary", "Trinary", "scale", "SCALE", "raw", "Raw"}) {
      for (const bool negate : {false, true}) {
        std::string mode = written;
        for (char& c : mode) c = static_cast<char>(std::tolower(c));
        const std::string text =
            yaml("origin: [0, 0, 0]\nmode: " + std::string(written) + "\nnegate: " + (negate ? "1" : "0") +
                 "\nfree_thresh: " + std::to_string(free) + "\noccupied_thresh: " + std::to_string(occupied) +
                 "\n");
        const GridMap map = load(text, pgm(256, 1, 255, all_greys()));
        for (int grey = 0; grey < 256; ++grey) {
          ASSERT_EQ(map.at({grey, 0}),
                    expected_cell(mode, grey, negate, static_cast<float>(free), static_cast<float>(occupied),
                                  static_cast<float>(occupied - free)))
              << text << grey;
        }
      }
    }
  }
}

TEST(MapServerRule, NegateIsAnIntegerOrATruthValueOfYaml) {
  const auto first = [](const std::string& word) {
    return load(yaml("origin: [0, 0, 0]\nnegate: " + word + "\n"), pgm(2, 1, 255, {0, 255})).cells[0];
  };
  for (const char* word : {"0", "False", "false", "FALSE", "no", "off"})
    EXPECT_EQ(first(word), kOccupied) << word;
  for (const char* word : {"1", "True", "true", "TRUE", "yes", "on", "2"})
    EXPECT_EQ(first(word), kFree) << word;
  EXPECT_THROW(first("maybe"), MapError);
  EXPECT_THROW(first("1.5"), MapError);
}

TEST(MapServerRule, SixteenBitsLoseTheLowerOnes) {
  // 257 units of 65535 are one of 255; parts are cut off.
  EXPECT_EQ(raw_cells(pgm(5, 1, 65535, {0, 256, 257, 25956, 25957})), (Cells{0, 0, 1, 100, -1}));
  EXPECT_EQ(raw_cells(pgm(3, 1, 1000, {0, 128, 1000})), (Cells{0, 32, -1}));  // 128 / 1000 x 255 = 32.6
  EXPECT_EQ(raw_cells("P2 2 1 65535\n0 25700\n"), (Cells{0, 100}));
}

/// A PNG of one row, written with libpng's simplified interface and then given a gamma chunk, and one more.
Bytes png_with_gamma(png_uint_32 format, std::vector<png_byte> pixels, const Bytes& chunk = {}) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.format = format;
  image.width = static_cast<png_uint_32>(pixels.size() / PNG_IMAGE_PIXEL_SIZE(format));
  image.height = 1;
  png_alloc_size_t size = 0;
  EXPECT_NE(png_image_write_to_memory(&image, nullptr, &size, 0, pixels.data(), 0, nullptr), 0);
  Bytes text(size, '\0');
  EXPECT_NE(png_image_write_to_memory(&image, text.data(), &size, 0, pixels.data(), 0, nullptr), 0);
  // gAMA of 1.0 in place of what the writer declares, each chunk by its length.
  Bytes result = text.substr(0, 33);
  result += Bytes("\0\0\0\x04gAMA\0\x01\x86\xA0\x31\xE8\x96\x5F", 16) + chunk;
  for (std::size_t at = 33; at + 12 <= text.size();) {
    const std::size_t length = png_get_uint_32(reinterpret_cast<png_const_bytep>(&text[at])) + 12U;
    const Bytes name = text.substr(at + 4, 4);
    if (name != "gAMA" && name != "sRGB" && name != "cHRM") result += text.substr(at, length);
    at += length;
  }
  return result;
}

TEST(MapServerRule, TheGammaOfAPngHasNoEffect) {
  EXPECT_EQ(raw_cells(png_with_gamma(PNG_FORMAT_GRAY, {0, 50, 100})), (Cells{0, 50, 100}));
}

TEST(MapServerRule, ColoursBecomeTheirLuma) {
  // 0.299 red, 0.587 green, 0.114 blue
  EXPECT_EQ(raw_cells(png_with_gamma(PNG_FORMAT_RGB, {0, 0, 0, 255, 0, 0, 0, 100, 0, 0, 0, 255})),
            (Cells{0, 76, 58, 29}));
}

TEST(MapServerRule, WhatIsNotOpaqueIsUnknownSaveInModeRaw) {
  const Bytes image = png_with_gamma(PNG_FORMAT_GA, {255, 255, 255, 254, 0, 255, 0, 0});
  EXPECT_EQ(raw_cells(image), (Cells{-1, -1, 0, 0}));
  for (const char* mode : {"trinary", "scale"}) {
    EXPECT_EQ(load(yaml("origin: [0, 0, 0]\nmode: " + std::string(mode) + "\n"), image).cells,
              (Cells{kFree, kUnknown, kOccupied, kUnknown}))
        << mode;
  }
}

TEST(MapServerRule, TheTransparentColourOfAPngIsUnknown) {
  const Bytes white_is_transparent(
      "\0\0\0\x06tRNS\0\xFF\0\xFF\0\xFF\x37"
      "\x58"
      "\x1B"
      "\x7D",
      18);
  const Bytes image =
      png_with_gamma(PNG_FORMAT_RGB, {255, 255, 255, 254, 254, 254, 0, 0, 0}, white_is_transparent);
  EXPECT_EQ(load(yaml("origin: [0, 0, 0]\n"), image).cells, (Cells{kUnknown, kFree, kOccupied}));
}

TEST(BmpMaps, RowsBeginAtTheBottomOrAtTheTop) {
  const Bytes below{"\1\1\1\2\2\2\0\0", 8};  // two pixels, padded to 4 bytes
  const Bytes above{"\3\3\3\0\0\0\0\0", 8};
  EXPECT_EQ(raw_cells(Bmp{.width = 2, .height = 2, .pixels = below + above}.bytes()), (Cells{1, 2, 3, 0}));
  EXPECT_EQ(raw_cells(Bmp{.width = 2, .height = -2, .pixels = above + below}.bytes()), (Cells{1, 2, 3, 0}));
}

TEST(BmpMaps, PalettesOfOneFourAndEightBits) {
  const Bytes palette{"\0\0\0\0\7\7\7\0\x09\x09\x09\0", 12};
  const auto image = [&](int bits, std::uint32_t colours, const char* row) {
    return Bmp{.width = 4, .bits = bits, .pixels = Bytes(row, 4), .palette = palette, .colours = colours}
        .bytes();
  };
  EXPECT_EQ(raw_cells(image(8, 3, "\0\1\2\1")), (Cells{0, 7, 9, 7}));
  EXPECT_EQ(raw_cells(image(4, 3, "\x01\x21\0\0")), (Cells{0, 7, 9, 7}));
  EXPECT_EQ(raw_cells(image(1, 2, "\x50\0\0\0")), (Cells{0, 7, 0, 7}));
  EXPECT_EQ(raw_cells(image(1, 0, "\x50\0\0\0")), (Cells{0, 7, 0, 7}));
  EXPECT_THROW(raw_cells(image(8, 3, "\0\1\2\3")), MapError);  // an index outside of the palette
  EXPECT_THROW(raw_cells(image(1, 3, "\0\0\0\0")), MapError);  // a palette larger than its indices
}

TEST(BmpMaps, ColoursOf32Bits) {
  const Bytes pixels{"\0\0\0\xFF\x0A\x14\x1E\0\0\0\0\x80", 12};  // blue, green, red, alpha
  EXPECT_EQ(raw_cells(Bmp{.width = 3, .bits = 32, .pixels = pixels}.bytes()), (Cells{0, 21, 0}));
  const auto trinary = [](const Bmp& bmp) {
    return load(yaml("origin: [0, 0, 0]\nnegate: 1\n"), bmp.bytes()).cells;
  };
  EXPECT_EQ(trinary({.width = 3, .bits = 32, .pixels = pixels}), (Cells{kFree, kUnknown, kUnknown}));
  const std::vector<std::uint32_t> opaque{0xFF0000, 0xFF00, 0xFF};
  EXPECT_EQ(trinary({.width = 3, .bits = 32, .pixels = pixels, .compression = 3, .masks = opaque}),
            (Cells{kFree, kFree, kFree}));
  const std::vector<std::uint32_t> other{0xFF, 0xFF00, 0xFF0000, 0xFF000000};  // red and blue change places
  EXPECT_EQ(
      raw_cells(Bmp{.width = 3, .bits = 32, .pixels = pixels, .compression = 3, .masks = other}.bytes()),
      (Cells{0, 18, 0}));
}

TEST(BmpMaps, AreRefusedWithOneLineThatNamesWhatIsWrong) {
  const auto told = [](const Bytes& image, const char* words) {
    try {
      raw_cells(image);
      ADD_FAILURE() << "no refusal that says " << words;
    } catch (const MapError& error) {
      const std::string line = error.what();
      EXPECT_NE(line.find(words), std::string::npos) << line;
      EXPECT_EQ(line.find('\n'), std::string::npos) << line;
    }
  };
  const Bmp good{.pixels = Bytes(4, '\0')};
  EXPECT_EQ(raw_cells(good.bytes()), (Cells{0}));
  const auto changed = [&](std::size_t at, std::uint32_t value, int bytes) {
    return good.bytes().replace(at, static_cast<std::size_t>(bytes), little(value, bytes));
  };
  for (std::size_t size = 2; size < good.bytes().size(); ++size)
    told(good.bytes().substr(0, size), "truncated");
  told(changed(14, 12, 4), "12 bytes");  // the header of OS/2
  told(changed(18, 0, 4), "size");
  told(changed(18, 0xFFFFFFFF, 4), "size");  // a negative width
  told(changed(22, 0x80000000, 4), "size");  // a height without a positive counterpart
  told(changed(18, 0x7FFFFFFF, 4), "4194304 cells");
  told(changed(18, 4000, 4), "truncated");
  told(changed(28, 16, 2), "1, 4, 8, 24 or 32 bits a pixel");
  told(changed(28, 0, 2), "bits a pixel");
  told(changed(30, 1, 4), "compression 1");
  told(changed(10, 0xFFFFFFFF, 4), "truncated");  // where the pixels begin
  told(Bmp{.bits = 32, .pixels = Bytes(4, '\0'), .compression = 3, .masks = {1, 0, 2}}.bytes(), "mask");
}

TEST(TurnedMaps, AQuarterTurnMovesEveryCellExactly) {
  // Upper row: occupied, unknown, free; lower row: free, free, occupied.
  const Bytes image = pgm(3, 2, 255, {0, 128, 255, 255, 255, 0});
  const auto turned = [&](double yaw_rad) {
    return load(yaml("origin: [1.0, 2.0, " + std::to_string(yaw_rad) + "]\n"), image);
  };
  const GridMap left = turned(std::numbers::pi / 2);
  EXPECT_EQ(left.width, 2);
  EXPECT_EQ(left.height, 3);
  EXPECT_EQ(left.cells, (Cells{kOccupied, kFree, kUnknown, kFree, kFree, kOccupied}));
  EXPECT_NEAR(left.origin_x_m, 0.0, 1e-5);  // 2 rows of 0.5 m lie left of the origin now
  EXPECT_NEAR(left.origin_y_m, 2.0, 1e-5);
  const GridMap half = turned(-std::numbers::pi);
  EXPECT_EQ(half.width, 3);
  EXPECT_EQ(half.cells, (Cells{kFree, kUnknown, kOccupied, kOccupied, kFree, kFree}));
  EXPECT_NEAR(half.origin_x_m, -0.5, 1e-5);
  EXPECT_NEAR(half.origin_y_m, 1.0, 1e-5);
}

TEST(TurnedMaps, EachCellHasTheStateBelowItsCentre) {
  constexpr int kWidth = 30;
  constexpr int kHeight = 20;
  std::vector<int> pixels;
  for (int i = 0; i < kWidth * kHeight; ++i) pixels.push_back(i % 101);
  const Bytes image = pgm(kWidth, kHeight, 255, pixels);
  const GridMap straight = load(yaml("origin: [3.0, -4.0, 0]\nmode: raw\n"), image);
  for (const double yaw_rad : {0.3, -0.7, 2.0, 4.5}) {
    const GridMap map =
        load(yaml("origin: [3.0, -4.0, " + std::to_string(yaw_rad) + "]\nmode: raw\n"), image);
    int known = 0;
    for (std::size_t i = 0; i < map.cell_count(); ++i) {
      const Point centre = map.centre(map.cell(i));
      // Back into the image: turned by -yaw about the origin.
      const double x_m = centre.x - 3.0;
      const double y_m = centre.y + 4.0;
      const Cell below = straight.cell_at(3.0 + std::cos(yaw_rad) * x_m + std::sin(yaw_rad) * y_m,
                                          -4.0 - std::sin(yaw_rad) * x_m + std::cos(yaw_rad) * y_m);
      EXPECT_EQ(map.cells[i], straight.contains(below) ? straight.at(below) : kUnknown);
      if (map.cells[i] != kUnknown) ++known;
    }
    EXPECT_NEAR(known, kWidth * kHeight, 15) << yaw_rad;  // an area keeps its size
  }
}

TEST(TurnedMaps, MayNotExceedTheLimitEither) {
  const std::string wide = "P5 4000 1000 255\n" + Bytes(4'000'000, '\xFE');
  EXPECT_NO_THROW(load(yaml("origin: [0, 0, 0]\n"), wide));
  EXPECT_THROW(load(yaml("origin: [0, 0, 0.8]\n"), wide), MapError);
}

TEST(DamagedImages, AreReadOrRefusedWithOneLine) {
  const Bytes greys(64, '\x40');
  const std::vector<Bytes> images{
      pgm(8, 8, 255, std::vector<int>(64, 200)),
      pgm(8, 4, 65535, std::vector<int>(32, 60000)),
      "P2 4 2 9\n# nine\n0 1 2 3 4 5 6 9\n",
      png_with_gamma(PNG_FORMAT_GRAY, std::vector<png_byte>(64, 200)),
      png_with_gamma(PNG_FORMAT_RGBA, std::vector<png_byte>(64, 255)),
      Bmp{.width = 8, .height = 2, .pixels = greys}.bytes(),
      Bmp{.width = 8, .height = -2, .bits = 32, .pixels = greys}.bytes(),
      Bmp{.width = 8, .height = 8, .bits = 8, .pixels = Bytes(64, '\0'), .palette = Bytes(1024, '\x60')}
          .bytes(),
      Bmp{.width = 8, .height = 2, .bits = 32, .pixels = greys, .compression = 3, .masks = {255, 65280, 9, 7}}
          .bytes()};
  const TemporaryFolder folder;
  const auto description = folder.write("map.yaml", yaml("origin: [0, 0, 0]\nmode: scale\n"));
  std::mt19937 random(7);  // NOLINT(cert-msc51-cpp): the same damage in every run
  const auto below = [&](std::size_t limit) { return static_cast<std::size_t>(random() % limit); };
  int refused = 0;
  for (int round = 0; round < 800; ++round) {
    Bytes image = images[below(images.size())];
    for (std::size_t changes = 1 + below(4); changes > 0; --changes)
      image[below(std::min<std::size_t>(image.size(), 80))] =
          static_cast<char>(below(2) == 0 ? below(256) : 255 * below(2));
    if (below(4) == 0) image.resize(below(image.size()) + 1);
    folder.write("map.img", image);
    try {
      const GridMap map = load_map(description);
      ASSERT_LE(map.cell_count(), kMaxMapCells);
      ASSERT_EQ(map.cells.size(), map.cell_count());
    } catch (const MapError& error) {
      ++refused;
      ASSERT_EQ(std::string(error.what()).find('\n'), std::string::npos) << error.what();
    }
  }
  EXPECT_GT(refused, 80);
}

}  // namespace mauve_examples::test_map_server_rule
