// SPDX-License-Identifier: LGPL-3.0-or-later
// Sends and takes large messages with rcl alone.
//   send --type image|cloud --topic NAME --period-us N [--priority 80] [--cpu 0]
//   take --type image|cloud --topic NAME --publishers N --file FILE
// Both print `ready`. The sender sends from a thread like a component's: at the line `start` it begins, at `stop` it pauses. What
// takes them is ready when it knows so many publishers; at a line it writes to the file when each was sent and taken, and prints
// `written`.
#include <rosidl_runtime_c/primitives_sequence_functions.h>
#include <sensor_msgs/msg/image.h>
#include <sensor_msgs/msg/point_cloud2.h>

#include <optional>

#include "ros/bare_node.hpp"
#include "ros/large.hpp"
#include "support/options.hpp"
#include "support/realtime_thread.hpp"

namespace {

struct Image {
  using Message = sensor_msgs__msg__Image;
  static constexpr std::size_t kBytes = bench::kImageBytes;
  static constexpr auto kInit = sensor_msgs__msg__Image__init;
  static const rosidl_message_type_support_t* type() {
    return ROSIDL_GET_MSG_TYPE_SUPPORT(sensor_msgs, msg, Image);
  }
};
struct Cloud {
  using Message = sensor_msgs__msg__PointCloud2;
  static constexpr std::size_t kBytes = bench::kCloudBytes;
  static constexpr auto kInit = sensor_msgs__msg__PointCloud2__init;
  static const rosidl_message_type_support_t* type() {
    return ROSIDL_GET_MSG_TYPE_SUPPORT(sensor_msgs, msg, PointCloud2);
  }
};

/// With memory for its contents.
template <typename Kind>
typename Kind::Message made() {
  typename Kind::Message message;
  if (!Kind::kInit(&message) || !rosidl_runtime_c__uint8__Sequence__init(&message.data, Kind::kBytes))
    throw std::runtime_error("no memory for the message");
  return message;
}

template <typename Kind>
void send(const bench::Options& options) {
  bench::BareNode node("bare_sender", "/");
  rcl_publisher_t publisher = rcl_get_zero_initialized_publisher();
  const rcl_publisher_options_t reliable = rcl_publisher_get_default_options();
  bench::check(rcl_publisher_init(&publisher, &node.get(), Kind::type(),
                                  options.text("topic", "/large").c_str(), &reliable),
               "rcl_publisher_init");
  typename Kind::Message message = made<Kind>();
  std::atomic<bool> stopping{false};
  std::optional<bench::RealtimeThread> loop;
  const mauve::time_ns_t period = options.number("period-us", 10'000) * 1000;
  bench::say("ready");
  for (std::string line; std::getline(std::cin, line);) {
    stopping = true;
    loop.reset();
    stopping = false;
    if (line != "start") continue;
    loop.emplace(options.priority(), options.cpu(), [&] {
      std::uint8_t pattern = 0;
      for (mauve::time_ns_t next = mauve::monotonic_now_ns() + period; !stopping; next += period) {
        bench::sleep_until(next);
        bench::fill(message.header.stamp, message.data.data, Kind::kBytes, ++pattern);
        if (rcl_publish(&publisher, &message, nullptr) != RCL_RET_OK) rcl_reset_error();
      }
    });
  }
}

template <typename Kind>
void take(const bench::Options& options) {
  bench::BareNode node("bare_taker", "/");
  rcl_subscription_t subscription = rcl_get_zero_initialized_subscription();
  const rcl_subscription_options_t reliable = rcl_subscription_get_default_options();
  bench::check(rcl_subscription_init(&subscription, &node.get(), Kind::type(),
                                     options.text("topic", "/large").c_str(), &reliable),
               "rcl_subscription_init");
  rcl_wait_set_t set = rcl_get_zero_initialized_wait_set();
  bench::check(rcl_wait_set_init(&set, 1, 0, 0, 0, 0, 0, &node.context(), rcl_get_default_allocator()),
               "rcl_wait_set_init");
  typename Kind::Message message = made<Kind>();
  bench::Arrivals arrivals;
  const std::atomic<bool>& ending = bench::ending_by_a_line();
  bench::await_publishers(subscription, static_cast<std::size_t>(options.number("publishers", 1)));
  bench::say("ready");
  while (!ending) {
    bench::check(rcl_wait_set_clear(&set), "rcl_wait_set_clear");
    bench::check(rcl_wait_set_add_subscription(&set, &subscription, nullptr), "rcl_wait_set_add");
    const rcl_ret_t outcome = rcl_wait(&set, mauve::ms_to_ns(100));
    if (outcome == RCL_RET_TIMEOUT) continue;
    bench::check(outcome, "rcl_wait");
    while (rcl_take(&subscription, &message, nullptr, nullptr) == RCL_RET_OK)
      arrivals.add(message.header.stamp, message.data.data, message.data.size, Kind::kBytes);
    rcl_reset_error();  // nothing left, which is no error
  }
  arrivals.write(options.text("file", "/dev/null"));
  bench::say("written");
}

bool is_image(const bench::Options& options) { return options.text("type", "image") == "image"; }

}  // namespace

extern "C" int bench_send(int count, char** words) {
  return bench::run_program(count, words, [](const bench::Options& options) {
    is_image(options) ? send<Image>(options) : send<Cloud>(options);
  });
}

extern "C" int bench_take(int count, char** words) {
  return bench::run_program(count, words, [](const bench::Options& options) {
    is_image(options) ? take<Image>(options) : take<Cloud>(options);
  });
}
