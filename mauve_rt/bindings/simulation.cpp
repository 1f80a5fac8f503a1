// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/simulation.hpp"

#include "transaction.hpp"

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

using PublishedSample = std::tuple<std::string, std::vector<std::byte>, time_ns_t>;

py::bytes as_bytes(const std::vector<std::byte>& message) {
  return {reinterpret_cast<const char*>(message.data()), message.size()};
}

py::list take_published(PyArchitecture& self) {
  std::vector<PublishedSample> samples;
  {
    const py::gil_scoped_release release;
    PublishedSample sample;
    auto& [resource, message, time_ns] = sample;
    while (self.architecture.next_published(resource, message, time_ns)) samples.push_back(sample);
  }
  py::list list;
  for (const auto& [resource, message, time_ns] : samples)
    list.append(py::make_tuple(resource, as_bytes(message), time_ns));
  return list;
}

py::tuple read_resource(PyArchitecture& self, const std::string& name) {
  std::vector<std::byte> message;
  time_ns_t time_ns = 0;
  std::uint64_t sequence = 0;
  {
    const py::gil_scoped_release release;
    self.architecture.resource(name).peek_sample(message, time_ns, sequence);
  }
  return py::make_tuple(as_bytes(message), sequence, time_ns);
}

StepReport commit_one(PySimulation& self, PyArchitecture& architecture, Transaction transaction) {
  return self.simulation.commit(architecture.architecture, std::move(transaction)).steps.front();
}

TransactionReport commit_simulated(PySimulation& self, PyArchitecture& architecture,
                                   const PyTransaction& steps, bool dry_run,
                                   std::uint64_t expected_revision) {
  Transaction transaction = steps.build(architecture.registry);
  const py::gil_scoped_release release;
  return self.simulation.commit(architecture.architecture, std::move(transaction),
                                {.dry_run = dry_run, .expected_revision = expected_revision});
}

}  // namespace

void bind_simulation(py::module_& module) {
  py::class_<PySimulation>(module, "Simulation")
      .def(py::init<bool, time_ns_t>(), py::kw_only(), py::arg("trace") = true,
           py::arg("begin_ns") = SimulationOptions{}.begin_ns)
      .def(
          "add",
          [](PySimulation& self, PyArchitecture& architecture) {
            self.simulation.add(architecture.architecture);
          },
          py::arg("architecture"), py::keep_alive<1, 2>())
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
      .def("epoch_ns", [](const PySimulation& self) { return self.simulation.epoch_ns(); })
      .def(
          "start",
          [](PySimulation& self, PyArchitecture& architecture, const std::string& component,
             std::optional<time_ns_t> clock_ns) {
            self.simulation.start(architecture.architecture, component, clock_ns);
          },
          py::arg("architecture"), py::arg("component"), py::arg("clock_ns") = std::nullopt, Unlocked())
      .def(
          "stop",
          [](PySimulation& self, PyArchitecture& architecture, const std::string& component) {
            self.simulation.stop(architecture.architecture, component);
          },
          py::arg("architecture"), py::arg("component"), Unlocked())
      .def(
          "get_time",
          [](const PySimulation& self, const PyArchitecture& architecture, const std::string& component) {
            return self.simulation.get_time(architecture.architecture, component);
          },
          py::arg("architecture"), py::arg("component"), Unlocked())
      .def("commit", &commit_simulated, py::arg("architecture"), py::arg("transaction"), py::kw_only(),
           py::arg("dry_run") = false, py::arg("expected_revision") = 0)
      .def(
          "replace_core",
          [](PySimulation& self, PyArchitecture& architecture, const std::string& component,
             const std::string& core) {
            Transaction transaction;
            transaction.replace_core(component, core);
            return commit_one(self, architecture, std::move(transaction));
          },
          py::arg("architecture"), py::arg("component"), py::arg("core"), Unlocked())
      .def(
          "set_property",
          [](PySimulation& self, PyArchitecture& architecture, const std::string& component,
             const std::string& name, const PropertyValue& value) {
            Transaction transaction;
            transaction.set_property(component, name, value);
            return commit_one(self, architecture, std::move(transaction));
          },
          py::arg("architecture"), py::arg("component"), py::arg("name"), py::arg("value"), Unlocked())
      .def(
          "drain_trace",
          [](PySimulation& self, PyArchitecture& architecture) {
            return self.simulation.drain_trace(architecture.architecture);
          },
          py::arg("architecture"), Unlocked())
      .def(
          "trace_components",
          [](PySimulation&, const PyArchitecture& architecture) {
            std::vector<std::string> names;
            for (const auto& component : architecture.architecture.components())
              names.push_back(component->name());
            return names;
          },
          py::arg("architecture"))
      .def("trace_names", [](PySimulation&) { return TraceNames::all(); })
      .def(
          "take_published",
          [](PySimulation&, PyArchitecture& architecture) { return take_published(architecture); },
          py::arg("architecture"))
      .def(
          "write_resource",
          [](PySimulation& self, PyArchitecture& architecture, const std::string& name,
             std::string_view data) {
            return architecture.architecture.resource(name).write_sample(std::as_bytes(std::span(data)),
                                                                         self.simulation.now_ns());
          },
          py::arg("architecture"), py::arg("resource"), py::arg("data"), Unlocked())
      .def(
          "read_resource",
          [](PySimulation&, PyArchitecture& architecture, const std::string& name) {
            return read_resource(architecture, name);
          },
          py::arg("architecture"), py::arg("resource"));
}

}  // namespace mauve::bindings
