// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/deploy/simulation.hpp"

#include "host.hpp"

namespace mauve::bindings {

namespace {

// Time passes without the interpreter's lock; callbacks and components written in Python take it when they run.
using Unlocked = py::call_guard<py::gil_scoped_release>;

/// A simulation whose last words need no lock of the interpreter's.
class PySimulation {
 public:
  PySimulation(bool trace, time_ns_t begin_ns) : simulation({.trace = trace, .begin_ns = begin_ns}) {}
  ~PySimulation() {
    const py::gil_scoped_release release;
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
  const py::class_<PySimulatedHost, PyHost> simulated_host(module, "SimulatedHost");
  py::class_<PySimulation>(module, "Simulation")
      .def(py::init<bool, time_ns_t>(), py::kw_only(), py::arg("trace") = true,
           py::arg("begin_ns") = SimulationOptions{}.begin_ns)
      .def(
          "add",
          [](PySimulation& self, PyArchitecture& architecture) {
            return std::make_unique<PySimulatedHost>(architecture,
                                                     self.simulation.add(architecture.architecture));
          },
          py::arg("architecture"), py::keep_alive<1, 2>(), py::keep_alive<0, 1>())
      .def(
          "deploy", [](PySimulation& self) { self.simulation.deploy(); }, Unlocked())
      .def(
          "shutdown", [](PySimulation& self) { self.simulation.shutdown(); }, Unlocked())
      .def(
          "at",
          [](PySimulation& self, time_ns_t instant_ns, Simulation::Callback callback) {
            self.simulation.at(instant_ns, std::move(callback));
          },
          py::arg("instant_ns"), py::arg("callback"))
      .def(
          "every",
          [](PySimulation& self, time_ns_t first_ns, time_ns_t period_ns, Simulation::Callback callback) {
            self.simulation.every(first_ns, period_ns, std::move(callback));
          },
          py::arg("first_ns"), py::arg("period_ns"), py::arg("callback"))
      .def(
          "run_until",
          [](PySimulation& self, time_ns_t instant_ns) { self.simulation.run_until(instant_ns); },
          py::arg("instant_ns"), Unlocked())
      .def("now_ns", [](const PySimulation& self) { return self.simulation.now_ns(); })
      .def("epoch_ns", [](const PySimulation& self) { return self.simulation.epoch_ns(); });
}

}  // namespace mauve::bindings
