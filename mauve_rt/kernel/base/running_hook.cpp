// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/base/running_hook.hpp"

#include <map>
#include <utility>

#include "mauve_rt/base/error.hpp"
#include "mauve_rt/base/seam/mutex.hpp"

namespace mauve {

namespace {

/// Of all threads that execute one. It outlives static objects, whose parts may be cleaned up at the end of the process.
struct Running {
  Mutex mutex;
  std::map<std::thread::id, RunningHook::Facts> hooks MAUVE_GUARDED_BY(mutex);
};
Running& running() {
  static auto* const all = new Running;
  return *all;
}

}  // namespace

RunningHook::RunningHook(const char* name, const std::string& part)
    : outer_{.hook = std::string(name) + " of " + part, .since_ns = monotonic_now_ns()} {
  Running& all = running();
  const LockGuard lock(all.mutex);
  std::swap(outer_, all.hooks[std::this_thread::get_id()]);
}

RunningHook::~RunningHook() { end(); }

/// Whether it was called off before. Looking and ending are one step: else it could be called off in between, and not learn of it.
bool RunningHook::end() noexcept {
  if (std::exchange(has_ended_, true)) return false;
  Running& all = running();
  const LockGuard lock(all.mutex);
  const auto present = all.hooks.find(std::this_thread::get_id());
  const bool is_off = present->second.is_off;
  if (outer_.hook.empty()) {
    all.hooks.erase(present);
  } else {
    outer_.is_off |= is_off;
    present->second = std::move(outer_);
  }
  return is_off;
}

void RunningHook::leave() {
  if (end()) throw Error(ErrorCode::wrong_revision, kCalledOff);
}

bool RunningHook::call_off(std::thread::id thread, const std::function<bool()>& decide) {
  Running& all = running();
  const LockGuard lock(all.mutex);
  const auto found = all.hooks.find(thread);
  if (found == all.hooks.end() || !decide()) return false;
  found->second.is_off = true;
  return true;
}

RunningHook::Facts RunningHook::of(std::thread::id thread) {
  Running& all = running();
  const LockGuard lock(all.mutex);
  const auto found = all.hooks.find(thread);
  return found != all.hooks.end() ? found->second : Facts{};
}

}  // namespace mauve
