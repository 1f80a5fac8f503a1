// SPDX-License-Identifier: LGPL-3.0-or-later
// Writes to a file what it takes of stamped points and of clouds, serialized, with rcl alone: a recorder that only counts.
//   record [--topics 20] [--namespace /bench] [--large /bench_large] --file FILE
// Prints `ready` when it knows a publisher of each topic. At a line on the standard input it ends and prints
// `written N`: so many messages.
#include <rmw/rmw.h>
#include <sensor_msgs/msg/point_cloud2.h>

#include <cstdio>
#include <memory>

#include "ros/bare_node.hpp"
#include "support/options.hpp"

namespace {

constexpr std::size_t kDepth = 5000;       // as the executor's subscriptions
constexpr std::size_t kBuffer = 1U << 20;  // of the file: a write for each message would cost more

class BareRecorder {
 public:
  explicit BareRecorder(const bench::Options& options)
      : node_("bare_recorder", options.text("namespace", "/bench")),
        file_(std::fopen(options.text("file", "/dev/null").c_str(), "wb"), &std::fclose) {
    if (file_ == nullptr || std::setvbuf(file_.get(), nullptr, _IOFBF, kBuffer) != 0)
      throw std::runtime_error("the file cannot be written");
    const auto topics = static_cast<std::size_t>(options.number("topics", 20));
    subscriptions_.resize(topics + 1, rcl_get_zero_initialized_subscription());
    for (std::size_t i = 0; i < topics; ++i)
      subscribe(subscriptions_[i], bench::point_type(), bench::topic_name(i));
    subscribe(subscriptions_[topics], ROSIDL_GET_MSG_TYPE_SUPPORT(sensor_msgs, msg, PointCloud2),
              options.text("large", "/bench_large"));
    bench::check(rcl_wait_set_init(&set_, subscriptions_.size(), 0, 0, 0, 0, 0, &node_.context(),
                                   rcl_get_default_allocator()),
                 "rcl_wait_set_init");
    const rcutils_allocator_t allocator = rcutils_get_default_allocator();
    bench::check(rmw_serialized_message_init(&message_, 0, &allocator), "rmw_serialized_message_init");
  }

  void await_publishers() {
    for (const rcl_subscription_t& subscription : subscriptions_) bench::await_publishers(subscription, 1);
  }

  void run(const std::atomic<bool>& ending) {
    bench::take_until(ending, set_, subscriptions_,
                      [this](std::size_t number) { take(subscriptions_[number]); });
  }

  std::size_t taken() const { return taken_; }

 private:
  void subscribe(rcl_subscription_t& subscription, const rosidl_message_type_support_t* type,
                 const std::string& topic) {
    rcl_subscription_options_t options = rcl_subscription_get_default_options();
    options.qos.depth = kDepth;
    bench::check(rcl_subscription_init(&subscription, &node_.get(), type, topic.c_str(), &options),
                 "rcl_subscription_init");
  }
  void take(const rcl_subscription_t& subscription) {
    rmw_message_info_t about = rmw_get_zero_initialized_message_info();
    while (rcl_take_serialized_message(&subscription, &message_, &about, nullptr) == RCL_RET_OK) {
      if (std::fwrite(message_.buffer, 1, message_.buffer_length, file_.get()) != message_.buffer_length)
        throw std::runtime_error("the file cannot be written");
      ++taken_;
    }
    rcl_reset_error();  // nothing left, which is no error
  }

  bench::BareNode node_;
  std::unique_ptr<std::FILE, int (*)(std::FILE*)> file_;
  std::vector<rcl_subscription_t> subscriptions_;
  rcl_wait_set_t set_ = rcl_get_zero_initialized_wait_set();
  rcl_serialized_message_t message_ = rmw_get_zero_initialized_serialized_message();
  std::size_t taken_{0};
};

}  // namespace

extern "C" int bench_record(int count, char** words) {
  return bench::run_program(count, words, [](const bench::Options& options) {
    BareRecorder recorder(options);
    recorder.await_publishers();
    bench::say("ready");
    recorder.run(bench::ending_by_a_line());
    bench::say(("written " + std::to_string(recorder.taken())).c_str());
  });
}
