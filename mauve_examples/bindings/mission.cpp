// SPDX-License-Identifier: LGPL-3.0-or-later
// mauve_examples._mission: the mission's map, starts and reachability for Python. Only translation, no
// behaviour.
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <cstdint>
#include <string>
#include <tuple>
#include <vector>

#include "mauve_examples/map_file.hpp"
#include "mauve_examples/reachability.hpp"
#include "mauve_examples/start_poses.hpp"

namespace py = pybind11;

namespace {

using mauve_examples::GridMap;
using mauve_examples::Pose2D;
using PoseTuple = std::tuple<double, double, double>;

std::vector<py::ssize_t> shape(const GridMap& map) { return {map.height, map.width}; }

std::vector<PoseTuple> start_poses(const GridMap& map, std::size_t n, std::uint64_t seed) {
  std::vector<PoseTuple> poses;
  for (const Pose2D& pose : mauve_examples::start_poses(map, n, seed))
    poses.emplace_back(pose.x, pose.y, pose.theta);
  return poses;
}

py::array_t<bool> reachable_mask(const GridMap& map, const std::vector<PoseTuple>& starts, double radius_m) {
  std::vector<Pose2D> poses;
  poses.reserve(starts.size());
  for (const auto& [x, y, theta] : starts) poses.push_back({x, y, theta});
  const std::vector<std::uint8_t> reached = mauve_examples::reachable_cells(map, poses, radius_m);
  py::array_t<bool> mask(shape(map));
  std::copy(reached.begin(), reached.end(), mask.mutable_data());
  return mask;
}

}  // namespace

PYBIND11_MODULE(_mission, module) {
  module.doc() =
      "The mission's maps: reading them, placing robots, and what these can reach. Lengths in m, angles in "
      "rad.";
  py::register_exception<mauve_examples::MapError>(module, "MapError", PyExc_ValueError).doc() =
      "A map that cannot be used. str() is one line: what, where, expected, found, remedy.";

  py::class_<GridMap>(module, "GridMap", "A map as the ROS map server reads it, turned upright.")
      .def_readonly("width", &GridMap::width)
      .def_readonly("height", &GridMap::height)
      .def_readonly("resolution_m", &GridMap::resolution_m)
      .def_readonly("origin_x_m", &GridMap::origin_x_m)
      .def_readonly("origin_y_m", &GridMap::origin_y_m)
      .def_property_readonly(
          "cells",
          [](const py::object& self) {
            const auto& map = self.cast<const GridMap&>();
            py::array_t<std::int8_t> view(shape(map), map.cells.data(),
                                          self);  // shares the map's memory and keeps it
            view.attr("setflags")(py::arg("write") = false);
            return view;
          },
          "A read-only view, (height, width), row 0 has the lowest y: -1 unknown, 0 free, to 100 occupied.");

  module.def(
      "load_map", [](const std::string& path) { return mauve_examples::load_map(path); }, py::arg("path"),
      R"(Read the YAML file of a map and the image it names.

Raises:
    MapError: a file is missing, truncated or of another format, or says what is not supported.)");
  module.def("start_poses", &start_poses, py::arg("grid"), py::arg("n"), py::arg("seed"),
             R"((x, y, yaw) of n robots near one another in the largest region a robot can move in.

Equal maps and seeds give equal poses on every machine.

Raises:
    MapError: there is no room for so many.)");
  module.def("reachable_mask", &reachable_mask, py::arg("grid"), py::arg("starts"), py::arg("radius_m"),
             "(height, width): where the centre of a disc of the radius can get to from one of the starts.");
}
