// SPDX-License-Identifier: LGPL-3.0-or-later
#include <gtest/gtest.h>
#include <png.h>

#include <algorithm>
#include <vector>

#include "mauve_examples/map_file.hpp"
#include "test_maps.hpp"

namespace mauve_examples::test_map_file {

using testing::TemporaryFolder;

/// A map file that is in order; more keys can be added.
std::string good_yaml() { return "image: map.pgm\nresolution: 0.5\norigin: [-1.0, -2.0, 0.0]\nnegate: 0\n"; }

/// Loads a map made of the two texts.
GridMap load(const std::string& yaml, const std::string& image, const std::string& image_name = "map.pgm") {
  const TemporaryFolder folder;
  folder.write(image_name, image);
  return load_map(folder.write("map.yaml", yaml));
}

/// The message of the refusal; fails the test when there is none.
std::string refusal(const std::string& yaml, const std::string& image = "P5 2 1 255\n\xFE\xFE") {
  try {
    load(yaml, image);
  } catch (const MapError& error) {
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << error.what();
    EXPECT_NE(std::string(error.what()).find("expected"), std::string::npos) << error.what();
    return error.what();
  }
  ADD_FAILURE() << "no refusal of " << yaml;
  return "";
}

TEST(MapFile, ReadsTrinaryCellsWithTheLowestRowFirst) {
  const GridMap map =
      load(good_yaml(), std::string("P5\n3 2\n255\n") + "\xFE\xCD" + std::string(1, '\0') + "\xFE\xFE\xFE");
  EXPECT_EQ(map.width, 3);
  EXPECT_EQ(map.height, 2);
  EXPECT_DOUBLE_EQ(map.resolution_m, 0.5);
  EXPECT_DOUBLE_EQ(map.origin_x_m, -1.0);
  EXPECT_DOUBLE_EQ(map.origin_y_m, -2.0);
  // 205 is 0.196 occupied, which is free under the usual threshold of 0.25.
  EXPECT_EQ(map.cells, (std::vector<std::int8_t>{kFree, kFree, kFree, kFree, kFree, kOccupied}));
}

TEST(MapFile, GreyIsUnknownUnderTheThresholdsOfMapSaver) {
  const GridMap map =
      load(good_yaml() + "free_thresh: 0.196\noccupied_thresh: 0.65\n", "P5 2 1 255\n\xCD\xFE");
  EXPECT_EQ(map.cells, (std::vector<std::int8_t>{kUnknown, kFree}));
}

TEST(MapFile, WhatIsNoTextIsRefusedWithItsPlace) {
  const auto told = [](const std::string& yaml, const char* words) {
    const std::string message = refusal(yaml);
    EXPECT_NE(message.find(words), std::string::npos) << message;
    EXPECT_TRUE(std::all_of(message.begin(), message.end(), [](unsigned char c) { return c < 0x80; }))
        << message;
  };
  told("image: map.pgm\nname: \xFF\n", "map.yaml:2:7: expected text in UTF-8, found byte 255");
  told("image: map\xFF.pgm\nresolution: 0.5\norigin: [0, 0, 0]\n", "map.yaml:1:11:");
  told("\xFF\xFEi\0m\0", "map.yaml:1:1:");                       // UTF-16
  told(std::string("image: map.pgm\n\0", 16), "map.yaml:2:1:");  // a null byte
  told("a: \xC0\xAF\n", "map.yaml:1:4:");                        // an overlong form
  told("a: \xED\xA0\x80\n", "map.yaml:1:4:");                    // a surrogate
  told("a: \xF4\x90\x80\x80\n", "map.yaml:1:4:");                // above U+10FFFF
  told("a: b\xC3", "map.yaml:1:5:");                             // cut off
  told(std::string(1'000'001, ' '), "too large");
  EXPECT_EQ(load("# \xC3\xA9 \xE2\x82\xAC \xF0\x9F\x98\x80\n" + good_yaml(), "P5 1 1 255\n\xFE").width, 1);
}

TEST(MapFile, TakesCommentsAnywhereInTheHeader) {
  const GridMap map = load(good_yaml(), "P5\n# made by hand\n2 # two wide\n1\n#255 is white\n255\n\xFE\xFE");
  EXPECT_EQ(map.cells, (std::vector<std::int8_t>{kFree, kFree}));
}

TEST(MapFile, PixelsMayLookLikeComments) {
  const GridMap map = load(good_yaml(), "P5 3 1 255\n#\n\xFE");
  EXPECT_EQ(map.cells, (std::vector<std::int8_t>{kOccupied, kOccupied, kFree}));
}

TEST(MapFile, ReadsPlainPgmWithAnotherWhite) {
  const GridMap map = load(good_yaml(), "P2\n3 1\n# half is unknown\n10\n10 5 # here too\n0");
  EXPECT_EQ(map.cells, (std::vector<std::int8_t>{kFree, kUnknown, kOccupied}));
}

TEST(MapFile, NegateSwapsFreeAndOccupied) {
  const GridMap map =
      load("image: map.pgm\nresolution: 1\norigin: [0, 0, 0]\nnegate: 1\n", "P2 2 1 255 255 0");
  EXPECT_EQ(map.cells, (std::vector<std::int8_t>{kOccupied, kFree}));
}

class PngColours : public ::testing::TestWithParam<std::pair<png_uint_32, std::vector<png_byte>>> {};

TEST_P(PngColours, AreReadAsGrey) {
  // Two pixels each: white, and black (opaque where there is an alpha channel).
  const auto& [format, pixels] = GetParam();
  const TemporaryFolder folder;
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = 2;
  image.height = 1;
  image.format = format;
  const std::vector<png_byte> palette{255, 255, 255, 0, 0, 0};
  image.colormap_entries = 2;
  ASSERT_NE(png_image_write_to_file(&image, (folder.path() / "map.png").c_str(), 0, pixels.data(), 0,
                                    palette.data()),
            0);
  const GridMap map =
      load_map(folder.write("map.yaml", "image: map.png\nresolution: 1\norigin: [0, 0, 0]\n"));
  EXPECT_EQ(map.cells[0], kFree);
  EXPECT_EQ(map.cells[1], kOccupied);
}

INSTANTIATE_TEST_SUITE_P(
    Formats, PngColours,
    ::testing::Values(std::pair{PNG_FORMAT_GRAY, std::vector<png_byte>{255, 0}},
                      std::pair{PNG_FORMAT_GA, std::vector<png_byte>{255, 255, 0, 255}},
                      std::pair{PNG_FORMAT_RGB, std::vector<png_byte>{255, 255, 255, 0, 0, 0}},
                      std::pair{PNG_FORMAT_RGBA, std::vector<png_byte>{255, 255, 255, 255, 0, 0, 0, 255}},
                      std::pair{PNG_FORMAT_RGB_COLORMAP, std::vector<png_byte>{0, 1}}));

TEST(MapFile, RefusesWithOneLineThatNamesWhatIsWrong) {
  EXPECT_NE(refusal("image: map.pgm\nresolution: -0.05\norigin: [0, 0, 0]\n").find("0.001 to 10 metres"),
            std::string::npos);
  EXPECT_NE(refusal("image: map.pgm\nresolution: 0\norigin: [0, 0, 0]\n").find("map.yaml:2"),
            std::string::npos);
  EXPECT_NE(refusal("image: map.pgm\nresolution: fine\norigin: [0, 0, 0]\n").find("'fine'"),
            std::string::npos);
  EXPECT_NE(refusal("image: map.pgm\nresolution: .nan\norigin: [0, 0, 0]\n").find("resolution"),
            std::string::npos);
  EXPECT_NE(refusal("image: map.pgm\nresolution: 1\norigin: 3\n").find("origin"), std::string::npos);
  EXPECT_NE(refusal("image: map.pgm\nresolution: 1\norigin: [0, zero, 0]\n").find("'zero'"),
            std::string::npos);
  EXPECT_NE(refusal("image: map.pgm\nresolution: 1\n").find("key origin"), std::string::npos);
  EXPECT_NE(refusal("resolution: 1\norigin: [0, 0, 0]\n").find("key image"), std::string::npos);
  EXPECT_NE(refusal(good_yaml() + "mode: binary\n").find("trinary, scale or raw"), std::string::npos);
  EXPECT_NE(refusal(good_yaml() + "occupied_thresh: 0.2\nfree_thresh: 0.3\n").find("thresholds"),
            std::string::npos);
  EXPECT_NE(refusal(good_yaml() + "occupied_thresh: 1.5\n").find("thresholds"), std::string::npos);
  EXPECT_NE(refusal("image: map.pgm\nresolution: 1\norigin: [0, 0, 0]\nnegate: maybe\n").find("maybe"),
            std::string::npos);
  EXPECT_NE(refusal("P5 2 1 255\n").find("map.yaml"), std::string::npos);
  EXPECT_NE(refusal("{image: [").find("YAML"), std::string::npos);
}

TEST(MapFile, RefusesImagesThatCannotBeUsed) {
  EXPECT_NE(refusal(good_yaml(), "P5 2 2 255\n\xFE\xFE\xFE").find("truncated"), std::string::npos);
  EXPECT_NE(refusal(good_yaml(), "P5 2").find("truncated"), std::string::npos);
  EXPECT_NE(refusal(good_yaml(), "P2 2 1 255 254").find("truncated"), std::string::npos);
  EXPECT_NE(refusal(good_yaml(), "P2 2 1 255 254 x").find("PGM"), std::string::npos);
  EXPECT_NE(refusal(good_yaml(), "P2 2 1 10 3 11").find("10"), std::string::npos);
  EXPECT_NE(refusal(good_yaml(), "P5 2 1 65535\n\xFE\xFE\xFE").find("4 bytes"), std::string::npos);
  EXPECT_NE(refusal(good_yaml(), "P5 2 1 65536\n\xFE\xFE\xFE\xFE").find("65535"), std::string::npos);
  EXPECT_NE(refusal(good_yaml(), "P5 2 1 0\n\xFE\xFE").find("maximum value"), std::string::npos);
  EXPECT_NE(refusal(good_yaml(), "P5 4096 4096 255\n").find("4194304 cells"), std::string::npos);
  EXPECT_NE(refusal(good_yaml(), "P5 0 1 255\n").find("size"), std::string::npos);
  EXPECT_NE(refusal(good_yaml(), "P5 900000 900000 255\n").find("size"), std::string::npos);
  EXPECT_NE(refusal(good_yaml(), "GIF89a").find("another format"), std::string::npos);
  EXPECT_NE(refusal(good_yaml(), "").find("another format"), std::string::npos);
  EXPECT_NE(refusal(good_yaml(), "\x89PNG\r\n\x1a\n and no more").find("PNG"), std::string::npos);
  EXPECT_NE(refusal(good_yaml(), std::string("P5 2 1 255\n") + std::string(2, '\0')).find("no free space"),
            std::string::npos);
}

TEST(MapFile, RefusesMissingFilesNamingThem) {
  const TemporaryFolder folder;
  const auto yaml = folder.write("map.yaml", good_yaml());
  EXPECT_THROW(load_map(yaml), MapError);
  EXPECT_THROW(load_map(folder.path()), MapError);
  try {
    load_map(folder.path() / "none.yaml");
    FAIL();
  } catch (const MapError& error) {
    EXPECT_NE(std::string(error.what()).find("none.yaml"), std::string::npos);
  }
}

TEST(MapFile, ReadsTheMapsOfTheProject) {
  for (const char* name : {"office", "room", "arena"}) {
    const GridMap map = load_map(testing::own_map(name));
    EXPECT_LT(map.origin_x_m, 0.0) << name;
    for (const std::int8_t state : {kFree, kOccupied, kUnknown}) {
      EXPECT_GT(std::count(map.cells.begin(), map.cells.end(), state), 100) << name;
    }
  }
}

TEST(MapFile, ReadsRealMaps) {
  if (!std::filesystem::exists(testing::shared_map("depot")))
    GTEST_SKIP() << "no folder shared/maps beside the clone";
  const GridMap depot = load_map(testing::shared_map("depot"));
  EXPECT_EQ(depot.width, 604);
  EXPECT_EQ(depot.height, 307);
  const GridMap sandbox = load_map(testing::shared_map("tb3_sandbox"));
  EXPECT_DOUBLE_EQ(sandbox.origin_x_m, -10.0);
  EXPECT_EQ(std::count(sandbox.cells.begin(), sandbox.cells.end(), kFree), 7903);
  EXPECT_EQ(std::count(sandbox.cells.begin(), sandbox.cells.end(), kOccupied), 870);
}

}  // namespace mauve_examples::test_map_file
