// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/base/realtime.hpp"

#include <fcntl.h>
#include <linux/capability.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <cstring>

#include "mauve_rt/base/error.hpp"
#include "mauve_rt/base/seam/thread.hpp"

namespace mauve {

namespace {

bool has_capability(unsigned capability) noexcept {
  __user_cap_header_struct header{.version = _LINUX_CAPABILITY_VERSION_3, .pid = 0};
  __user_cap_data_struct data[2]{};
  if (syscall(SYS_capget, &header, data) != 0) return false;
  return (data[capability / 32].effective >> (capability % 32) & 1U) != 0;
}

std::string limit_text(rlim_t limit) { return limit == RLIM_INFINITY ? "unlimited" : std::to_string(limit); }

}  // namespace

void RealtimeStatus::deny(std::string line) {
  granted = false;
  missing.push_back(std::move(line));
}

RealtimeProcess::~RealtimeProcess() {
  if (latency_fd_ >= 0) close(latency_fd_);
  if (locked_) munlockall();
}

void RealtimeProcess::acquire(int priority, bool require) {
  if (acquired_) return;
  acquired_ = true;
  check_fifo(priority);
  lock_memory();
  hold_cpu_latency();
  if (require && !status_.granted) {
    throw Error(ErrorCode::realtime_denied,
                "real time is required and was not granted: " + join(status_.missing),
                {.remedy = "grant the rights, or do not require real time"});
  }
}

/// A thread that tries: limits, capabilities and cgroups all have their say, and only the attempt tells.
void RealtimeProcess::check_fifo(int priority) {
  Thread thread;
  const ThreadSettings settings{.name = "trial", .priority = priority, .require_realtime = true};
  if (thread.start(settings, [](void*) -> void* { return nullptr; }, nullptr) == 0) return thread.join();
  rlimit limit{};
  getrlimit(RLIMIT_RTPRIO, &limit);
  if (limit.rlim_cur >= static_cast<rlim_t>(priority) || has_capability(CAP_SYS_NICE)) {
    status_.deny(
        "SCHED_FIFO priority " + std::to_string(priority) +
        " (this account has the right; the cgroup has no real-time CPU time, or the container forbids "
        "SCHED_FIFO): components run as SCHED_OTHER and can be late by milliseconds; to grant it start "
        "the container with --cpu-rt-runtime=950000 --cap-add=SYS_NICE, or leave the cgroup");
    return;
  }
  status_.deny("SCHED_FIFO priority " + std::to_string(priority) + " (the rtprio limit is " +
               limit_text(limit.rlim_cur) +
               "): components run as SCHED_OTHER and can be late by milliseconds; to grant it add the line "
               "'@realtime - rtprio 98' to /etc/security/limits.d/mauve.conf, add the user to group "
               "realtime, log in again");
}

void RealtimeProcess::lock_memory() {
  rlimit limit{};
  getrlimit(RLIMIT_MEMLOCK, &limit);
  // Under a finite limit MCL_FUTURE would make later allocations fail; better not to lock at all.
  const bool allowed = limit.rlim_cur == RLIM_INFINITY || has_capability(CAP_IPC_LOCK);
  locked_ = allowed && mlockall(MCL_CURRENT | MCL_FUTURE | MCL_ONFAULT) == 0;
  if (locked_) return;
  status_.deny("locked memory (the memlock limit is " + limit_text(limit.rlim_cur) +
               " bytes): page faults can delay components; to grant it add the line '@realtime - memlock "
               "unlimited' to "
               "/etc/security/limits.d/mauve.conf, add the user to group realtime, log in again");
}

void RealtimeProcess::hold_cpu_latency() {
  const char* const path = "/dev/cpu_dma_latency";
  latency_fd_ = open(path, O_WRONLY | O_CLOEXEC);
  const std::int32_t no_latency = 0;
  if (latency_fd_ >= 0 && write(latency_fd_, &no_latency, sizeof(no_latency)) == sizeof(no_latency)) return;
  const std::string reason = std::strerror(errno);
  if (latency_fd_ >= 0) close(latency_fd_);
  latency_fd_ = -1;
  status_.deny(
      std::string(path) + " (" + reason +
      "): deep idle states can double the wake-up latency; to grant it add the udev rule "
      "'KERNEL==\"cpu_dma_latency\", GROUP=\"realtime\", MODE=\"0660\"' and add the user to group realtime");
}

}  // namespace mauve
