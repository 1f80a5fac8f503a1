// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/deploy/deployer.hpp"

#include <algorithm>
#include <set>

#include "mauve_rt/base/contract.hpp"
#include "mauve_rt/base/error.hpp"

#include "base/prefault.hpp"

namespace mauve {

namespace {

/// The deployers of the process, for its end.
struct Living {
  Mutex mutex;
  std::set<Deployer*> deployers MAUVE_GUARDED_BY(mutex);
  bool has_ended MAUVE_GUARDED_BY(mutex){false};
};

/// Not destroyed with static objects: a thread may end the process later.
Living& living() {
  static auto* const all = new Living;
  return *all;
}

}  // namespace

Deployer::Deployer(Architecture& architecture, DeployerOptions options)
    : Host(architecture), options_(options) {
  Living& all = living();
  const LockGuard lock(all.mutex);
  all.deployers.insert(this);
  has_ended_ = all.has_ended;
}

Deployer::~Deployer() {
  {
    Living& all = living();
    const LockGuard lock(all.mutex);
    all.deployers.erase(this);
  }
  shutdown();
  wait_unused();
}

void Deployer::prepare_process() {
  int highest = 1;
  for (const auto& component : architecture().components()) {
    highest = std::max(highest, component->task().settings().priority);
  }
  process_.acquire(highest, options_.require_realtime);
}

void Deployer::deploy() {
  architecture().change_lock().lock_alone();
  const LockGuard change(architecture().change_lock(), std::adopt_lock);
  architecture().settle_changes();
  const LockGuard life(life_mutex_);
  if (has_ended_) {
    throw Error(ErrorCode::not_configured, "the process ends", {.remedy = "deploy in a new process"});
  }
  require_deployable();
  prepare_process();
  architecture().set_host(*this);
  try {
    create_threads();
  } catch (...) {
    architecture().release_host(*this);
    throw;
  }
  // Only now, all threads being ready, is there an epoch: nobody's own start-up time gets into it. Each finds its start
  // waiting when the barrier opens, which one wake-up does for all: none runs while the others' are being posted.
  start_all(monotonic_now_ns() + kDeploymentLead);
  barrier_->arrive_and_wait();
  for (const auto& component : architecture().components()) component->task().wait_started(kForever);
  architecture().commit_gate().open();
  set_deployed(true);
}

void Deployer::create_threads() {
  const auto components = architecture().components();
  for (const auto& component : components) {
    Task& task = component->task();
    if (!task.end_thread(monotonic_now_ns())) {  // left behind by a shutdown
      task.throw_state_running("the component still executes a state of an earlier deployment", 0,
                               "wait for its end, then deploy again");
    }
  }
  auto missing = static_cast<std::uint32_t>(components.size() + 1);
  barrier_ = std::make_unique<Barrier>(missing);
  watchdog_ = std::make_shared<Watchdog>();
  try {
    for (const auto& component : components) {
      component->task().create_thread(barrier_.get(), options_.require_realtime, options_.trace, watchdog_);
      --missing;
      note_hosted(component);
    }
  } catch (...) {
    barrier_->arrive(missing);  // lets those go on that have arrived
    for (const auto& component : components) component->task().end_thread(kForever);
    watchdog_.reset();
    throw;
  }
  prefault_allocated();
}

void Deployer::shutdown() noexcept {
  const LockGuard life(life_mutex_);
  shut_down();
}

void Deployer::end() noexcept {
  const LockGuard life(life_mutex_);
  has_ended_ = true;
  shut_down();
}

bool Deployer::all_ended() noexcept {
  Living& all = living();
  const LockGuard lock(all.mutex);
  return all.has_ended;
}

void Deployer::end_all() noexcept {
  Living& all = living();
  const LockGuard lock(all.mutex);
  all.has_ended = true;
  for (Deployer* deployer : all.deployers) deployer->end();
}

void Deployer::shut_down() noexcept {
  if (!is_deployed()) return;
  set_deployed(false);
  // From here on each change is made or not, and hosted() is all that can run.
  architecture().commit_gate().close();
  stop_all(monotonic_now_ns() + kStopTimeout);
  give_up_hung();
  const time_ns_t until = monotonic_now_ns() + kThreadEnd;
  const auto all = hosted();
  // The order to end goes to all at once: one that hangs delays no other.
  for (const auto& component : all) component->task().end_thread(0);
  for (const auto& component : all) component->task().end_thread(until);
  shadow_threads_.end(until);  // stop_all() has ended its shadows
  watchdog_->stop();           // last: stopping is watched too
  architecture().release_host(*this);
  architecture().changes().bump();
}

void Deployer::begin_task(Task& task) {
  task.create_thread(nullptr, options_.require_realtime, options_.trace, watchdog_);
}

void Deployer::run_shadow(const std::shared_ptr<Shadow>& shadow) {
  const LockGuard life(life_mutex_);
  if (is_deployed()) shadow_threads_.add(shadow);  // else the change finds the host shut down
}

bool Deployer::end_task(Task& task, time_ns_t until_ns) noexcept { return task.end_thread(until_ns); }

}  // namespace mauve
