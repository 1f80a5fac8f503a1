// SPDX-License-Identifier: LGPL-3.0-or-later
#include "node_watch.hpp"

#include <rcutils/logging_macros.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <cstring>

#include "thread.hpp"

namespace mauve::bridge {

namespace {

constexpr time_ns_t kBetweenLooks = ms_to_ns(200);
/// A look so late: the process itself stood still, and the node with it.
constexpr time_ns_t kStoodStill = s_to_ns(1);

/// Of the environment; 0: it is not there, or no number.
std::int64_t number_of(const char* variable) {
  const char* const text = std::getenv(variable);
  return text == nullptr ? 0 : std::strtoll(text, nullptr, 10);
}

/// WATCHDOG_USEC, unless it is another process's.
time_ns_t watchdog_period() {
  const std::int64_t process = number_of("WATCHDOG_PID");
  if (process != 0 && process != getpid()) return 0;
  return std::max<time_ns_t>(0, us_to_ns(number_of("WATCHDOG_USEC")));
}

}  // namespace

NodeWatch::NodeWatch(std::string logger, time_ns_t silent_after_ns)
    : logger_(std::move(logger)),
      silent_after_ns_(silent_after_ns),
      watchdog_ns_(watchdog_period()),
      beat_ns_(monotonic_now_ns()) {
  thread_ = start_thread("node watch", [this] { watch(); });
}

void NodeWatch::stop() noexcept {
  {
    const std::lock_guard lock(mutex_);
    is_ending_ = true;
  }
  end_.notify_all();
  if (thread_.joinable()) thread_.join();
}

void NodeWatch::watch() {
  std::unique_lock lock(mutex_);
  time_ns_t looked_ns = monotonic_now_ns();
  while (!end_.wait_for(lock, std::chrono::nanoseconds(kBetweenLooks), [this] { return is_ending_; })) {
    const time_ns_t now = monotonic_now_ns();
    if (now - looked_ns > kStoodStill) beat();
    looked_ns = now;
    look(now);
  }
}

void NodeWatch::look(time_ns_t now_ns) {
  const time_ns_t silent_ns = now_ns - beat_ns_.load(std::memory_order_relaxed);
  const bool is_silent = silent_ns > silent_after_ns_;
  if (is_silent && !is_silent_) {
    RCUTILS_LOG_ERROR_NAMED(
        logger_.c_str(),
        "node: Python has been silent for %.1f s: requests are not answered; components run on",
        static_cast<double>(silent_ns) * 1e-9);
  } else if (!is_silent && is_silent_) {
    RCUTILS_LOG_WARN_NAMED(logger_.c_str(), "node: Python works again");
  }
  is_silent_ = is_silent;
  if (watchdog_ns_ == 0 || is_silent || now_ns - notified_ns_ < watchdog_ns_ / 2 - kBetweenLooks) return;
  notify("WATCHDOG=1");
  notified_ns_ = now_ns;
}

void NodeWatch::notify(const std::string& state) noexcept {
  const char* const path = std::getenv("NOTIFY_SOCKET");
  sockaddr_un address{.sun_family = AF_UNIX, .sun_path = {}};
  if (path == nullptr || std::strlen(path) >= sizeof(address.sun_path)) return;
  std::memcpy(address.sun_path, path, std::strlen(path));
  if (path[0] == '@') address.sun_path[0] = '\0';  // an abstract address
  const auto length = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + std::strlen(path));
  const int socket_fd = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (socket_fd < 0) return;
  sendto(socket_fd, state.data(), state.size(), MSG_NOSIGNAL, reinterpret_cast<const sockaddr*>(&address),
         length);  // a manager that does not listen is not waited for
  close(socket_fd);
}

}  // namespace mauve::bridge
