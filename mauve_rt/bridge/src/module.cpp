// SPDX-License-Identifier: LGPL-3.0-or-later
// mauve_rt._bridge; its interface with docs is _bridge.pyi.
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <bit>

#include "bridge.hpp"
#include "console.hpp"
#include "node_watch.hpp"
#include "parameters.hpp"
#include "stop_guard.hpp"

namespace py = pybind11;

namespace {

using namespace mauve;
using namespace mauve::bridge;

rmw_time_t duration(time_ns_t time_ns) {
  return {.sec = static_cast<std::uint64_t>(time_ns / s_to_ns(1)),
          .nsec = static_cast<std::uint64_t>(time_ns % s_to_ns(1))};
}

rmw_qos_profile_t make_qos(int reliability, int durability, std::size_t depth, time_ns_t deadline_ns,
                           time_ns_t lifespan_ns, int liveliness, time_ns_t lease_ns) {
  rmw_qos_profile_t qos{};
  qos.history = RMW_QOS_POLICY_HISTORY_KEEP_LAST;
  qos.depth = depth;
  qos.reliability = static_cast<rmw_qos_reliability_policy_t>(reliability);
  qos.durability = static_cast<rmw_qos_durability_policy_t>(durability);
  qos.deadline = duration(deadline_ns);
  qos.lifespan = duration(lifespan_ns);
  qos.liveliness = static_cast<rmw_qos_liveliness_policy_t>(liveliness);
  qos.liveliness_lease_duration = duration(lease_ns);
  return qos;
}

template <std::size_t (Bridge::*open)(const TopicSettings&)>
std::size_t open_topic(Bridge& self, const std::string& resource, const std::string& topic,
                       const std::string& type, const rmw_qos_profile_t& qos) {
  return (self.*open)({.resource = resource, .name = topic, .type = type, .qos = qos});
}

/// From (name, type, "" | "fixed" | "sequence", size, fields).
FlatField flat_field(const py::tuple& told) {
  FlatField field{.name = told[0].cast<std::string>(), .type = told[1].cast<std::string>()};
  const auto array = told[2].cast<std::string>();
  if (!array.empty()) field.arity = array == "fixed" ? FlatField::Arity::fixed : FlatField::Arity::sequence;
  field.size = told[3].cast<std::size_t>();
  for (const py::handle inner : told[4]) field.fields.push_back(flat_field(inner.cast<py::tuple>()));
  return field;
}

FlatNumbers flat_numbers(const py::iterable& fields) {
  std::vector<FlatField> all;
  for (const py::handle field : fields) all.push_back(flat_field(field.cast<py::tuple>()));
  return FlatNumbers(std::move(all));
}

std::size_t open_mirror(Bridge& self, const std::string& resource, const std::string& topic,
                        const std::string& type, const rmw_qos_profile_t& qos, time_ns_t period_ns,
                        const std::optional<FlatNumbers>& numbers, std::optional<std::size_t> number) {
  return self.mirror({.resource = resource, .name = topic, .type = type, .qos = qos},
                     {.period_ns = period_ns, .numbers = numbers, .number = number});
}

py::bytes python_bytes(const std::vector<std::byte>& data) {
  return {reinterpret_cast<const char*>(data.data()), data.size()};
}

py::list take_log(Bridge& self) {
  py::list all;
  for (const LoggedMessage& message : self.log().take()) {
    all.append(py::make_tuple(message.topic, message.time_ns, python_bytes(message.data)));
  }
  return all;
}

py::list take_answered(StopGuard& self) {
  py::list all;
  for (const auto& each : self.take_answered())
    all.append(py::make_tuple(python_bytes(each.request), python_bytes(each.response)));
  return all;
}

py::list take_transitions(StopGuard& self) {
  py::list all;
  for (const auto& each : self.take_transitions())
    all.append(py::make_tuple(each.number, python_bytes(each.request)));
  return all;
}

void answer_transition(StopGuard& self, std::uint64_t number, std::string_view response) {
  const auto* const begin = reinterpret_cast<const std::byte*>(response.data());
  self.answer(number, {begin, begin + response.size()});
}

py::list python_parameters(const std::vector<std::string>& words) {
  py::list all;
  for (const NodeParameters& each : parameters_of(words)) {
    py::dict values;
    for (const auto& [name, value] : each.values) values[py::str(name)] = py::cast(value);
    all.append(py::make_tuple(each.nodes, values));
  }
  return all;
}

}  // namespace

PYBIND11_MODULE(_bridge, module) {
  module.doc() = "Resources on ROS topics and services, natively, on a node of rclpy's.";
  // What the threads wait for may want the interpreter's lock: never wait for them under it.
  using Unlocked = py::call_guard<py::gil_scoped_release>;
  module.def("start_console", &Console::start);
  module.def("flush_console", &Console::flush, py::arg("timeout_ns"), Unlocked());
  module.def("parameters_of", &python_parameters, py::arg("words"));
  py::class_<NodeWatch>(module, "NodeWatch")
      .def(py::init<std::string, time_ns_t>(), py::arg("logger"), py::kw_only(), py::arg("silent_after_ns"))
      .def("beat", &NodeWatch::beat)
      .def("stop", &NodeWatch::stop, Unlocked())
      .def_static("notify", &NodeWatch::notify, py::arg("state"));
  py::class_<StopGuard>(module, "StopGuard")
      .def(py::init([](std::uintptr_t node, std::uintptr_t stop, std::uintptr_t change_state,
                       std::uintptr_t news, const std::string& logger, const std::string& instance_id,
                       const std::map<std::string, std::uint16_t>& codes) {
             return std::make_unique<StopGuard>(
                 GuardedNode{.node = *std::bit_cast<rcl_node_t*>(node),
                             .stop = *std::bit_cast<rcl_service_t*>(stop),
                             .change_state = *std::bit_cast<rcl_service_t*>(change_state),
                             .news = *std::bit_cast<rcl_guard_condition_t*>(news),
                             .logger = logger,
                             .instance_id = instance_id,
                             .codes = codes});
           }),
           py::arg("node"), py::kw_only(), py::arg("stop"), py::arg("change_state"), py::arg("news"),
           py::arg("logger"), py::arg("instance_id"), py::arg("codes"))
      .def(
          "set_architecture",
          [](StopGuard& self, std::uintptr_t architecture) {
            self.set_architecture(std::bit_cast<Architecture*>(architecture));
          },
          py::arg("architecture"), Unlocked())
      .def("take_answered", &take_answered)
      .def("take_transitions", &take_transitions)
      .def("answer", &answer_transition, py::arg("number"), py::arg("response"))
      .def("stop", &StopGuard::stop, Unlocked());
  py::class_<rmw_qos_profile_t>(module, "Qos")
      .def(py::init(&make_qos), py::kw_only(), py::arg("reliability"), py::arg("durability"),
           py::arg("depth"), py::arg("deadline_ns") = 0, py::arg("lifespan_ns") = 0,
           py::arg("liveliness") = 0, py::arg("lease_ns") = 0);
  py::class_<TopicTroubles>(module, "TopicTroubles")
      .def_readonly("deadlines_missed", &TopicTroubles::deadlines_missed)
      .def_readonly("liveliness_lost", &TopicTroubles::liveliness_lost)
      .def_readonly("incompatible_qos", &TopicTroubles::incompatible_qos)
      .def_readonly("policy", &TopicTroubles::policy);
  py::class_<CallCounts>(module, "CallCounts")
      .def_readonly("answered", &CallCounts::answered)
      .def_readonly("no_server", &CallCounts::no_server)
      .def_readonly("timed_out", &CallCounts::timed_out)
      .def_readonly("other", &CallCounts::other)
      .def_readonly("longest_ns", &CallCounts::longest_ns);
  py::class_<CallReport>(module, "CallReport")
      .def_readonly("resource", &CallReport::resource)
      .def_readonly("service", &CallReport::service)
      .def_readonly("is_offered", &CallReport::is_offered)
      .def_readonly("counts", &CallReport::counts);
  py::class_<TopicReport>(module, "TopicReport")
      .def_readonly("resource", &TopicReport::resource)
      .def_readonly("topic", &TopicReport::topic)
      .def_property_readonly("passed", [](const TopicReport& self) { return self.counts.passed; })
      .def_property_readonly("refused", [](const TopicReport& self) { return self.counts.refused; })
      .def_readonly("refusal", &TopicReport::refusal)
      .def_property_readonly("troubles", [](const TopicReport& self) { return self.troubles; });
  py::class_<FlatNumbers>(module, "FlatNumbers")
      .def(py::init(&flat_numbers), py::arg("fields"))
      .def_property_readonly("names", &FlatNumbers::names);
  py::class_<Bridge>(module, "Bridge")
      .def(py::init([](std::uintptr_t node, std::uintptr_t architecture, int priority,
                       const std::vector<int>& cpus) {
             return std::make_unique<Bridge>(*std::bit_cast<rcl_node_t*>(node),
                                             *std::bit_cast<Architecture*>(architecture),
                                             ThreadPlace{.priority = priority, .cpus = cpus});
           }),
           py::arg("node"), py::arg("architecture"), py::kw_only(), py::arg("priority") = 1,
           py::arg("cpus") = std::vector<int>())
      .def("publish", &open_topic<&Bridge::publish>, py::arg("resource"), py::arg("topic"), py::arg("type"),
           py::arg("qos"), Unlocked())
      .def("subscribe", &open_topic<&Bridge::subscribe>, py::arg("resource"), py::arg("topic"),
           py::arg("type"), py::arg("qos"), Unlocked())
      .def("mirror", &open_mirror, py::arg("resource"), py::arg("topic"), py::arg("type"), py::arg("qos"),
           py::kw_only(), py::arg("period_ns"), py::arg("numbers") = std::nullopt,
           py::arg("number") = std::nullopt, Unlocked())
      .def(
          "call",
          [](Bridge& self, const std::string& resource, const std::string& service, const std::string& type) {
            return self.call({.resource = resource, .name = service, .type = type});
          },
          py::arg("resource"), py::arg("service"), py::arg("type"), Unlocked())
      .def(
          "offer",
          [](Bridge& self, const std::string& resource, const std::string& service, const std::string& type,
             const std::string& offered) {
            return self.offer({.resource = resource, .name = service, .type = type}, offered);
          },
          py::arg("resource"), py::arg("service"), py::arg("type"), py::arg("offered"), Unlocked())
      .def("attach", &Bridge::attach, py::arg("numbers"), Unlocked())
      .def("close", py::overload_cast<const std::vector<std::size_t>&>(&Bridge::close), py::arg("numbers"),
           Unlocked())
      .def("listen_for_silence", &Bridge::listen_for_silence, py::arg("resources"), Unlocked())
      .def("start", &Bridge::start)
      .def("stop", &Bridge::stop, Unlocked())
      .def("close", py::overload_cast<>(&Bridge::close), Unlocked())
      .def(
          "topics", [](Bridge& self) { return self.report().topics; }, Unlocked())
      .def(
          "calls", [](Bridge& self) { return self.report().calls; }, Unlocked())
      .def(
          "log", [](Bridge& self, bool on) { self.log().enable(on); }, py::arg("on"))
      .def("take_log", &take_log)
      .def_property_readonly("log_dropped", [](Bridge& self) { return self.log().dropped(); });
}
