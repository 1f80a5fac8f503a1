// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/deployer.hpp"

#include <algorithm>

#include "mauve_rt/error.hpp"
#include "mauve_rt/futex.hpp"

#include "prefault.hpp"

namespace mauve {

namespace {

constexpr time_ns_t kWatchPeriod = ms_to_ns(5);
constexpr time_ns_t kStopTimeout = ms_to_ns(500);
constexpr time_ns_t kJoinTimeout = ms_to_ns(500);

}  // namespace

/// The barrier that component threads and deployer meet at.
class Deployer::Barrier {
 public:
  explicit Barrier(std::size_t parties) : missing_(parties) {
    pthread_barrier_init(&barrier_, nullptr, static_cast<unsigned>(parties));
  }
  ~Barrier() { pthread_barrier_destroy(&barrier_); }
  Barrier(const Barrier&) = delete;
  Barrier& operator=(const Barrier&) = delete;

  pthread_barrier_t& get() noexcept { return barrier_; }
  void created_one() noexcept { --missing_; }
  void arrive() noexcept { pthread_barrier_wait(&barrier_); }
  /// Lets those go on that have arrived, by standing in for whoever never will.
  void stand_in() {
    std::vector<std::thread> stand_ins;
    for (; missing_ > 0; --missing_) stand_ins.emplace_back([this] { arrive(); });
    for (std::thread& thread : stand_ins) thread.join();
  }

 private:
  pthread_barrier_t barrier_{};
  std::size_t missing_;
};

Deployer::Deployer(Architecture& architecture, DeployerOptions options)
    : architecture_(architecture), options_(options) {}

Deployer::~Deployer() { shutdown(); }

void Deployer::prepare_process() {
  int highest = 1;
  for (const auto& component : architecture_.components()) {
    highest = std::max(highest, component->task().settings().priority);
  }
  process_.acquire(highest, options_.require_realtime);
}

void Deployer::deploy() {
  const std::lock_guard lock(structure_mutex_);
  if (deployed_) throw Error(ErrorCode::already_running, "the architecture is deployed already");
  if (!architecture_.is_configured()) {
    throw Error(ErrorCode::not_configured, "the architecture is not configured",
                {.remedy = "call configure() first"});
  }
  prepare_process();
  const auto components = architecture_.components();
  barrier_ = std::make_unique<Barrier>(components.size() + 1);
  try {
    for (const auto& component : components) {
      component->task().create_thread(&barrier_->get(), options_.require_realtime, options_.trace);
      barrier_->created_one();
    }
  } catch (...) {
    barrier_->stand_in();
    for (const auto& component : components) component->task().end_thread(kForever);
    throw;
  }
  prefault_allocated();
  barrier_->arrive();
  conductor_ = std::make_unique<Conductor>();

  // Only now, all threads being ready, is there an epoch: nobody's own start-up time gets into it.
  const time_ns_t epoch_ns = monotonic_now_ns() + deployment_lead_ns(components.size());
  architecture_.set_deployment_epoch(epoch_ns);
  for (const auto& component : components) {
    Task& task = component->task();
    task.start_at(task.join(epoch_ns));
  }
  for (const auto& component : components) component->task().wait_started();
  deployed_ = true;
  watchdog_stop_.store(0, std::memory_order_relaxed);  // relaxed: the thread is created after
  watchdog_ = std::thread([this] { watch(); });
}

void Deployer::shutdown() noexcept {
  const std::lock_guard lock(structure_mutex_);
  if (!deployed_) return;
  deployed_ = false;  // nobody starts anything from here on
  watchdog_stop_.store(1, std::memory_order_release);
  futex_wake_all(watchdog_stop_);
  watchdog_.join();
  const time_ns_t stopped_by = monotonic_now_ns() + kStopTimeout;  // all of them together
  const auto components = architecture_.components();
  for (auto component = components.rbegin(); component != components.rend(); ++component) {
    try {
      if ((*component)->task().state() != ComponentState::running) continue;
      (*component)->task().stop(std::max<time_ns_t>(0, stopped_by - monotonic_now_ns()));
    } catch (const Error&) {  // still in a state, or faulted by now: joining its thread is the answer
    }
  }
  const time_ns_t until = monotonic_now_ns() + kJoinTimeout;
  for (const auto& component : components) component->task().end_thread(until);
  conductor_.reset();
  architecture_.changes().bump();
}

void Deployer::watch() noexcept {
  while (watchdog_stop_.load(std::memory_order_acquire) == 0) {
    futex_wait_until(watchdog_stop_, 0, monotonic_now_ns() + kWatchPeriod);
    for (const auto& component : architecture_.components())
      component->task().check_execution(monotonic_now_ns());
  }
}

void Deployer::require_deployed() const {
  if (deployed_) return;
  throw Error(ErrorCode::not_configured, "the architecture is not deployed",
              {.remedy = "call deploy() first"});
}

void Deployer::start(const std::string& component, std::optional<time_ns_t> clock_ns) {
  require_deployed();
  architecture_.hold_component(component)->task().start(clock_ns);
}

void Deployer::stop(const std::string& component, time_ns_t timeout_ns) {
  require_deployed();
  architecture_.hold_component(component)->task().stop(timeout_ns);
}

time_ns_t Deployer::get_time(const std::string& component) const {
  return architecture_.hold_component(component)->task().get_time();
}

TransactionHost Deployer::host() {
  return {.deployed = deployed_,
          .conductor = conductor_.get(),
          .attach =
              [this](Task& task) { task.create_thread(nullptr, options_.require_realtime, options_.trace); },
          .detach = [](Task& task) { return task.end_thread(monotonic_now_ns() + kJoinTimeout); }};
}

std::unique_ptr<TransactionCommit> Deployer::make(Transaction transaction,
                                                  const TransactionOptions& options) {
  const std::lock_guard lock(structure_mutex_);
  auto work = std::make_unique<TransactionCommit>(architecture_, host(), options);
  work->make(std::move(transaction));
  return work;
}

TransactionReport Deployer::commit(Transaction transaction, const TransactionOptions& options) {
  return make(std::move(transaction), options)->report(options.timeouts.phase_ns);
}

StepReport Deployer::commit_one(Transaction transaction, const CommitTimeouts& timeouts) {
  try {
    return commit(std::move(transaction), {.timeouts = timeouts}).steps.front();
  } catch (const Error& failure) {  // who asked for one thing needs no number for it
    ErrorDetail detail = failure.detail();
    detail.step = 0;
    detail.step_name.clear();
    throw Error(failure.code(), failure.statement(), detail);
  }
}

StepReport Deployer::replace_core(const std::string& component, const std::string& core,
                                  const CommitTimeouts& timeouts) {
  Transaction transaction;
  transaction.replace_core(component, core);
  return commit_one(std::move(transaction), timeouts);
}

StepReport Deployer::set_property(const std::string& component, const std::string& name,
                                  const PropertyValue& value, const CommitTimeouts& timeouts) {
  Transaction transaction;
  transaction.set_property(component, name, value);
  return commit_one(std::move(transaction), timeouts);
}

std::uint32_t Deployer::wait_change(std::uint32_t seen, time_ns_t until_ns) noexcept {
  const std::atomic<std::uint32_t>& word = architecture_.changes().word;
  while (word.load(std::memory_order_acquire) == seen) {
    if (!futex_wait_until(word, seen, until_ns)) break;
  }
  return word.load(std::memory_order_acquire);
}

}  // namespace mauve
