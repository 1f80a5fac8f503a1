// SPDX-License-Identifier: LGPL-3.0-or-later
// Cores on probation: how long, what puts the old core back, and what came of it.
#include "host.hpp"

namespace mauve::bindings {

void bind_probation(py::module_& module) {
  py::class_<OutputLimit>(
      module, "OutputLimit",
      "What a number of an output must be; NaN breaks a bound, too. `field`: empty: each number.")
      .def(py::init([](const std::string& port, const std::string& field, std::optional<double> minimum,
                       std::optional<double> maximum, bool not_nan) {
             return OutputLimit{
                 .port = port, .field = field, .minimum = minimum, .maximum = maximum, .not_nan = not_nan};
           }),
           py::arg("port"), py::arg("field") = "", py::kw_only(), py::arg("minimum") = std::nullopt,
           py::arg("maximum") = std::nullopt, py::arg("not_nan") = false);
  py::class_<ProbationOptions>(
      module, "ProbationOptions",
      "How long a new core is on probation, and which violations put the old core back.")
      .def(py::init([](time_ns_t duration_ns, bool on_fault, bool on_overrun, bool on_over_declared,
                       std::vector<OutputLimit> outputs, std::int64_t min_releases) {
             return ProbationOptions{.duration_ns = duration_ns,
                                     .on_fault = on_fault,
                                     .on_overrun = on_overrun,
                                     .on_over_declared = on_over_declared,
                                     .outputs = std::move(outputs),
                                     .min_releases = min_releases};
           }),
           py::arg("duration_ns"), py::kw_only(), py::arg("on_fault") = true, py::arg("on_overrun") = false,
           py::arg("on_over_declared") = false, py::arg("outputs") = std::vector<OutputLimit>{},
           py::arg("min_releases") = 1);
  py::class_<ProbationRecord>(module, "ProbationRecord", "One probation; fields as mauve_msgs/msg/Probation.")
      .def_readonly("component", &ProbationRecord::component)
      .def_readonly("from_core", &ProbationRecord::from_core)
      .def_readonly("to_core", &ProbationRecord::to_core)
      .def_property_readonly(
          "verdict", [](const ProbationRecord& self) { return std::string(to_string(self.verdict)); },
          "Running, passed, reverted or inconclusive.")
      .def_readonly("reason", &ProbationRecord::reason)
      .def_readonly("releases", &ProbationRecord::releases, "Of the new core.")
      .def_readonly("begin_ns", &ProbationRecord::begin_ns)
      .def_readonly("end_ns", &ProbationRecord::end_ns,
                    "When it was decided; while it runs: when it is over.");
}

}  // namespace mauve::bindings
