// SPDX-License-Identifier: LGPL-3.0-or-later
// ActionServer: a resource whose goals come from outside of the architecture, of a ROS action as a rule.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "mauve_rt/base/pi_mutex.hpp"
#include "mauve_rt/base/rt.hpp"
#include "mauve_rt/base/seam/guards.hpp"
#include "mauve_rt/base/seam/mutex.hpp"
#include "mauve_rt/data/action_type.hpp"
#include "mauve_rt/data/resource.hpp"
#include "mauve_rt/data/resource_kind.hpp"
#include "mauve_rt/data/service.hpp"

namespace mauve {

inline constexpr time_ns_t kDefaultAnswerTime = ms_to_ns(100);
inline constexpr std::int64_t kMostGoals = 64;

/// What became of the goals of a server or a client so far.
struct ActionCounts {
  std::uint64_t accepted{0};
  std::uint64_t rejected{0};
  std::uint64_t succeeded{0};
  std::uint64_t canceled{0};
  std::uint64_t aborted{0};
  std::uint64_t refused{0};  // decisions of components that fit no goal
};

/// Another state of a goal, or feedback about the goal, for the carrier.
struct GoalEvent {
  GoalId id{};
  std::uint32_t number{0};
  GoalState state{GoalState::unknown};
  GoalReason reason{GoalReason::none};
  bool has_feedback{false};
  bool has_result{false};  // the state is a final one
};

/// An action server seen without its type. Its goals are executed one after another: the oldest accepted one is the current one.
///
/// The carrier of goals (the bridge, or a GoalSender) calls ask(). The component answers in the declared time: by a read of `status`
/// where no port is connected to `asked`, else by a decision. A goal that ends without a decision has a GoalReason.
///
/// | member                | written by                             | read by            | under            |
/// | --------------------- | -------------------------------------- | ------------------ | ---------------- |
/// | slots_, current_, sequence_, counts_, next_number_, is_aborted_ | component, carrier | both, rules | mutex_ |
/// | what a derived class keeps of goals, results and feedback | both | both               | mutex_           |
/// | what it takes in, and hands out | requests' thread; sender's thread | same          | -                |
/// | floor_                | commits, who deploys                   | component          | its own          |
///
/// The wait of a component for an event of this resource ends with each goal that comes, and each cancel.
class ActionServerBase : public Resource {
 public:
  /// `goals`: so many that have not ended. Throws Error (out_of_range): `goals` not in 1 ... kMostGoals, `answer_ns` < 1.
  ActionServerBase(std::string type, std::int64_t goals, time_ns_t answer_ns);

  ActionServerBase* action_server() noexcept override { return this; }
  void set_name(const std::string& name) override;
  /// [non-rt]
  ActionCounts counts() const;
  /// [rt]
  GoalsNow goals_now() const MAUVE_RT;

  // ---- the carrier; asks and cancels on one thread

  /// A goal comes, as rosidl's <Type>_Goal. None when it waits for its answer now, else why it is rejected at once. [non-rt]
  GoalReason ask(const GoalId& id, std::span<const std::byte> message, time_ns_t now_ns);
  /// Its client asks to cancel a goal; false: no such goal is accepted and has not ended. [non-rt]
  bool cancel(const GoalId& id, time_ns_t now_ns);

  // ---- the carrier; takes events on one thread

  /// The next state or feedback to report, of the oldest goal first; false: there is none. After its final state a goal is gone.
  /// `message`: the feedback, as rosidl's <Type>_Feedback, or of a goal that has ended its <Type>_Result.
  /// [non-rt]
  bool next_event(GoalEvent& event, std::vector<std::byte>& message);
  /// Rejects goals that were not answered in time, and ends all when no component serves; returns when to call it again. [non-rt]
  time_ns_t poll(time_ns_t now_ns);
  /// The carrier goes: all goals end as removed. [non-rt]
  void close(time_ns_t now_ns);

 protected:
  /// Offers all services, these of the action's own types among them. [setup]
  void offer_all(ServiceBase& goal, ServiceBase& asked, ServiceBase& feedback, ServiceBase& result);
  /// Reads a goal into a buffer; false: malformed. [non-rt]
  virtual bool take_in(std::span<const std::byte> message) = 0;
  /// Keeps the goal that was taken in; keeps the present result as that goal's, and begins another one. [rt] Under mutex_.
  virtual void keep_goal(std::size_t slot) MAUVE_RT = 0;
  virtual void keep_result(std::size_t slot) MAUVE_RT = 0;
  /// Copies them to a buffer. [rt] Under mutex_.
  virtual void copy_feedback() MAUVE_RT = 0;
  virtual void copy_result(std::size_t slot) MAUVE_RT = 0;
  /// Those copies as messages. [non-rt]
  virtual void put_feedback(std::vector<std::byte>& message) const = 0;
  virtual void put_result(std::vector<std::byte>& message) const = 0;

  // ---- the component

  /// As ReadService::read(). `copy` gets the slot of the goal, under mutex_. [rt]
  template <typename Copy>
  DataStatus read_goal(Copy copy, time_ns_t& time_ns, ReaderState& reader) MAUVE_RT {
    const LockGuard lock(mutex_);
    return read_slot(current_, copy, time_ns, reader);
  }
  template <typename Copy>
  DataStatus read_asked(Copy copy, time_ns_t& time_ns, ReaderState& reader) MAUVE_RT {
    const LockGuard lock(mutex_);
    return read_slot(oldest(GoalState::unknown), copy, time_ns, reader);
  }
  /// Feedback about the current goal, or its result: `keep` copies it under mutex_. Without a goal nothing happens, nor in a stop. [rt]
  template <typename Keep>
  bool give_feedback(Keep keep, time_ns_t time_ns) MAUVE_RT {
    {
      const LockGuard lock(mutex_);
      if (!may_give(time_ns)) return true;
      keep();
      has_feedback_ = true;
    }
    notify();
    return true;
  }
  template <typename Keep>
  bool give_result(Keep keep, time_ns_t time_ns) MAUVE_RT {
    const LockGuard lock(mutex_);
    if (may_give(time_ns)) keep();
    return true;
  }
  WriteFloor& floor() MAUVE_RT { return floor_; }
  std::size_t slots() const noexcept { return slots_.size(); }

 private:
  static constexpr std::size_t kNone = SIZE_MAX;

  /// A goal, or room for one.
  struct Slot {
    bool is_used{false};
    GoalId id{};
    std::uint32_t number{0};
    GoalState state{GoalState::unknown};
    GoalReason reason{GoalReason::none};
    GoalState reported{GoalState::unknown};  // the last one that next_event() gave
    time_ns_t due_ns{0};                     // to be answered
    time_ns_t since_ns{0};                   // when it came, or became the current one
    time_ns_t accepted_ns{0};
  };

  /// The services that are the same for all actions, of one port each: one component serves.
  class Status final : public ReadService<ActionGoal> {
   public:
    explicit Status(ActionServerBase& owner) : ReadService<ActionGoal>("status"), owner_(owner) {}
    std::uint32_t max_ports() const noexcept override { return 1; }
    DataStatus read(ActionGoal& value, time_ns_t& time_ns, ReaderState& reader) noexcept override {
      return owner_.read_status(value, time_ns, reader);
    }

   private:
    ActionServerBase& owner_;
  };
  class Decide final : public WriteService<ActionGoal> {
   public:
    explicit Decide(ActionServerBase& owner) : WriteService<ActionGoal>("decide"), owner_(owner) {}
    std::uint32_t max_ports() const noexcept override { return 1; }
    bool write(const ActionGoal& decision, time_ns_t time_ns) noexcept override {
      return owner_.take_decision(decision, time_ns);
    }
    TryWrite try_write(const ActionGoal& decision, time_ns_t time_ns) noexcept override {
      return owner_.try_decision(decision, time_ns);
    }
    void raise_floor(time_ns_t instant_ns) noexcept override { owner_.floor().raise(instant_ns); }
    void forget_floor() noexcept override { owner_.floor().forget(); }

   private:
    ActionServerBase& owner_;
  };

  /// Whether a port decides about goals, and whether one looks at those that wait for an answer. [rt]
  bool is_served() const MAUVE_RT { return decide.ports() != 0; }
  bool has_judge() const MAUVE_RT { return asked_->ports() != 0; }
  DataStatus read_status(ActionGoal& value, time_ns_t& time_ns, ReaderState& reader) MAUVE_RT;
  bool take_decision(const ActionGoal& decision, time_ns_t time_ns) MAUVE_RT;
  TryWrite try_decision(const ActionGoal& decision, time_ns_t time_ns) MAUVE_RT;

  std::size_t oldest(GoalState state) const MAUVE_RT;
  std::size_t find(const GoalId& id) const noexcept;
  std::size_t find(std::uint32_t number) const noexcept;
  std::size_t open_goals() const noexcept;
  bool may_give(time_ns_t time_ns) const noexcept {
    return current_ != kNone && time_ns > stop_ns() && floor_.admits(time_ns);
  }
  void accept(std::size_t slot, time_ns_t now_ns) noexcept;
  void end(std::size_t slot, GoalState state, GoalReason reason, time_ns_t now_ns) noexcept;
  void end_all(GoalReason reason, time_ns_t now_ns) noexcept;
  void begin_next(time_ns_t now_ns) noexcept;
  void changed(time_ns_t now_ns) noexcept;
  bool decide_locked(const ActionGoal& decision, time_ns_t time_ns) noexcept;

  /// [rt]
  template <typename Copy>
  DataStatus read_slot(std::size_t slot, Copy copy, time_ns_t& time_ns, ReaderState& reader) MAUVE_RT;

  const std::size_t goals_;
  const time_ns_t answer_ns_;
  mutable PiMutex mutex_;
  WriteFloor floor_;
  std::vector<Slot> slots_;
  std::size_t current_{kNone};
  bool has_feedback_{false};
  std::uint32_t next_number_{1};
  std::uint64_t sequence_{1};
  time_ns_t changed_ns_{0};
  ActionCounts counts_;
  bool is_aborted_{false};
  const ServiceBase* asked_{nullptr};  // [setup]

 public:
  Status status{*this};
  Decide decide{*this};
};

/// [rt] Under mutex_.
template <typename Copy>
DataStatus ActionServerBase::read_slot(std::size_t slot, Copy copy, time_ns_t& time_ns, ReaderState& reader)
    MAUVE_RT {
  if (slot == kNone) return DataStatus::none;
  copy(slot);
  time_ns = slots_[slot].since_ns;
  return reader.look(slots_[slot].number);
}

/// Offers `status`, `goal` and `asked` to read, `decide`, `feedback` and `result` to write.
template <DescribedAction A>
class ActionServer final : public ActionServerBase {
 public:
  using Goal = typename A::Goal;
  using Result = typename A::Result;
  using Feedback = typename A::Feedback;

  explicit ActionServer(std::int64_t goals = 1, time_ns_t answer_ns = kDefaultAnswerTime)
      : ActionServerBase(std::string(ActionTraits<A>::name), goals, answer_ns),
        goals_(slots()),
        results_(slots()) {
    offer_all(goal, asked, feedback, result);
  }

 protected:
  bool take_in(std::span<const std::byte> message) override { return CdrReader(message).get(*taken_in_); }
  void keep_goal(std::size_t slot) noexcept override {
    goals_[slot] = *taken_in_;
    results_[slot] = {};
  }
  void keep_result(std::size_t slot) noexcept override { results_[slot] = std::exchange(result_, {}); }
  void copy_feedback() noexcept override { *feedback_out_ = feedback_; }
  void copy_result(std::size_t slot) noexcept override { *result_out_ = results_[slot]; }
  void put_feedback(std::vector<std::byte>& message) const override {
    CdrWriter(message).put(*feedback_out_);
  }
  void put_result(std::vector<std::byte>& message) const override { CdrWriter(message).put(*result_out_); }

 private:
  /// Of one port: one component serves. `Part::find` reads it.
  template <Described T, typename Part>
  class Read final : public ReadService<T> {
   public:
    Read(ActionServer& owner, const char* name) : ReadService<T>(name), owner_(owner) {}
    std::uint32_t max_ports() const noexcept override { return 1; }
    DataStatus read(T& value, time_ns_t& time_ns, ReaderState& reader) noexcept override {
      return Part::find(owner_, value, time_ns, reader);
    }

   private:
    ActionServer& owner_;
  };
  /// `Part::put` writes it.
  template <Described T, typename Part>
  class Write final : public WriteService<T> {
   public:
    Write(ActionServer& owner, const char* name) : WriteService<T>(name), owner_(owner) {}
    std::uint32_t max_ports() const noexcept override { return 1; }
    bool write(const T& value, time_ns_t time_ns) noexcept override {
      return Part::put(owner_, value, time_ns);
    }
    /// Of a stop: `decide` alone acts then.
    TryWrite try_write(const T& /*value*/, time_ns_t /*time_ns*/) noexcept override { return TryWrite::done; }
    void raise_floor(time_ns_t instant_ns) noexcept override { owner_.floor().raise(instant_ns); }
    void forget_floor() noexcept override { owner_.floor().forget(); }

   private:
    ActionServer& owner_;
  };

  struct GoalPart {
    static DataStatus find(ActionServer& owner, Goal& value, time_ns_t& time_ns, ReaderState& reader)
        MAUVE_RT {
      const auto copy = [&](std::size_t slot) MAUVE_RT { value = owner.goals_[slot]; };
      return owner.read_goal(copy, time_ns, reader);
    }
  };
  struct AskedPart {
    static DataStatus find(ActionServer& owner, Goal& value, time_ns_t& time_ns, ReaderState& reader)
        MAUVE_RT {
      const auto copy = [&](std::size_t slot) MAUVE_RT { value = owner.goals_[slot]; };
      return owner.read_asked(copy, time_ns, reader);
    }
  };
  struct FeedbackPart {
    static bool put(ActionServer& owner, const Feedback& value, time_ns_t time_ns) MAUVE_RT {
      return owner.give_feedback([&]() MAUVE_RT { owner.feedback_ = value; }, time_ns);
    }
  };
  struct ResultPart {
    static bool put(ActionServer& owner, const Result& value, time_ns_t time_ns) MAUVE_RT {
      return owner.give_result([&]() MAUVE_RT { owner.result_ = value; }, time_ns);
    }
  };

  // Under the base's mutex:
  std::vector<Goal> goals_;      // by slot
  std::vector<Result> results_;  // of goals that have ended
  Result result_{};              // of the current one
  Feedback feedback_{};
  // Of the thread that takes in, and of the one that hands out:
  std::unique_ptr<Goal> taken_in_{std::make_unique<Goal>()};
  std::unique_ptr<Result> result_out_{std::make_unique<Result>()};
  std::unique_ptr<Feedback> feedback_out_{std::make_unique<Feedback>()};

 public:
  Read<Goal, GoalPart> goal{*this, "goal"};
  Read<Goal, AskedPart> asked{*this, "asked"};
  Write<Feedback, FeedbackPart> feedback{*this, "feedback"};
  Write<Result, ResultPart> result{*this, "result"};
};

/// As architectures name and make it. All functions [setup].
struct ActionServerKind {
  static ResourceKind describe();
  template <DescribedAction A>
  static std::unique_ptr<Resource> make(const ResourceParameters& given) {
    return std::make_unique<ActionServer<A>>(get<std::int64_t>(given, "goals"),
                                             get<std::int64_t>(given, "answer_ns"));
  }
};

}  // namespace mauve
