// SPDX-License-Identifier: LGPL-3.0-or-later
// What all bindings of a resource to ROS are: opened on a name, then attached to the resource that they serve.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "mauve_rt/base/contract.hpp"
#include "mauve_rt/base/seam/atomic.hpp"
#include "mauve_rt/data/action_server.hpp"
#include "mauve_rt/data/client.hpp"
#include "mauve_rt/data/resource.hpp"

#include "receiver.hpp"
#include "topic_events.hpp"

namespace mauve::bridge {

/// How a topic fared, or an offered service. Counts of messages.
struct TrafficCounts {
  std::uint64_t passed{0};   // sent, or received and written
  std::uint64_t refused{0};  // by rcl, or by the resource: full, malformed, larger than it declares
};

/// The counts while one thread counts and others look.
///
/// | member            | written by       | order                                     |
/// | ----------------- | ---------------- | ----------------------------------------- |
/// | passed_, refused_ | the one thread   | relaxed: figures that nothing depends on  |
class TrafficCounter {
 public:
  void count(bool passed) noexcept {
    Atomic<std::uint64_t>& counter = passed ? passed_ : refused_;
    counter.store(counter.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
  }
  TrafficCounts counts() const noexcept {
    return {.passed = passed_.load(std::memory_order_relaxed),
            .refused = refused_.load(std::memory_order_relaxed)};
  }

 private:
  Atomic<std::uint64_t> passed_{0};
  Atomic<std::uint64_t> refused_{0};
};

/// What is known of a bound topic from outside.
struct TopicReport {
  std::string resource;
  std::string topic;  // expanded and remapped
  TrafficCounts counts;
  TopicTroubles troubles;
  std::string refusal;  // why the resource refused a message lately; empty: none
};

/// What is known of a ROS service that a resource calls, or offers: then only answered and other count.
struct CallReport {
  std::string resource;
  std::string service;  // expanded and remapped
  bool is_offered;
  CallCounts counts;
};

/// What is known of a ROS action that a resource serves, or whose server it calls.
struct ActionReport {
  std::string resource;
  std::string action;  // expanded and remapped
  bool is_offered;
  ActionCounts counts;
};

struct BridgeReport {
  std::vector<TopicReport> topics;
  std::vector<CallReport> calls;
  std::vector<ActionReport> actions;
};

/// Which receiver's thread takes what arrives: calls wait for nobody's messages, nor the other way round.
enum class Lane { messages, requests, events };

/// What rules listen for at a resource: what can be read, or what the link brings, which may have to wait to be written.
enum class Silence { none, of_writes, of_link };

/// An rcl entity and the resource behind it. Used by one thread at a time, or as its parts say.
class Binding {
 public:
  explicit Binding(std::string resource_name) : resource_name_(std::move(resource_name)) {}
  virtual ~Binding() = default;
  Binding(const Binding&) = delete;
  Binding& operator=(const Binding&) = delete;

  const std::string& resource_name() const noexcept { return resource_name_; }
  /// Whether it serves a resource; nothing is sent or taken before. [non-rt]
  bool is_attached() const noexcept { return resource_ != nullptr; }
  /// Serves the resource from now on, and keeps it alive. [non-rt] Throws Error when it is none to serve.
  virtual void attach(std::shared_ptr<Resource> resource) {
    MAUVE_EXPECTS(resource != nullptr);
    resource_ = std::move(resource);
  }
  /// Sends one thing that its resource has for the outside, the oldest; true when there may be more. [non-rt]
  virtual bool send() { return false; }
  /// What send_stops() returns while it has more to send.
  static constexpr time_ns_t kAtOnce = 0;
  /// Sends one thing, the oldest, if a stop has written since all was sent; else a copy of a stop's output that is due.
  /// Returns when to call it again. Unless it `may_wait`, it does nothing while another thread sends here. [non-rt]
  /// In parallel with send().
  virtual time_ns_t send_stops(bool /*may_wait*/) { return kForever; }
  /// When the sending thread is to call send() at the latest, though nothing was written. [non-rt]
  virtual time_ns_t next_look_ns() const { return kForever; }
  /// It carries nothing from now on but what it sends; what waits for the outside ends. [non-rt]
  virtual void end() {}
  /// What its receivers wait for. [non-rt]
  virtual std::vector<Arrival*> arrivals(Lane /*lane*/) { return {}; }
  /// Whose silence rules listen for: it reports that nothing waits to be written, and of a link arrivals as early as it can.
  /// Its receivers are stopped. [non-rt] Throws Error when rcl refuses.
  virtual void listen_for_silence(Silence /*of*/) {}
  virtual void report(BridgeReport& report) const = 0;

 protected:
  Resource& resource() const {
    MAUVE_EXPECTS(is_attached());
    return *resource_;
  }

 private:
  std::string resource_name_;
  std::shared_ptr<Resource> resource_;
};

}  // namespace mauve::bridge
