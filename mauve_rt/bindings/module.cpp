// SPDX-License-Identifier: LGPL-3.0-or-later
// mauve_rt._kernel; its interface with docs is _kernel.pyi.
#include "translate.hpp"

PYBIND11_MODULE(_kernel, module) {
  using namespace mauve::bindings;
  module.doc() = "The native kernel, translated one to one. Times are int64 nanoseconds of CLOCK_MONOTONIC.";
  bind_errors(module);
  bind_descriptions(module);
  bind_python_shell(module);
  bind_python_fsm(module);
  bind_registry(module);
  bind_settings(module);
  bind_architecture(module);
  bind_value_log(module);
  bind_probation(module);
  bind_shadow(module);
  bind_transaction(module);
  bind_host(module);
  bind_simulation(module);
  bind_rules(module);
  bind_rule_runner(module);
  bind_process_end(module);
  module.attr("__version__") = MAUVE_VERSION;
  module.attr("NOT_MEASURED") = mauve::kNotMeasured;
  module.def("monotonic_ns", &mauve::monotonic_now_ns);
}
