// SPDX-License-Identifier: LGPL-3.0-or-later
// StopGuard: stops components, and makes outputs safe, for requests that the node's Python side does not take up.
#pragma once

#include <rcl/guard_condition.h>
#include <rcl/service.h>
#include <rcl/wait.h>

#include <atomic>
#include <cstdint>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "mauve_rt/architecture/architecture.hpp"
#include "mauve_rt/deploy/host.hpp"

#include "calls.hpp"
#include "type_support.hpp"

namespace mauve::bridge {

/// What a node that has a StopGuard gives it. All of it outlives the guard.
struct GuardedNode {
  rcl_node_t& node;
  rcl_service_t& stop;          // mauve_msgs/srv/Stop
  rcl_service_t& change_state;  // lifecycle_msgs/srv/ChangeState
  rcl_guard_condition_t& news;  // triggered when there is something to take
  std::string logger;
  std::string instance_id;
  std::map<std::string, std::uint16_t> codes;  // constants of mauve_msgs/msg/ReplyCode
};

/// What came of a stop; `code`: the name of a constant of mauve_msgs/msg/ReplyCode.
struct StopReply {
  std::string code;
  std::string message;
};

/// Takes the requests of two services that lie unread for 200 ms, since the node's Python side does not work. A stop is carried
/// out and answered here, and reported to the node later. For a deactivation or shutdown outputs are made safe; the transition
/// itself is the node's, as is its answer. All functions [non-rt].
///
/// | member        | written by         | read by                | under                                          |
/// | ------------- | ------------------ | ---------------------- | ---------------------------------------------- |
/// | architecture_ | set_architecture() | the thread             | architecture_mutex_, held while it is used     |
/// | answered_, transitions_, last_number_ | the thread, the node | the same | mutex_, for a moment                 |
/// | ending_       | stop()             | the thread             | release/acquire; the guard condition wakes after |
/// | the rest      | the thread         | the thread             | -                                              |
class StopGuard {
 public:
  /// A stop that was answered here. Both messages are serialized.
  struct Answered {
    std::vector<std::byte> request;
    std::vector<std::byte> response;
    std::string request_id;
    std::string words;  // of the whole request
  };
  /// A request for a transition, serialized, which the node is to answer().
  struct Transition {
    std::uint64_t number;
    std::vector<std::byte> request;
  };

  /// Guards from now on. Throws Error when a type is not installed or rcl refuses.
  explicit StopGuard(GuardedNode guarded);
  ~StopGuard();
  StopGuard(const StopGuard&) = delete;
  StopGuard& operator=(const StopGuard&) = delete;

  /// Whose components it stops; nullptr: of none. Waits for what the guard does to the present ones.
  void set_architecture(Architecture* architecture);
  /// Those since the last call.
  std::vector<Answered> take_answered();
  std::vector<Transition> take_transitions();
  /// Sends the response to a request for a transition.
  void answer(std::uint64_t number, std::vector<std::byte> response);
  /// May be called again.
  void stop();

 private:
  /// A service whose requests the node should read.
  struct Watched {
    rcl_service_t& service;
    void (StopGuard::*take)();
    std::size_t place{0};          // in the wait set
    time_ns_t unread_since_ns{0};  // 0: nothing is unread
  };
  /// A stop that was taken, and is not answered yet.
  struct Stop {
    rmw_request_id_t id{};
    std::vector<std::byte> request{};
    std::string request_id{};
    std::string words{};
    std::string component{};
    time_ns_t until_ns{0};
    bool force{false};
    bool is_ordered{false};
  };

  void run();
  rcl_ret_t wait(rcl_wait_set_t& set, time_ns_t timeout_ns, bool for_requests);
  void look(const rcl_wait_set_t& set);
  bool is_unread() const noexcept;
  void take_stops();
  void take_changes();
  void carry_out_all();
  std::optional<StopReply> carry_out(Stop& stop);
  Host& host() const;
  void respond(Stop& stop, const StopReply& reply);
  void finish(Stop& stop, const StopReply& reply);
  bool send_again(Stop& stop);
  void make_safe();
  void tell_news();

  GuardedNode guarded_;
  CallTypeSupport stop_type_;
  CallTypeSupport change_type_;
  TypedMessage stop_request_;
  TypedMessage stop_response_;
  TypedMessage change_request_;
  OwnedMessage message_;
  Watched watched_[2];
  std::vector<Stop> stops_;
  rcl_guard_condition_t wake_{rcl_get_zero_initialized_guard_condition()};
  std::mutex architecture_mutex_;
  Architecture* architecture_{nullptr};
  std::mutex mutex_;
  std::vector<Answered> answered_;
  struct Waiting {
    rmw_request_id_t id;
    std::vector<std::byte> request;
    bool is_taken;  // by the node
  };
  std::map<std::uint64_t, Waiting> transitions_;
  std::uint64_t last_number_{0};
  std::atomic<bool> ending_{false};
  WorkerThread thread_;
};

}  // namespace mauve::bridge
