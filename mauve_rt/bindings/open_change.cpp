// SPDX-License-Identifier: LGPL-3.0-or-later
// Open changes: what they are, and for which components they wait.
#include "host.hpp"

namespace mauve::bindings {

void bind_open_change(py::module_& module) {
  py::class_<LateComponent>(module, "LateComponent", "A component for which an open change waits.")
      .def_readonly("name", &LateComponent::name)
      .def_property_readonly(
          "state", [](const LateComponent& self) { return self.state.state; },
          "The state that it executes or waits in, or the last one; empty before its first start.")
      .def_property_readonly(
          "state_age_ns", [](const LateComponent& self) { return self.state.age_ns; },
          "Of an execution since it began, of a wait past its pending instant; 0: parked.")
      .def_property_readonly("waiting", [](const LateComponent& self) { return self.state.is_wait; })
      .def_readonly("left_behind", &LateComponent::left_behind,
                    "Its execution was given up, and its thread has not come back.");
  py::class_<OpenChangeFacts>(module, "OpenChange", "A change that is not complete, as of one moment.")
      .def_readonly("author", &OpenChangeFacts::author, "Empty: unknown.")
      .def_readonly("steps", &OpenChangeFacts::steps, "In words.")
      .def_readonly("begun_ns", &OpenChangeFacts::begun_ns, "When it was asked for, on the host's clock.")
      .def_property_readonly(
          "phase", [](const OpenChangeFacts& self) { return std::string(to_string(self.phase)); },
          "preparing, waiting (for its components to agree) or made.")
      .def_readonly("hook", &OpenChangeFacts::hook,
                    "The hook of a part that it is at: `configure of core my_robot/Pid`; empty: at none.")
      .def_readonly("hook_age_ns", &OpenChangeFacts::hook_age_ns, "For how long.")
      .def_readonly("instant_ns", &OpenChangeFacts::instant_ns, "T; 0: it is not decided.")
      .def_readonly(
          "late", &OpenChangeFacts::late,
          "Of one that is made, the components that have not taken it; else those that have not agreed.");
}

}  // namespace mauve::bindings
