// SPDX-License-Identifier: LGPL-3.0-or-later
// The topics, services and actions of an architecture, on a ROS node that someone else made; no interpreter on the way.
#pragma once

#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "mauve_rt/architecture/architecture.hpp"
#include "mauve_rt/base/pi_mutex.hpp"
#include "mauve_rt/base/seam/atomic.hpp"

#include "calls.hpp"
#include "mirror.hpp"
#include "thread.hpp"
#include "topics.hpp"

namespace mauve::bridge {

/// Opens, serves and closes bindings. One thread sends, one sends the outputs of stops before all others, one takes messages
/// and answers, one takes requests, one receives events such as missed deadlines.
///
/// | member      | written by                   | read by                        | under / order                    |
/// | ----------- | ---------------------------- | ------------------------------ | -------------------------------- |
/// | bindings_   | publish() ... close()        | the sending thread, report()   | mutex_; receivers are stopped    |
/// | stoppable_  | attach(), close()            | who sends the outputs of stops | stops_mutex_, after mutex_       |
/// | stops_sent_ | send_stops()                 | the sending thread             | stops_mutex_; relaxed: only says whether to take it |
/// | ending_     | stop()                       | the sending thread             | release/acquire                  |
/// | stops_ending_ | stop()                     | the thread that sends outputs of stops | release/acquire          |
/// | the others  | one ordinary thread at a time, which the caller sees to      | -                                |
class Bridge {
 public:
  /// The node and the architecture outlive the bridge. Throws Error when rcl refuses. [non-rt]
  /// The sending thread is real-time: an ordinary one of a busy machine comes when the newest value is replaced already.
  /// Outputs of stops have a priority that is higher by one.
  Bridge(rcl_node_t& node, Architecture& architecture, ThreadPlace sender = {})
      : node_(node), architecture_(architecture), sender_place_(std::move(sender)) {}
  ~Bridge();
  Bridge(const Bridge&) = delete;
  Bridge& operator=(const Bridge&) = delete;

  // Each opens a binding under a number of its own, which the log uses too. Others may find it on the network, but
  // nothing flows before attach(). [non-rt] Throws Error when the type is not installed or rcl refuses.

  std::size_t publish(const TopicSettings& settings);
  std::size_t subscribe(const TopicSettings& settings);
  /// The value is polled, and published when it is a new one: on a topic, and for Values on another one with `/names`.
  std::size_t mirror(const TopicSettings& topic, const MirrorSettings& settings);
  /// A client's calls go to a ROS service.
  std::size_t call(const CallSettings& settings);
  /// A resource's call is a ROS service.
  std::size_t offer(const CallSettings& settings, const std::string& offered);
  /// A binding that is made already.
  std::size_t open(std::unique_ptr<Binding> binding);

  /// These serve the resources of their names from now on. [non-rt] Throws Error when one is none to serve.
  void attach(const std::vector<std::size_t>& numbers);
  /// Rules listen for the silence of these resources, and of the links that those are bound to, and of no others. [non-rt]
  /// Throws Error when rcl refuses.
  void listen_for_silence(std::set<std::string> resources, std::set<std::string> links);
  /// These end when what was written before is sent, with copies of the outputs of stops. [non-rt]
  void close(const std::vector<std::size_t>& numbers);

  /// Lets messages and calls flow, both ways. [non-rt]
  void start();
  /// Ends the flow when what was written before is sent, with copies of the outputs of stops (up to 200 ms). May be called
  /// again. [non-rt]
  void stop();
  /// stop(), and all bindings end. [non-rt]
  void close();

  /// [non-rt]
  BridgeReport report();
  TopicLog& log() noexcept { return log_; }
  rcl_node_t& node() noexcept { return node_; }

 private:
  template <typename Kind, typename... Args>
  std::size_t open(const Args&... args);
  Silence silence_of(const Binding& binding) const;
  bool send_some();
  bool has_stops() noexcept;
  time_ns_t send_stops();
  void list_stoppable() MAUVE_REQUIRES(stops_mutex_);
  time_ns_t next_look_ns();
  void send_all();
  void send_all_stops();
  void start_receivers();
  void stop_receivers();

  rcl_node_t& node_;
  Architecture& architecture_;
  ThreadPlace sender_place_;
  TopicLog log_;
  PiMutex mutex_;
  std::map<std::size_t, std::unique_ptr<Binding>> bindings_;
  PiMutex stops_mutex_;  // never held while anything else is sent
  std::vector<Binding*> stoppable_ MAUVE_GUARDED_BY(stops_mutex_);
  Atomic<std::uint32_t> stops_sent_{0};  // the word of the architecture's stops(), as far as they are sent
  std::size_t opened_{0};
  std::set<std::string> silent_;  // resources whose silence rules listen for
  std::set<std::string> links_;   // those of which they listen for the silence of the link
  Receiver messages_{node_, "topics_in"};
  Receiver requests_{node_, "requests_in"};  // the resource's own code runs here
  // Few, so that waiting for messages stays cheap. Fast DDS wakes who waits for events while a message waits to be taken.
  Receiver events_{node_, "topic_events", ms_to_ns(100)};
  bool running_{false};
  Atomic<bool> ending_{false};
  Atomic<bool> stops_ending_{false};
  WorkerThread sender_;
  WorkerThread stops_sender_;
};

}  // namespace mauve::bridge
