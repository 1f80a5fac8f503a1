// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/simulation.hpp"

#include <pthread.h>

#include <algorithm>
#include <tuple>

#include "mauve_rt/error.hpp"
#include "mauve_rt/futex.hpp"

namespace mauve {

namespace {

/// Marks and service records go to the ring of the task that runs, as on its own thread.
class RingOfThread {
 public:
  explicit RingOfThread(TraceRing* ring) noexcept { TraceRing::set_for_this_thread(ring); }
  ~RingOfThread() { TraceRing::set_for_this_thread(nullptr); }
  RingOfThread(const RingOfThread&) = delete;
  RingOfThread& operator=(const RingOfThread&) = delete;
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
  if (options_.begin_ns > 0) return;
  throw Error(ErrorCode::invalid_argument, "a simulation begins at a positive instant",
              {.element = "begin_ns", .expected = "> 0", .found = std::to_string(options_.begin_ns)});
}

Simulation::~Simulation() { shutdown(); }

void Simulation::add(Architecture& architecture) {
  if (epoch_ns_ != 0) throw Error(ErrorCode::already_running, "the simulation is deployed already");
  if (!architecture.is_configured()) {
    throw Error(ErrorCode::not_configured, "the architecture is not configured",
                {.remedy = "call configure() first"});
  }
  const std::size_t stack_bytes = own_stack_bytes();
  for (const auto& component : architecture.components()) {
    check_stack(*component, stack_bytes);
    if (!component->task().has_thread() && !component->task().is_simulated()) continue;
    throw Error(ErrorCode::already_running, "the architecture is deployed, or simulated, already",
                {.component = component->name(), .remedy = "shut that down first"});
  }
  processors_.push_back(
      std::make_unique<Processor>(Processor{&architecture, SimulatedClock(now_ns_), {}, 0}));
}

void Simulation::deploy() {
  if (epoch_ns_ != 0) throw Error(ErrorCode::already_running, "the simulation is deployed already");
  std::size_t components = 0;
  for (const auto& processor : processors_) components += processor->architecture->components().size();
  epoch_ns_ = now_ns_ + deployment_lead_ns(components);
  for (const auto& processor : processors_) {
    processor->architecture->set_deployment_epoch(epoch_ns_);
    for (const auto& component : processor->architecture->components()) {
      Task& task = component->task();
      task.simulate(processor->clock, options_.trace);
      task.start_at(task.join(epoch_ns_));
    }
  }
}

void Simulation::shutdown() noexcept {
  for (const auto& processor : processors_) {
    const auto components = processor->architecture->components();
    for (auto component = components.rbegin(); component != components.rend(); ++component) {
      Task& task = (*component)->task();
      try {
        if (!task.is_parked()) task.stop(0);
      } catch (const Error&) {  // it faulted while stopping: parked all the same
      }
      task.end_simulation();
    }
  }
  processors_.clear();
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
  const std::uint64_t revision = processor.architecture->revision();
  if (processor.seen_lists != revision) {
    processor.components = processor.architecture->components();
    processor.seen_lists = revision;
  }
  const time_ns_t now = processor.clock.now_ns();
  Next next;
  const auto rank = [](time_ns_t begin, const Task& task) {
    return std::pair(begin, -task.settings().priority);
  };
  for (const auto& component : processor.components) {
    Task& task = component->task();
    if (task.due_ns() == kForever) continue;
    const time_ns_t begin = std::max(task.due_ns(), now);
    if (next.task == nullptr || rank(begin, task) < rank(next.begin_ns, *next.task))
      next = {begin, &processor, &task};
  }
  return next;
}

void Simulation::run_until(time_ns_t instant_ns) {
  for (;;) {
    Next next;
    for (const auto& processor : processors_) {
      const Next candidate = next_of(*processor);
      if (candidate.begin_ns < next.begin_ns) next = candidate;
    }
    const time_ns_t timer = timers_.empty() ? kForever : timers_.begin()->instant_ns;
    if (std::min(timer, next.begin_ns) > instant_ns) break;
    if (timer <= next.begin_ns) {
      run_timer();
      continue;
    }
    now_ns_ = std::max(now_ns_, next.begin_ns);
    next.processor->clock.advance_to(next.begin_ns);
    const RingOfThread ring(next.task->ring());
    next.task->resume();
  }
  advance_to(instant_ns);
}

void Simulation::run_timer() {
  Timer timer = timers_.extract(timers_.begin()).value();
  const std::shared_ptr<Callback> callback = timer.callback;
  advance_to(timer.instant_ns);
  if (timer.period_ns != 0) {
    timer.instant_ns += timer.period_ns;
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

Simulation::Processor& Simulation::require(const Architecture& architecture) const {
  for (const auto& processor : processors_) {
    if (processor->architecture == &architecture) return *processor;
  }
  throw Error(ErrorCode::invalid_argument, "the architecture is not part of the simulation",
              {.remedy = "add() it first"});
}

void Simulation::start(Architecture& architecture, const std::string& component,
                       std::optional<time_ns_t> clock_ns) {
  require(architecture);
  architecture.hold_component(component)->task().start(clock_ns);
}

void Simulation::stop(Architecture& architecture, const std::string& component) {
  require(architecture);
  architecture.hold_component(component)->task().stop(0);
}

time_ns_t Simulation::get_time(const Architecture& architecture, const std::string& component) const {
  require(architecture);
  return architecture.hold_component(component)->task().get_time();
}

TransactionReport Simulation::commit(Architecture& architecture, Transaction transaction,
                                     const TransactionOptions& options) {
  Processor& processor = require(architecture);
  TransactionOptions at_once = options;
  at_once.timeouts.phase_ns = 0;  // the release that follows comes only when this call has returned
  TransactionCommit work(architecture,
                         {.deployed = epoch_ns_ != 0,
                          .conductor = nullptr,
                          .attach = [&](Task& task) { task.simulate(processor.clock, options_.trace); },
                          .detach =
                              [](Task& task) {
                                task.end_simulation();
                                return true;
                              }},
                         at_once);
  work.make(std::move(transaction));
  TransactionReport report = work.report(0);
  report.is_complete = true;  // what it lacks nobody will wait for
  report.prepare_ns = 0;
  for (StepReport& step : report.steps) step.prepare_ns = 0;
  return report;
}

TraceDrain Simulation::drain_trace(Architecture& architecture) {
  TraceDrain drain = architecture.drain_trace();
  drain.monotonic_ns = drain.realtime_ns = require(architecture).clock.now_ns();
  return drain;
}

}  // namespace mauve
