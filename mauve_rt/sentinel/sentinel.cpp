// SPDX-License-Identifier: LGPL-3.0-or-later
// sentinel SOCKET PEER STATUS PRIORITY NAMESPACE NAME: publishes the safe outputs of an executor that has crashed.
//
// Native code that crashes takes its whole process with it: no thread of an executor can write outputs afterwards. This
// process has a publisher of each such output ready, which listeners have discovered long before, and publishes nothing while
// the executor lives. When the executor ends without having reported its outputs safe, this process publishes the safe messages.
//
// SOCKET is a Unix socket (SOCK_SEQPACKET) for orders and answers, PEER the process id of the executor, STATUS its
// /proc/PEER/status, PRIORITY the SCHED_FIFO priority of the thread that publishes. mauve_rt/node/executor/sentinel.py is the
// other side, and has signals blocked here: this process ends after the executor, whatever is sent to the group.
#include <fcntl.h>
#include <poll.h>
#include <pthread.h>
#include <rcl/rcl.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <climits>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <span>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "mauve_rt/base/error.hpp"
#include "mauve_rt/base/seam/sleep.hpp"
#include "mauve_rt/base/time.hpp"

#include "../bridge/src/owned.hpp"
#include "../bridge/src/qos.hpp"
#include "../bridge/src/rcl_error.hpp"
#include "../bridge/src/type_support.hpp"

namespace mauve::bridge {

namespace {

/// The first byte of each message on the socket.
enum class Order : char { outputs = 'o', unsafe = 'u', safe = 's' };

constexpr std::size_t kLargestOrder = std::size_t{1} << 20U;  // bytes; the system sends less at once
// The pidfd reports the end after the core dump, which can take seconds, and after memory is released: the status is earlier.
constexpr int kReadStatusMs = 10;
// A network loses messages for some ms; a listener and this process may be about to discover each other; and a thread of the
// executor can still be sending its last message.
constexpr int kCopies = 20;
constexpr time_ns_t kCopyEvery = ms_to_ns(10);
constexpr unsigned kLeaveS = 1;  // how long the middleware may take to leave the network

/// An output to be made safe.
struct OutputSettings {
  bool operator==(const OutputSettings&) const = default;

  rmw_qos_profile_t profile() const {
    const auto [reliability, durability, deadline_ns, lifespan_ns, liveliness, lease_ns] = qos;
    constexpr std::size_t kDepth = 1;  // all its messages are the same
    return make_qos(static_cast<int>(reliability), static_cast<int>(durability), kDepth, deadline_ns,
                    lifespan_ns, static_cast<int>(liveliness), lease_ns);
  }

  std::array<std::int64_t, 6> qos{};
  std::string topic;
  std::string type;
  std::string message;
};

/// One of the list that sentinel.py makes: numbers and words, a space after each, then the message.
std::istream& operator>>(std::istream& list, OutputSettings& output) {
  for (std::int64_t& each : output.qos) list >> each;
  std::streamsize length = 0;
  list >> output.topic >> output.type >> length;
  list.ignore();
  output.message.resize(static_cast<std::size_t>(length));
  return list.read(output.message.data(), length);
}

/// A publisher, and the message that makes its output safe.
class SafeOutput {
 public:
  /// Throws Error when the type is not installed or rcl refuses.
  SafeOutput(rcl_node_t& node, OutputSettings settings)
      : settings_(std::move(settings)), publisher_(node, rcl_get_zero_initialized_publisher()) {
    rcl_publisher_options_t options = rcl_publisher_get_default_options();
    options.qos = settings_.profile();
    check(rcl_publisher_init(publisher_.get(), &node, &message_type_support(settings_.type),
                             settings_.topic.c_str(), &options),
          "the safe output cannot be published", "topic " + settings_.topic);
  }

  const OutputSettings& settings() const noexcept { return settings_; }
  std::size_t subscribers() const {
    std::size_t count = 0;
    static_cast<void>(went_well(rcl_publisher_get_subscription_count(publisher_.get(), &count)));
    return count;
  }
  void publish() {
    const rcl_serialized_message_t serialized{
        .buffer = reinterpret_cast<std::uint8_t*>(settings_.message.data()),
        .buffer_length = settings_.message.size(),
        .buffer_capacity = settings_.message.size(),
        .allocator = rcl_get_default_allocator()};
    static_cast<void>(went_well(rcl_publish_serialized_message(publisher_.get(), &serialized, nullptr)));
  }

 private:
  OutputSettings settings_;
  Owned<rcl_publisher_t, rcl_publisher_fini> publisher_;
};

/// The ROS side: a context, a node, publishers.
class Outputs {
 public:
  /// Throws Error when rcl refuses.
  Outputs(const char* name_space, const char* name) {
    rcl_init_options_t options = rcl_get_zero_initialized_init_options();
    check(rcl_init_options_init(&options, rcl_get_default_allocator()), "ROS cannot start", "sentinel");
    const rcl_ret_t started = rcl_init(0, nullptr, &options, &context_);
    static_cast<void>(went_well(rcl_init_options_fini(&options)));
    check(started, "ROS cannot start", "sentinel");
    rcl_node_options_t of_node = rcl_node_get_default_options();
    of_node.enable_rosout = false;
    check(rcl_node_init(&node_, name, name_space, &context_, &of_node), "the node cannot be made",
          std::string("node ") + name);
  }
  ~Outputs() {
    all_.clear();
    static_cast<void>(went_well(rcl_node_fini(&node_)));
    static_cast<void>(went_well(rcl_shutdown(&context_)));
    static_cast<void>(went_well(rcl_context_fini(&context_)));
  }
  Outputs(const Outputs&) = delete;
  Outputs& operator=(const Outputs&) = delete;

  /// These from now on; a publisher of the same settings stays. Returns why some are missing; empty: none is.
  std::string replace(std::istringstream list) {
    std::string missing;
    std::vector<std::unique_ptr<SafeOutput>> fresh;
    for (OutputSettings output; list >> output;) {
      try {
        fresh.push_back(find_or_make(output));
      } catch (const Error& error) {
        missing += (missing.empty() ? "" : "; ") + std::string(error.what());
      }
    }
    all_ = std::move(fresh);
    return missing;
  }

  /// How many would receive the safe outputs now.
  std::size_t subscribers() const {
    std::size_t count = 0;
    for (const auto& output : all_) count += output->subscribers();
    return count;
  }
  void publish() {
    for (int copy = 0; copy < kCopies; ++copy) {
      for (const auto& output : all_) output->publish();
      sleep_for(kCopyEvery);
    }
  }

 private:
  std::unique_ptr<SafeOutput> find_or_make(const OutputSettings& settings) {
    for (auto& output : all_) {
      if (output != nullptr && output->settings() == settings) return std::move(output);
    }
    return std::make_unique<SafeOutput>(node_, settings);
  }

  rcl_context_t context_{rcl_get_zero_initialized_context()};
  rcl_node_t node_{rcl_get_zero_initialized_node()};
  std::vector<std::unique_ptr<SafeOutput>> all_;
};

/// The executor, as this process sees it.
class Peer {
 public:
  /// Throws std::runtime_error when it has ended already.
  Peer(int socket, pid_t process, const char* status)
      : socket_(socket),
        pidfd_(static_cast<int>(syscall(SYS_pidfd_open, process, 0))),
        status_(open(status, O_RDONLY | O_CLOEXEC)) {
    if (pidfd_ < 0 || status_ < 0 || getppid() != process) throw std::runtime_error("the executor has ended");
  }

  /// Waits until there is something to receive, or the executor has ended; `in_ms` at most, -1: for ever.
  void wait(int in_ms) {
    std::array<pollfd, 2> all{pollfd{.fd = pidfd_, .events = POLLIN, .revents = 0},
                              pollfd{.fd = is_closed_ ? -1 : socket_, .events = POLLIN, .revents = 0}};
    if (poll(all.data(), all.size(), in_ms) > 0) has_ended_ = all[0].revents != 0;
  }
  bool has_ended() const noexcept { return has_ended_; }
  /// Its socket is closed: it sends no more orders.
  bool is_closed() const noexcept { return is_closed_; }
  /// Whether it ends: its core is being dumped, SIGKILL waits for its first thread, or that thread has released its memory.
  bool is_ending() const {
    std::array<char, 4096> text{};
    if (pread(status_, text.data(), text.size() - 1, 0) <= 0) return false;  // the pidfd shows the end
    if (std::strstr(text.data(), "\nCoreDumping:\t1") != nullptr) return true;
    constexpr const char* kPending = "\nSigPnd:\t";
    const char* const pending = std::strstr(text.data(), kPending);
    // The next line is there, too: else the text is longer than this buffer, and what is not in it may still follow.
    if (pending == nullptr || std::strstr(pending, "\nShdPnd:") == nullptr) return false;
    constexpr std::uint64_t kKill = 0x100;  // SIGKILL is 9, and 1 is the lowest bit
    return (std::strtoull(pending + std::strlen(kPending), nullptr, 16) & kKill) != 0 ||
           std::strstr(text.data(), "\nVmSize:") == nullptr;
  }
  /// The next order; empty: none is there now.
  std::string receive() {
    const ssize_t length = recv(socket_, order_.data(), order_.size(), MSG_DONTWAIT);
    is_closed_ = length == 0 || (length < 0 && errno != EAGAIN && errno != EINTR);
    return {order_.data(), static_cast<std::size_t>(std::max(length, ssize_t{0}))};
  }
  void answer(const std::string& text) const {
    static_cast<void>(send(socket_, text.data(), text.size(), MSG_NOSIGNAL | MSG_DONTWAIT));
  }

 private:
  int socket_;
  int pidfd_;
  int status_;
  bool has_ended_{false};
  bool is_closed_{false};
  std::vector<char> order_{std::vector<char>(kLargestOrder)};
};

/// Returns when the executor has ended, or needs no sentinel any longer; true: its outputs are not safe.
bool watch(Peer& peer, Outputs& outputs) {
  std::size_t reported = 0;
  for (bool is_safe = true;;) {
    peer.wait(is_safe ? -1 : kReadStatusMs);
    const bool is_gone = peer.has_ended() || (!is_safe && peer.is_ending());
    for (std::string order; !(order = peer.receive()).empty();) {
      if (static_cast<Order>(order[0]) != Order::outputs) {
        is_safe = static_cast<Order>(order[0]) == Order::safe;
      } else if (!is_gone) {  // else listeners would not discover them in time
        const std::string problem = outputs.replace(std::istringstream(order.substr(1)));
        peer.answer(problem.empty() ? "ready" : problem);
      }
    }
    if (is_gone || (is_safe && peer.is_closed())) return !is_safe;
    if (const std::size_t subscribers = outputs.subscribers(); subscribers != reported) {
      reported = subscribers;
      peer.answer(std::to_string(subscribers));
    }
  }
}

/// Memory and priority, as far as the system grants them.
void become_real_time(int priority) {
  rlimit limit{};
  getrlimit(RLIMIT_MEMLOCK, &limit);
  // Under a finite limit MCL_FUTURE would make later allocations fail.
  if (limit.rlim_cur == RLIM_INFINITY || geteuid() == 0)
    static_cast<void>(mlockall(MCL_CURRENT | MCL_FUTURE | MCL_ONFAULT));
  const sched_param urgency{.sched_priority = std::min(priority, sched_get_priority_max(SCHED_FIFO))};
  static_cast<void>(pthread_setschedparam(pthread_self(), SCHED_FIFO, &urgency));
}

/// Ends this process soon, in order or by SIGALRM: where a participant is destroyed while it discovers another, Fast DDS can spin
/// for ever.
void limit_end() {
  const sched_param ordinary{};
  static_cast<void>(pthread_setschedparam(pthread_self(), SCHED_OTHER, &ordinary));
  alarm(kLeaveS);
}

int run(std::span<char* const> arguments) {
  if (arguments.size() != 7) return EXIT_FAILURE;
  const int socket = STDERR_FILENO + 1;
  try {
    dup2(std::stoi(arguments[1]), socket);
    // Also the sockets of the executor's middleware: they are to close with the executor.
    close_range(socket + 1, UINT_MAX, 0);
    Peer peer(socket, std::stoi(arguments[2]), arguments[3]);
    try {
      Outputs outputs(arguments[5], arguments[6]);
      // Afterwards: the middleware looks for a profile in the executor's folder.
      static_cast<void>(chdir("/"));
      become_real_time(std::stoi(arguments[4]));
      if (watch(peer, outputs)) outputs.publish();
      limit_end();
      return EXIT_SUCCESS;
    } catch (const std::exception& error) {
      peer.answer(error.what());
    }
  } catch (const std::exception&) {  // nothing is left to be watched
  }
  return EXIT_FAILURE;
}

}  // namespace

}  // namespace mauve::bridge

// rcl as PyPI has it loads libraries of Python's message classes without Python's own. Their data must exist for them to be
// loaded; nothing here reads it.
extern "C" {
[[gnu::weak]] void* PyExc_RuntimeError = nullptr;
[[gnu::weak]] void* _Py_TrueStruct = nullptr;  // NOLINT(bugprone-reserved-identifier)
}

int main(int count, char** arguments) {
  return mauve::bridge::run({arguments, static_cast<std::size_t>(count)});
}
