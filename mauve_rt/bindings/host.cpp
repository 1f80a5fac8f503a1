// SPDX-License-Identifier: LGPL-3.0-or-later
// What runs an architecture, bound once: Deployer and SimulatedHost are made differently, and used alike.
#include "host.hpp"

#include <algorithm>

#include "mauve_rt/base/seam/futex.hpp"
#include "mauve_rt/deploy/deployer.hpp"

#include "transaction.hpp"

namespace mauve::bindings {

namespace {

using Unlocked = py::call_guard<InterpreterUnlocked>;

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
    const InterpreterUnlocked release;
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
    const InterpreterUnlocked release;
    for (PyDeployer* deployer : all) deployer->deployer_->shutdown();
  }

 private:
  std::unique_ptr<Deployer> deployer_;
};

CommitTimeouts timeouts(time_ns_t commit_ns, time_ns_t phase_ns) {
  return {.commit_ns = commit_ns,
          .phase_ns = phase_ns,
          .prepare_ns = std::max(CommitTimeouts{}.prepare_ns, commit_ns)};
}

/// By its registered name, which the component must declare; or by its class, which is the program's own.
StepReport replace_core(PyHost& self, const std::string& component, const AnyCore& core,
                        time_ns_t commit_timeout_ns, time_ns_t phase_timeout_ns) {
  const CommitTimeouts limits = timeouts(commit_timeout_ns, phase_timeout_ns);
  if (py::isinstance<py::str>(core)) {
    const auto name = core.cast<std::string>();
    const InterpreterUnlocked release;
    return self.host().replace_core(component, name, limits);
  }
  Transaction transaction;
  transaction.replace_core(component, make_core(core, self.registry()));
  const InterpreterUnlocked release;
  return self.host().commit(std::move(transaction), {.timeouts = limits}).steps.at(0);
}

/// A transaction that is in force, for who asks for its report later.
class PyCommitted {
 public:
  explicit PyCommitted(std::unique_ptr<TransactionCommit> work) : work_(std::move(work)) {}
  ~PyCommitted() {
    const InterpreterUnlocked release;  // a component it removed may need the interpreter for its end
    work_.reset();
  }
  PyCommitted(const PyCommitted&) = delete;
  PyCommitted& operator=(const PyCommitted&) = delete;

  TransactionReport report(time_ns_t phase_timeout_ns) { return work_->report(phase_timeout_ns); }

 private:
  std::unique_ptr<TransactionCommit> work_;
};

std::unique_ptr<PyCommitted> make(PyHost& self, const PyTransaction& steps, bool dry_run,
                                  std::uint64_t expected_revision, time_ns_t commit_timeout_ns, bool force,
                                  bool idle, time_ns_t idle_within_ns) {
  Transaction transaction = steps.build(self.registry());
  const InterpreterUnlocked release;
  const TransactionOptions options{.timeouts = timeouts(commit_timeout_ns, 0),
                                   .dry_run = dry_run,
                                   .expected_revision = expected_revision,
                                   .force = force,
                                   .idle = idle,
                                   .idle_within_ns = idle_within_ns};
  return std::make_unique<PyCommitted>(self.host().make(std::move(transaction), options));
}

TransactionReport commit(PyHost& self, const PyTransaction& steps, bool dry_run,
                         std::uint64_t expected_revision, time_ns_t commit_timeout_ns,
                         time_ns_t phase_timeout_ns, bool force, bool idle, time_ns_t idle_within_ns) {
  const auto committed =
      make(self, steps, dry_run, expected_revision, commit_timeout_ns, force, idle, idle_within_ns);
  const InterpreterUnlocked release;
  return committed->report(dry_run ? 0 : phase_timeout_ns);
}

/// A component in Python waits up to one interval for a thread that computes. Python's default is 5 ms.
void shorten_switch_interval() {
  constexpr double kSwitchIntervalS = 1e-4;
  const py::module_ sys = py::module_::import("sys");
  if (sys.attr("getswitchinterval")().cast<double>() > kSwitchIntervalS)
    sys.attr("setswitchinterval")(kSwitchIntervalS);
}

}  // namespace

void bind_reports(py::module_& module) {
  py::class_<StepReport>(module, "StepReport", "Fields as mauve_msgs/msg/StepReport.")
      .def_readonly("step", &StepReport::step)
      .def_readonly("component", &StepReport::component)
      .def_readonly("from_core", &StepReport::from_core)
      .def_readonly("to_core", &StepReport::to_core)
      .def_readonly("prepare_ns", &StepReport::prepare_ns)
      .def_readonly("blackout_ns", &StepReport::blackout_ns)
      .def_readonly("missed_releases", &StepReport::missed_releases)
      .def_readonly("phase_nominal_ns", &StepReport::phase_nominal_ns)
      .def_readonly("phase_actual_ns", &StepReport::phase_actual_ns,
                    "NOT_MEASURED until the first release after the commit.")
      .def_readonly("remark", &StepReport::remark, "Why releases were missed; empty when none was.")
      .def_readonly("shift_ns", &StepReport::shift_ns, "By which a new epoch made its instants later.")
      .def_readonly("released_ns", &StepReport::released_ns, "The instant of the release that followed.")
      .def_readonly("instant_ns", &StepReport::instant_ns,
                    "T: the component executes with the change from this instant on.")
      .def_readonly("release_ns", &StepReport::release_ns, "Nominal instant of the release that followed.")
      .def_readonly("taken", &StepReport::taken, "State fields that the new core took over.")
      .def_readonly("left", &StepReport::left, "State fields that it did not, with the reason.")
      .def_readonly("outputs", &StepReport::outputs, "Of a bumpless change, its outputs.");
  py::class_<RealtimeStatus>(module, "RealtimeStatus")
      .def_readonly("granted", &RealtimeStatus::granted)
      .def_readonly("missing", &RealtimeStatus::missing);
  py::class_<TraceDrain>(module, "TraceDrain")
      .def_property_readonly(
          "records",
          [](const TraceDrain& self) {
            return to_bytes(self.records.data(), self.records.size() * sizeof(TraceRecord));
          },
          "n * 48, layout of mauve_msgs/msg/TraceRecord, little-endian, no padding.")
      .def_readonly("written", &TraceDrain::written, "Per component.")
      .def_readonly("dropped", &TraceDrain::dropped)
      .def_readonly("monotonic_ns", &TraceDrain::monotonic_ns)
      .def_readonly("realtime_ns", &TraceDrain::realtime_ns);
}

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

bool PyHost::write_resource(const std::string& name, const py::bytes& data) {
  const std::string_view message = data;
  const InterpreterUnlocked release;
  return architecture_.resource(name).write_sample(std::as_bytes(std::span(message)), host().now_ns());
}

ReadMessage PyHost::read_resource(const std::string& name) {
  std::vector<std::byte> message;
  time_ns_t time_ns = 0;
  std::uint64_t sequence = 0;
  {
    const InterpreterUnlocked release;
    architecture_.hold_resource(name)->peek_sample(message, time_ns, sequence);
  }
  return py::make_tuple(to_bytes(message.data(), message.size()), sequence, time_ns);
}

void PyHost::collect_trace(time_ns_t period_ns) {
  const std::lock_guard lock(collector_mutex_);
  keep_period_ns_ = period_ns;
  renew_collector();
}

void PyHost::renew_collector() {
  constexpr time_ns_t kWatchPeriod = ms_to_ns(20);
  collector_.reset();
  const bool keeps = keep_period_ns_ > 0;
  if ((keeps || is_watched_) && !host().is_simulated()) {
    collector_ = std::make_unique<TraceCollector>(architecture_, keeps ? keep_period_ns_ : kWatchPeriod,
                                                  &watch_, keeps);
  }
}

bool PyHost::watch_jobs(const std::vector<JobBound>& bounds, std::uint64_t revision) {
  if (!watch_.watch(bounds, revision, host().now_ns())) return false;
  const std::lock_guard lock(collector_mutex_);
  is_watched_ = true;
  if (collector_ == nullptr) renew_collector();
  return true;
}

void PyHost::end_job_watch() {
  const std::lock_guard lock(collector_mutex_);
  watch_.end();
  is_watched_ = false;
  if (keep_period_ns_ <= 0) collector_.reset();
}

TraceDrain PyHost::drain_trace() {
  const std::lock_guard lock(collector_mutex_);
  if (collector_ != nullptr) return collector_->take();
  TraceDrain drain = host().drain_trace();
  watch_.take(drain);
  return drain;
}

void bind_host(py::module_& module) {
  py::class_<JobBound>(module, "JobBound",
                       "The bound of one kind of job: of all that a component executes between two waits.")
      .def(py::init([](std::string component, std::string after, std::string until, time_ns_t bound_ns) {
             return JobBound{std::move(component), std::move(after), std::move(until), bound_ns};
           }),
           py::kw_only(), py::arg("component"), py::arg("after"), py::arg("until"), py::arg("bound_ns"))
      .def_readonly("component", &JobBound::component)
      .def_readonly("after", &JobBound::after,
                    "The wait that it follows; of the first job after a start the initial state.")
      .def_readonly("until", &JobBound::until, "The wait that it leads to.")
      .def_readonly("bound_ns", &JobBound::bound_ns, "From the job's instant to its wait.");
  py::class_<JobFigures>(module, "JobFigures",
                         "What was measured of a kind of job since its bound is watched.")
      .def_readonly("job", &JobFigures::job)
      .def_readonly("jobs", &JobFigures::jobs, "How many came to their wait.")
      .def_readonly("violations", &JobFigures::violations, "How many of them took longer than the bound.")
      .def_readonly("longest_ns", &JobFigures::longest_ns);
  py::class_<BoundViolation>(
      module, "BoundViolation",
      "Jobs of a component that took longer than their bound, with times of the worst one.")
      .def_readonly("job", &BoundViolation::job)
      .def_readonly("instant_ns", &BoundViolation::instant_ns)
      .def_readonly("response_ns", &BoundViolation::response_ns)
      .def_readonly("count", &BoundViolation::count)
      .def_property_readonly(
          "records",
          [](const BoundViolation& self) {
            return to_bytes(self.records.data(), self.records.size() * sizeof(TraceRecord));
          },
          "As of a TraceDrain: of all components, from a while before the instant to the end of the job.");
  py::class_<PyCommitted>(
      module, "Committed",
      "A transaction that is in force. Others may change what it did while its report is asked for.")
      .def("report", &PyCommitted::report, py::arg("phase_timeout_ns") = 0, Unlocked(),
           "What it cost, so far; waits up to so long for the releases that follow. May be called again.");
  py::class_<PyHost>(
      module, "Host",
      R"(What runs an architecture: a Deployer, on threads, or a SimulatedHost, in virtual time.

An architecture has one host at a time. Every call releases the interpreter's lock. In virtual time
nothing happens while the caller waits: waits return at once, and preparing takes no time.)")
      .def(
          "prepare_process", [](PyHost& self) { self.host().prepare_process(); }, Unlocked(),
          R"(On threads: locks memory, holds /dev/cpu_dma_latency at 0, notes what was denied.

Called by deploy() if not before.)")
      .def(
          "deploy",
          [](PyHost& self) {
            shorten_switch_interval();
            const InterpreterUnlocked release;
            self.host().deploy();
          },
          R"(Publishes the epoch and starts every component; a simulation deploys all its hosts at once.

On threads: creates these, meets them at the barrier first. Shortens the interpreter's switch interval
to 0.1 ms where it is longer, for components in Python.)")
      .def(
          "shutdown", [](PyHost& self) { self.host().shutdown(); }, Unlocked(),
          R"(Stops in reverse order (outputs written), joins the threads; waits for no preparation.

The architecture can be deployed again.)")
      .def(
          "stop",
          [](PyHost& self, const std::string& component, time_ns_t timeout_ns, bool force,
             std::uint64_t expected_revision) {
            return self.host().stop(
                component,
                {.timeout_ns = timeout_ns, .force = force, .expected_revision = expected_revision});
          },
          py::arg("component"), py::arg("timeout_ns") = s_to_ns(1), py::kw_only(), py::arg("force") = false,
          py::arg("expected_revision") = 0, Unlocked(),
          R"(Stops a component at the end of its state; a wait ends at once.

By force: a component that still executes a state, or a guard, at the time-out is given up. It is
FAULTED, its outputs are written as on a stop, and its thread is left behind until the state ends.
True when that was done. A core that loops in Python is given up like any other. An extension that
never releases the interpreter's lock stops all Python of the process, this call included.

Raises:
    MauveError: not_running; timeout, and the stop stays pending: it takes effect when the state ends;
        wrong_revision where the architecture is not at `expected_revision` (0: any).)")
      .def(
          "start",
          [](PyHost& self, const std::string& component, std::optional<time_ns_t> clock_ns,
             std::uint64_t expected_revision) { self.host().start(component, clock_ns, expected_revision); },
          py::arg("component"), py::arg("clock_ns") = std::nullopt, py::kw_only(),
          py::arg("expected_revision") = 0, Unlocked())
      .def(
          "get_time",
          [](PyHost& self, const std::string& component) { return self.host().get_time(component); },
          py::arg("component"), Unlocked())
      .def("commit", &commit, py::arg("transaction"), py::kw_only(), py::arg("dry_run") = false,
           py::arg("expected_revision") = 0, py::arg("commit_timeout_ns") = s_to_ns(1),
           py::arg("phase_timeout_ns") = s_to_ns(1), py::arg("force") = false, py::arg("idle") = false,
           py::arg("idle_within_ns") = s_to_ns(1),
           R"(Carries out a transaction, deployed or not.

It takes effect at one logical instant T: each component takes its change on its own thread, in its
wait, before its first release at or after T. No component waits for another one. A component that
never comes to a wait stops the change from being made: timeout, and nothing is changed. A component
that is late at T takes its change at the end of its overrun. Until then it runs its old parts.

By force: a component that is removed, stopped or given new parts, and whose state does not end within
the commit's time-out, is stopped by force, as stop() says. It stays FAULTED whatever becomes of the
transaction. The commit is tried once more, without the thread of one that is removed or stopped; for
new parts it is refused (faulted): remove the component and add it anew, in one transaction.

With `idle`: the change is made at an instant at which no job of a participant is pending, so that no
component executes with old parts after T. Where no such instant comes `idle_within_ns` after the last
participant has agreed, the change is called off: timeout, and nothing is changed. In virtual time a
request takes no time: the change is called off at once where a job is pending.

Raises MauveError with the number of the failed step (`step`); nothing was changed then.)")
      .def("make", &make, py::arg("transaction"), py::kw_only(), py::arg("dry_run") = false,
           py::arg("expected_revision") = 0, py::arg("commit_timeout_ns") = s_to_ns(1),
           py::arg("force") = false, py::arg("idle") = false, py::arg("idle_within_ns") = s_to_ns(1),
           py::keep_alive<0, 1>(), "As commit(), but waits for no release that follows: ask what it returns.")
      .def(
          "settle_probations", [](PyHost& self) { self.host().settle_probations(); }, Unlocked(),
          "Decides the probations whose time is over, and retires what they have put out.")
      .def(
          "probations", [](PyHost& self) { return self.host().probations(); }, Unlocked(),
          "Of each component the last verdict, then the core on probation now.")
      .def(
          "shadows", [](PyHost& self) { return self.host().shadows(); }, Unlocked(),
          "Of each component the shadow that runs, or the last one that has ended.")
      .def(
          "open_changes", [](PyHost& self) { return self.host().open_changes(); }, Unlocked(),
          "The changes that are under way, or that a component has not taken. Waits for no change and for no "
          "hook.")
      .def(
          "disposing",
          [](PyHost& self) {
            const Keeper::Busy busy = self.host().architecture().disposing();
            return std::pair(busy.what, busy.since_ns == 0 ? 0 : monotonic_now_ns() - busy.since_ns);
          },
          Unlocked(),
          "The cleanup of old parts that runs now, and how long it has lasted (ns); empty: none runs.")
      .def(
          "abandon",
          [](PyHost& self, const std::string& component) {
            return std::string(to_string(self.host().abandon(component)));
          },
          py::arg("component"), Unlocked(),
          R"(Ends what a change waits for. Waits for no change and for no hook.

Calls off the change of the component that is not decided: `called_off`. Else, where a change that is made
waits for the component, or its state hangs, stops the component by force at once: `faulted`, or `stopped`
where its state had ended that moment.

Raises MauveError: unknown_component; not_running where neither is so; faulted where it was given up before.)")
      .def(
          "revert_probation",
          [](PyHost& self, const std::string& component, const std::string& reason, time_ns_t timeout_ns) {
            return self.host().revert_probation(component, reason, timeout_ns);
          },
          py::arg("component"), py::arg("reason"), py::arg("timeout_ns") = s_to_ns(1), Unlocked(),
          R"(Puts the old core back; False: no core is on probation, or it was decided before.

Raises MauveError (timeout): the request stays pending.)")
      .def("replace_core", &replace_core, py::arg("component"), py::arg("core"), py::kw_only(),
           py::arg("commit_timeout_ns") = s_to_ns(1), py::arg("phase_timeout_ns") = s_to_ns(1),
           R"(Prepare, commit, retire.

A name must be one that the component declares; a class is the program's own choice.

Waits up to phase_timeout_ns for the next release to measure phase_actual_ns.)")
      .def(
          "set_property",
          [](PyHost& self, const std::string& component, const std::string& name, const PropertyValue& value,
             time_ns_t commit_timeout_ns) {
            return self.host().set_property(component, name, value, timeouts(commit_timeout_ns, 0));
          },
          py::arg("component"), py::arg("name"), py::arg("value"), py::kw_only(),
          py::arg("commit_timeout_ns") = s_to_ns(1), Unlocked())
      .def(
          "describe", [](PyHost& self) { return self.host().describe(); }, Unlocked(),
          "As Architecture.describe.")
      .def("is_deployed", [](PyHost& self) { return self.host().is_deployed(); })
      .def(
          "now_ns", [](PyHost& self) { return self.host().now_ns(); }, "Now, as the components see it.")
      .def("realtime_status", [](PyHost& self) { return self.host().realtime_status(); })
      .def_property_readonly(
          "epoch_ns", [](PyHost& self) { return self.host().epoch_ns(); },
          "The instant that all grids are counted from; 0 before deployment.")
      .def("collect_trace", &PyHost::collect_trace, py::arg("period_ns"), Unlocked(),
           "Let a native thread empty the rings so often, for drain_trace(); 0: no longer.")
      .def("drain_trace", &PyHost::drain_trace, Unlocked())
      .def("watch_jobs", &PyHost::watch_jobs, py::arg("bounds"), py::arg("revision"), Unlocked(),
           R"(Compare each job from now on with its bound, until the architecture changes.

False: it has another revision, or a change is open. Unless collect_trace() asks for the trace, its records are lost.)")
      .def("end_job_watch", &PyHost::end_job_watch, Unlocked(),
           "Watch no bounds, and take no records for it.")
      .def(
          "watches_jobs", [](PyHost& self) { return self.job_watch().holds(); }, Unlocked(),
          "Whether bounds are watched: not after a change, until they are given again.")
      .def(
          "job_figures", [](PyHost& self) { return self.job_watch().figures(); }, Unlocked(),
          "Of each bound that is watched.")
      .def("take_violations", &PyHost::take_violations, Unlocked(),
           "Of each component that exceeded a bound since the last call one.")
      .def("trace_components", &PyHost::trace_components,
           "Names by the numbers that records carry; those of removed components stay.")
      .def("trace_names", [](PyHost&) { return Host::trace_names(); })
      .def(
          "wait_published",
          [](PyHost& self, time_ns_t timeout_ns) {
            std::vector<PyHost::PublishedSample> samples;
            {
              const InterpreterUnlocked release;
              samples = self.wait_published(timeout_ns);
            }
            py::list list;
            for (const auto& [resource, message, time_ns] : samples) {
              list.append(py::make_tuple(resource, to_bytes(message.data(), message.size()), time_ns));
            }
            return Typed<"list[tuple[str, bytes, int]]">(std::move(list));
          },
          py::arg("timeout_ns"), R"(What was written to published resources since the last call.

(resource, serialized message with its CDR header, writer's time), one thread at a time.)")
      .def("write_resource", &PyHost::write_resource, py::arg("resource"), py::arg("data"),
           "Writes a serialized message to a given resource, raises an event; False when a ring is full.")
      .def("read_resource", &PyHost::read_resource, py::arg("resource"), R"(Looks at a shared_data resource.

(serialized message, sequence number - 0: never written, writer's time))")
      .def("ask_goal", &PyHost::ask_goal, py::arg("resource"), py::arg("goal"),
           R"(Asks an action_server for a goal, a serialized message, as a client of the action does.

(number of the goal, why it is rejected at once - NONE: it waits for its answer). One thread at a time asks,
cancels and takes events, and only where no ROS action is bound to the resource.)")
      .def("cancel_goal", &PyHost::cancel_goal, py::arg("resource"), py::arg("goal"), Unlocked(),
           "Asks to cancel a goal; False: no such goal is accepted and has not ended.")
      .def("next_event", &PyHost::next_event, py::arg("resource"),
           "What is to be reported of a goal next, of the oldest goal first; None: nothing.")
      .def("wait_change", &PyHost::wait_change, py::arg("timeout_ns"), Unlocked(),
           "Waits until any component changes its state or core (a fault included); False at the timeout.")
      .def("wake", &PyHost::wake, Unlocked(),
           "Ends every wait_published and wait_change at once (for shutting down).");
  py::module_::import("atexit").attr("register")(py::cpp_function(&PyDeployer::shut_down_all));
  py::class_<PyDeployer, PyHost>(module, "Deployer", "The host of threads: one for each component.")
      .def(py::init<PyArchitecture&, bool, bool>(), py::arg("architecture"), py::kw_only(),
           py::arg("require_realtime") = false, py::arg("trace") = true, py::keep_alive<1, 2>());
}

}  // namespace mauve::bindings
