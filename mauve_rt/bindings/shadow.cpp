// SPDX-License-Identifier: LGPL-3.0-or-later
// Candidates in the shadow of a component: what they cost, and how their outputs differ.
#include "host.hpp"

namespace mauve::bindings {

void bind_output_steps(py::module_& module) {
  py::class_<GreatestStep>(module, "GreatestStep", "The greatest step of an output at a bumpless change.")
      .def(py::init([](const std::string& port, const std::string& field, double step) {
             return GreatestStep{.port = port, .field = field, .step = step};
           }),
           py::arg("port"), py::arg("field"), py::kw_only(), py::arg("step"))
      .def_readonly("port", &GreatestStep::port)
      .def_readonly("field", &GreatestStep::field)
      .def_readonly("step", &GreatestStep::step, ">= 0, in the unit of the number.");
  py::class_<BumplessOptions>(module, "BumplessOptions",
                              "A core goes in only where its outputs are near those of the core in force.")
      .def(py::init([](const std::vector<GreatestStep>& outputs, time_ns_t within_ns, time_ns_t budget_ns,
                       time_ns_t blend_ns) {
             return BumplessOptions{
                 .outputs = outputs, .within_ns = within_ns, .budget_ns = budget_ns, .blend_ns = blend_ns};
           }),
           py::arg("outputs"), py::kw_only(), py::arg("within_ns") = BumplessOptions{}.within_ns,
           py::arg("budget_ns") = 0, py::arg("blend_ns") = 0,
           "`budget_ns`: of the candidate for one release; 0: the component's period. `blend_ns`: so long "
           "both cores execute, and the outputs go over linearly; 0: at once.")
      .def_readonly("outputs", &BumplessOptions::outputs)
      .def_readonly("within_ns", &BumplessOptions::within_ns, "So long such an instant is waited for.")
      .def_readonly("budget_ns", &BumplessOptions::budget_ns)
      .def_readonly("blend_ns", &BumplessOptions::blend_ns);
  py::class_<OutputStep>(module, "OutputStep",
                         "One output of a bumpless change; fields as mauve_msgs/msg/OutputStep.")
      .def_readonly("output", &OutputStep::output)
      .def_readonly("greatest", &OutputStep::greatest)
      .def_readonly("difference", &OutputStep::difference)
      .def_readonly("least", &OutputStep::least)
      .def_readonly("least_instant_ns", &OutputStep::least_instant_ns)
      .def_readonly("step", &OutputStep::step, "NaN until it is known.");
  py::class_<OutputCurve>(module, "OutputCurve",
                          "One output around a bumpless change; fields as mauve_msgs/msg/OutputCurve.")
      .def_readonly("output", &OutputCurve::output)
      .def_readonly("instant_ns", &OutputCurve::instant_ns)
      .def_readonly("instants_ns", &OutputCurve::instants_ns)
      .def_readonly("live", &OutputCurve::live)
      .def_readonly("candidate", &OutputCurve::candidate)
      .def_readonly("new_instants_ns", &OutputCurve::new_instants_ns)
      .def_readonly("new_core", &OutputCurve::new_core);
}

void bind_shadow(py::module_& module) {
  py::class_<NumberDifference>(module, "NumberDifference")
      .def_readonly("path", &NumberDifference::path)
      .def_readonly("count", &NumberDifference::count)
      .def_readonly("maximum", &NumberDifference::maximum)
      .def_readonly("rms", &NumberDifference::rms)
      .def_readonly("nan", &NumberDifference::nan)
      .def_readonly("live_nan", &NumberDifference::live_nan);
  py::class_<OutputDifference>(module, "OutputDifference")
      .def_readonly("port", &OutputDifference::port)
      .def_readonly("type", &OutputDifference::type)
      .def_readonly("both", &OutputDifference::both)
      .def_readonly("live_only", &OutputDifference::live_only)
      .def_readonly("shadow_only", &OutputDifference::shadow_only)
      .def_readonly("is_truncated", &OutputDifference::is_truncated,
                    "The value has more numbers than are compared.")
      .def_readonly("numbers", &OutputDifference::numbers)
      .def_readonly("lag", &OutputDifference::lag,
                    "Releases by which the candidate's first number is later.");
  py::class_<ShadowRecord>(module, "ShadowRecord", "One shadow; fields as mauve_msgs/msg/Shadow.")
      .def_readonly("component", &ShadowRecord::component)
      .def_readonly("core", &ShadowRecord::core)
      .def_readonly("live_core", &ShadowRecord::live_core)
      .def_property_readonly(
          "verdict", [](const ShadowRecord& self) { return std::string(to_string(self.verdict)); },
          "Running, ended, faulted or promoted.")
      .def_readonly("reason", &ShadowRecord::reason)
      .def_readonly("begin_ns", &ShadowRecord::begin_ns)
      .def_readonly("end_ns", &ShadowRecord::end_ns)
      .def_readonly("releases", &ShadowRecord::releases)
      .def_readonly("compared", &ShadowRecord::compared)
      .def_readonly("skipped_late", &ShadowRecord::skipped_late)
      .def_readonly("skipped_budget", &ShadowRecord::skipped_budget)
      .def_readonly("idle", &ShadowRecord::idle)
      .def_readonly("over_budget", &ShadowRecord::over_budget)
      .def_readonly("budget_ns", &ShadowRecord::budget_ns)
      .def_readonly("largest_execution_ns", &ShadowRecord::largest_execution_ns)
      .def_readonly("outputs", &ShadowRecord::outputs)
      .def_readonly("steps", &ShadowRecord::steps, "Of a bumpless change.")
      .def_readonly("curves", &ShadowRecord::curves, "Of the same outputs.");
}

}  // namespace mauve::bindings
