// SPDX-License-Identifier: LGPL-3.0-or-later
// Publishes stamped points with rcl alone, all topics once a millisecond, from a thread like a component's.
//   publish [--topics 1] [--namespace /bench] [--priority 80] [--cpu 0] [--releases 0] [--file FILE]
// Prints `ready`, then does what lines on the standard input say: start, idle (the same loop, but nothing is
// published), stop, write (the first so many nominal and actual instants, as 64 bit integers; then prints `written`).
#include <optional>

#include "mauve_rt/mauve_rt.hpp"

#include "ros/bare_node.hpp"
#include "ros/stamp.hpp"
#include "support/options.hpp"
#include "support/realtime_thread.hpp"
#include "support/records.hpp"

namespace {

class BarePublisher {
 public:
  explicit BarePublisher(const bench::Options& options)
      : priority_(options.priority()),
        cpu_(options.cpu()),
        file_(options.text("file", "/dev/null")),
        node_("bare_publisher", options.text("namespace", "/bench")),
        releases_(static_cast<std::size_t>(options.number("releases", 0))) {  // pages touched
    process_.acquire(priority_, false);  // locks memory and holds /dev/cpu_dma_latency, as an executor does
    publishers_.resize(static_cast<std::size_t>(options.number("topics", 1)),
                       rcl_get_zero_initialized_publisher());
    const rcl_publisher_options_t reliable = rcl_publisher_get_default_options();
    for (std::size_t i = 0; i < publishers_.size(); ++i) {
      bench::check(rcl_publisher_init(&publishers_[i], &node_.get(), bench::point_type(),
                                      bench::topic_name(i).c_str(), &reliable),
                   "rcl_publisher_init");
    }
  }

  void obey(const std::string& line) {
    stopping_ = true;
    loop_.reset();
    stopping_ = false;
    if (line == "start") loop_.emplace(priority_, cpu_, [this] { run(publishers_.size()); });
    if (line == "idle") loop_.emplace(priority_, cpu_, [this] { run(0); });
    if (line == "write") write();
  }

 private:
  struct Release {
    mauve::time_ns_t nominal_ns;
    mauve::time_ns_t actual_ns;
  };

  void run(std::size_t topics) {
    constexpr mauve::time_ns_t kInterval = mauve::ms_to_ns(1);
    mauve::time_ns_t next = mauve::monotonic_now_ns() + kInterval;
    while (!stopping_) {
      bench::sleep_until(next);
      const mauve::time_ns_t released = mauve::monotonic_now_ns();
      if (remembered_ < releases_.size())
        releases_[remembered_++] = {.nominal_ns = next, .actual_ns = released};
      publish(topics);
      next += kInterval;
      // What was missed is skipped, as components do.
      const mauve::time_ns_t now = mauve::monotonic_now_ns();
      if (now > next) next += (now - next + kInterval - 1) / kInterval * kInterval;
    }
  }
  void publish(std::size_t topics) {
    ++number_;
    for (std::size_t i = 0; i < topics; ++i) {
      bench::PointMessage point{};
      bench::stamp(point, mauve::monotonic_now_ns(), number_);
      if (rcl_publish(&publishers_[i], &point, nullptr) != RCL_RET_OK) rcl_reset_error();
    }
  }
  void write() const {
    bench::write_records(file_, std::span<const Release>(releases_.data(), remembered_));
    bench::say("written");
  }

  int priority_;
  int cpu_;
  std::string file_;
  bench::BareNode node_;
  mauve::RealtimeProcess process_;
  std::vector<rcl_publisher_t> publishers_;
  std::vector<Release> releases_;
  std::size_t remembered_{0};
  std::int64_t number_{0};
  std::atomic<bool> stopping_{false};
  std::optional<bench::RealtimeThread> loop_;
};

}  // namespace

extern "C" int bench_publish(int count, char** words) {
  return bench::run_program(count, words, [](const bench::Options& options) {
    BarePublisher publisher(options);
    bench::say("ready");
    for (std::string line; std::getline(std::cin, line);) publisher.obey(line);
  });
}
