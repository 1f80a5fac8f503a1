// SPDX-License-Identifier: LGPL-3.0-or-later
// Maps for tests: drawn in the test, shipped with the project, or real ones beside the clone.
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <initializer_list>
#include <string>

#include "mauve_examples/map_file.hpp"

namespace mauve_examples::testing {

std::filesystem::path source_folder();
/// A map that the project ships.
inline std::filesystem::path own_map(const std::string& name) {
  return source_folder() / "maps" / (name + ".yaml");
}
/// A real map beside the clone, which not everybody has.
inline std::filesystem::path shared_map(const std::string& name) {
  return source_folder().parent_path().parent_path() / "shared" / "maps" / (name + ".yaml");
}

/// A map drawn with characters, upper rows first: '#' occupied, '.' free, anything else unknown.
inline GridMap drawn(std::initializer_list<std::string> rows, double resolution_m = 1.0) {
  GridMap map;
  map.width = static_cast<int>(rows.begin()->size());
  map.height = static_cast<int>(rows.size());
  map.resolution_m = resolution_m;
  map.cells.assign(map.cell_count(), kUnknown);
  int row = map.height;
  for (const std::string& line : rows) {
    --row;
    for (int column = 0; column < map.width; ++column) {
      const char c = line[static_cast<std::size_t>(column)];
      if (c == '#') map.cells[map.index({column, row})] = kOccupied;
      if (c == '.') map.cells[map.index({column, row})] = kFree;
    }
  }
  return map;
}

/// A folder of its own for one test, gone afterwards.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string pattern = (std::filesystem::temp_directory_path() / "mauve_maps_XXXXXX").string();
    path_ = ::mkdtemp(pattern.data());
  }
  ~TemporaryFolder() { std::filesystem::remove_all(path_); }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  std::filesystem::path write(const std::string& name, const std::string& bytes) const {
    std::ofstream(path_ / name, std::ios::binary) << bytes;
    return path_ / name;
  }
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace mauve_examples::testing
