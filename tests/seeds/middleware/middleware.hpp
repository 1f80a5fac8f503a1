// SPDX-License-Identifier: LGPL-3.0-or-later
// Middleware: what is behind the simulated rcl. It delivers messages in virtual time, and loses, refuses and fails as the seed wants.
#pragma once

#include <pthread.h>

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "mauve_rt/base/seam/atomic.hpp"
#include "mauve_rt/base/time.hpp"

#include "../forked_run.hpp"
#include "../scenario/dice.hpp"
#include "simulated_rcl.h"

namespace mauve::testing {

using Bytes = std::vector<std::byte>;

/// How often the middleware fails: once in so many times; 0: never.
struct Failures {
  int publish{0};
  int blocked_publish{0};  // returns after up to 4 ms
  int take{0};             // the message is lost
  int wait{0};
  int send_request{0};
  int send_response{0};
};

/// A message that the bridge has published, or tried to, or has taken.
struct CarriedMessage {
  std::uint64_t entity;  // the publisher or subscription
  Bytes data;
  bool is_sent{true};
  std::uint64_t order{0};  // in which all messages began to be published
  std::uint64_t ended{0};  // so many had begun when this one ended
  pthread_t thread{};      // that published it
};
/// A message that waits for the bridge.
struct WaitingMessage {
  Bytes data;
  time_ns_t arrived_ns;
  std::int64_t sequence{0};  // of a request or a response
};
struct SentRequest {
  std::uint64_t client;
  std::int64_t sequence;
  Bytes data;
};
struct SentResponse {
  std::int64_t sequence;
  Bytes data;
};

/// One for each run, which is a process of its own. One thread runs at a time: no member needs a lock. The functions of rcl use it.
class Middleware {
 public:
  Middleware(std::uint64_t seed, seeds::Findings& findings);
  ~Middleware();
  Middleware(const Middleware&) = delete;
  Middleware& operator=(const Middleware&) = delete;
  static Middleware& here();

  rcl_node_t& node() noexcept { return node_; }
  Failures failures{};
  bool has_server{true};

  // ---- the network's side

  /// To each subscription of the topic. One that is full loses its oldest message.
  void deliver(const std::string& topic, const Bytes& data);
  /// To a client that is still there.
  void respond(const SentRequest& request, const Bytes& data);
  /// To the service, if there is one. Its number: whether, and which response belongs to it.
  std::int64_t request(const std::string& service, const Bytes& data);
  /// Of an event of each publisher and subscription of the topic.
  void trouble(const std::string& topic);
  /// No wait succeeds any more.
  void shut_down();

  std::map<std::string, std::vector<CarriedMessage>> published{};  // by topic
  std::map<std::string, std::vector<CarriedMessage>>
      taken{};                 // likewise, but by subscriptions that only report arrivals
  std::uint64_t publishes{0};  // that have begun
  std::vector<SentRequest> requests{};
  std::vector<SentResponse> responses{};
  std::map<std::int64_t, bool> taken_requests{};  // of services, by number; true: the response was refused

  /// When the oldest message arrived that waits for the first subscription of the topic; kForever: none waits.
  time_ns_t waits_since_ns(const std::string& topic) const;
  /// The publisher or the first subscription that the topic has now; 0: none.
  std::uint64_t entity_of(const std::string& topic) const;
  std::size_t entities() const noexcept { return entities_.size(); }

  // ---- the functions of rcl

  enum class Kind : std::uint8_t { guard, publisher, subscription, client, service, event };
  struct Entity {
    Kind kind;
    std::string name{};
    std::size_t depth{0};
    rmw_qos_profile_t qos{};
    std::uint64_t of{0};  // of an event: its publisher or subscription
    std::deque<WaitingMessage> waiting{};
    bool is_triggered{false};       // of a guard
    int news{0};                    // of an event
    std::int64_t last_sequence{0};  // of a client
    std::uint64_t uses{0};          // messages taken
    int users{0};                   // threads that use it now
  };
  std::uint64_t open(Entity entity);
  /// Of an entity in use, by one thread at a time; otherwise a finding, and nullptr.
  Entity* find(std::uint64_t number, Kind kind, const char* function);
  void close(std::uint64_t number, Kind kind);
  rcl_ret_t wait(rcl_wait_set_t& set, time_ns_t timeout_ns);
  bool fails(int once_in) { return once_in != 0 && dice_.once_in(once_in); }
  bool is_shut_down() const noexcept { return is_shut_down_; }
  /// The time that a call of the middleware takes: other threads may run in it.
  void pass(time_ns_t most_ns);
  void changed();

 private:
  template <typename Handles>
  bool mark(Handles* handles, std::size_t added, bool is_over);
  bool mark_ready(rcl_wait_set_t& set, bool is_over);
  bool is_ready(std::uint64_t number);

  seeds::Findings& findings_;
  Dice dice_;
  rcl_context_t context_{.number = 1};
  rcl_node_t node_{.context = &context_};
  std::map<std::uint64_t, Entity> entities_;
  std::uint64_t last_number_{0};
  std::int64_t last_request_{0};
  bool is_shut_down_{false};
  Atomic<std::uint32_t> word_{0};  // counts what changes
};

}  // namespace mauve::testing
