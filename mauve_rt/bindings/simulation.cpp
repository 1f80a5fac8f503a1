// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/deploy/simulation.hpp"

#include "host.hpp"

namespace mauve::bindings {

namespace {

// Time passes without the interpreter's lock; callbacks and components written in Python take it when they run.
using Unlocked = py::call_guard<InterpreterUnlocked>;
using Callback = Typed<"typing.Callable[[], object]">;

/// A simulation whose last words need no lock of the interpreter's.
class PySimulation {
 public:
  PySimulation(bool trace, time_ns_t begin_ns) : simulation({.trace = trace, .begin_ns = begin_ns}) {}
  ~PySimulation() {
    const InterpreterUnlocked release;
    simulation.shutdown();
  }
  PySimulation(const PySimulation&) = delete;
  PySimulation& operator=(const PySimulation&) = delete;

  Simulation simulation;
};

/// Keeps the simulation and the architecture.
class PySimulatedHost final : public PyHost {
 public:
  PySimulatedHost(PyArchitecture& architecture, SimulatedHost& host) : PyHost(architecture), host_(host) {}
  Host& host() const noexcept override { return host_; }

 private:
  SimulatedHost& host_;
};

}  // namespace

void bind_simulation(py::module_& module) {
  const py::class_<PySimulatedHost, PyHost> simulated_host(
      module, "SimulatedHost",
      "The host of one architecture in virtual time; from Simulation.add, which it keeps.");
  py::class_<PySimulation>(module, "Simulation",
                           R"(Architectures in virtual time on the calling thread, the same every time.

Time passes without the interpreter's lock; callbacks and components written in Python take it.
An exception of a callback ends run_until, which may be called again. A reference from a callback to the
simulation's owner lives until shutdown().)")
      .def(py::init<bool, time_ns_t>(), py::kw_only(), py::arg("trace") = true,
           py::arg("begin_ns") = SimulationOptions{}.begin_ns)
      .def(
          "add",
          [](PySimulation& self, PyArchitecture& architecture) {
            return std::make_unique<PySimulatedHost>(architecture,
                                                     self.simulation.add(architecture.architecture));
          },
          py::arg("architecture"), py::keep_alive<1, 2>(), py::keep_alive<0, 1>(),
          R"(Takes in a configured architecture, before deploy(), which lives as long as the simulation.

Returns what runs it, to command and change it by, from callbacks or between two run_until().)")
      .def(
          "deploy", [](PySimulation& self) { self.simulation.deploy(); }, Unlocked(),
          "Gives all components one epoch and starts them.")
      .def(
          "shutdown", [](PySimulation& self) { self.simulation.shutdown(); }, Unlocked(),
          "Stops every component, drops the callbacks and lets the architectures go.")
      .def(
          "at",
          [](PySimulation& self, time_ns_t instant_ns, const Callback& callback) {
            self.simulation.at(instant_ns, callback.cast<Simulation::Callback>());
          },
          py::arg("instant_ns"), py::arg("callback"),
          "Calls back once, at the instant or now if that is past.")
      .def(
          "every",
          [](PySimulation& self, time_ns_t first_ns, time_ns_t period_ns, const Callback& callback) {
            self.simulation.every(first_ns, period_ns, callback.cast<Simulation::Callback>());
          },
          py::arg("first_ns"), py::arg("period_ns"), py::arg("callback"))
      .def(
          "run_until",
          [](PySimulation& self, time_ns_t instant_ns) { self.simulation.run_until(instant_ns); },
          py::arg("instant_ns"), Unlocked(),
          "Lets virtual time pass up to the instant, that instant included.")
      .def("now_ns", [](const PySimulation& self) { return self.simulation.now_ns(); })
      .def(
          "epoch_ns", [](const PySimulation& self) { return self.simulation.epoch_ns(); },
          "The instant that all grids are counted from; 0 before deploy().");
}

}  // namespace mauve::bindings
