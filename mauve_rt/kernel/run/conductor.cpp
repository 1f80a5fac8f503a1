// SPDX-License-Identifier: LGPL-3.0-or-later
// Who conducts commits, and the ordinary thread's side of one.
#include <algorithm>
#include <mutex>
#include <stdexcept>

#include "mauve_rt/base/error.hpp"
#include "mauve_rt/base/futex.hpp"
#include "mauve_rt/run/commit.hpp"
#include "mauve_rt/run/task.hpp"

namespace mauve {

namespace {

constexpr int kConductorPriority = 99;
constexpr std::size_t kConductorStackBytes = std::size_t{128} * 1024;

void check_state(const Task& task) {
  switch (task.state()) {
    case ComponentState::stopping:
      task.throw_state_running("the component is STOPPING", 0, "try again when it has stopped");
    case ComponentState::faulted:
      throw Error(ErrorCode::faulted, "the component is FAULTED: " + task.fault().what,
                  {.component = task.name(),
                   .remedy = task.is_parked() ? Task::kRepairRemedy : Task::kLeftBehindRemedy});
    default:
      return;
  }
}

/// Keeps condemned threads from coming back while their components are being removed; once they are, for ever.
class Claims {
 public:
  explicit Claims(Commit& commit) noexcept : commit_(commit) {
    for (Participant& place : commit_.participants()) {
      place.left_behind = place.afterwards == Afterwards::stop && place.task->claim();
    }
  }
  ~Claims() {
    for (const Participant& place : commit_.participants()) {
      if (!place.left_behind) continue;
      if (commit_.committed()) {
        place.task->abandon();
      } else {
        place.task->give_up_claim();
      }
    }
  }
  Claims(const Claims&) = delete;
  Claims& operator=(const Claims&) = delete;

 private:
  Commit& commit_;
};

}  // namespace

Conductor::Conductor() {
  const int result = thread_.start(
      {.name = "conductor", .priority = kConductorPriority, .stack_bytes = kConductorStackBytes},
      &Conductor::entry, this);
  if (result != 0) throw Error(ErrorCode::internal, "the system refuses the conductor's thread");
}

Conductor::~Conductor() {
  order_.store(kEnd, std::memory_order_release);
  futex_wake_all(order_);
  thread_.join();
}

void* Conductor::entry(void* self) noexcept {
  static_cast<Conductor*>(self)->run();
  return nullptr;
}

void Conductor::run() noexcept {
  for (;;) {
    const std::uint32_t order = order_.load(std::memory_order_acquire);
    if (order == kEnd) return;
    if (order == kNone) {
      futex_wait_until(order_, kNone, kForever);
      continue;
    }
    order_.store(kNone, std::memory_order_relaxed);  // relaxed: the next order comes only after finished_
    mauve::conduct(*commit_, timeout_ns_);
    finished_.store(1, std::memory_order_release);
    futex_wake_all(finished_);
  }
}

void Conductor::press() noexcept {
  pressing_.fetch_add(1, std::memory_order_seq_cst);
  under_way_.use([this](Commit& commit) { give_way(commit); });
}

void Conductor::give_way(Commit& commit) noexcept {
  if (commit.yields() && pressing_.load(std::memory_order_seq_cst) != 0)
    commit.call_off(Commit::Off::preempted);
}

void Conductor::conduct(Commit& commit, time_ns_t timeout_ns) noexcept {
  commit_ = &commit;
  timeout_ns_ = timeout_ns;
  finished_.store(0, std::memory_order_relaxed);  // relaxed: the order publishes it
  under_way_.lend(commit);
  give_way(commit);
  order_.store(kConduct, std::memory_order_release);
  futex_wake_all(order_);
  while (finished_.load(std::memory_order_acquire) == 0) futex_wait_until(finished_, 0, kForever);
  under_way_.recall(kForever);
}

void Conductor::make_alone(Commit& commit) noexcept {
  under_way_.lend(commit);
  give_way(commit);
  commit.make_alone();
  under_way_.recall(kForever);
}

void Conductor::withdraw() noexcept {
  under_way_.use([](Commit& commit) {
    commit.hurry();
    commit.call_off(Commit::Off::shut_down);
  });
}

void conduct(Commit& commit, time_ns_t timeout_ns) noexcept {
  constexpr time_ns_t kLook = ms_to_ns(20);  // only while an adopt or take lasts
  const time_ns_t until = later_by(monotonic_now_ns(), timeout_ns);
  for (Participant* place : commit.in_order()) {
    if (place->is_called()) place->task->post(*place);
  }
  if (!commit.wait_settled(until)) commit.call_off(Commit::Off::timed_out);
  for (Participant& place : commit.participants()) {
    while (place.is_called() && !place.task->retract(monotonic_now_ns() + kLook)) {
      if (monotonic_now_ns() < commit.patience_ends_ns(until)) continue;
      if (commit.abandon() && commit.maker() == &place)
        break;  // its place is empty; it comes back from there or not
    }
  }
}

namespace {

/// Whose adopt or take it was that did not end, and on whose thread. That component is given up; those that waited for
/// its take are as well, as nobody knows what they are made of now.
[[noreturn]] void give_up(Commit& commit) {
  Task& stuck = *commit.maker()->task;
  const CommitAction* action = commit.under_way();
  const std::string whose = action->task != nullptr ? action->task->name() : stuck.name();
  const std::string call = commit.is_taking() ? "take" : "adopt";
  const std::string what =
      call + " of " + whose + "'s new part does not end, on the thread of " + stuck.name();
  for (Participant& place : commit.participants()) {
    if (place.task == &stuck || (commit.is_taking() && place.in_flight)) {
      place.task->condemn(what, place.task->clock().now_ns());
    } else if (commit.is_taking() && !place.in_flight) {
      place.task->fault_parked(what);
    }
  }
  throw Error(
      ErrorCode::faulted, what,
      {.component = stuck.name(),
       .found = std::string(to_string(stuck.state())),
       .remedy = "remove the component, and add it anew; " +
                 std::string(commit.is_taking() ? "what is changed is not known" : "nothing was changed")});
}

/// Who was never at the gate, or is still in a long state; nullptr: all came, but never together.
const Participant* one_still_running(Commit& commit, time_ns_t timeout_ns) {
  for (const Participant& place : commit.participants()) {
    if (place.in_flight && !place.came.load(std::memory_order_relaxed)) return &place;
  }
  for (const Participant& place : commit.participants()) {
    if (!place.in_flight || place.arrived.load(std::memory_order_relaxed)) continue;
    const StateAge age = place.task->state_age();
    if (!age.is_wait && age.age_ns > timeout_ns / 2) return &place;
  }
  return nullptr;
}

[[noreturn]] void throw_timeout(Commit& commit, time_ns_t timeout_ns) {
  if (const Participant* running = one_still_running(commit, timeout_ns)) {
    running->task->throw_state_running("the component did not reach a wait in time; nothing was changed",
                                       timeout_ns, "try again, or allow a longer commit timeout");
  }
  for (const Participant& place : commit.participants()) {
    if (!place.in_flight || commit.declared_ns() == 0 || place.passed.load(std::memory_order_relaxed) == 0)
      continue;
    throw Error(
        ErrorCode::timeout, "the declared budget fits in no wait of the component; nothing was changed",
        {.component = place.task->name(),
         .element = "budget_ns",
         .expected = "less than what is left of a wait",
         .found = std::to_string(commit.declared_ns() / 1000) + " us for adopt and take of all new cores",
         .remedy = "declare a shorter budget, or allow releases to be missed (max_missed)"});
  }
  throw Error(ErrorCode::timeout, "the components were never in their waits together; nothing was changed",
              {.remedy = "allow a longer commit timeout, or some releases to be missed (max_missed)"});
}

[[noreturn]] void throw_withdrawn(const Task* by) {
  ErrorDetail detail{.element = "state", .remedy = "look at the architecture again, then decide again"};
  if (by != nullptr) {
    detail.component = by->name();
    detail.found = std::string(to_string(by->state()));
  }
  throw Error(ErrorCode::wrong_revision, "the component was started or stopped, or it faulted, meanwhile",
              detail);
}

/// How long an adopt took, in place of what it would have thrown.
[[noreturn]] void throw_late_adopt(const CommitAction& action) {
  const bool is_declared = action.declared_ns() != 0;
  throw std::runtime_error("it took " + std::to_string(action.adopt_ns / 1000) + " us, and its " +
                           (is_declared ? "declared budget is " : "budget is reckoned at ") +
                           std::to_string(action.budget_ns() / 1000) + " us");
}

/// Throws what a commit that was called off, or whose adopt was late, is to answer.
void throw_if_off(Commit& commit, time_ns_t timeout_ns) {
  switch (commit.off()) {
    case Commit::Off::withdrawn:
      throw_withdrawn(commit.off_by());
    case Commit::Off::shut_down:
      throw Error(ErrorCode::wrong_revision, "the architecture is being shut down; nothing was changed",
                  {.remedy = "deploy it again first"});
    case Commit::Off::preempted:
      throw Error(ErrorCode::wrong_revision, "a prepared change came before this one; nothing was changed",
                  {.remedy = "look at the architecture again, then decide again"});
    case Commit::Off::timed_out:
    case Commit::Off::overran:
      if (const CommitAction* slowest = commit.put_down()) throw_late_adopt(*slowest);
      throw_timeout(commit, timeout_ns);
    case Commit::Off::not_yet:
      if (commit.adopt_was_late()) throw_late_adopt(*commit.refused_by());
  }
}

/// Where all are parked and new parts come in, one of their threads makes the change, so that an adopt that does not end
/// keeps that thread and nobody else; how many are called.
std::uint32_t call_parked(Commit& commit) {
  for (Participant& place : commit.participants()) {
    if (!place.replaces_parts || place.left_behind || !place.task->has_thread()) continue;
    place.makes_parked = true;
    return 1;
  }
  return 0;
}

/// All that is done with the tasks' commands held. Runs no code of others but the actions'.
void make_or_refuse(Commit& commit, time_ns_t timeout_ns, Conductor* conductor) noexcept {
  std::uint32_t running = 0;
  for (Participant& place : commit.participants()) {
    place.in_flight = !place.left_behind && !place.task->is_parked();
    if (place.in_flight && !place.task->is_simulated()) ++running;
  }
  for (Participant& place : commit.participants()) {
    if (running == 0) place.task->hold_parked(place);
  }
  if (running == 0 && conductor != nullptr) running = call_parked(commit);
  commit.expect(running);
  if (running == 0) {
    if (conductor != nullptr) {
      conductor->make_alone(commit);
    } else {
      commit.make_alone();
    }
  } else if (conductor != nullptr) {
    conductor->conduct(commit, timeout_ns);
  } else {
    commit.call_off(Commit::Off::shut_down);  // a task left behind by a host that is no more
  }
  if (commit.is_abandoned()) return;
  for (Participant& place : commit.participants()) {
    if (!place.in_flight || place.task->is_simulated()) place.task->finish_parked(place, commit.committed());
  }
}

std::vector<Task*> tasks_of(Commit& commit) {
  std::vector<Task*> tasks;
  for (const Participant& place : commit.participants()) tasks.push_back(place.task);
  std::sort(tasks.begin(), tasks.end(),
            [](const Task* a, const Task* b) { return a->number() < b->number(); });
  return tasks;
}

}  // namespace

bool carry_out(Commit& commit, time_ns_t timeout_ns, Conductor* conductor) {
  // Whoever commands two tasks takes them in the order of their numbers, so that no two wait for each other.
  commit.order_participants();
  const std::vector<Task*> tasks = tasks_of(commit);
  std::vector<std::unique_lock<PiMutex>> locks;
  locks.reserve(tasks.size());
  for (Task* task : tasks) locks.emplace_back(task->command_mutex());

  const Claims claims(commit);
  for (const Participant& place : commit.participants()) {
    if (place.afterwards != Afterwards::stop && !place.repairs) check_state(*place.task);
  }
  make_or_refuse(commit, timeout_ns, conductor);
  if (commit.is_abandoned()) give_up(commit);
  throw_if_off(commit, timeout_ns);
  if (commit.refusal()) std::rethrow_exception(commit.refusal());
  return commit.committed();
}

PreparedCommit::PreparedCommit(Commit& commit) : commit_(commit), tasks_(tasks_of(commit)) {
  commit.order_participants();  // reserves what ordering them again needs
}

bool PreparedCommit::lock(time_ns_t until_ns) noexcept {
  for (std::size_t i = 0; i < tasks_.size(); ++i) {
    if (tasks_[i]->command_mutex().try_lock_until(until_ns)) continue;
    while (i-- > 0) tasks_[i]->command_mutex().unlock();
    return false;
  }
  return true;
}

void PreparedCommit::unlock() noexcept {
  for (Task* task : tasks_) task->command_mutex().unlock();
}

PreparedCommit::Outcome PreparedCommit::carry_out(time_ns_t until_ns, Conductor* conductor) noexcept {
  if (!lock(until_ns)) return Outcome::timed_out;
  const bool is_as_it_was =
      std::all_of(commit_.participants().begin(), commit_.participants().end(), [](const Participant& place) {
        const ComponentState state = place.task->state();
        if (place.afterwards == Afterwards::stop || place.repairs) return true;
        return state != ComponentState::stopping && state != ComponentState::faulted;
      });
  if (is_as_it_was) {
    const Claims claims(commit_);
    timeout_ns_ = std::max<time_ns_t>(0, until_ns - monotonic_now_ns());
    make_or_refuse(commit_, timeout_ns_, conductor);
    if (commit_.is_abandoned()) {
      try {
        give_up(commit_);
      } catch (...) {
        given_up_ = std::current_exception();
      }
    }
  }
  unlock();
  has_begun_ = is_as_it_was;
  if (!is_as_it_was) return Outcome::changed;
  if (commit_.committed()) return Outcome::made;
  if (commit_.is_abandoned()) return Outcome::refused;
  switch (commit_.off()) {
    case Commit::Off::not_yet:
      return Outcome::refused;
    case Commit::Off::timed_out:
    case Commit::Off::overran:
      return Outcome::timed_out;
    default:
      return Outcome::off;
  }
}

void PreparedCommit::rethrow_refusal() const {
  if (given_up_) std::rethrow_exception(given_up_);
  if (!has_begun_) {
    throw Error(ErrorCode::timeout,
                "a start of one of its components, or the end of its thread, lasted; nothing was changed",
                {.remedy = "try again, or allow a longer commit timeout"});
  }
  throw_if_off(commit_, timeout_ns_);
  if (commit_.refusal()) std::rethrow_exception(commit_.refusal());
}

}  // namespace mauve
