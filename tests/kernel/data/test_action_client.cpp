// SPDX-License-Identifier: LGPL-3.0-or-later
// Goals that somebody outside executes: one at a time, and each ends.
#include "action_types.hpp"

namespace mauve::testing::test_action_client {

using enum GoalState;

constexpr time_ns_t kAnswer = ms_to_ns(100);

struct ActionClients : ::testing::Test {
  ActionClient<Walk> client{kAnswer};
  WritePort<Walk::Goal> goal{"goal"};
  WritePort<ActionGoal> decide{"decide"};
  ReadPort<ActionGoal> status{"status"};
  ReadPort<Walk::Feedback> feedback{"feedback"};
  ReadPort<Walk::Result> result{"result"};
  std::vector<std::byte> request;
  std::uint32_t number{0};

  ActionClients() {
    client.set_name("walk");
    goal.connect(client.goal, "walk");
    decide.connect(client.decide, "walk");
    status.connect(client.status, "walk");
    feedback.connect(client.feedback, "walk");
    result.connect(client.result, "walk");
  }
  ~ActionClients() override {
    for (PortBase* port : std::initializer_list<PortBase*>{&goal, &decide, &status, &feedback, &result})
      port->disconnect();
  }
  ActionGoal found() { return status.read().value; }
  GoalState state() { return found().its_state(); }
  bool next() { return client.next_goal(goal_id(1), request, number); }
  void cancel() { decide.write(decision(canceling)); }
  static std::vector<std::byte> feedback_of(std::int64_t step) {
    std::vector<std::byte> message;
    CdrWriter writer(message);
    writer.put(goal_id(1));
    writer.put(Walk::Feedback{step});
    return message;
  }
  static std::vector<std::byte> response_of(GoalState ended, std::int64_t steps) {
    std::vector<std::byte> message;
    CdrWriter writer(message);
    writer.put(static_cast<std::int8_t>(ended));
    writer.put(Walk::Result{steps});
    return message;
  }
};

TEST_F(ActionClients, SendsAGoalAndReadsWhatBecomesOfIt) {
  EXPECT_EQ(DataStatus::none, status.read().status);
  EXPECT_TRUE(goal.write({12}));
  EXPECT_EQ(1U, found().number);
  EXPECT_EQ(unknown, state());
  ASSERT_TRUE(next());
  CdrReader reader(request);
  GoalId id{};
  Walk::Goal sent;
  EXPECT_TRUE(reader.get(id) && reader.get(sent));
  EXPECT_EQ(goal_id(1), id);
  EXPECT_EQ(12, sent.steps);
  EXPECT_FALSE(next()) << "it is sent once";

  client.answer(number, true, 1);
  EXPECT_EQ(accepted, state());
  client.set_state(number, executing, 2);
  EXPECT_EQ(executing, state());
  client.feed_back(number, feedback_of(3), 3);
  const Sample<Walk::Feedback> fed = feedback.read();
  EXPECT_TRUE(fed.is_new());
  EXPECT_EQ(3, fed.value.step);
  EXPECT_EQ(DataStatus::none, result.read().status);
  client.finish(number, response_of(succeeded, 12), 4);
  EXPECT_EQ(succeeded, state());
  EXPECT_EQ(12, result.read().value.steps);
  client.finish(number, response_of(aborted, 1), 5);
  EXPECT_EQ(succeeded, state()) << "it has ended";

  EXPECT_TRUE(goal.write({13}));
  EXPECT_EQ(2U, found().number);
  EXPECT_EQ(DataStatus::none, feedback.read().status) << "that was of another goal";
  EXPECT_EQ(DataStatus::none, result.read().status);
}

TEST_F(ActionClients, HasOneGoalAtATime) {
  EXPECT_TRUE(goal.write({1}));
  EXPECT_FALSE(goal.write({2}));
  EXPECT_EQ(1U, client.counts().refused);
  EXPECT_EQ(1U, client.open_goal());
}

TEST_F(ActionClients, AGoalThatIsNotAnsweredInTimeIsRejected) {
  goal.write({1});
  const time_ns_t sent_ns = status.read().time_ns;
  EXPECT_EQ(sent_ns + kAnswer, client.look(sent_ns + 1));
  client.look(sent_ns + kAnswer);
  EXPECT_EQ(rejected, state());
  EXPECT_EQ(GoalReason::no_answer, found().its_reason());
  EXPECT_FALSE(next()) << "nobody gets it any more";
  client.answer(1, true, sent_ns + kAnswer + 1);
  EXPECT_EQ(rejected, state()) << "the answer came too late";
}

TEST_F(ActionClients, AGoalThatNobodyHasYetIsCanceledAtOnce) {
  goal.write({1});
  cancel();
  EXPECT_EQ(canceled, state());
  EXPECT_FALSE(next());
}

TEST_F(ActionClients, ACancelWaitsForTheAnswer) {
  goal.write({1});
  ASSERT_TRUE(next());
  cancel();
  EXPECT_FALSE(client.next_cancel(number)) << "the server knows no such goal yet";
  client.answer(1, true, 1);
  ASSERT_TRUE(client.next_cancel(number));
  EXPECT_EQ(1U, number);
  EXPECT_FALSE(client.next_cancel(number)) << "once";
  client.set_state(1, canceling, 2);
  EXPECT_EQ(canceling, state());
  client.finish(1, response_of(canceled, 0), 3);
  EXPECT_EQ(canceled, state());
}

TEST_F(ActionClients, AStopCancelsTheGoalAndSendsNone) {
  for (PortBase* port : std::initializer_list<PortBase*>{&goal, &decide})
    port->write_stopped(monotonic_now_ns());
  EXPECT_EQ(0U, client.open_goal()) << "the default value that a stop writes is no goal";
  goal.write({1});
  ASSERT_TRUE(next());
  client.answer(1, true, 1);
  for (PortBase* port : std::initializer_list<PortBase*>{&goal, &decide})
    port->write_stopped(monotonic_now_ns());
  EXPECT_TRUE(client.next_cancel(number));
}

TEST_F(ActionClients, EndsWithAReasonWhenItsServerIsGoneOrSpeaksNonsense) {
  goal.write({1});
  ASSERT_TRUE(next());
  client.give_up(1, GoalReason::no_server, 1);
  EXPECT_EQ(rejected, state());
  EXPECT_EQ(GoalReason::no_server, found().its_reason());
  goal.write({1});
  ASSERT_TRUE(next());
  client.answer(2, true, 2);
  client.finish(2, response_of(unknown, 0), 3);
  EXPECT_EQ(aborted, state()) << "the server does not know the goal";
  EXPECT_EQ(GoalReason::no_server, found().its_reason());
  goal.write({1});
  ASSERT_TRUE(next());
  client.answer(3, true, 4);
  client.feed_back(3, std::vector<std::byte>(3), 5);
  EXPECT_EQ(aborted, state());
  EXPECT_EQ(GoalReason::malformed, found().its_reason());
}

}  // namespace mauve::testing::test_action_client
