// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/deployer.hpp"

#include "mauve_rt/futex.hpp"
#include "mauve_rt/trace_collector.hpp"

#include "transaction.hpp"

namespace mauve::bindings {

namespace {

using Unlocked = py::call_guard<py::gil_scoped_release>;

using PublishedSample = std::tuple<std::string, std::vector<std::byte>, time_ns_t>;

py::bytes to_bytes(const void* data, std::size_t size) { return {static_cast<const char*>(data), size}; }

/// A deployer with what its waits have seen, so that Python needs to carry nothing from call to call.
class PyDeployer {
 public:
  PyDeployer(PyArchitecture& architecture, bool require_realtime, bool trace)
      : registry_(architecture.registry),
        architecture_(architecture.architecture),
        deployer_(architecture_, {.require_realtime = require_realtime, .trace = trace}) {
    living().insert(this);
  }
  ~PyDeployer() {
    living().erase(this);
    const py::gil_scoped_release release;  // a component thread may need the interpreter to come to its end
    deployer_.shutdown();
  }
  PyDeployer(const PyDeployer&) = delete;
  PyDeployer& operator=(const PyDeployer&) = delete;

  Deployer& deployer() noexcept { return deployer_; }
  const PluginRegistry& registry() const noexcept { return registry_; }

  /// Every deployer there is, under the interpreter's lock: at its end no component thread may want that any
  /// more.
  static std::set<PyDeployer*>& living() {
    static std::set<PyDeployer*> all;
    return all;
  }
  static void shut_down_all() {
    const std::set<PyDeployer*> all = living();
    const py::gil_scoped_release release;
    for (PyDeployer* deployer : all) deployer->deployer().shutdown();
  }

  std::vector<PublishedSample> wait_published(time_ns_t timeout_ns) {
    const time_ns_t until = monotonic_now_ns() + timeout_ns;
    std::vector<PublishedSample> samples;
    for (;;) {
      const std::uint32_t word =
          architecture_.publications().word();  // before the look: what comes after is noticed
      std::string resource;
      std::vector<std::byte> message;
      time_ns_t time_ns = 0;
      while (architecture_.next_published(resource, message, time_ns))
        samples.emplace_back(resource, message, time_ns);
      if (!samples.empty() || woken() || monotonic_now_ns() >= until) return samples;
      architecture_.publications().wait(word, until);
    }
  }

  bool wait_change(time_ns_t timeout_ns) {
    const time_ns_t until = monotonic_now_ns() + timeout_ns;
    const std::uint32_t word = deployer_.wait_change(seen_change_, until);
    const bool changed = word != seen_change_;
    seen_change_ = word;
    return changed;
  }

  void wake() noexcept {
    woken_.store(true, std::memory_order_release);
    architecture_.publications().notify();
    architecture_.changes().bump();
  }

  bool write_resource(const std::string& name, std::string_view data) {
    return architecture_.resource(name).write_sample(std::as_bytes(std::span(data)), monotonic_now_ns());
  }

  py::tuple read_resource(const std::string& name) {
    Resource& resource = architecture_.resource(name);
    std::vector<std::byte> message;
    time_ns_t time_ns = 0;
    std::uint64_t sequence = 0;
    {
      const py::gil_scoped_release release;
      resource.peek_sample(message, time_ns, sequence);
    }
    return py::make_tuple(to_bytes(message.data(), message.size()), sequence, time_ns);
  }

  std::vector<std::string> trace_components() const { return architecture_.trace_components(); }

  void collect_trace(time_ns_t period_ns) {
    const std::lock_guard lock(collector_mutex_);
    collector_.reset();
    if (period_ns > 0) collector_ = std::make_unique<TraceCollector>(architecture_, period_ns);
  }

  TraceDrain drain_trace() {
    const std::lock_guard lock(collector_mutex_);
    return collector_ != nullptr ? collector_->take() : architecture_.drain_trace();
  }

 private:
  bool woken() const noexcept { return woken_.load(std::memory_order_acquire); }

  const PluginRegistry& registry_;
  Architecture& architecture_;
  Deployer deployer_;
  std::mutex collector_mutex_;
  std::unique_ptr<TraceCollector> collector_;  // under collector_mutex_
  std::atomic<bool> woken_{false};             // release/acquire: set once, for good
  std::uint32_t seen_change_{0};               // of the one thread that waits for changes
};

CommitTimeouts timeouts(time_ns_t commit_ns, time_ns_t phase_ns) {
  return {.commit_ns = commit_ns, .phase_ns = phase_ns};
}

/// By its registered name, which the component must declare; or by its class, which is the program's own.
StepReport replace_core(PyDeployer& self, const std::string& component, const py::object& core,
                        time_ns_t commit_timeout_ns, time_ns_t phase_timeout_ns) {
  const CommitTimeouts limits = timeouts(commit_timeout_ns, phase_timeout_ns);
  if (py::isinstance<py::str>(core)) {
    const auto name = core.cast<std::string>();
    const py::gil_scoped_release release;
    return self.deployer().replace_core(component, name, limits);
  }
  Transaction transaction;
  transaction.replace_core(component, make_core(core, self.registry()));
  const py::gil_scoped_release release;
  return self.deployer().commit(std::move(transaction), {.timeouts = limits}).steps.at(0);
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

std::unique_ptr<PyCommitted> make(PyDeployer& self, const PyTransaction& steps, bool dry_run,
                                  std::uint64_t expected_revision, time_ns_t commit_timeout_ns,
                                  std::int64_t max_missed) {
  Transaction transaction = steps.build(self.registry());
  const py::gil_scoped_release release;
  const TransactionOptions options{.timeouts = timeouts(commit_timeout_ns, 0),
                                   .dry_run = dry_run,
                                   .expected_revision = expected_revision,
                                   .max_missed = max_missed};
  return std::make_unique<PyCommitted>(self.deployer().make(std::move(transaction), options));
}

TransactionReport commit(PyDeployer& self, const PyTransaction& steps, bool dry_run,
                         std::uint64_t expected_revision, time_ns_t commit_timeout_ns,
                         time_ns_t phase_timeout_ns, std::int64_t max_missed) {
  const auto committed = make(self, steps, dry_run, expected_revision, commit_timeout_ns, max_missed);
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
      .def_readonly("phase_actual_ns", &StepReport::phase_actual_ns);
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

void bind_deployer(py::module_& module) {
  bind_reports(module);
  py::class_<PyCommitted>(module, "Committed")
      .def("report", &PyCommitted::report, py::arg("phase_timeout_ns") = 0, Unlocked());
  py::module_::import("atexit").attr("register")(py::cpp_function(&PyDeployer::shut_down_all));
  py::class_<PyDeployer>(module, "Deployer")
      .def(py::init<PyArchitecture&, bool, bool>(), py::arg("architecture"), py::kw_only(),
           py::arg("require_realtime") = false, py::arg("trace") = true, py::keep_alive<1, 2>())
      .def(
          "prepare_process", [](PyDeployer& self) { self.deployer().prepare_process(); }, Unlocked())
      .def("deploy",
           [](PyDeployer& self) {
             shorten_switch_interval();
             const py::gil_scoped_release release;
             self.deployer().deploy();
           })
      .def(
          "shutdown", [](PyDeployer& self) { self.deployer().shutdown(); }, Unlocked())
      .def(
          "stop",
          [](PyDeployer& self, const std::string& component, time_ns_t timeout_ns) {
            self.deployer().stop(component, timeout_ns);
          },
          py::arg("component"), py::arg("timeout_ns") = s_to_ns(1), Unlocked())
      .def(
          "start",
          [](PyDeployer& self, const std::string& component, std::optional<time_ns_t> clock_ns) {
            self.deployer().start(component, clock_ns);
          },
          py::arg("component"), py::arg("clock_ns") = std::nullopt, Unlocked())
      .def(
          "get_time",
          [](PyDeployer& self, const std::string& component) { return self.deployer().get_time(component); },
          py::arg("component"), Unlocked())
      .def("commit", &commit, py::arg("transaction"), py::kw_only(), py::arg("dry_run") = false,
           py::arg("expected_revision") = 0, py::arg("commit_timeout_ns") = s_to_ns(1),
           py::arg("phase_timeout_ns") = s_to_ns(1), py::arg("max_missed") = 0)
      .def("make", &make, py::arg("transaction"), py::kw_only(), py::arg("dry_run") = false,
           py::arg("expected_revision") = 0, py::arg("commit_timeout_ns") = s_to_ns(1),
           py::arg("max_missed") = 0, py::keep_alive<0, 1>())
      .def("replace_core", &replace_core, py::arg("component"), py::arg("core"), py::kw_only(),
           py::arg("commit_timeout_ns") = s_to_ns(1), py::arg("phase_timeout_ns") = s_to_ns(1))
      .def(
          "set_property",
          [](PyDeployer& self, const std::string& component, const std::string& name,
             const PropertyValue& value, time_ns_t commit_timeout_ns) {
            return self.deployer().set_property(component, name, value, timeouts(commit_timeout_ns, 0));
          },
          py::arg("component"), py::arg("name"), py::arg("value"), py::kw_only(),
          py::arg("commit_timeout_ns") = s_to_ns(1), Unlocked())
      .def("realtime_status", [](PyDeployer& self) { return self.deployer().realtime_status(); })
      .def_property_readonly("epoch_ns", [](PyDeployer& self) { return self.deployer().epoch_ns(); })
      .def("collect_trace", &PyDeployer::collect_trace, py::arg("period_ns"), Unlocked())
      .def("drain_trace", &PyDeployer::drain_trace, Unlocked())
      .def("trace_components", &PyDeployer::trace_components)
      .def("trace_names", [](PyDeployer&) { return TraceNames::all(); })
      .def(
          "wait_published",
          [](PyDeployer& self, time_ns_t timeout_ns) {
            std::vector<PublishedSample> samples;
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
      .def("write_resource", &PyDeployer::write_resource, py::arg("resource"), py::arg("data"), Unlocked())
      .def("read_resource", &PyDeployer::read_resource, py::arg("resource"))
      .def("wait_change", &PyDeployer::wait_change, py::arg("timeout_ns"), Unlocked())
      .def("wake", &PyDeployer::wake, Unlocked());
}

}  // namespace mauve::bindings
