// SPDX-License-Identifier: LGPL-3.0-or-later
// Takes stamped points with rcl alone, and remembers when.
//   subscribe [--topics 1] [--namespace /bench] [--publishers 1] [--capacity 1000000] --file FILE
// Prints `ready` when it knows so many publishers of each topic. At a line on the standard input it writes what it
// took to the file, as 64 bit integers (topic, number, instant sent, instant taken), and prints `written`.
#include "mauve_rt/base/time.hpp"

#include "ros/bare_node.hpp"
#include "ros/stamp.hpp"
#include "support/options.hpp"
#include "support/records.hpp"

namespace {

struct Taken {
  std::int64_t topic;
  std::int64_t number;
  mauve::time_ns_t sent_ns;
  mauve::time_ns_t taken_ns;
};

class BareSubscriber {
 public:
  explicit BareSubscriber(const bench::Options& options)
      : node_("bare_subscriber", options.text("namespace", "/bench")) {
    taken_.resize(static_cast<std::size_t>(options.number("capacity", 1'000'000)));  // pages touched
    subscriptions_.resize(static_cast<std::size_t>(options.number("topics", 1)),
                          rcl_get_zero_initialized_subscription());
    const rcl_subscription_options_t reliable = rcl_subscription_get_default_options();
    for (std::size_t i = 0; i < subscriptions_.size(); ++i) {
      bench::check(rcl_subscription_init(&subscriptions_[i], &node_.get(), bench::point_type(),
                                         bench::topic_name(i).c_str(), &reliable),
                   "rcl_subscription_init");
    }
    bench::check(rcl_wait_set_init(&set_, subscriptions_.size(), 0, 0, 0, 0, 0, &node_.context(),
                                   rcl_get_default_allocator()),
                 "rcl_wait_set_init");
  }

  void await_publishers(std::size_t wanted) {
    for (const rcl_subscription_t& subscription : subscriptions_)
      bench::await_publishers(subscription, wanted);
  }

  /// Takes what comes until told to end.
  void run(const std::atomic<bool>& ending) {
    bench::take_until(ending, set_, subscriptions_, [this](std::size_t topic) { take(topic); });
  }

  void write(const std::string& name) const {
    bench::write_records(name, std::span<const Taken>(taken_.data(), count_));
  }

 private:
  void take(std::size_t topic) {
    bench::PointMessage point{};
    while (rcl_take(&subscriptions_[topic], &point, nullptr, nullptr) == RCL_RET_OK) {
      const mauve::time_ns_t now = mauve::monotonic_now_ns();
      if (count_ == taken_.size()) throw std::runtime_error("more messages than --capacity");
      taken_[count_++] = {.topic = static_cast<std::int64_t>(topic),
                          .number = static_cast<std::int64_t>(point.z),
                          .sent_ns = bench::instant_of(point),
                          .taken_ns = now};
    }
    rcl_reset_error();  // nothing left, which is no error
  }

  bench::BareNode node_;
  std::vector<rcl_subscription_t> subscriptions_;
  rcl_wait_set_t set_ = rcl_get_zero_initialized_wait_set();
  std::vector<Taken> taken_;
  std::size_t count_{0};
};

}  // namespace

extern "C" int bench_subscribe(int count, char** words) {
  return bench::run_program(count, words, [](const bench::Options& options) {
    BareSubscriber subscriber(options);
    subscriber.await_publishers(static_cast<std::size_t>(options.number("publishers", 1)));
    bench::say("ready");
    subscriber.run(bench::ending_by_a_line());
    subscriber.write(options.text("file", "/dev/null"));
    bench::say("written");
  });
}
