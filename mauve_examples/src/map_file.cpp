// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_examples/map_file.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <string>

#include "grey_image.hpp"
#include "map_description.hpp"

namespace mauve_examples {

namespace {

namespace fs = std::filesystem;

void require_file(const fs::path& path, const char* what) {
  std::error_code error;
  if (!fs::exists(path, error)) {
    throw MapError(
        {std::string(what) + " does not exist", path.string(), "a file", "none", "check the path"});
  }
  if (!fs::is_regular_file(path, error) || !std::ifstream(path)) {
    throw MapError({std::string(what) + " cannot be opened", path.string(), "a readable file",
                    "a folder or a file without read permission", "check the path and its permissions"});
  }
}

GreyImage read_image(const fs::path& path) {
  require_file(path, "map image");
  std::array<char, 8> magic{};
  std::ifstream(path, std::ios::binary).read(magic.data(), magic.size());
  if (magic[0] == 'P' && (magic[1] == '2' || magic[1] == '5')) return read_pgm(path);
  if (std::equal(magic.begin(), magic.begin() + 4, "\x89PNG")) return read_png(path);
  if (magic[0] == 'B' && magic[1] == 'M') return read_bmp(path);
  throw MapError({"map image has another format", path.string(), "PGM (P2 or P5), PNG or BMP",
                  "other first bytes", "convert the image to PGM or PNG"});
}

/// The map server's rule for one pixel. The server computes in float, and the cells are to be equal.
std::int8_t cell_of(std::uint8_t grey, const MapDescription& map) {
  if (map.mode == MapMode::raw) return grey <= kOccupied ? static_cast<std::int8_t>(grey) : kUnknown;
  const float bright = static_cast<float>(grey) / 255.0F;
  const float occupancy = map.negate ? bright : 1.0F - bright;
  const auto free = static_cast<float>(map.free_threshold);
  const auto occupied = static_cast<float>(map.occupied_threshold);
  if (occupancy <= free) return kFree;
  if (occupancy >= occupied) return kOccupied;
  if (map.mode == MapMode::trinary) return kUnknown;
  const auto span = static_cast<float>(map.occupied_threshold - map.free_threshold);
  return static_cast<std::int8_t>(std::round((occupancy - free) / span * 100.0F));
}

GridMap cells_of_image(const GreyImage& image, const MapDescription& description) {
  std::array<std::int8_t, 256> cell_of_grey{};
  for (std::size_t grey = 0; grey < cell_of_grey.size(); ++grey)
    cell_of_grey[grey] = cell_of(static_cast<std::uint8_t>(grey), description);

  GridMap map;
  map.width = image.width;
  map.height = image.height;
  map.resolution_m = description.resolution_m;
  map.origin_x_m = description.origin_x_m;
  map.origin_y_m = description.origin_y_m;
  map.cells.resize(map.cell_count(), kUnknown);
  for (std::size_t i = 0; i < image.greys.size(); ++i) {
    if (description.mode != MapMode::raw && !image.alphas.empty() && image.alphas[i] < 255) continue;
    const Cell from_top = map.cell(i);
    map.cells[map.index({from_top.column, map.height - 1 - from_top.row})] = cell_of_grey[image.greys[i]];
  }
  return map;
}

/// The map turned by the yaw about its origin: each cell of an upright grid takes the cell below its centre.
GridMap turned(const GridMap& map, double yaw_rad, const fs::path& path) {
  constexpr double kSliver = 0.01;  // of a cell: thinner parts, from a rounded yaw, get no column or row
  const double cosine = std::cos(yaw_rad);
  const double sine = std::sin(yaw_rad);
  // The corners of the turned map, in cells from the origin.
  const auto [left, right] =
      std::minmax({0.0, cosine * map.width, -sine * map.height, cosine * map.width - sine * map.height});
  const auto [low, high] =
      std::minmax({0.0, sine * map.width, cosine * map.height, sine * map.width + cosine * map.height});
  const double columns = std::max(1.0, std::ceil(right - left - kSliver));
  const double rows = std::max(1.0, std::ceil(high - low - kSliver));
  check_image_size(path, static_cast<unsigned long long>(columns), static_cast<unsigned long long>(rows));

  GridMap upright;
  upright.width = static_cast<int>(columns);
  upright.height = static_cast<int>(rows);
  upright.resolution_m = map.resolution_m;
  upright.origin_x_m = map.origin_x_m + left * map.resolution_m;
  upright.origin_y_m = map.origin_y_m + low * map.resolution_m;
  upright.cells.resize(upright.cell_count(), kUnknown);
  for (std::size_t i = 0; i < upright.cells.size(); ++i) {
    const Cell cell = upright.cell(i);
    const double x = left + cell.column + 0.5;
    const double y = low + cell.row + 0.5;
    const Cell source{static_cast<int>(std::floor(cosine * x + sine * y)),
                      static_cast<int>(std::floor(cosine * y - sine * x))};
    if (map.contains(source)) upright.cells[i] = map.at(source);
  }
  return upright;
}

}  // namespace

void check_image_size(const fs::path& path, unsigned long long width, unsigned long long height) {
  if (width == 0 || height == 0 || width > kMaxMapCells || height > kMaxMapCells ||
      width * height > kMaxMapCells) {
    throw MapError({"map has an unusable size", path.string(),
                    "1 to " + std::to_string(kMaxMapCells) + " cells, as robots plan in locked memory",
                    std::to_string(width) + " x " + std::to_string(height),
                    "crop the map or lower its resolution"});
  }
}

GridMap load_map(const fs::path& yaml_path) {
  require_file(yaml_path, "map file");
  const MapDescription description = read_map_description(yaml_path);
  GridMap map = cells_of_image(read_image(description.image), description);
  if (std::ranges::find(map.cells, kFree) == map.cells.end()) {
    throw MapError({"map has no free space", description.image.string(), "an opaque pixel of a free cell",
                    "none", "check mode, free_thresh and negate in " + yaml_path.string()});
  }
  return description.yaw_rad == 0.0 ? map : turned(map, description.yaw_rad, yaml_path);
}

}  // namespace mauve_examples
