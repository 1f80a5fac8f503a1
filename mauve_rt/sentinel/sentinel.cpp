// SPDX-License-Identifier: LGPL-3.0-or-later
// sentinel SOCKET PEER STATUS PRIORITY NAMESPACE NAME: publishes the safe outputs of an executor that has crashed.
//
// Native code that crashes takes its whole process with it: no thread of an executor can write outputs afterwards. This
// process has a publisher of each such output ready, which listeners have discovered long before, and publishes nothing while
// the executor lives. When the executor ends without having reported its outputs safe, this process publishes the safe messages.
//
// SOCKET is a Unix socket (SOCK_SEQPACKET) for orders and answers, PEER a pidfd of the executor, STATUS its /proc/PID/status,
// PRIORITY the SCHED_FIFO priority of the thread that publishes. mauve_rt/node/executor/sentinel.py is the other side, and has
// signals blocked here: this process ends after the executor, whatever is sent to the group.
#include <fcntl.h>
#include <poll.h>
#include <pthread.h>
#include <rcl/rcl.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <climits>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "mauve_rt/base/error.hpp"
#include "mauve_rt/base/seam/sleep.hpp"
#include "mauve_rt/base/time.hpp"

#include "../bridge/src/copies.hpp"
#include "../bridge/src/owned.hpp"
#include "../bridge/src/rcl_error.hpp"
#include "../bridge/src/type_support.hpp"

namespace mauve::bridge {

namespace {

/// The first byte of each message on the socket.
enum class Order : char { outputs = 'o', unsafe = 'u', safe = 's' };

// A core dump is written before the pidfd reports the end, and can take seconds: nothing else reports its begin.
constexpr int kLookForDumpMs = 10;
constexpr std::size_t kThreadStack = std::size_t{256} << 10U;  // of each thread of the middleware

/// Reads what sentinel.py packs.
class Unpacked {
 public:
  explicit Unpacked(std::span<const std::byte> bytes) : rest_(bytes) {}
  bool is_empty() const noexcept { return rest_.empty(); }
  template <typename Number>
  Number number() {
    Number read{};
    const std::span<const std::byte> bytes = take(sizeof(read));
    std::memcpy(&read, bytes.data(), sizeof(read));
    return read;
  }
  std::span<const std::byte> bytes() { return take(number<std::uint32_t>()); }
  std::string text() {
    const std::span<const std::byte> read = bytes();
    return {reinterpret_cast<const char*>(read.data()), read.size()};
  }

 private:
  /// Throws Error (invalid_argument) when it is not there.
  std::span<const std::byte> take(std::size_t length) {
    if (length > rest_.size()) throw Error(ErrorCode::invalid_argument, "the list of outputs ends too early");
    const std::span<const std::byte> taken = rest_.first(length);
    rest_ = rest_.subspan(length);
    return taken;
  }

  std::span<const std::byte> rest_;
};

rmw_time_t duration(std::int64_t ns) {
  return {.sec = static_cast<std::uint64_t>(ns / s_to_ns(1)),
          .nsec = static_cast<std::uint64_t>(ns % s_to_ns(1))};
}

/// What one output is published with.
struct OutputSettings {
  std::array<std::int64_t, 6> qos;  // reliability, durability, deadline, lifespan, liveliness, lease
  std::string topic;
  std::string type;
  bool operator==(const OutputSettings&) const = default;

  rmw_qos_profile_t profile() const {
    const auto [reliability, durability, deadline_ns, lifespan_ns, liveliness, lease_ns] = qos;
    rmw_qos_profile_t made{};
    made.history = RMW_QOS_POLICY_HISTORY_KEEP_LAST;
    made.depth = 1;  // all its messages are the same
    made.reliability = static_cast<rmw_qos_reliability_policy_t>(reliability);
    made.durability = static_cast<rmw_qos_durability_policy_t>(durability);
    made.deadline = duration(deadline_ns);
    made.lifespan = duration(lifespan_ns);
    made.liveliness = static_cast<rmw_qos_liveliness_policy_t>(liveliness);
    made.liveliness_lease_duration = duration(lease_ns);
    return made;
  }
};

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
    is_reliable_ = settings_.qos[0] == RMW_QOS_POLICY_RELIABILITY_RELIABLE;
  }

  const OutputSettings& settings() const noexcept { return settings_; }
  void set_message(std::span<const std::byte> message) { message_.assign(message.begin(), message.end()); }

  void publish() {
    const rcl_serialized_message_t serialized = borrowed(message_);
    static_cast<void>(went_well(rcl_publish_serialized_message(publisher_.get(), &serialized, nullptr)));
  }
  /// Another copy where a listener may lack the message; returns when to come again, after the first message.
  time_ns_t repeat(time_ns_t after_ns) {
    const time_ns_t due_ns = copy_after_ns(is_reliable_, copies_);
    if (after_ns < due_ns) return due_ns;
    if (is_reliable_ && went_well(rcl_publisher_wait_for_all_acked(publisher_.get(), 0))) return kForever;
    publish();
    return copy_after_ns(is_reliable_, ++copies_);
  }

 private:
  OutputSettings settings_;
  Owned<rcl_publisher_t, rcl_publisher_fini> publisher_;
  bool is_reliable_{false};
  std::vector<std::byte> message_;
  std::size_t copies_{0};
};

/// The ROS side: a context, a node, publishers.
class Outputs {
 public:
  /// Throws Error when rcl refuses.
  Outputs(const std::string& name_space, const std::string& name) {
    rcl_init_options_t options = rcl_get_zero_initialized_init_options();
    check(rcl_init_options_init(&options, rcl_get_default_allocator()), "ROS cannot start", "sentinel");
    const rcl_ret_t started = rcl_init(0, nullptr, &options, &context_);
    static_cast<void>(went_well(rcl_init_options_fini(&options)));
    check(started, "ROS cannot start", "sentinel");
    rcl_node_options_t of_node = rcl_node_get_default_options();
    of_node.enable_rosout = false;
    check(rcl_node_init(&node_, name.c_str(), name_space.c_str(), &context_, &of_node),
          "the node cannot be made", "node " + name);
  }
  ~Outputs() {
    all_.clear();
    static_cast<void>(went_well(rcl_node_fini(&node_)));
    static_cast<void>(went_well(rcl_shutdown(&context_)));
    static_cast<void>(went_well(rcl_context_fini(&context_)));
  }
  Outputs(const Outputs&) = delete;
  Outputs& operator=(const Outputs&) = delete;

  /// These from now on; a publisher that stays is the same. Returns why some are missing; empty: none is.
  std::string replace(std::span<const std::byte> packed) {
    std::string missing;
    std::vector<std::unique_ptr<SafeOutput>> fresh;
    for (Unpacked list(packed); !list.is_empty();) {
      OutputSettings settings{};
      for (std::int64_t& each : settings.qos) each = list.number<std::int64_t>();
      settings.topic = list.text();
      settings.type = list.text();
      const std::span<const std::byte> message = list.bytes();
      try {
        fresh.push_back(find_or_make(std::move(settings)));
        fresh.back()->set_message(message);
      } catch (const Error& error) {
        missing += (missing.empty() ? "" : "; ") + std::string(error.what());
      }
    }
    all_ = std::move(fresh);
    return missing;
  }

  /// Publishes all, with copies: up to 200 ms.
  void publish() {
    for (const auto& output : all_) output->publish();
    const time_ns_t began_ns = monotonic_now_ns();
    for (;;) {
      const time_ns_t after_ns = monotonic_now_ns() - began_ns;
      time_ns_t next_ns = kForever;
      for (const auto& output : all_) next_ns = std::min(next_ns, output->repeat(after_ns));
      if (next_ns == kForever) return;
      sleep_for(std::max(began_ns + next_ns - monotonic_now_ns(), time_ns_t{0}));
    }
  }

 private:
  std::unique_ptr<SafeOutput> find_or_make(OutputSettings settings) {
    for (auto& output : all_) {
      if (output != nullptr && output->settings() == settings) return std::move(output);
    }
    return std::make_unique<SafeOutput>(node_, std::move(settings));
  }

  rcl_context_t context_{rcl_get_zero_initialized_context()};
  rcl_node_t node_{rcl_get_zero_initialized_node()};
  std::vector<std::unique_ptr<SafeOutput>> all_;
};

/// A message from the executor.
struct Received {
  Order order{};
  int list{-1};  // of outputs: a file that holds it
};

/// The executor, as this process sees it.
class Peer {
 public:
  Peer(int socket, int pidfd, int status) : socket_(socket), pidfd_(pidfd), status_(status) {}

  /// Waits until there is something to receive, or the executor has ended; `in_ms` at most, -1: for ever.
  void wait(int in_ms) {
    std::array<pollfd, 2> all{pollfd{.fd = pidfd_, .events = POLLIN, .revents = 0},
                              pollfd{.fd = is_closed_ ? -1 : socket_, .events = POLLIN, .revents = 0}};
    if (poll(all.data(), all.size(), in_ms) <= 0) return;
    has_ended_ = all[0].revents != 0;
  }
  bool has_ended() const noexcept { return has_ended_; }
  /// Its socket is closed: it sends no more orders.
  bool is_closed() const noexcept { return is_closed_; }
  /// Whether its core is being dumped: none of its threads runs any more.
  bool is_dumping() const {
    std::array<char, 4096> text{};
    const ssize_t length = pread(status_, text.data(), text.size(), 0);
    if (length <= 0) return false;
    return std::string_view(text.data(), static_cast<std::size_t>(length)).find("CoreDumping:\t1") !=
           std::string_view::npos;
  }
  /// The next message; nothing: none is there now.
  std::optional<Received> receive() {
    Received received{};
    iovec data{.iov_base = &received.order, .iov_len = sizeof(received.order)};
    alignas(cmsghdr) std::array<char, CMSG_SPACE(sizeof(int))> control{};
    msghdr message{};
    message.msg_iov = &data;
    message.msg_iovlen = 1;
    message.msg_control = control.data();
    message.msg_controllen = control.size();
    ssize_t length = 0;
    do {
      length = recvmsg(socket_, &message, MSG_CMSG_CLOEXEC | MSG_DONTWAIT);
    } while (length < 0 && errno == EINTR);
    if (length < 0 && errno == EAGAIN) return {};
    if (length <= 0) {
      is_closed_ = true;
      return {};
    }
    const cmsghdr* const rights = CMSG_FIRSTHDR(&message);
    if (rights != nullptr && rights->cmsg_type == SCM_RIGHTS)
      std::memcpy(&received.list, CMSG_DATA(rights), sizeof(received.list));
    return received;
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
};

std::string replace_outputs(Outputs& outputs, int list) {
  struct stat about{};
  std::string problem = "the list of outputs cannot be read";
  if (fstat(list, &about) == 0) {
    std::vector<std::byte> packed(static_cast<std::size_t>(about.st_size));
    if (pread(list, packed.data(), packed.size(), 0) == about.st_size) problem = outputs.replace(packed);
  }
  close(list);
  return problem;
}

/// Returns when the executor has ended, or needs no sentinel any more; true: its outputs are not safe.
bool watch(Peer& peer, Outputs& outputs) {
  for (bool is_safe = true;;) {
    peer.wait(is_safe ? -1 : kLookForDumpMs);
    const bool is_gone = peer.has_ended() || (!is_safe && peer.is_dumping());
    while (const std::optional<Received> received = peer.receive()) {
      if (received->order != Order::outputs) {
        is_safe = received->order == Order::safe;
      } else if (!is_gone) {  // else listeners would not discover them in time
        const std::string problem = replace_outputs(outputs, received->list);
        peer.answer(problem.empty() ? "ready" : problem);
      }
    }
    if (is_gone || (is_safe && peer.is_closed())) return !is_safe;
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

/// Closes what the executor had inherited itself: no process is to wait for this one by mistake.
void keep_only(std::array<int, 3> kept) {
  std::sort(kept.begin(), kept.end());
  unsigned first = STDERR_FILENO + 1;
  for (const int descriptor : kept) {
    const auto number = static_cast<unsigned>(descriptor);
    if (first < number) close_range(first, number - 1, 0);
    first = std::max(first, number + 1);
  }
  close_range(first, INT_MAX, 0);
}

void limit_stacks() {
  pthread_attr_t attributes{};
  if (pthread_attr_init(&attributes) != 0) return;
  if (pthread_attr_setstacksize(&attributes, kThreadStack) == 0)
    static_cast<void>(pthread_setattr_default_np(&attributes));
  pthread_attr_destroy(&attributes);
}

bool read_number(const char* text, int& number) {
  const char* const end = text + std::strlen(text);
  return std::from_chars(text, end, number).ptr == end && text != end;
}

int run(std::span<char* const> arguments) {
  std::array<int, 4> numbers{};
  if (arguments.size() != numbers.size() + 3) return EXIT_FAILURE;
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    if (!read_number(arguments[i + 1], numbers[i])) return EXIT_FAILURE;
  }
  const auto [socket, pidfd, status, priority] = numbers;
  keep_only({socket, pidfd, status});
  limit_stacks();
  Peer peer(socket, pidfd, status);
  try {
    Outputs outputs(arguments[5], arguments[6]);
    static_cast<void>(chdir("/"));  // afterwards: the middleware looks for a profile in the executor's folder
    become_real_time(priority);
    if (watch(peer, outputs)) outputs.publish();
    return EXIT_SUCCESS;
  } catch (const std::exception& error) {
    peer.answer(error.what());
    return EXIT_FAILURE;
  }
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
