// SPDX-License-Identifier: LGPL-3.0-or-later
// Goals between resources and ROS actions, both ways.
#pragma once

#include <rcl_action/rcl_action.h>

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "mauve_rt/base/pi_mutex.hpp"
#include "mauve_rt/base/seam/mutex.hpp"
#include "mauve_rt/data/action_client.hpp"
#include "mauve_rt/data/action_server.hpp"

#include "binding.hpp"
#include "owned.hpp"
#include "type_support.hpp"
#include "typed_message.hpp"

namespace mauve::bridge {

/// What both directions are made from.
struct ActionSettings {
  std::string resource;
  std::string name;  // as given; rcl expands and remaps it
  std::string type;  // package/action/Type
};

/// The clock by which a server forgets results.
class SteadyClock {
 public:
  SteadyClock();
  ~SteadyClock();
  SteadyClock(const SteadyClock&) = delete;
  SteadyClock& operator=(const SteadyClock&) = delete;
  rcl_clock_t* get() noexcept { return &clock_; }

 private:
  rcl_clock_t clock_{};
};

/// The answer to a request for a result, whose result is a message of its own. [non-rt]
class ResultResponse {
 public:
  explicit ResultResponse(const ActionTypeSupport& type);
  void* get() const noexcept { return response_.get(); }
  GoalState state() const noexcept;
  void set_state(GoalState state) noexcept;
  /// As of TypedMessage.
  bool deserialize_result(std::vector<std::byte>& message);
  bool serialize_result(OwnedMessage& into) const;

 private:
  void* result() const noexcept { return static_cast<std::byte*>(get()) + offset_; }

  TypedMessage response_;
  const rosidl_message_type_support_t* type_;
  std::size_t offset_;
};

/// What both directions have in common: the type, and a message of each kind.
class BoundAction : public Binding, protected Arrival {
 public:
  /// Throws Error when the type is not installed. [non-rt]
  BoundAction(const rcl_node_t& node, const ActionSettings& settings);

 protected:
  std::size_t entities() const override {
    return 3;
  }  // services and a timer; or clients and two subscriptions
  /// For messages about it: its resource and its name.
  std::string described() const;
  /// Throws Error (type_mismatch) unless `fits`, and the resource is of the action's type. [non-rt]
  void check_kind(const Resource& resource, bool fits, const char* kind) const;
  ActionReport report_of(const ActionCounts& counts, bool is_offered) const;

 private:
  const ActionSettings settings_;

 protected:
  const ActionTypeSupport type_;
  TypedMessage goal_request_;
  TypedMessage goal_response_;
  TypedMessage result_request_;
  ResultResponse result_response_;
  TypedMessage feedback_;
  OwnedMessage incoming_;

 private:
  const std::string name_;  // expanded and remapped
};

/// Offers a resource of kind action_server as a ROS action.
///
/// | member               | used by                                  | under  |
/// | -------------------- | ---------------------------------------- | ------ |
/// | entity_, goals_      | who takes requests, who sends            | mutex_ (waiting needs none: rcl keeps the places in the wait set apart) |
/// | goal_request_ ... result_request_, incoming_, goal_ | who takes requests | - |
/// | feedback_, message_  | who sends                                | -      |
/// | goal_response_, result_response_ | both                         | mutex_ |
class OfferedAction final : public BoundAction {
 public:
  /// Throws Error when the type is not installed or rcl refuses. [non-rt]
  OfferedAction(rcl_node_t& node, const ActionSettings& settings);

  /// Throws Error (type_mismatch) when the resource is no server of that type. [non-rt]
  void attach(std::shared_ptr<Resource> resource) override;
  bool send() override;
  time_ns_t next_look_ns() const override;
  void end() override;
  std::vector<Arrival*> arrivals(Lane lane) override;
  void report(BridgeReport& report) const override;

 private:
  /// A goal of a client, until its result is forgotten.
  struct Goal {
    rmw_request_id_t asked{};                   // by which request
    rcl_action_goal_handle_t* handle{nullptr};  // of one that was accepted; rcl owns it
    std::vector<rmw_request_id_t> results{};    // requests that wait for the result
    GoalState ended{GoalState::unknown};        // how it has ended
    std::vector<std::byte> result{};            // then
  };

  void join(rcl_wait_set_t& set) override;
  bool has_arrived(const rcl_wait_set_t& set) const override;
  void take() override;
  void take_goals();
  void take_cancels();
  void take_results();
  void forget_expired();

  void answer(const rmw_request_id_t& asked, bool is_accepted) MAUVE_REQUIRES(mutex_);
  bool accept(const GoalId& id, Goal& goal) MAUVE_REQUIRES(mutex_);
  void follow(const GoalEvent& event, Goal& goal) MAUVE_REQUIRES(mutex_);
  void send_result(const rmw_request_id_t& asked, GoalState ended, std::vector<std::byte>& result)
      MAUVE_REQUIRES(mutex_);
  void publish_status() MAUVE_REQUIRES(mutex_);

  SteadyClock clock_;
  Owned<rcl_action_server_t, rcl_action_server_fini> entity_;
  ActionServerBase* server_{nullptr};
  PiMutex mutex_;
  std::map<GoalId, Goal> goals_ MAUVE_GUARDED_BY(mutex_);
  std::vector<std::byte> goal_;
  std::vector<std::byte> message_;
  std::vector<std::byte> unknown_;  // the result of a goal that is not known
};

/// Carries a client's goals to a ROS action server, and what becomes of them back.
///
/// | member                | written by            | read by       | under  |
/// | --------------------- | --------------------- | ------------- | ------ |
/// | goal_                 | who sends             | who receives  | mutex_ |
/// | goal_request_, outgoing_ | who sends          | -             | -      |
/// | the other messages    | who receives          | -             | -      |
/// | next_check_ns_, unseen_since_ns_ | who sends  | -             | -      |
class CalledAction final : public BoundAction {
 public:
  /// Throws Error when the type is not installed or rcl refuses. [non-rt]
  CalledAction(rcl_node_t& node, const ActionSettings& settings);
  ~CalledAction() override;

  /// Throws Error (type_mismatch) when the resource is no client of that type. [non-rt]
  void attach(std::shared_ptr<Resource> resource) override;
  bool send() override;
  time_ns_t next_look_ns() const override;
  void end() override;
  std::vector<Arrival*> arrivals(Lane lane) override;
  void report(BridgeReport& report) const override;

 private:
  /// The present one, with rcl's numbers of its requests.
  struct Goal {
    GoalId id{};
    std::uint32_t number{0};
    std::int64_t asked{-1};
    std::int64_t result{-1};
  };

  void join(rcl_wait_set_t& set) override;
  bool has_arrived(const rcl_wait_set_t& set) const override;
  void take() override;
  void take_answers();
  void take_states();
  void take_feedback();
  void take_results();
  void send_goal(const GoalId& id, std::uint32_t number);
  void send_cancel();
  bool has_server() const;
  void check_server(std::uint32_t number, time_ns_t now_ns) const;
  Goal present() const;

  rcl_node_t& node_;
  Owned<rcl_action_client_t, rcl_action_client_fini> entity_;
  ActionClientBase* client_{nullptr};
  mutable PiMutex mutex_;
  Goal goal_ MAUVE_GUARDED_BY(mutex_);
  std::vector<std::byte> outgoing_;
  std::vector<std::byte> part_;
  mutable time_ns_t next_check_ns_{0};           // of the server
  mutable time_ns_t unseen_since_ns_{kForever};  // the server
};

}  // namespace mauve::bridge
