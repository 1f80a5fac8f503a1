// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/deploy/process_end.hpp"

#include <pybind11/stl.h>

#include "mauve_rt/deploy/deployer.hpp"

#include "translate.hpp"

namespace mauve::bindings {

void bind_process_end(py::module_& module) {
  module.attr("END_SIGNALS") = py::cast(std::set<int>(kEndSignals.begin(), kEndSignals.end()));
  module.attr("STOP_TIMEOUT_NS") = Deployer::kStopTimeout;
  module.def("process_ends", &Deployer::all_ended, py::call_guard<InterpreterUnlocked>(),
             "Whether one of END_SIGNALS came: nothing is deployed any more.");
  module.def(
      "wait_end_signal",
      [](time_ns_t grace_ns, int dump_signal) {
        return wait_end_signal({.grace_ns = grace_ns, .dump_signal = dump_signal});
      },
      py::kw_only(), py::arg("grace_ns"), py::arg("dump_signal") = 0, py::call_guard<InterpreterUnlocked>(),
      R"(Sleep until one of END_SIGNALS comes, which all threads have to block; returns it.

Before it returns, every deployer of the process is shut down for good: outputs are safe. None of that
needs the interpreter's lock. The process ends `grace_ns` after the signal at the latest, with status 1;
it raises `dump_signal` then, for a handler that shows where the threads are.)");
}

}  // namespace mauve::bindings
