// SPDX-License-Identifier: LGPL-3.0-or-later
// The values of a map's YAML file, and their reader.
#pragma once

#include <filesystem>

namespace mauve_examples {

/// How the map server makes a cell of a pixel.
enum class MapMode { trinary, scale, raw };

/// The values of one YAML file of the map server.
struct MapDescription {
  std::filesystem::path image;
  MapMode mode{MapMode::trinary};
  double resolution_m{0.0};
  double origin_x_m{0.0};
  double origin_y_m{0.0};
  double yaw_rad{0.0};
  bool negate{false};
  double occupied_threshold{0.65};
  double free_threshold{0.25};
};

/// Reads the YAML file of a map; the path of the image is relative to the file. Throws MapError. [non-rt]
MapDescription read_map_description(const std::filesystem::path& path);

}  // namespace mauve_examples
