// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/architecture/keeper.hpp"

#include <chrono>
#include <utility>

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
  };
  std::mutex mutex;
  std::condition_variable changed;
  std::deque<Work> works;
  Busy busy;
  std::uint64_t taken{0};
  std::uint64_t done{0};
  bool is_to_end{false};
};

Keeper::Keeper() : state_(std::make_shared<State>()) {}

Keeper::~Keeper() {
  if (!thread_.joinable()) return;
  const time_ns_t until_ns = monotonic_now_ns() + kEnd;
  wait(0, until_ns);
  bool is_over = false;
  {
    const std::lock_guard lock(state_->mutex);
    state_->is_to_end = true;
    is_over = state_->taken == state_->done;
  }
  state_->changed.notify_all();
  if (is_over) {
    thread_.join();
  } else {
    thread_.detach();
  }
}

void Keeper::take(std::string what, std::function<void()> work) {
  {
    const std::lock_guard lock(state_->mutex);
    state_->works.push_back({.what = std::move(what), .call = std::move(work)});
    ++state_->taken;
    if (!thread_.joinable()) thread_ = std::thread(&Keeper::run, state_);
  }
  state_->changed.notify_all();
}

std::uint64_t Keeper::taken() const {
  const std::lock_guard lock(state_->mutex);
  return state_->taken;
}

void Keeper::wait(std::uint64_t first, time_ns_t until_ns) const {
  std::unique_lock lock(state_->mutex);
  const std::uint64_t taken = state_->taken;
  if (thread_.get_id() == std::this_thread::get_id()) return;
  while (state_->done < taken) {
    const time_ns_t now_ns = monotonic_now_ns();
    const time_ns_t since_ns = state_->busy.since_ns;
    const bool is_anothers = state_->done < first && since_ns != 0 && now_ns - since_ns > kAnothers;
    if (now_ns >= until_ns || is_anothers) return;
    state_->changed.wait_for(lock, std::chrono::milliseconds(20));
  }
}

Keeper::Busy Keeper::busy() const {
  const std::lock_guard lock(state_->mutex);
  return state_->busy;
}

void Keeper::run(const std::shared_ptr<State>& state) {
  std::unique_lock lock(state->mutex);
  for (;;) {
    state->changed.wait(lock, [&] { return state->is_to_end || !state->works.empty(); });
    if (state->works.empty()) return;
    State::Work work = std::move(state->works.front());
    state->works.pop_front();
    state->busy = {.what = std::move(work.what), .since_ns = monotonic_now_ns()};
    lock.unlock();
    try {
      work.call();
    } catch (...) {  // a hook has thrown, and no caller is left to report it to
    }
    work.call = nullptr;  // what it held goes here, not under the mutex
    lock.lock();
    state->busy = {};
    ++state->done;
    state->changed.notify_all();
  }
}

}  // namespace mauve
