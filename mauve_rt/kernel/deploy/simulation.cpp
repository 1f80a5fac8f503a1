// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/deploy/simulation.hpp"

#include <pthread.h>

#include <algorithm>
#include <tuple>
#include <utility>

#include "mauve_rt/base/error.hpp"
#include "mauve_rt/base/seam/futex.hpp"

namespace mauve {

namespace {

/// The calling thread is the task's own for as long: marks, service records and log lines go to its rings.
class TaskOfThread {
 public:
  explicit TaskOfThread(Task& task) noexcept {
    TraceRing::set_for_this_thread(task.ring());
    LogRing::set_for_this_thread(task.log_ring());
    Task::set_simulated_here(&task);
  }
  ~TaskOfThread() {
    TraceRing::set_for_this_thread(nullptr);
    LogRing::set_for_this_thread(nullptr);
    Task::set_simulated_here(nullptr);
  }
  TaskOfThread(const TaskOfThread&) = delete;
  TaskOfThread& operator=(const TaskOfThread&) = delete;
};

/// Of the calling thread; 0 when the system does not tell.
std::size_t own_stack_bytes() noexcept {
  pthread_attr_t attributes;
  if (pthread_getattr_np(pthread_self(), &attributes) != 0) return 0;
  void* lowest = nullptr;
  std::size_t size = 0;
  pthread_attr_getstack(&attributes, &lowest, &size);
  pthread_attr_destroy(&attributes);
  return size;
}

/// A simulated component runs on the caller's stack, not on one of its own.
void check_stack(Component& component, std::size_t stack_bytes) {
  const LargestMessage largest = largest_message(component.shell());
  const std::size_t needed = stack_bytes_for(largest);
  if (stack_bytes == 0 || needed <= stack_bytes) return;
  throw Error(ErrorCode::out_of_range, "a port's messages do not fit on the simulating thread's stack",
              {.component = component.name(),
               .element = "port " + largest.port,
               .expected = "a stack of at least " + std::to_string(needed) + " bytes",
               .found = std::to_string(stack_bytes),
               .remedy = "raise the limit (ulimit -s), or make the message smaller"});
}

}  // namespace

Simulation::Simulation(SimulationOptions options) : options_(options), now_ns_(options.begin_ns) {
  if (options_.begin_ns > 0 && options_.begin_ns <= kLatestBegin) return;
  throw Error(ErrorCode::invalid_argument, "a simulation cannot begin at that instant",
              {.element = "begin_ns",
               .expected = "1 to " + std::to_string(kLatestBegin) + " ns, which leaves a year to run",
               .found = std::to_string(options_.begin_ns),
               .remedy = "leave it out, or begin within these limits"});
}

Simulation::~Simulation() { shutdown(); }

SimulatedHost& Simulation::add(Architecture& architecture) {
  if (epoch_ns_ != 0) throw Error(ErrorCode::already_running, "the simulation is deployed already");
  auto host = std::make_unique<SimulatedHost>(*this, architecture);
  host->join();
  hosts_.push_back(std::move(host));
  return *hosts_.back();
}

void Simulation::deploy() {
  if (epoch_ns_ != 0) throw Error(ErrorCode::already_running, "the simulation is deployed already");
  for (const Processor* processor : processors_) processor->architecture->require_ready_cores();
  epoch_ns_ = now_ns_ + kDeploymentLead;
  for (const auto& host : hosts_) {
    if (std::find(processors_.begin(), processors_.end(), &host->processor_) != processors_.end())
      host->begin(epoch_ns_);
  }
}

void Simulation::shutdown() noexcept {
  for (const auto& host : hosts_) host->shutdown();
  timers_.clear();
}

void Simulation::at(time_ns_t instant_ns, Callback callback) {
  timers_.insert({instant_ns, timers_set_++, 0, std::make_shared<Callback>(std::move(callback))});
}

void Simulation::every(time_ns_t first_ns, time_ns_t period_ns, Callback callback) {
  if (period_ns <= 0) {
    throw Error(ErrorCode::invalid_argument, "a repeated callback needs a period",
                {.element = "period_ns", .expected = "> 0", .found = std::to_string(period_ns)});
  }
  timers_.insert({first_ns, timers_set_++, period_ns, std::make_shared<Callback>(std::move(callback))});
}

Simulation::Next Simulation::next_of(Processor& processor) {
  Task* const task = processor.clock.next();
  if (task == nullptr) return {};
  return {std::max(task->due_ns(), processor.clock.now_ns()), &processor, task};
}

void Simulation::run_until(time_ns_t instant_ns) {
  do {
    if (failure_) std::rethrow_exception(std::exchange(failure_, nullptr));
  } while (step(instant_ns));
}

bool Simulation::step_in_change(time_ns_t until_ns) noexcept {
  try {
    return !failure_ && step(until_ns);
  } catch (...) {
    failure_ = std::current_exception();
    return false;
  }
}

/// What comes first happens, if it comes by the instant; else time passes up to the instant, and this is false.
bool Simulation::step(time_ns_t until_ns) {
  Next next;
  for (const auto& processor : processors_) {
    const Next candidate = next_of(*processor);
    if (candidate.begin_ns < next.begin_ns) next = candidate;
  }
  const time_ns_t timer = timers_.empty() ? kForever : timers_.begin()->instant_ns;
  const time_ns_t first = std::min(timer, next.begin_ns);
  if (first > until_ns || first == kForever) {
    advance_to(until_ns);
    return false;
  }
  if (timer <= next.begin_ns) {
    run_timer();
    return true;
  }
  now_ns_ = std::max(now_ns_, next.begin_ns);
  next.processor->clock.advance_to(next.begin_ns);
  const TaskOfThread here(*next.task);
  next.task->resume();
  return true;
}

void Simulation::run_timer() {
  Timer timer = timers_.extract(timers_.begin()).value();
  const std::shared_ptr<Callback> callback = timer.callback;
  advance_to(timer.instant_ns);
  timer.instant_ns = later_by(timer.instant_ns, timer.period_ns);
  if (timer.period_ns != 0 && timer.instant_ns != kForever) {  // else it does not come again
    timer.number = timers_set_++;
    timers_.insert(std::move(timer));
  }
  (*callback)();
}

/// Commands from outside find every processor at the present.
void Simulation::advance_to(time_ns_t instant_ns) {
  now_ns_ = std::max(now_ns_, instant_ns);
  for (const auto& processor : processors_) processor->clock.advance_to(now_ns_);
}

SimulatedHost::SimulatedHost(Simulation& simulation, Architecture& architecture)
    : Host(architecture),
      simulation_(simulation),
      processor_{.architecture = &architecture, .clock = SimulatedClock(simulation.now_ns())} {}

SimulatedHost::~SimulatedHost() { shutdown(); }

void SimulatedHost::join() {
  const auto change = architecture().change_lock().join_alone();
  require_deployable();
  const std::size_t stack_bytes = own_stack_bytes();
  for (const auto& component : architecture().components()) {
    check_stack(*component, stack_bytes);
    if (!component->task().has_thread()) continue;
    throw Error(ErrorCode::already_running, "the component has a thread still",
                {.component = component->name(), .remedy = "shut its deployer down first"});
  }
  architecture().set_host(*this);
  processor_.clock.advance_to(simulation_.now_ns_);
  architecture().log_queue()->set_clock(&processor_.clock);
  simulation_.processors_.push_back(&processor_);
}

void SimulatedHost::deploy() {
  architecture().change_lock().lock_alone();
  const LockGuard change(architecture().change_lock(), std::adopt_lock);
  if (architecture().host() != this) join();  // it was shut down
  require_deployable();
  if (simulation_.epoch_ns_ == 0) return simulation_.deploy();
  begin(simulation_.now_ns_ + kDeploymentLead);
}

void SimulatedHost::begin(time_ns_t epoch_ns) {
  const auto change = architecture().change_lock().join_alone();
  architecture().settle_changes();
  for (const auto& component : architecture().components()) attach(component);
  start_all(epoch_ns);
  architecture().commit_gate().open();
  set_deployed(true);
}

void SimulatedHost::shutdown() noexcept {
  auto& running = simulation_.processors_;
  const auto place = std::find(running.begin(), running.end(), &processor_);
  if (place == running.end()) return;
  running.erase(place);
  set_deployed(false);
  architecture().commit_gate().close();
  stop_all(0);
  for (const auto& component : hosted()) {
    component->settle_shadow();  // no thread of its own retires it
    component->task().end_simulation();
  }
  architecture().log_queue()->set_clock(nullptr);
  architecture().release_host(*this);
}

const RealtimeStatus& SimulatedHost::realtime_status() const noexcept {
  static const RealtimeStatus none{.granted = false, .missing = {"simulated time: nothing ran in real time"}};
  return none;
}

bool SimulatedHost::pass_time(time_ns_t until_ns) noexcept { return simulation_.step_in_change(until_ns); }

void SimulatedHost::begin_task(Task& task) { task.simulate(processor_.clock, simulation_.options_.trace); }

bool SimulatedHost::end_task(Task& task, time_ns_t /*until_ns*/) noexcept {
  task.end_simulation();
  return true;
}

}  // namespace mauve
