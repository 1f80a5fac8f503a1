// SPDX-License-Identifier: LGPL-3.0-or-later
// Cores on probation: how long, what puts the old core back, and what came of it.
#include "host.hpp"

namespace mauve::bindings {

void bind_probation(py::module_& module) {
  py::class_<OutputLimit>(module, "OutputLimit")
      .def(py::init([](const std::string& port, const std::string& field, std::optional<double> minimum,
                       std::optional<double> maximum, bool not_nan) {
             return OutputLimit{
                 .port = port, .field = field, .minimum = minimum, .maximum = maximum, .not_nan = not_nan};
           }),
           py::arg("port"), py::arg("field") = "", py::kw_only(), py::arg("minimum") = std::nullopt,
           py::arg("maximum") = std::nullopt, py::arg("not_nan") = false);
  py::class_<ProbationOptions>(module, "ProbationOptions")
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
  py::class_<ProbationRecord>(module, "ProbationRecord")
      .def_readonly("component", &ProbationRecord::component)
      .def_readonly("from_core", &ProbationRecord::from_core)
      .def_readonly("to_core", &ProbationRecord::to_core)
      .def_property_readonly("verdict",
                             [](const ProbationRecord& self) { return std::string(to_string(self.verdict)); })
      .def_readonly("reason", &ProbationRecord::reason)
      .def_readonly("releases", &ProbationRecord::releases)
      .def_readonly("begin_ns", &ProbationRecord::begin_ns)
      .def_readonly("end_ns", &ProbationRecord::end_ns);
}

}  // namespace mauve::bindings
