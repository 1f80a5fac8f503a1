// SPDX-License-Identifier: LGPL-3.0-or-later
// TransformBuffer for Python: frames without an architecture.
#include "translate.hpp"

namespace mauve::bindings {

namespace {

using Numbers3 = std::array<double, 3>;
using Numbers4 = std::array<double, 4>;

FrameId frame_of(const TransformBuffer& buffer, const std::string& name) {
  return buffer.find(name).value_or(kNoFrame);
}

TransformLookup lookup(const TransformBuffer& buffer, const std::string& target, const std::string& source,
                       time_ns_t time_ns) {
  const FrameId into = frame_of(buffer, target);
  const FrameId from = frame_of(buffer, source);
  if (into == kNoFrame || from == kNoFrame) return {.outcome = TransformOutcome::unknown_frame};
  return buffer.lookup(into, from, time_ns);
}

std::map<int, std::string> outcomes() {
  std::map<int, std::string> all;
  for (std::uint8_t number = 0; !to_string(static_cast<TransformOutcome>(number)).empty(); ++number)
    all.emplace(number, to_string(static_cast<TransformOutcome>(number)));
  return all;
}

Transform transform_of(const Numbers3& p, const Numbers4& q) {
  return {.translation = {.x = p[0], .y = p[1], .z = p[2]},
          .rotation = {.x = q[0], .y = q[1], .z = q[2], .w = q[3]}};
}

using Pair = std::pair<Numbers3, Numbers3>;

template <void (*kMove)(const Transform&, Vector3&, Vector3&)>
Pair moved_pair(const Transform& by, const Numbers3& first, const Numbers3& second) {
  Vector3 one{.x = first[0], .y = first[1], .z = first[2]};
  Vector3 other{.x = second[0], .y = second[1], .z = second[2]};
  kMove(by, one, other);
  return {{one.x, one.y, one.z}, {other.x, other.y, other.z}};
}

template <void (*kMove)(const Transform&, Covariance&)>
Covariance moved_covariance(const Transform& by, Covariance covariance) {
  kMove(by, covariance);
  return covariance;
}

void bind_values(py::module_& module) {
  py::class_<Transform>(module, "RigidTransform", "Turns values, then moves them, into another frame.")
      .def(py::init(&transform_of), py::arg("translation"), py::arg("rotation"), "x, y, z; and x, y, z, w.")
      .def(
          "vector",
          [](const Transform& self, const Numbers3& v) {
            const Vector3 turned = rotate(self.rotation, {.x = v[0], .y = v[1], .z = v[2]});
            return Numbers3{turned.x, turned.y, turned.z};
          },
          py::arg("vector"))
      .def(
          "point",
          [](const Transform& self, const Numbers3& v) {
            const Vector3 turned = rotate(self.rotation, {.x = v[0], .y = v[1], .z = v[2]});
            const auto& [x, y, z] = self.translation;
            return Numbers3{turned.x + x, turned.y + y, turned.z + z};
          },
          py::arg("point"))
      .def(
          "quaternion",
          [](const Transform& self, const Numbers4& q) {
            const Quaternion found = turned(self.rotation, {.x = q[0], .y = q[1], .z = q[2], .w = q[3]});
            return Numbers4{found.x, found.y, found.z, found.w};
          },
          py::arg("quaternion"))
      .def("twist", &moved_pair<transform_twist>, py::arg("linear"), py::arg("angular"),
           "Of the same body, at the origin of the other frame.")
      .def("wrench", &moved_pair<transform_wrench>, py::arg("force"), py::arg("torque"),
           "With the torque about the origin of the other frame.")
      .def("pose_covariance", &moved_covariance<transform_pose_covariance>, py::arg("covariance"))
      .def("twist_covariance", &moved_covariance<transform_twist_covariance>, py::arg("covariance"));
}

}  // namespace

void bind_transforms(py::module_& module) {
  bind_values(module);
  module.attr("TRANSFORM_OUTCOMES") = py::cast(outcomes());
  py::class_<TransformLookup>(module, "TransformLookup", "What a lookup found.")
      .def_property_readonly(
          "outcome", [](const TransformLookup& self) { return std::string(to_string(self.outcome)); },
          "One of TRANSFORM_OUTCOMES: 'done', 'unknown frame', 'before interval', ...")
      .def_property_readonly(
          "translation",
          [](const TransformLookup& self) {
            const Vector3& p = self.transform.translation;
            return Numbers3{p.x, p.y, p.z};
          },
          "x, y, z of the transform of a point in the source to the target.")
      .def_property_readonly(
          "rotation",
          [](const TransformLookup& self) {
            const Quaternion& q = self.transform.rotation;
            return Numbers4{q.x, q.y, q.z, q.w};
          },
          "x, y, z, w.")
      .def_readonly("time_ns", &TransformLookup::time_ns, "The time of the transform.")
      .def_readonly("first_ns", &TransformLookup::first_ns,
                    "The interval of a frame without a transform then.")
      .def_readonly("last_ns", &TransformLookup::last_ns);
  py::class_<TransformBuffer>(module, "TransformBuffer",
                              "What a transform_tree holds, for programs and tests without an architecture.")
      .def(py::init<std::uint32_t, std::uint32_t>(), py::kw_only(), py::arg("frames"), py::arg("history"))
      .def(
          "set",
          [](TransformBuffer& self, const std::string& parent, const std::string& child, const Numbers3& p,
             const Numbers4& q, time_ns_t time_ns, bool is_static) {
            return std::string(to_string(self.set(parent, child, transform_of(p, q), time_ns, is_static)));
          },
          py::arg("parent"), py::arg("child"), py::arg("translation"), py::arg("rotation"), py::kw_only(),
          py::arg("time_ns") = 0, py::arg("is_static") = false, "Adds a transform; the outcome in words.")
      .def("lookup", &lookup, py::arg("target"), py::arg("source"), py::arg("time_ns") = kLatestCommon,
           "The transform of a point in `source` to `target`; 0: at the latest common time.")
      .def_property_readonly("frames", &TransformBuffer::frames, "How many frames have a name.");
}

}  // namespace mauve::bindings
