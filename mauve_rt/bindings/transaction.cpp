// SPDX-License-Identifier: LGPL-3.0-or-later
#include "transaction.hpp"

namespace mauve::bindings {

namespace {

using Self = PyTransaction&;

PyTransaction& add_component(Self self, const std::string& name, const AnyShell& shell, const AnyCore& core,
                             const AnyFsm& fsm, const std::map<std::string, PropertyValue>& properties,
                             const std::vector<std::string>& alternatives, const std::string& fallback,
                             bool reconfigurable,
                             const std::map<std::string, std::pair<std::string, std::string>>& frames,
                             const py::kwargs& settings) {
  ComponentParts rest{.settings = task_settings(name, settings),
                      .properties = properties,
                      .alternatives = alternatives,
                      .fallback = fallback,
                      .reconfigurable = reconfigurable};
  for (const auto& [port, names] : frames)
    rest.frames.emplace(port, Frames{.frame = names.first, .child_frame = names.second});
  return self.add([=](Transaction& transaction, const PluginRegistry& registry) {
    transaction.add_component(name,
                              Parts{.shell = make_shell(shell, registry),
                                    .core = make_core(core, registry),
                                    .fsm = make_fsm(fsm, registry)},
                              rest);
  });
}

TopicBinding topic_binding(const std::string& name) {
  if (name.empty()) return TopicBinding::none;
  if (name == "publish") return TopicBinding::publish;
  if (name == "subscribe") return TopicBinding::subscribe;
  throw Error(ErrorCode::invalid_argument, "there is no such way to bind a resource to a topic",
              {.element = "topic", .expected = "publish, subscribe or nothing", .found = name});
}

PyTransaction& add_step(Self self, const std::string& kind, const std::string& target,
                        const std::string& name, const std::optional<PropertyValue>& value) {
  return self.add([=](Transaction& steps, const PluginRegistry&) {
    steps.add(kind, target, name, value ? StepValue(*value) : StepValue{});
  });
}

bool is_name(const py::object& part) { return py::isinstance<py::str>(part); }

void bind_replacements(py::class_<PyTransaction>& transaction) {
  transaction
      .def(
          "replace_core",
          [](Self self, const std::string& component, const AnyCore& core,
             const std::optional<ProbationOptions>& probation,
             const std::optional<BumplessOptions>& bumpless) -> Self {
            return self.add([=](Transaction& steps, const PluginRegistry& registry) {
              const ReplaceOptions options{.probation = probation, .bumpless = bumpless};
              if (is_name(core)) {
                steps.replace_core(component, core.cast<std::string>(), options);
              } else {
                steps.replace_core(component, make_core(core, registry), options);
              }
            });
          },
          py::arg("component"), py::arg("core"), py::arg("probation") = std::nullopt,
          py::arg("bumpless") = std::nullopt,
          R"(With `probation`, an fsm that the same transaction replaces is on probation with the core.

With `bumpless`, the core of a running component goes in only where its outputs are near those of the old one.)")
      .def(
          "shadow",
          [](Self self, const std::string& component, const std::string& core, time_ns_t budget_ns,
             bool fresh) -> Self {
            return self.add([=](Transaction& steps, const PluginRegistry&) {
              steps.shadow(component, core, {.budget_ns = budget_ns, .is_fresh = fresh});
            });
          },
          py::arg("component"), py::arg("core"), py::arg("budget_ns"), py::arg("fresh") = false,
          R"(A candidate executes in parallel with the core; its budget is for one release, on average.

It begins with copies of the core's state fields, unless it is `fresh`.)")
      .def(
          "promote",
          [](Self self, const std::string& component, const std::optional<BumplessOptions>& bumpless,
             bool fresh) -> Self {
            return self.add([=](Transaction& steps, const PluginRegistry&) {
              steps.promote(component, {.bumpless = bumpless, .is_fresh = fresh});
            });
          },
          py::arg("component"), py::arg("bumpless") = std::nullopt, py::arg("fresh") = false,
          R"(The candidate of the shadow becomes the core, with copies of the core's state fields.

With `bumpless` it goes in where its outputs are near, with its own state. `fresh`: with its own state.)")
      .def(
          "replace_fsm",
          [](Self self, const std::string& component, const AnyFsm& fsm) -> Self {
            return self.add([=](Transaction& steps, const PluginRegistry& registry) {
              if (is_name(fsm)) {
                steps.replace_fsm(component, fsm.cast<std::string>());
              } else {
                steps.replace_fsm(component, make_fsm(fsm, registry));
              }
            });
          },
          py::arg("component"), py::arg("fsm"),
          R"(The new one goes on in the wait of the same name, where the pending instant lies on its grid.

Else it starts in its initial state, on its own period, on the deployment's epoch.)")
      .def(
          "replace_shell",
          [](Self self, const std::string& component, const AnyShell& shell) -> Self {
            return self.add([=](Transaction& steps, const PluginRegistry& registry) {
              if (is_name(shell)) {
                steps.replace_shell(component, shell.cast<std::string>());
              } else {
                steps.replace_shell(component, make_shell(shell, registry));
              }
            });
          },
          py::arg("component"), py::arg("shell"),
          "Ports keep their connections by name, properties their values.");
}

/// A call of Transaction that takes plain values, collected.
template <typename... Arguments>
auto collected(Transaction& (Transaction::*call)(Arguments...)) {
  return [call](Self self, const std::decay_t<Arguments>&... arguments) -> Self {
    return self.add([=](Transaction& steps, const PluginRegistry&) { (steps.*call)(arguments...); });
  };
}

void bind_wiring(py::class_<PyTransaction>& transaction) {
  using Steps = Transaction&;
  using Registry = const PluginRegistry&;
  transaction
      .def("set_property", collected(&Transaction::set_property), py::arg("component"), py::arg("name"),
           py::arg("value"))
      .def("connect", collected(&Transaction::connect), py::arg("component"), py::arg("port"),
           py::arg("resource"), py::arg("service"))
      .def("disconnect", collected(&Transaction::disconnect), py::arg("component"), py::arg("port"))
      .def("remove_component", collected(&Transaction::remove_component), py::arg("name"))
      .def(
          "add_resource",
          [](Self self, const std::string& name, const AnyResource& resource, const std::string& topic,
             time_ns_t longest_hold_ns, const std::string& frame, const std::string& child_frame) -> Self {
            const TopicBinding binding = topic_binding(topic);
            return self.add([=](Steps steps, Registry registry) {
              steps.add_resource(name, make_resource(resource, registry), binding, longest_hold_ns,
                                 {.frame = frame, .child_frame = child_frame});
            });
          },
          py::arg("name"), py::arg("resource"), py::kw_only(), py::arg("topic") = "",
          py::arg("longest_hold_ns") = 0, py::arg("frame") = "", py::arg("child_frame") = "")
      .def(
          "add_resource",
          [](Self self, const std::string& name, const std::string& kind, const std::string& type,
             const std::string& topic, time_ns_t longest_hold_ns, const std::string& frame,
             const std::string& child_frame, const py::kwargs& keywords) -> Self {
            const TopicBinding binding = topic_binding(topic);
            const ResourceParameters parameters = parameters_of(keywords);
            return self.add([=](Steps steps, Registry) {
              steps.add_resource(name, kind, type, parameters, binding, longest_hold_ns,
                                 {.frame = frame, .child_frame = child_frame});
            });
          },
          py::arg("name"), py::kw_only(), py::arg("kind"), py::arg("type") = "", py::arg("topic") = "",
          py::arg("longest_hold_ns") = 0, py::arg("frame") = "", py::arg("child_frame") = "",
          "As Architecture.add_resource; `topic`: 'publish', 'subscribe' (as its methods) or ''.")
      .def("remove_resource", collected(&Transaction::remove_resource), py::arg("name"),
           "Refused while a port is connected to it.")
      .def("start", collected(&Transaction::start), py::arg("component"), py::arg("clock_ns") = std::nullopt)
      .def("stop", collected(&Transaction::stop), py::arg("component"))
      .def(
          "configure", collected(&Transaction::configure), py::arg("component"),
          R"(Gives one that is not running new instances of its parts; it is STOPPED then, a fault is forgotten.

They take nothing over from the present parts.)")
      .def("resynchronise", collected(&Transaction::resynchronise),
           R"(A new common epoch, 20 ms after the commit.

Every component goes on in its place, all its instants later by the same, less than a period. The
report has a line for each, with its `shift_ns`.)")
      .def("by", collected(&Transaction::by), py::arg("author"),
           "Who makes the change, for Architecture.authors(); empty: the program itself.");
}

}  // namespace

Transaction PyTransaction::build(const PluginRegistry& registry) const {
  Transaction transaction;
  for (std::size_t i = 0; i < steps_.size(); ++i) {
    try {
      steps_[i](transaction, registry);
    } catch (const Error& failure) {
      ErrorDetail detail = failure.detail();
      if (detail.step == 0) detail.step = static_cast<int>(i) + 1;
      throw Error(failure.code(), failure.statement(), detail);
    }
  }
  return transaction;
}

void bind_transaction(py::module_& module) {
  py::class_<TransactionReport>(module, "TransactionReport")
      .def_readonly("steps", &TransactionReport::steps)
      .def_readonly("revision", &TransactionReport::revision, "Of the architecture, after.")
      .def_readonly("prepare_ns", &TransactionReport::prepare_ns)
      .def_readonly("blackout_ns", &TransactionReport::blackout_ns, "The longest of any component's.")
      .def_readonly("is_complete", &TransactionReport::is_complete,
                    "False: a release that follows has not come yet.")
      .def_readonly("is_idle", &TransactionReport::is_idle,
                    "It was made while no job of a participant was pending.")
      .def_readonly("instant_ns", &TransactionReport::instant_ns,
                    "T; NOT_MEASURED when the transaction changed no running component.");
  py::class_<ArchitectureDescription>(
      module, "ArchitectureDescription",
      "Equal to another exactly when nothing was changed; str() has one line a fact.")
      .def(
          "__eq__",
          [](const ArchitectureDescription& self, const py::object& other) {
            return py::isinstance<ArchitectureDescription>(other) &&
                   self == other.cast<const ArchitectureDescription&>();
          },
          py::arg("value"))
      .def("__str__", [](const ArchitectureDescription& self) { return to_string(self); });
  py::class_<PyTransaction> transaction(
      module, "Transaction",
      R"(A list of steps that take effect as one, or not at all; nothing happens before Host.commit.

Parts are classes or registered names. Each step returns the transaction.)");
  transaction.def(py::init<>())
      .def("add", &add_step, py::arg("kind"), py::arg("target") = "", py::arg("name") = "",
           py::arg("value") = std::nullopt,
           "A step by the name of its kind, with no object in it; the calls below are the same, typed.")
      .def("add_component", &add_component, py::arg("name"), py::arg("shell"), py::arg("core"),
           py::arg("fsm"), py::kw_only(), py::arg("properties") = std::map<std::string, PropertyValue>{},
           py::arg("alternatives") = std::vector<std::string>{}, py::arg("fallback") = "",
           py::arg("reconfigurable") = true,
           py::arg("frames") = std::map<std::string, std::pair<std::string, std::string>>{},
           R"(It arrives STOPPED; a start step starts it.

`frames`: (frame, child_frame) of ports by name, in addition to those that the shell declares.)");
  bind_replacements(transaction);
  bind_wiring(transaction);
}

}  // namespace mauve::bindings
