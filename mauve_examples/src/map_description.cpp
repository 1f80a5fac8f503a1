// SPDX-License-Identifier: LGPL-3.0-or-later
#include "map_description.hpp"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <fstream>
#include <string>

#include "mauve_examples/map_error.hpp"
#include "utf8.hpp"

namespace mauve_examples {

namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxMapFileBytes = 1'000'000;

/// The text of a map file. yaml-cpp takes any bytes for text. Throws MapError.
std::string read_text(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::string text(kMaxMapFileBytes + 1, '\0');
  file.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(file.gcount()));
  if (text.size() > kMaxMapFileBytes) {
    throw MapError({"map file is too large", path.string(),
                    "at most " + std::to_string(kMaxMapFileBytes) + " bytes", "more",
                    "give the map's .yaml file, not its image"});
  }
  const std::size_t wrong = std::min(first_no_utf8(text), text.find('\0'));
  if (wrong < text.size()) {
    const std::size_t line_begin = wrong == 0 ? std::string::npos : text.rfind('\n', wrong - 1);
    const auto line = std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(wrong), '\n') + 1;
    const std::size_t column = line_begin == std::string::npos ? wrong + 1 : wrong - line_begin;
    throw MapError({"map file is no text",
                    path.string() + ":" + std::to_string(line) + ":" + std::to_string(column),
                    "text in UTF-8", "byte " + std::to_string(static_cast<unsigned char>(text[wrong])),
                    "give the map's .yaml file, not its image, saved as UTF-8"});
  }
  return text;
}

/// Reads the values of one map file; every complaint names the file, the line and the key.
class MapYaml {
 public:
  explicit MapYaml(const fs::path& path) : path_(path) {
    const std::string content = read_text(path);
    try {
      root_ = YAML::Load(content);
    } catch (const YAML::Exception& error) {
      throw MapError({"map file is no valid YAML", where(error.mark), "YAML as the ROS map server reads it",
                      error.msg, "give the map's .yaml file, not its image"});
    }
    if (!root_.IsMap()) {
      throw MapError({"map file holds no map description", where(root_.Mark()),
                      "keys image, resolution, origin", "no keys at all",
                      "give the .yaml file that map_saver wrote beside the image"});
    }
  }

  MapDescription read() const {
    MapDescription map;
    if (optional("mode")) map.mode = mode(root_["mode"]);
    map.image = path_.parent_path() / text(required("image"), "image");
    const YAML::Node resolution = required("resolution");
    map.resolution_m = number(resolution, "resolution");
    if (map.resolution_m < 0.001 || map.resolution_m > 10.0) {
      refuse("resolution is out of range", resolution, "0.001 to 10 metres per cell", resolution.Scalar(),
             "set the size of a cell, e.g. 0.05");
    }
    read_origin(map);
    if (optional("negate")) map.negate = flag(root_["negate"]);
    read_thresholds(map);
    return map;
  }

 private:
  void read_origin(MapDescription& map) const {
    const YAML::Node origin = required("origin");
    if (!origin.IsSequence() || origin.size() < 2 || origin.size() > 3) {
      refuse("origin is no pose", origin, "[x, y, yaw] in m, m, rad", "something else",
             "write e.g. [-10.0, -10.0, 0]");
    }
    map.origin_x_m = number(origin[0], "origin x");
    map.origin_y_m = number(origin[1], "origin y");
    if (origin.size() == 3) map.yaw_rad = number(origin[2], "origin yaw");
  }

  void read_thresholds(MapDescription& map) const {
    if (optional("occupied_thresh"))
      map.occupied_threshold = number(root_["occupied_thresh"], "occupied_thresh");
    if (optional("free_thresh")) map.free_threshold = number(root_["free_thresh"], "free_thresh");
    if (!(0.0 <= map.free_threshold && map.free_threshold <= map.occupied_threshold &&
          map.occupied_threshold <= 1.0)) {
      const YAML::Node at = optional("free_thresh") ? root_["free_thresh"] : root_["occupied_thresh"];
      refuse("thresholds are out of order", at, "0 <= free_thresh <= occupied_thresh <= 1",
             "free_thresh " + std::to_string(map.free_threshold) + ", occupied_thresh " +
                 std::to_string(map.occupied_threshold),
             "usual values are 0.25 and 0.65");
    }
  }

  bool optional(const char* key) const { return root_[key].IsDefined(); }

  YAML::Node required(const char* key) const {
    if (!root_[key].IsDefined()) {
      refuse("map file is incomplete", root_, std::string("key ") + key, "none", "add it");
    }
    return root_[key];
  }

  std::string text(const YAML::Node& node, const char* key) const {
    if (!node.IsScalar() || node.Scalar().empty()) {
      refuse(std::string(key) + " is no text", node, "one word or path", "something else",
             "correct the value");
    }
    return node.Scalar();
  }

  double number(const YAML::Node& node, const char* key) const {
    double value = 0.0;
    if (!node.IsScalar() || !YAML::convert<double>::decode(node, value) || !std::isfinite(value)) {
      refuse(std::string(key) + " is no number", node, "a finite number",
             node.IsScalar() ? "'" + node.Scalar() + "'" : "something else", "correct the value");
    }
    return value;
  }

  MapMode mode(const YAML::Node& node) const {
    std::string word = text(node, "mode");
    std::ranges::transform(word, word.begin(), [](unsigned char c) { return std::tolower(c); });
    if (word == "trinary") return MapMode::trinary;
    if (word == "scale") return MapMode::scale;
    if (word == "raw") return MapMode::raw;
    refuse("mode is unknown", node, "trinary, scale or raw", node.Scalar(), "correct the value");
  }

  /// As the map server reads it: an integer, else a truth value of YAML (True, false, yes, off ...).
  bool flag(const YAML::Node& node) const {
    int integer = 0;
    bool truth = false;
    if (node.IsScalar() && YAML::convert<int>::decode(node, integer)) return integer != 0;
    if (node.IsScalar() && YAML::convert<bool>::decode(node, truth)) return truth;
    refuse("negate is no switch", node, "0, 1, true or false",
           node.IsScalar() ? node.Scalar() : "something else", "correct the value");
  }

  std::string where(const YAML::Mark& mark) const {
    return mark.is_null() ? path_.string() : path_.string() + ":" + std::to_string(mark.line + 1);
  }

  [[noreturn]] void refuse(const std::string& what, const YAML::Node& at, const std::string& expected,
                           const std::string& found, const std::string& remedy) const {
    throw MapError(
        {what, where(at.IsDefined() ? at.Mark() : YAML::Mark::null_mark()), expected, found, remedy});
  }

  fs::path path_;
  YAML::Node root_;
};

}  // namespace

MapDescription read_map_description(const fs::path& path) { return MapYaml(path).read(); }

}  // namespace mauve_examples
