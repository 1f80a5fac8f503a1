// SPDX-License-Identifier: LGPL-3.0-or-later
// ActionClient: a resource whose goals somebody outside of the architecture executes, a ROS action server as a rule.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "mauve_rt/base/pi_mutex.hpp"
#include "mauve_rt/base/rt.hpp"
#include "mauve_rt/base/seam/guards.hpp"
#include "mauve_rt/base/seam/mutex.hpp"
#include "mauve_rt/data/action_server.hpp"
#include "mauve_rt/data/action_type.hpp"
#include "mauve_rt/data/resource.hpp"
#include "mauve_rt/data/resource_kind.hpp"
#include "mauve_rt/data/service.hpp"

namespace mauve {

/// An action client seen without its type: one goal at a time. A goal is written, then its status is read until it is a final one.
/// A write of `decide` with any state asks to cancel the goal; what a stop writes there does so, too.
///
/// | member              | written by                       | read by          | under  |
/// | ------------------- | -------------------------------- | ---------------- | ------ |
/// | number_ ... accepted_ns_ | component, carrier          | both, rules      | mutex_ |
/// | what a derived class keeps | both                      | both             | mutex_ |
/// | what it takes in, and hands out | receivers' thread; sender's thread | same | -   |
/// | floor_              | commits, who deploys             | component        | its own |
class ActionClientBase : public Resource {
 public:
  /// `answer_ns`: a goal that is not answered by then is rejected (>= 1).
  ActionClientBase(std::string type, time_ns_t answer_ns);

  ActionClientBase* action_client() noexcept override { return this; }
  void set_name(const std::string& name) override;
  /// [non-rt]
  ActionCounts counts() const;
  /// [rt]
  GoalsNow goals_now() const MAUVE_RT;

  // ---- the carrier of goals (the bridge): one thread sends, one receives

  /// The goal to be sent, once each, as rosidl's <Type>_Goal; false: none. [non-rt]
  bool next_goal(std::vector<std::byte>& message, std::uint32_t& number);
  /// Whether the component asks to cancel a goal that was accepted, once each; false: it does not. [non-rt]
  bool next_cancel(std::uint32_t& number);
  /// The server's answer, another state, feedback (<Type>_Feedback), the end (<Type>_Result). Of any other goal than the present
  /// one: nothing happens. A message that does not fit ends the goal as malformed. [non-rt]
  void answer(std::uint32_t number, bool is_accepted, time_ns_t now_ns);
  void set_state(std::uint32_t number, GoalState state, time_ns_t now_ns);
  void feed_back(std::uint32_t number, std::span<const std::byte> feedback, time_ns_t now_ns);
  void finish(std::uint32_t number, GoalState state, std::span<const std::byte> result, time_ns_t now_ns);
  /// Ends the goal: rejected before it was accepted, else aborted. [non-rt]
  void give_up(std::uint32_t number, GoalReason reason, time_ns_t now_ns);
  /// The number of the goal that has not ended; 0: there is none. [non-rt]
  std::uint32_t open_goal() const;
  /// Rejects a goal that was not answered in time; returns when to call it again. [non-rt]
  time_ns_t poll(time_ns_t now_ns);

 protected:
  /// Offers all services, these of the action's own types among them. [setup]
  void offer_all(ServiceBase& goal, ServiceBase& feedback, ServiceBase& result);
  /// Copies the goal to a buffer. [rt] Under mutex_.
  virtual void copy_goal() MAUVE_RT = 0;
  /// That copy as a message. [non-rt]
  virtual void put_goal(std::vector<std::byte>& message) const = 0;
  /// Reads a message into a buffer; false: malformed. [non-rt]
  virtual bool take_in_feedback(std::span<const std::byte> message) = 0;
  virtual bool take_in_result(std::span<const std::byte> message) = 0;
  /// Keeps what was taken in. [rt] Under mutex_.
  virtual void keep_feedback() MAUVE_RT = 0;
  virtual void keep_result() MAUVE_RT = 0;

  // ---- the component

  /// Of WriteService::write(): `keep` copies the goal under mutex_; false: the one before has not ended. [rt]
  template <typename Keep>
  bool begin_goal(Keep keep, time_ns_t time_ns) MAUVE_RT {
    {
      const LockGuard lock(mutex_);
      if (time_ns <= stop_ns() || !floor_.admits(time_ns)) return true;  // a stop's default value is no goal
      if (is_open()) {
        ++counts_.refused;
        return false;
      }
      keep();
      begin(time_ns);
    }
    notify();
    return true;
  }
  /// As ReadService::read(); `copy` runs under mutex_. [rt]
  template <typename Copy>
  DataStatus read_feedback(Copy copy, time_ns_t& time_ns, ReaderState& reader) MAUVE_RT {
    const LockGuard lock(mutex_);
    if (feedback_ == 0) return DataStatus::none;
    copy();
    time_ns = feedback_ns_;
    return reader.look(feedback_);
  }
  template <typename Copy>
  DataStatus read_result(Copy copy, time_ns_t& time_ns, ReaderState& reader) MAUVE_RT {
    const LockGuard lock(mutex_);
    if (result_of_ != number_ || result_of_ == 0) return DataStatus::none;
    copy();
    time_ns = changed_ns_;
    return reader.look(result_of_);
  }
  WriteFloor& floor() MAUVE_RT { return floor_; }

 private:
  /// The services that are the same for all actions.
  class Status final : public ReadService<ActionGoal> {
   public:
    explicit Status(ActionClientBase& owner) : ReadService<ActionGoal>("status"), owner_(owner) {}
    DataStatus read(ActionGoal& value, time_ns_t& time_ns, ReaderState& reader) noexcept override {
      return owner_.read_status(value, time_ns, reader);
    }

   private:
    ActionClientBase& owner_;
  };
  class Decide final : public WriteService<ActionGoal> {
   public:
    explicit Decide(ActionClientBase& owner) : WriteService<ActionGoal>("decide"), owner_(owner) {}
    std::uint32_t max_ports() const noexcept override { return 1; }
    bool write(const ActionGoal& /*decision*/, time_ns_t time_ns) noexcept override {
      return owner_.ask_to_cancel(time_ns);
    }
    TryWrite try_write(const ActionGoal& /*decision*/, time_ns_t time_ns) noexcept override {
      return owner_.try_ask_to_cancel(time_ns);
    }
    void raise_floor(time_ns_t instant_ns) noexcept override { owner_.floor().raise(instant_ns); }
    void forget_floor() noexcept override { owner_.floor().forget(); }

   private:
    ActionClientBase& owner_;
  };

  DataStatus read_status(ActionGoal& value, time_ns_t& time_ns, ReaderState& reader) MAUVE_RT;
  bool ask_to_cancel(time_ns_t time_ns) MAUVE_RT;
  TryWrite try_ask_to_cancel(time_ns_t time_ns) MAUVE_RT;
  bool is_open() const noexcept { return number_ != 0 && !is_final(state_); }
  bool is_present(std::uint32_t number) const noexcept { return is_open() && number == number_; }
  void begin(time_ns_t time_ns) MAUVE_RT;
  void cancel_locked(time_ns_t time_ns) noexcept;
  void enter(GoalState state, GoalReason reason, time_ns_t now_ns) noexcept;
  void report(std::uint32_t number, GoalState state, GoalReason reason) const;

  const time_ns_t answer_ns_;
  mutable PiMutex mutex_;
  WriteFloor floor_;
  std::uint32_t number_{0};
  GoalState state_{GoalState::unknown};
  GoalReason reason_{GoalReason::none};
  bool is_to_send_{false};
  bool is_to_cancel_{false};
  time_ns_t due_ns_{0};
  time_ns_t changed_ns_{0};
  std::uint64_t sequence_{0};  // of states
  std::uint64_t feedback_{0};  // how many came; 0: none of this goal
  std::uint64_t fed_back_{0};  // of all goals
  time_ns_t feedback_ns_{0};
  std::uint32_t result_of_{0};  // the goal whose result is there
  ActionCounts counts_;
  bool is_aborted_{false};
  time_ns_t accepted_ns_{0};

 public:
  Decide decide{*this};
  Status status{*this};
};

/// Offers `goal` and `decide` to write, `status`, `feedback` and `result` to read.
template <DescribedAction A>
class ActionClient final : public ActionClientBase {
 public:
  using Goal = typename A::Goal;
  using Result = typename A::Result;
  using Feedback = typename A::Feedback;

  explicit ActionClient(time_ns_t answer_ns = s_to_ns(1))
      : ActionClientBase(std::string(ActionTraits<A>::name), answer_ns) {
    offer_all(goal, feedback, result);
  }

 protected:
  void copy_goal() noexcept override { *goal_out_ = goal_; }
  void put_goal(std::vector<std::byte>& message) const override { CdrWriter(message).put(*goal_out_); }
  bool take_in_feedback(std::span<const std::byte> message) override {
    return CdrReader(message).get(*feedback_in_);
  }
  bool take_in_result(std::span<const std::byte> message) override {
    return CdrReader(message).get(*result_in_);
  }
  void keep_feedback() noexcept override { feedback_ = *feedback_in_; }
  void keep_result() noexcept override { result_ = *result_in_; }

 private:
  /// `Part::find` reads it.
  template <Described T, typename Part>
  class Read final : public ReadService<T> {
   public:
    Read(ActionClient& owner, const char* name) : ReadService<T>(name), owner_(owner) {}
    DataStatus read(T& value, time_ns_t& time_ns, ReaderState& reader) noexcept override {
      return Part::find(owner_, value, time_ns, reader);
    }

   private:
    ActionClient& owner_;
  };
  class SendGoal final : public WriteService<Goal> {
   public:
    explicit SendGoal(ActionClient& owner) : WriteService<Goal>("goal"), owner_(owner) {}
    std::uint32_t max_ports() const noexcept override { return 1; }
    bool write(const Goal& value, time_ns_t time_ns) noexcept override {
      return owner_.begin_goal([&]() noexcept { owner_.goal_ = value; }, time_ns);
    }
    TryWrite try_write(const Goal& /*value*/, time_ns_t /*time_ns*/) noexcept override {
      return TryWrite::done;  // of a stop: no goal
    }
    void raise_floor(time_ns_t instant_ns) noexcept override { owner_.floor().raise(instant_ns); }
    void forget_floor() noexcept override { owner_.floor().forget(); }

   private:
    ActionClient& owner_;
  };
  struct FeedbackPart {
    static DataStatus find(ActionClient& owner, Feedback& value, time_ns_t& time_ns, ReaderState& reader)
        MAUVE_RT {
      return owner.read_feedback([&]() MAUVE_RT { value = owner.feedback_; }, time_ns, reader);
    }
  };
  struct ResultPart {
    static DataStatus find(ActionClient& owner, Result& value, time_ns_t& time_ns, ReaderState& reader)
        MAUVE_RT {
      return owner.read_result([&]() MAUVE_RT { value = owner.result_; }, time_ns, reader);
    }
  };

  // Under the base's mutex:
  Goal goal_{};
  Feedback feedback_{};
  Result result_{};
  // Of the thread that hands out, and of the one that takes in:
  std::unique_ptr<Goal> goal_out_{std::make_unique<Goal>()};
  std::unique_ptr<Feedback> feedback_in_{std::make_unique<Feedback>()};
  std::unique_ptr<Result> result_in_{std::make_unique<Result>()};

 public:
  SendGoal goal{*this};
  Read<Feedback, FeedbackPart> feedback{*this, "feedback"};
  Read<Result, ResultPart> result{*this, "result"};
};

/// As architectures name and make it. All functions [setup].
struct ActionClientKind {
  static ResourceKind describe();
  template <DescribedAction A>
  static std::unique_ptr<Resource> make(const ResourceParameters& given) {
    return std::make_unique<ActionClient<A>>(get<std::int64_t>(given, "answer_ns"));
  }
};

}  // namespace mauve
