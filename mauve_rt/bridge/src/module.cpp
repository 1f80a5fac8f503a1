// SPDX-License-Identifier: LGPL-3.0-or-later
// mauve_rt._bridge.
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <bit>

#include "actions.hpp"
#include "bridge.hpp"
#include "console.hpp"
#include "interpreter.hpp"
#include "node_watch.hpp"
#include "parameters.hpp"
#include "qos.hpp"
#include "steady_waits.hpp"
#include "stop_guard.hpp"
#include "topic_receiver.hpp"
#include "type_support.hpp"
#include "types.hpp"

namespace py = pybind11;

namespace {

using namespace mauve;
using namespace mauve::bridge;
using mauve::bindings::Typed;

template <std::size_t (Bridge::*open)(const TopicSettings&)>
std::size_t open_topic(Bridge& self, const std::string& resource, const std::string& topic,
                       const std::string& type, const rmw_qos_profile_t& qos, bool is_static) {
  return (self.*
          open)({.resource = resource, .name = topic, .type = type, .qos = qos, .is_static = is_static});
}

template <typename Kind>
std::size_t open_action(Bridge& self, const std::string& resource, const std::string& action,
                        const std::string& type) {
  return self.open(std::make_unique<Kind>(
      self.node(), ActionSettings{.resource = resource, .name = action, .type = type}));
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

FlatNumbers flat_numbers(const Typed<"typing.Sequence[tuple[str, str, str, int, typing.Any]]">& fields,
                         const std::string& path) {
  std::vector<FlatField> all;
  for (const py::handle field : fields) all.push_back(flat_field(field.cast<py::tuple>()));
  return path.empty() ? FlatNumbers(std::move(all)) : FlatNumbers(std::move(all), path);
}

std::size_t open_mirror(Bridge& self, const std::string& resource, const std::string& topic,
                        const std::string& type, const rmw_qos_profile_t& qos, time_ns_t period_ns,
                        const std::optional<FlatNumbers>& numbers, std::optional<std::size_t> number) {
  return self.mirror({.resource = resource, .name = topic, .type = type, .qos = qos},
                     {.period_ns = period_ns, .numbers = numbers, .number = number});
}

py::bytes python_bytes(std::span<const std::byte> data) {
  return {reinterpret_cast<const char*>(data.data()), data.size()};
}

Typed<"list[tuple[int, int, bytes]]"> take_log(Bridge& self) {
  py::list all;
  for (const LoggedMessage& message : self.log().take()) {
    all.append(py::make_tuple(message.topic, message.time_ns, python_bytes(message.data)));
  }
  return all;
}

Typed<"list[tuple[int, bytes]]"> messages_of(const MessageBatch& self, std::size_t topic) {
  py::list all;
  self.each(topic, [&all](time_ns_t time_ns, std::span<const std::byte> message) {
    all.append(py::make_tuple(time_ns, python_bytes(message)));
  });
  return all;
}

/// The records stay where they are: a copy would cost page faults for each of 30 MB/s.
Typed<"tuple[memoryview, list[tuple[int, int, int, bytes]]]"> pack(
    const py::object& batch, const std::vector<std::uint16_t>& channels, time_ns_t log_ahead_ns,
    time_ns_t publish_ahead_ns, time_ns_t earliest_log_ns, std::uint64_t offset) {
  const BagClock clock{
      .log_ahead_ns = log_ahead_ns, .publish_ahead_ns = publish_ahead_ns, .earliest_log_ns = earliest_log_ns};
  py::list parts;
  for (const ChannelPart& part : batch.cast<MessageBatch&>().pack(channels, clock, offset))
    parts.append(py::make_tuple(part.channel, part.first_ns, part.last_ns, python_bytes(part.index)));
  return py::make_tuple(py::memoryview(batch), parts);
}

Typed<"list[tuple[int, int, int]]"> counts_of(const MessageBatch& self) {
  py::list all;
  for (const ReceivedCounts& one : self.counts)
    all.append(py::make_tuple(one.received, one.lost_before, one.lost));
  return all;
}

Typed<"list[tuple[bytes, bytes]]"> take_answered(StopGuard& self) {
  py::list all;
  for (const auto& each : self.take_answered())
    all.append(py::make_tuple(python_bytes(each.request), python_bytes(each.response)));
  return all;
}

Typed<"list[tuple[int, bytes]]"> take_transitions(StopGuard& self) {
  py::list all;
  for (const auto& each : self.take_transitions())
    all.append(py::make_tuple(each.number, python_bytes(each.request)));
  return all;
}

void answer_transition(StopGuard& self, std::uint64_t number, const py::bytes& data) {
  const std::string_view response = data;
  const auto* const begin = reinterpret_cast<const std::byte*>(response.data());
  self.answer(number, {begin, begin + response.size()});
}

Typed<"list[tuple[str, dict[str, typing.Any]]]"> python_parameters(const std::vector<std::string>& words) {
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
  module.doc() =
      "Resources on ROS topics and services, natively, on a node of rclpy's. C++: mauve_rt/bridge.";
  // What the threads wait for may want the interpreter's lock: never wait for them under it.
  using Unlocked = py::call_guard<bindings::InterpreterUnlocked>;
  module.def("start_console", &Console::start,
             R"(From here on a thread of its own writes the process's log lines to the console.

Once, after rclpy.init(), which was told `--disable-stdout-logs`.)");
  module.def(
      "write_log_line",
      [](int severity, const std::string& name, time_ns_t time_ns, const std::string& text,
         const std::string& function, const std::string& file, std::size_t line) {
        Console::write(severity, name, time_ns, text, {.function = function, .file = file, .number = line});
      },
      py::arg("severity"), py::arg("name"), py::arg("time_ns"), py::arg("text"), py::arg("function"),
      py::arg("file"), py::arg("line"), Unlocked(),
      "Write a line with a time of its own (CLOCK_REALTIME), to /rosout and the console.");
  module.def("require_type_support", &require_type_support, py::arg("type"),
             R"(Load what a topic, service or action of this type needs.

Raises:
    MauveError: the type is not installed, or cannot be loaded.)");
  module.def("flush_console", &Console::flush, py::arg("timeout_ns"), Unlocked(),
             "Wait until all lines are written; False: the console is not read.");
  module.def("wait_by_the_monotonic_clock", &wait_by_the_monotonic_clock,
             R"(Let the middleware that is loaded wait by CLOCK_MONOTONIC, where it would by CLOCK_REALTIME.

Once, after rclpy.init() and before the first node.)");
  module.def(
      "parameters_of", &python_parameters, py::arg("words"),
      R"(What `--ros-args` says to nodes, in rcl's order: their name or pattern, and values by parameter.

Raises:
    MauveError: rcl refuses the words, or a parameter file.)");
  py::class_<NodeWatch>(
      module, "NodeWatch",
      "Reports, without Python, that Python is silent: an ERROR in the log, no WATCHDOG=1 for systemd.")
      .def(py::init<std::string, time_ns_t>(), py::arg("logger"), py::kw_only(), py::arg("silent_after_ns"),
           "Watch from now on.")
      .def("beat", &NodeWatch::beat, "Say that Python works.")
      .def("stop", &NodeWatch::stop, Unlocked(), "End the watch; may be called again.")
      .def_static(
          "notify", &NodeWatch::notify, py::arg("state"),
          "Report a state, such as READY=1, to the service manager that NOTIFY_SOCKET names, if it does.");
  py::class_<StopGuard>(
      module, "StopGuard",
      R"(Takes requests to stop, deactivate or shut down that the node leaves unread for 200 ms.

A stop is carried out and answered; for a transition outputs are made safe, and the node answers it.)")
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
           py::arg("logger"), py::arg("instance_id"), py::arg("codes"),
           R"(Guard from now on. Addresses of the node, the two services and a guard condition outlive it.

`news` is triggered when there is something to take; `codes` are the constants of ReplyCode.)")
      .def(
          "set_architecture",
          [](StopGuard& self, std::uintptr_t architecture) {
            self.set_architecture(std::bit_cast<Architecture*>(architecture));
          },
          py::arg("architecture"), Unlocked(),
          "Stop components of this one, by its address, from now on; 0: of none.")
      .def("take_answered", &take_answered,
           "(request, response) of each stop that was answered here since the last call, as CDR.")
      .def("take_transitions", &take_transitions,
           "(number, request) of each transition that is to be made and answered, as CDR.")
      .def("answer", &answer_transition, py::arg("number"), py::arg("response"),
           "Send the response, CDR, to a transition of take_transitions().")
      .def("stop", &StopGuard::stop, Unlocked(), "End the guard; may be called again.");
  py::class_<rmw_qos_profile_t>(
      module, "Qos",
      "Quality of service; policies as rclpy's enumerations number them, durations in ns, 0: none.")
      .def(py::init(&make_qos), py::kw_only(), py::arg("reliability"), py::arg("durability"),
           py::arg("depth"), py::arg("deadline_ns") = 0, py::arg("lifespan_ns") = 0,
           py::arg("liveliness") = 0, py::arg("lease_ns") = 0);
  py::class_<MessageBatch>(module, "MessageBatch", py::buffer_protocol(),
                           "Messages of a TopicReceiver as records of an MCAP file, one behind the other.")
      .def_buffer([](MessageBatch& self) {
        const std::span<const std::byte> all = self.records();
        return py::buffer_info(reinterpret_cast<const std::uint8_t*>(all.data()),
                               static_cast<py::ssize_t>(all.size()));
      })
      .def_property_readonly("sizes", &MessageBatch::sizes, "Messages of each topic.")
      .def_property_readonly("counts", &counts_of,
                             "(received, lost before, lost here for want of room) of each topic, so far.")
      .def("messages", &messages_of, py::arg("topic"),
           "(CLOCK_MONOTONIC ns, CDR) of each message of a topic; before pack().")
      .def("pack", &pack, py::arg("channels"), py::kw_only(), py::arg("log_ahead_ns"),
           py::arg("publish_ahead_ns"), py::arg("earliest_log_ns"), py::arg("offset"),
           R"(Complete the records for a place in a chunk; once.

Channels: of each topic, 0 leaves its messages out. Returns the records, and (channel, first and last log
time, entries of its message index) of each channel.)");
  py::class_<SequenceGaps>(module, "SequenceGaps",
                           "Messages lost before they came, by the sequence numbers of their writers.")
      .def(py::init())
      .def(
          "follow",
          [](SequenceGaps& self, const std::string& writer, std::uint64_t sequence) {
            rmw_gid_t gid{};
            writer.copy(reinterpret_cast<char*>(gid.data), sizeof gid.data);
            return self.follow(gid, sequence);
          },
          py::arg("writer"), py::arg("sequence"),
          "Of a message of a writer, named by up to 16 characters; returns how many were lost so far.");
  py::class_<TopicReceiver>(
      module, "TopicReceiver",
      R"(Receives topics of other nodes for a recorder, by an ordinary thread without the interpreter.

The messages stay serialized. Of each topic it counts what it received, what was lost before (gaps in the
sequence numbers of a writer) and what found no room.)")
      .def(py::init([](std::uintptr_t node, std::size_t limit_bytes) {
             return std::make_unique<TopicReceiver>(*std::bit_cast<rcl_node_t*>(node), limit_bytes);
           }),
           py::arg("node"), py::kw_only(), py::arg("limit_bytes"),
           "Take the address of a node that outlives close(), and how much may wait for take().")
      .def_static("numbered", &TopicReceiver::numbered,
                  "Whether the middleware numbers the messages of each writer, so that gaps are known.")
      .def("subscribe", &TopicReceiver::subscribe, py::arg("topic"), py::arg("type"), py::arg("qos"),
           Unlocked(),
           R"(Subscribe, also after start(); returns the number of the topic, counted from 0.

Raises:
    MauveError: the type is not installed, or the middleware refuses.)")
      .def("start", &TopicReceiver::start, Unlocked(), "Receive from now on.")
      .def("stop", &TopicReceiver::stop, Unlocked(),
           "End, when all that has arrived is taken. May be called again.")
      .def("close", &TopicReceiver::close, Unlocked(),
           "stop(), and end the subscriptions; what came stays for take().")
      .def("take", &TopicReceiver::take, Unlocked(), "What came since the last call.")
      .def("ignore", &TopicReceiver::ignore, py::arg("number"), py::arg("on"), Unlocked(),
           "Neither keep nor count the messages of a topic from now on, or do again.")
      .def("take_misfits", &TopicReceiver::take_misfits, Unlocked(),
           R"(Of each topic the quality of service in which a publisher did not fit since the last call.

As rclpy's QoSPolicyKind; 0: none.)");
  py::class_<TopicTroubles>(
      module, "TopicTroubles",
      "What the middleware tells of a topic besides its messages. Counts since it was opened.")
      .def_readonly("deadlines_missed", &TopicTroubles::deadlines_missed)
      .def_readonly("liveliness_lost", &TopicTroubles::liveliness_lost,
                    "By us as a publisher, or by a publisher that we heard of.")
      .def_readonly("incompatible_qos", &TopicTroubles::incompatible_qos)
      .def_readonly("policy", &TopicTroubles::policy,
                    "The last quality of service that did not fit, as rclpy's QoSPolicyKind.");
  py::class_<CallCounts>(module, "CallCounts", "How calls ended so far.")
      .def_readonly("answered", &CallCounts::answered)
      .def_readonly("no_server", &CallCounts::no_server)
      .def_readonly("timed_out", &CallCounts::timed_out)
      .def_readonly("other", &CallCounts::other,
                    "Busy, malformed, or given up for a stop; of an offered call: refused by the resource.")
      .def_readonly("longest_ns", &CallCounts::longest_ns, "The longest of those answered.");
  py::class_<CallReport>(
      module, "CallReport",
      "A ROS service that a resource calls or offers: its name, expanded and remapped, and counts.")
      .def_readonly("resource", &CallReport::resource)
      .def_readonly("service", &CallReport::service)
      .def_readonly("is_offered", &CallReport::is_offered)
      .def_readonly("counts", &CallReport::counts);
  py::class_<ActionCounts>(module, "ActionCounts", "What became of goals so far.")
      .def_readonly("accepted", &ActionCounts::accepted)
      .def_readonly("rejected", &ActionCounts::rejected)
      .def_readonly("succeeded", &ActionCounts::succeeded)
      .def_readonly("canceled", &ActionCounts::canceled)
      .def_readonly("aborted", &ActionCounts::aborted)
      .def_readonly("refused", &ActionCounts::refused, "Decisions of components that fit no goal.");
  py::class_<ActionReport>(
      module, "ActionReport",
      "A ROS action that a resource serves or calls: its name, expanded and remapped, and counts of goals.")
      .def_readonly("resource", &ActionReport::resource)
      .def_readonly("action", &ActionReport::action)
      .def_readonly("is_offered", &ActionReport::is_offered)
      .def_readonly("counts", &ActionReport::counts);
  py::class_<TopicReport>(module, "TopicReport",
                          "A bound topic: its name, expanded and remapped, and counts of messages.")
      .def_readonly("resource", &TopicReport::resource)
      .def_readonly("topic", &TopicReport::topic)
      .def_property_readonly(
          "passed", [](const TopicReport& self) { return self.counts.passed; },
          "Sent, or received and written.")
      .def_property_readonly(
          "refused", [](const TopicReport& self) { return self.counts.refused; },
          "By the middleware or by the resource: full, malformed, or larger than it declares.")
      .def_readonly("refusal", &TopicReport::refusal,
                    "Why the resource refused a message lately; empty: none.")
      .def_property_readonly("troubles", [](const TopicReport& self) { return self.troubles; });
  py::class_<FlatNumbers>(
      module, "FlatNumbers",
      "Reads the numbers of messages of one type; a sequence has one number, its length; a text has none.")
      .def(py::init(&flat_numbers), py::arg("fields"), py::arg("path") = "",
           R"(Fields: (name, type as in .msg files, "" or "fixed" or "sequence", size, fields of a message).

With a path such as position.x or ranges[3], the one number there.

Raises:
    MauveError: there is no number, or more than 1,000, or a field cannot be read.)")
      .def_property_readonly("names", &FlatNumbers::names,
                             "What the numbers are, in their order: position.x, ranges[3], path.length.");
  py::class_<Bridge>(
      module, "Bridge",
      R"(The topics, services and actions of an architecture, by threads of its own: one sends, the others receive.

What is opened can be found on the network; it serves its resource from attach() on.)")
      .def(py::init([](std::uintptr_t node, std::uintptr_t architecture, int priority,
                       const std::vector<int>& cpus) {
             return std::make_unique<Bridge>(*std::bit_cast<rcl_node_t*>(node),
                                             *std::bit_cast<Architecture*>(architecture),
                                             ThreadPlace{.priority = priority, .cpus = cpus});
           }),
           py::arg("node"), py::arg("architecture"), py::kw_only(), py::arg("priority") = 1,
           py::arg("cpus") = std::vector<int>(),
           R"(Take addresses: `node.handle.pointer`, `architecture.pointer`; both outlive the bridge.

Priority (SCHED_FIFO) and CPUs (none: any) are the sending thread's.)")
      .def("publish", &open_topic<&Bridge::publish>, py::arg("resource"), py::arg("topic"), py::arg("type"),
           py::arg("qos"), py::kw_only(), py::arg("is_static") = false, Unlocked(),
           R"(Open a topic for a resource; returns the number of what was opened, also in the log.

`is_static`: for the static transforms of a transform_tree.

Raises:
    MauveError: the type is not installed, or the middleware refuses; nothing is open then.)")
      .def("subscribe", &open_topic<&Bridge::subscribe>, py::arg("resource"), py::arg("topic"),
           py::arg("type"), py::arg("qos"), py::kw_only(), py::arg("is_static") = false, Unlocked(),
           "As publish(), the other way.")
      .def("mirror", &open_mirror, py::arg("resource"), py::arg("topic"), py::arg("type"), py::arg("qos"),
           py::kw_only(), py::arg("period_ns"), py::arg("numbers") = std::nullopt,
           py::arg("number") = std::nullopt, Unlocked(),
           R"(Open a topic on which the polled value is published, at most once in `period_ns`; as publish().

With `numbers`: all of them as mauve_msgs/msg/Values, their names on another topic, with
`/names` behind it; with `number`, too: that one as std_msgs/msg/Float64.)")
      .def(
          "call",
          [](Bridge& self, const std::string& resource, const std::string& service, const std::string& type) {
            return self.call({.resource = resource, .name = service, .type = type});
          },
          py::arg("resource"), py::arg("service"), py::arg("type"), Unlocked(),
          "Open a ROS service that answers a client's calls; as publish().")
      .def(
          "offer",
          [](Bridge& self, const std::string& resource, const std::string& service, const std::string& type,
             const std::string& offered) {
            return self.offer({.resource = resource, .name = service, .type = type}, offered);
          },
          py::arg("resource"), py::arg("service"), py::arg("type"), py::arg("offered"), Unlocked(),
          "Open a ROS service that a resource's call `offered` answers; as publish().")
      .def("call_action", &open_action<CalledAction>, py::arg("resource"), py::arg("action"), py::arg("type"),
           Unlocked(), "Open a ROS action whose server executes a client's goals; as publish().")
      .def("offer_action", &open_action<OfferedAction>, py::arg("resource"), py::arg("action"),
           py::arg("type"), Unlocked(), "Open a ROS action whose goals a resource takes; as publish().")
      .def("attach", &Bridge::attach, py::arg("numbers"), Unlocked(),
           R"(Let these serve the resources of their names in the architecture.

Raises:
    MauveError: there is no such resource, or it is none to serve.)")
      .def("close", py::overload_cast<const std::vector<std::size_t>&>(&Bridge::close), py::arg("numbers"),
           Unlocked(), "End these; what was written before is sent.")
      .def(
          "listen_for_silence", &Bridge::listen_for_silence, py::arg("resources"), py::arg("links"),
          Unlocked(),
          R"(Report that nothing waits to be written to these resources, and of those of `links` also arrivals.

A reliable topic of `links` gets a best-effort subscription, too: there a lost message holds up no later one.

Raises:
    MauveError: the middleware refuses.)")
      .def("start", &Bridge::start, "Let messages flow, both ways.")
      .def("stop", &Bridge::stop, Unlocked(),
           "End the flow when what was written before is sent. May be called again.")
      .def("close", py::overload_cast<>(&Bridge::close), Unlocked(), "stop(), and end all.")
      .def(
          "topics", [](Bridge& self) { return self.report().topics; }, Unlocked())
      .def(
          "calls", [](Bridge& self) { return self.report().calls; }, Unlocked())
      .def(
          "actions", [](Bridge& self) { return self.report().actions; }, Unlocked())
      .def(
          "log", [](Bridge& self, bool on) { self.log().enable(on); }, py::arg("on"),
          "Keep messages for take_log() from now on, or do not.")
      .def("take_log", &take_log,
           "(topic's number, CLOCK_MONOTONIC ns, CDR) of each message since the last call.")
      .def_property_readonly(
          "log_dropped", [](Bridge& self) { return self.log().dropped(); },
          "Messages that found no room in the log.");
}
