// SPDX-License-Identifier: LGPL-3.0-or-later
// The topics of an architecture, on a ROS node that someone else made; no interpreter on the way.
#pragma once

#include <memory>
#include <mutex>
#include <vector>

#include "mauve_rt/architecture.hpp"

#include "topics.hpp"

namespace mauve::bridge {

/// What is known of a bound topic from outside.
struct TopicReport {
  std::string resource;
  std::string topic;  // expanded and remapped
  TopicCounts counts;
  TopicTroubles troubles;
};

/// Opens, serves and closes topics. One thread sends, one receives, one hears of deadlines and the like.
///
/// | member              | written by               | read by               | under / order                    |
/// | ------------------- | ------------------------ | --------------------- | -------------------------------- |
/// | outgoing_,          | publish(), subscribe(),  | the sending thread,   | topics_mutex_; the receivers     |
/// | incoming_           | close()                  | reports()             | are stopped for a change         |
/// | ending_             | stop()                   | the sending thread    | release/acquire                  |
class Bridge {
 public:
  /// The node and the architecture outlive the bridge. Throws Error when rcl refuses. [non-rt]
  Bridge(rcl_node_t& node, Architecture& architecture) : node_(node), architecture_(architecture) {}
  ~Bridge();
  Bridge(const Bridge&) = delete;
  Bridge& operator=(const Bridge&) = delete;

  /// Binds a resource to a topic; returns its number in the log. [non-rt]
  /// Throws Error when the type is not installed or rcl refuses; nothing is bound then.
  std::size_t publish(const std::string& resource, const std::string& topic, const std::string& type,
                      const rmw_qos_profile_t& qos);
  /// As publish(), the other way.
  std::size_t subscribe(const std::string& resource, const std::string& topic, const std::string& type,
                        const rmw_qos_profile_t& qos);
  /// Lets messages flow, both ways. [non-rt]
  void start();
  /// Ends the flow when what was written before is sent. May be called again. [non-rt]
  void stop();
  /// stop(), and no topic is bound any more. [non-rt]
  void close();

  /// [non-rt]
  std::vector<TopicReport> reports();
  TopicLog& log() noexcept { return log_; }

 private:
  void send_all();
  void start_receivers();
  void stop_receivers();

  rcl_node_t& node_;
  Architecture& architecture_;
  TopicLog log_;
  std::mutex topics_mutex_;
  std::vector<std::unique_ptr<OutgoingTopic>> outgoing_;
  std::vector<std::unique_ptr<IncomingTopic>> incoming_;
  std::size_t topic_count_{0};
  Receiver receiver_{node_, "topics_in"};
  Receiver events_{node_, "topic_events"};  // few, so that waiting for messages stays cheap
  bool running_{false};
  std::atomic<bool> ending_{false};
  std::thread sender_;
};

}  // namespace mauve::bridge
