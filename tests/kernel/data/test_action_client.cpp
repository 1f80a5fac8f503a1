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
  std::vector<std::byte> message;
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
  bool next() { return client.next_goal(message, number); }
  void cancel() { decide.write(decision(canceling)); }
  template <typename T>
  static std::vector<std::byte> message_of(const T& value) {
    std::vector<std::byte> written;
    CdrWriter(written).put(value);
    return written;
  }
  void finish(std::uint32_t goal_number, GoalState ended, std::int64_t steps, time_ns_t now_ns) {
    client.finish(goal_number, ended, message_of(Walk::Result{steps}), now_ns);
  }
};

TEST_F(ActionClients, SendsAGoalAndReadsWhatBecomesOfIt) {
  EXPECT_EQ(DataStatus::none, status.read().status);
  EXPECT_TRUE(goal.write({12}));
  EXPECT_EQ(1U, found().number);
  EXPECT_EQ(unknown, state());
  ASSERT_TRUE(next());
  Walk::Goal sent;
  EXPECT_TRUE(CdrReader(message).get(sent));
  EXPECT_EQ(12, sent.steps);
  EXPECT_FALSE(next()) << "it is sent once";

  client.answer(number, true, 1);
  EXPECT_EQ(accepted, state());
  client.set_state(number, executing, 2);
  EXPECT_EQ(executing, state());
  client.feed_back(number, message_of(Walk::Feedback{3}), 3);
  const Sample<Walk::Feedback> fed = feedback.read();
  EXPECT_TRUE(fed.is_new());
  EXPECT_EQ(3, fed.value.step);
  EXPECT_EQ(DataStatus::none, result.read().status);
  finish(number, succeeded, 12, 4);
  EXPECT_EQ(succeeded, state());
  EXPECT_EQ(12, result.read().value.steps);
  finish(number, aborted, 1, 5);
  EXPECT_EQ(succeeded, state()) << "it has ended";

  EXPECT_TRUE(goal.write({13}));
  EXPECT_EQ(2U, found().number);
  EXPECT_EQ(DataStatus::none, feedback.read().status) << "that was of another goal";
  EXPECT_EQ(DataStatus::none, result.read().status);
}

TEST_F(ActionClients, KnowsTheGoalThatExecutesAndWhetherTheLastOneFailed) {
  const auto now = [&] { return client.goals_now(); };
  EXPECT_FALSE(now().is_aborted);
  goal.write({1});
  next();
  client.answer(number, true, 5);
  EXPECT_EQ(0U, now().executing) << "the server has accepted the goal, no more";
  client.set_state(number, executing, 7);
  EXPECT_EQ(number, now().executing);
  EXPECT_EQ(5, now().accepted_ns);
  client.set_state(number, canceling, 8);
  EXPECT_EQ(number, now().executing);
  finish(number, aborted, 0, 9);
  EXPECT_EQ(0U, now().executing);
  EXPECT_TRUE(now().is_aborted);
  goal.write({1});
  EXPECT_TRUE(now().is_aborted) << "the goal is not accepted yet";
  next();
  client.answer(number, false, 10);
  EXPECT_TRUE(now().is_aborted) << "a rejection by the server's component changes nothing";
  goal.write({1});
  next();
  client.answer(number, true, 11);
  EXPECT_FALSE(now().is_aborted);
  client.give_up(number, GoalReason::no_server, 12);
  EXPECT_TRUE(now().is_aborted);
  goal.write({1});
  cancel();
  EXPECT_FALSE(now().is_aborted) << "the goal was canceled before it was sent";
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
  EXPECT_EQ(sent_ns + kAnswer, client.poll(sent_ns + 1));
  client.poll(sent_ns + kAnswer);
  EXPECT_EQ(rejected, state());
  EXPECT_EQ(GoalReason::no_answer, found().its_reason());
  EXPECT_FALSE(next()) << "it is not sent after that";
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
  finish(1, canceled, 0, 3);
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
  finish(2, unknown, 0, 3);
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
