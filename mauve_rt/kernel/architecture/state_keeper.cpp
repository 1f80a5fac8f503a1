// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/architecture/state_keeper.hpp"

#include <exception>
#include <utility>

#include "mauve_rt/architecture/state_file.hpp"
#include "mauve_rt/base/error.hpp"
#include "mauve_rt/base/seam/futex.hpp"
#include "mauve_rt/base/time.hpp"

namespace mauve {

namespace {

constexpr time_ns_t kRetry = s_to_ns(1);

}  // namespace

StateKeeper::StateKeeper(Architecture& architecture, std::filesystem::path path)
    : architecture_(architecture), file_(architecture.describe()), path_(std::move(path)) {}

StateKeeper::~StateKeeper() { stop(); }

void StateKeeper::start() {
  if (runs_) return;
  write();
  ending_.store(false, std::memory_order_relaxed);  // the thread's creation publishes it
  const auto entry = [](void* self) -> void* {
    static_cast<StateKeeper*>(self)->run();
    return nullptr;
  };
  if (thread_.start({.name = "state keeper"}, entry, this) != 0)
    throw Error(ErrorCode::internal, "the system refuses a thread", {.element = "state keeper"});
  runs_ = true;
}

void StateKeeper::stop() noexcept {
  if (!std::exchange(runs_, false)) return;
  ending_.store(true, std::memory_order_release);
  overlays().bump();
  thread_.join();
}

std::string StateKeeper::problem() const {
  const LockGuard lock(mutex_);
  return problem_;
}

void StateKeeper::run() noexcept {
  for (;;) {
    const std::uint32_t seen = overlays().word().load(std::memory_order_acquire);  // before the state is read
    const bool is_last = ending_.load(std::memory_order_acquire);
    const bool is_written = write();
    if (is_last) return;
    futex_wait_until(overlays().word(), seen, is_written ? kForever : later_by(monotonic_now_ns(), kRetry));
  }
}

/// Whether the present state is in the file.
bool StateKeeper::write() {
  std::string problem;
  try {
    std::string text = text_of(overlays().kept(file_));
    if (text != written_) {
      write_state_file(path_, text);
      written_ = std::move(text);
    }
  } catch (const std::exception& failure) {
    problem = failure.what();
  }
  const LockGuard lock(mutex_);
  problem_ = std::move(problem);
  return problem_.empty();
}

}  // namespace mauve
