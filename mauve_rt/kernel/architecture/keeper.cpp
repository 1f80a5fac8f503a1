// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/architecture/keeper.hpp"

#include <algorithm>
#include <deque>
#include <map>
#include <utility>

#include "mauve_rt/base/contract.hpp"
#include "mauve_rt/base/seam/condition_variable.hpp"
#include "mauve_rt/base/seam/ordinary_thread.hpp"

#include "base/keep_for_ever.hpp"

namespace mauve {

namespace {

/// What is another's and has lasted for so long is not waited for.
constexpr time_ns_t kAnothers = ms_to_ns(50);
constexpr time_ns_t kEnd = ms_to_ns(500);

}  // namespace

struct Keeper::State {
  struct Work {
    std::string what;
    std::function<void()> call;
    std::uint64_t number;  // of all that came, from 1 on
  };
  /// It is there while it has a thread, or somebody holds it.
  struct Lane {
    std::deque<Work> works{};
    Busy busy{};
    std::uint64_t at{0};  // the number of what it does now; 0: nothing
    std::thread::id thread{};
    int holds{0};

    bool has_next() const noexcept { return holds == 0 && !works.empty(); }
    std::uint64_t oldest() const noexcept { return at != 0 || !has_next() ? at : works.front().number; }
  };
  Mutex mutex;
  ConditionVariable changed;
  std::map<const void*, Lane> lanes MAUVE_GUARDED_BY(mutex);
  std::uint64_t taken MAUVE_GUARDED_BY(mutex){0};
};

Keeper::Keeper() : state_(std::make_shared<State>()) {}

Keeper::~Keeper() {
  wait(0, monotonic_now_ns() + kEnd);
  const LockGuard lock(state_->mutex);
  const auto is_held = [](const auto& each) { return each.second.holds != 0; };
  // Who holds a lane uses what waits there.
  if (std::any_of(state_->lanes.begin(), state_->lanes.end(), is_held)) keep_for_ever(state_);
}

void Keeper::take(std::string what, std::function<void()> work, const void* lane, Place place) {
  const LockGuard lock(state_->mutex);
  State::Lane& its = state_->lanes[lane];
  its.works.insert(place == Place::next ? its.works.begin() : its.works.end(),
                   {.what = std::move(what), .call = std::move(work), .number = ++state_->taken});
  run_if_idle(state_, lane);
}

void Keeper::run_if_idle(const std::shared_ptr<State>& state, const void* lane) MAUVE_REQUIRES(state->mutex) {
  State::Lane& its = state->lanes.at(lane);
  if (its.thread != std::thread::id{} || !its.has_next()) return;
  OrdinaryThread thread(&Keeper::run, state, lane);
  its.thread = thread.get_id();
  thread.detach();  // it ends with the work of its lane, and owns what it uses
}

void Keeper::hold(const void* lane) {
  const LockGuard lock(state_->mutex);
  ++state_->lanes[lane].holds;
}

void Keeper::release(const void* lane) {
  const LockGuard lock(state_->mutex);
  State::Lane& its = state_->lanes.at(lane);
  MAUVE_EXPECTS(its.holds > 0);
  if (--its.holds > 0 || its.thread != std::thread::id{}) return;
  if (its.works.empty()) {
    state_->lanes.erase(lane);
  } else {
    run_if_idle(state_, lane);
  }
}

bool Keeper::is_at(const void* lane) const {
  const LockGuard lock(state_->mutex);
  return state_->lanes.contains(lane);
}

bool Keeper::is_held(const void* lane) const {
  const LockGuard lock(state_->mutex);
  const auto found = state_->lanes.find(lane);
  return found != state_->lanes.end() && found->second.holds != 0;
}

std::uint64_t Keeper::taken() const {
  const LockGuard lock(state_->mutex);
  return state_->taken;
}

void Keeper::wait(std::uint64_t first, time_ns_t until_ns) const {
  const LockGuard lock(state_->mutex);
  const std::uint64_t taken = state_->taken;
  time_ns_t now_ns = monotonic_now_ns();
  const auto is_awaited = [&](const auto& each) {
    const State::Lane& lane = each.second;
    if (lane.oldest() == 0 || lane.oldest() > taken) return false;
    const bool is_anothers = lane.at != 0 && lane.at <= first;
    return !is_anothers || now_ns - lane.busy.since_ns <= kAnothers;
  };
  const auto is_own = [](const auto& each) { return each.second.thread == std::this_thread::get_id(); };
  const auto& lanes = state_->lanes;
  if (std::any_of(lanes.begin(), lanes.end(), is_own)) return;
  for (; now_ns < until_ns && std::any_of(lanes.begin(), lanes.end(), is_awaited);
       now_ns = monotonic_now_ns())
    state_->changed.wait_until(state_->mutex, now_ns + ms_to_ns(20));
}

Keeper::Busy Keeper::busy() const {
  const LockGuard lock(state_->mutex);
  Busy longest;
  for (const auto& [key, lane] : state_->lanes) {
    if (lane.at == 0 || (longest.since_ns != 0 && longest.since_ns <= lane.busy.since_ns)) continue;
    longest = lane.busy;
  }
  return longest;
}

void Keeper::run(const std::shared_ptr<State>& state, const void* lane) {
  UniqueLock lock(state->mutex);
  State::Lane& its = state->lanes.at(lane);
  while (its.has_next()) {
    MAUVE_AUDIT(its.at == 0 && its.thread == std::this_thread::get_id());
    State::Work work = std::move(its.works.front());
    its.works.pop_front();
    its.at = work.number;
    its.busy = {.what = std::move(work.what), .since_ns = monotonic_now_ns()};
    lock.unlock();
    try {
      work.call();
    } catch (...) {  // a hook has thrown, and no caller is left to report it to
    }
    work.call = nullptr;  // what it held goes here, not under the mutex
    lock.lock();
    its.busy = {};
    its.at = 0;
    state->changed.notify_all();
  }
  its.thread = {};
  if (its.holds == 0) state->lanes.erase(lane);
  state->changed.notify_all();
}

}  // namespace mauve
