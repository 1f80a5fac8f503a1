// SPDX-License-Identifier: LGPL-3.0-or-later
// What runs an architecture, bound once: Deployer and SimulatedHost are made differently, and used alike.
#include "host.hpp"

#include "mauve_rt/base/futex.hpp"
#include "mauve_rt/deploy/deployer.hpp"

#include "transaction.hpp"

namespace mauve::bindings {

namespace {

using Unlocked = py::call_guard<py::gil_scoped_release>;

py::bytes to_bytes(const void* data, std::size_t size) { return {static_cast<const char*>(data), size}; }

/// Threads end without the interpreter's lock, and before the interpreter does.
class PyDeployer final : public PyHost {
 public:
  PyDeployer(PyArchitecture& architecture, bool require_realtime, bool trace)
      : PyHost(architecture),
        deployer_(std::make_unique<Deployer>(
            architecture.architecture,
            DeployerOptions{.require_realtime = require_realtime, .trace = trace})) {
    living().insert(this);
  }
  ~PyDeployer() override {
    living().erase(this);
    // A component thread, or a change that is being prepared, may need the interpreter to come to its end.
    const py::gil_scoped_release release;
    deployer_.reset();
  }

  Host& host() const noexcept override { return *deployer_; }

  /// Every deployer there is, under the interpreter's lock: at its end no component thread may want that any
  /// more.
  static std::set<PyDeployer*>& living() {
    static std::set<PyDeployer*> all;
    return all;
  }
  static void shut_down_all() {
    const std::set<PyDeployer*> all = living();
    const py::gil_scoped_release release;
    for (PyDeployer* deployer : all) deployer->deployer_->shutdown();
  }

 private:
  std::unique_ptr<Deployer> deployer_;
};

CommitTimeouts timeouts(time_ns_t commit_ns, time_ns_t phase_ns) {
  return {.commit_ns = commit_ns, .phase_ns = phase_ns};
}

/// By its registered name, which the component must declare; or by its class, which is the program's own.
StepReport replace_core(PyHost& self, const std::string& component, const py::object& core,
                        time_ns_t commit_timeout_ns, time_ns_t phase_timeout_ns) {
  const CommitTimeouts limits = timeouts(commit_timeout_ns, phase_timeout_ns);
  if (py::isinstance<py::str>(core)) {
    const auto name = core.cast<std::string>();
    const py::gil_scoped_release release;
    return self.host().replace_core(component, name, limits);
  }
  Transaction transaction;
  transaction.replace_core(component, make_core(core, self.registry()));
  const py::gil_scoped_release release;
  return self.host().commit(std::move(transaction), {.timeouts = limits}).steps.at(0);
}

/// A transaction that is in force, for who asks for its report later.
class PyCommitted {
 public:
  explicit PyCommitted(std::unique_ptr<TransactionCommit> work) : work_(std::move(work)) {}
  ~PyCommitted() {
    const py::gil_scoped_release release;  // a component it removed may need the interpreter for its end
    work_.reset();
  }
  PyCommitted(const PyCommitted&) = delete;
  PyCommitted& operator=(const PyCommitted&) = delete;

  TransactionReport report(time_ns_t phase_timeout_ns) { return work_->report(phase_timeout_ns); }

 private:
  std::unique_ptr<TransactionCommit> work_;
};

std::unique_ptr<PyCommitted> make(PyHost& self, const PyTransaction& steps, bool dry_run,
                                  std::uint64_t expected_revision, time_ns_t commit_timeout_ns, bool force) {
  Transaction transaction = steps.build(self.registry());
  const py::gil_scoped_release release;
  const TransactionOptions options{.timeouts = timeouts(commit_timeout_ns, 0),
                                   .dry_run = dry_run,
                                   .expected_revision = expected_revision,
                                   .force = force};
  return std::make_unique<PyCommitted>(self.host().make(std::move(transaction), options));
}

TransactionReport commit(PyHost& self, const PyTransaction& steps, bool dry_run,
                         std::uint64_t expected_revision, time_ns_t commit_timeout_ns,
                         time_ns_t phase_timeout_ns, bool force) {
  const auto committed = make(self, steps, dry_run, expected_revision, commit_timeout_ns, force);
  const py::gil_scoped_release release;
  return committed->report(dry_run ? 0 : phase_timeout_ns);
}

/// With Python's 5 ms a component in Python would wait that long for a thread that computes; DESIGN section 4.
void shorten_switch_interval() {
  constexpr double kSwitchIntervalS = 1e-4;
  const py::module_ sys = py::module_::import("sys");
  if (sys.attr("getswitchinterval")().cast<double>() > kSwitchIntervalS)
    sys.attr("setswitchinterval")(kSwitchIntervalS);
}

void bind_reports(py::module_& module) {
  py::class_<StepReport>(module, "StepReport")
      .def_readonly("step", &StepReport::step)
      .def_readonly("component", &StepReport::component)
      .def_readonly("from_core", &StepReport::from_core)
      .def_readonly("to_core", &StepReport::to_core)
      .def_readonly("prepare_ns", &StepReport::prepare_ns)
      .def_readonly("blackout_ns", &StepReport::blackout_ns)
      .def_readonly("missed_releases", &StepReport::missed_releases)
      .def_readonly("phase_nominal_ns", &StepReport::phase_nominal_ns)
      .def_readonly("phase_actual_ns", &StepReport::phase_actual_ns)
      .def_readonly("remark", &StepReport::remark)
      .def_readonly("shift_ns", &StepReport::shift_ns)
      .def_readonly("released_ns", &StepReport::released_ns)
      .def_readonly("instant_ns", &StepReport::instant_ns)
      .def_readonly("release_ns", &StepReport::release_ns)
      .def_readonly("taken", &StepReport::taken)
      .def_readonly("left", &StepReport::left);
  py::class_<RealtimeStatus>(module, "RealtimeStatus")
      .def_readonly("granted", &RealtimeStatus::granted)
      .def_readonly("missing", &RealtimeStatus::missing);
  py::class_<TraceDrain>(module, "TraceDrain")
      .def_property_readonly("records",
                             [](const TraceDrain& self) {
                               return to_bytes(self.records.data(),
                                               self.records.size() * sizeof(TraceRecord));
                             })
      .def_readonly("written", &TraceDrain::written)
      .def_readonly("dropped", &TraceDrain::dropped)
      .def_readonly("monotonic_ns", &TraceDrain::monotonic_ns)
      .def_readonly("realtime_ns", &TraceDrain::realtime_ns);
}

}  // namespace

std::vector<PyHost::PublishedSample> PyHost::wait_published(time_ns_t timeout_ns) {
  const time_ns_t until = host().is_simulated() ? 0 : monotonic_now_ns() + timeout_ns;
  std::vector<PublishedSample> samples;
  for (;;) {
    const std::uint32_t word =
        architecture_.publications().word();  // before the look: what comes after is noticed
    PublishedSample sample;
    auto& [resource, message, time_ns] = sample;
    while (architecture_.next_published(resource, message, time_ns)) samples.push_back(sample);
    if (!samples.empty() || woken() || monotonic_now_ns() >= until) return samples;
    architecture_.publications().wait(word, until);
  }
}

bool PyHost::wait_change(time_ns_t timeout_ns) {
  const std::uint32_t word = host().wait_change(seen_change_, monotonic_now_ns() + timeout_ns);
  const bool changed = word != seen_change_;
  seen_change_ = word;
  return changed;
}

void PyHost::wake() noexcept {
  woken_.store(true, std::memory_order_release);
  architecture_.publications().notify();
  architecture_.changes().bump();
}

bool PyHost::write_resource(const std::string& name, std::string_view data) {
  return architecture_.resource(name).write_sample(std::as_bytes(std::span(data)), host().now_ns());
}

py::tuple PyHost::read_resource(const std::string& name) {
  std::vector<std::byte> message;
  time_ns_t time_ns = 0;
  std::uint64_t sequence = 0;
  {
    const py::gil_scoped_release release;
    architecture_.hold_resource(name)->peek_sample(message, time_ns, sequence);
  }
  return py::make_tuple(to_bytes(message.data(), message.size()), sequence, time_ns);
}

void PyHost::collect_trace(time_ns_t period_ns) {
  const std::lock_guard lock(collector_mutex_);
  collector_.reset();
  if (period_ns > 0 && !host().is_simulated())
    collector_ = std::make_unique<TraceCollector>(architecture_, period_ns);
}

TraceDrain PyHost::drain_trace() {
  const std::lock_guard lock(collector_mutex_);
  return collector_ != nullptr ? collector_->take() : host().drain_trace();
}

void bind_host(py::module_& module) {
  bind_reports(module);
  py::class_<PyCommitted>(module, "Committed")
      .def("report", &PyCommitted::report, py::arg("phase_timeout_ns") = 0, Unlocked());
  py::class_<PyHost>(module, "Host")
      .def(
          "prepare_process", [](PyHost& self) { self.host().prepare_process(); }, Unlocked())
      .def("deploy",
           [](PyHost& self) {
             shorten_switch_interval();
             const py::gil_scoped_release release;
             self.host().deploy();
           })
      .def(
          "shutdown", [](PyHost& self) { self.host().shutdown(); }, Unlocked())
      .def(
          "stop",
          [](PyHost& self, const std::string& component, time_ns_t timeout_ns, bool force) {
            return self.host().stop(component, {.timeout_ns = timeout_ns, .force = force});
          },
          py::arg("component"), py::arg("timeout_ns") = s_to_ns(1), py::kw_only(), py::arg("force") = false,
          Unlocked())
      .def(
          "start",
          [](PyHost& self, const std::string& component, std::optional<time_ns_t> clock_ns) {
            self.host().start(component, clock_ns);
          },
          py::arg("component"), py::arg("clock_ns") = std::nullopt, Unlocked())
      .def(
          "get_time",
          [](PyHost& self, const std::string& component) { return self.host().get_time(component); },
          py::arg("component"), Unlocked())
      .def("commit", &commit, py::arg("transaction"), py::kw_only(), py::arg("dry_run") = false,
           py::arg("expected_revision") = 0, py::arg("commit_timeout_ns") = s_to_ns(1),
           py::arg("phase_timeout_ns") = s_to_ns(1), py::arg("force") = false)
      .def("make", &make, py::arg("transaction"), py::kw_only(), py::arg("dry_run") = false,
           py::arg("expected_revision") = 0, py::arg("commit_timeout_ns") = s_to_ns(1),
           py::arg("force") = false, py::keep_alive<0, 1>())
      .def(
          "settle_probations", [](PyHost& self) { self.host().settle_probations(); }, Unlocked())
      .def(
          "probations", [](PyHost& self) { return self.host().probations(); }, Unlocked())
      .def(
          "shadows", [](PyHost& self) { return self.host().shadows(); }, Unlocked())
      .def(
          "revert_probation",
          [](PyHost& self, const std::string& component, const std::string& reason, time_ns_t timeout_ns) {
            return self.host().revert_probation(component, reason, timeout_ns);
          },
          py::arg("component"), py::arg("reason"), py::arg("timeout_ns") = s_to_ns(1), Unlocked())
      .def("replace_core", &replace_core, py::arg("component"), py::arg("core"), py::kw_only(),
           py::arg("commit_timeout_ns") = s_to_ns(1), py::arg("phase_timeout_ns") = s_to_ns(1))
      .def(
          "set_property",
          [](PyHost& self, const std::string& component, const std::string& name, const PropertyValue& value,
             time_ns_t commit_timeout_ns) {
            return self.host().set_property(component, name, value, timeouts(commit_timeout_ns, 0));
          },
          py::arg("component"), py::arg("name"), py::arg("value"), py::kw_only(),
          py::arg("commit_timeout_ns") = s_to_ns(1), Unlocked())
      .def(
          "describe", [](PyHost& self) { return self.host().describe(); }, Unlocked())
      .def("is_deployed", [](PyHost& self) { return self.host().is_deployed(); })
      .def("now_ns", [](PyHost& self) { return self.host().now_ns(); })
      .def("realtime_status", [](PyHost& self) { return self.host().realtime_status(); })
      .def_property_readonly("epoch_ns", [](PyHost& self) { return self.host().epoch_ns(); })
      .def("collect_trace", &PyHost::collect_trace, py::arg("period_ns"), Unlocked())
      .def("drain_trace", &PyHost::drain_trace, Unlocked())
      .def("trace_components", &PyHost::trace_components)
      .def("trace_names", [](PyHost&) { return Host::trace_names(); })
      .def(
          "wait_published",
          [](PyHost& self, time_ns_t timeout_ns) {
            std::vector<PyHost::PublishedSample> samples;
            {
              const py::gil_scoped_release release;
              samples = self.wait_published(timeout_ns);
            }
            py::list list;
            for (const auto& [resource, message, time_ns] : samples) {
              list.append(py::make_tuple(resource, to_bytes(message.data(), message.size()), time_ns));
            }
            return list;
          },
          py::arg("timeout_ns"))
      .def("write_resource", &PyHost::write_resource, py::arg("resource"), py::arg("data"), Unlocked())
      .def("read_resource", &PyHost::read_resource, py::arg("resource"))
      .def("wait_change", &PyHost::wait_change, py::arg("timeout_ns"), Unlocked())
      .def("wake", &PyHost::wake, Unlocked());
  py::module_::import("atexit").attr("register")(py::cpp_function(&PyDeployer::shut_down_all));
  py::class_<PyDeployer, PyHost>(module, "Deployer")
      .def(py::init<PyArchitecture&, bool, bool>(), py::arg("architecture"), py::kw_only(),
           py::arg("require_realtime") = false, py::arg("trace") = true, py::keep_alive<1, 2>());
}

}  // namespace mauve::bindings
