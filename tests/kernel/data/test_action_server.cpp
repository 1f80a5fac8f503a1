// SPDX-License-Identifier: LGPL-3.0-or-later
// Goals that come from outside: one after another, answered in time or rejected, ended by the component or with a reason.
#include "action_types.hpp"

namespace mauve::testing::test_action_server {

using States = std::map<int, std::vector<GoalState>>;
using enum GoalState;

constexpr time_ns_t kAnswer = ms_to_ns(100);

/// A server of two goals, with the ports of a component.
struct ActionServers : ::testing::Test {
  ActionServer<Walk> server{2, kAnswer};
  GoalCarrier carrier{server};
  ReadPort<ActionGoal> status{"status"};
  ReadPort<Walk::Goal> goal{"goal"};
  WritePort<ActionGoal> decide{"decide"};
  WritePort<Walk::Feedback> feedback{"feedback"};
  WritePort<Walk::Result> result{"result"};

  ActionServers() {
    server.set_name("walk");
    status.connect(server.status, "walk");
    goal.connect(server.goal, "walk");
    decide.connect(server.decide, "walk");
    feedback.connect(server.feedback, "walk");
    result.connect(server.result, "walk");
  }
  ~ActionServers() override {
    for (PortBase* port : std::initializer_list<PortBase*>{&status, &goal, &decide, &feedback, &result})
      port->disconnect();
  }
  GoalState state() { return status.read().value.its_state(); }
};

TEST_F(ActionServers, ExecutesGoalsOneAfterAnother) {
  EXPECT_EQ(unknown, state());
  EXPECT_EQ(GoalReason::none, carrier.ask(1, 10));
  EXPECT_EQ(GoalReason::none, carrier.ask(2, 20));
  EXPECT_EQ(1U, server.status.ports());
  const ActionGoal first = status.read().value;
  EXPECT_EQ(1U, first.number);
  EXPECT_EQ(executing, first.its_state());
  EXPECT_EQ(1U, first.waiting);
  EXPECT_EQ(10, goal.read().value.steps);
  EXPECT_EQ((States{{1, {executing}}, {2, {accepted}}}), carrier.take());

  feedback.write({3});
  EXPECT_EQ(States{}, carrier.take());
  EXPECT_EQ((std::deque<std::int64_t>{3}), carrier.feedback);
  result.write({10});
  EXPECT_TRUE(decide.write(decision(succeeded)));
  EXPECT_EQ((States{{1, {succeeded}}, {2, {executing}}}), carrier.take());
  EXPECT_EQ(10, carrier.results[1]);

  const Sample<Walk::Goal> second = goal.read();
  EXPECT_TRUE(second.is_new());
  EXPECT_EQ(20, second.value.steps);
  EXPECT_FALSE(goal.read().is_new());
  EXPECT_TRUE(decide.write(decision(aborted)));
  EXPECT_EQ((States{{2, {aborted}}}), carrier.take());
  EXPECT_EQ(0, carrier.results[2]) << "the result of another goal is not its own";
  EXPECT_EQ(unknown, state());
  EXPECT_EQ(DataStatus::none, goal.read().status);
  const ActionCounts counts = server.counts();
  EXPECT_EQ(2U, counts.accepted);
  EXPECT_EQ(1U, counts.succeeded);
  EXPECT_EQ(1U, counts.aborted);
}

TEST_F(ActionServers, KnowsTheGoalThatExecutesSinceItsAcceptance) {
  EXPECT_EQ(0U, server.goals_now().executing);
  carrier.ask(1, 1, 10);
  EXPECT_EQ(0U, server.goals_now().executing) << "no component has accepted the goal";
  carrier.ask(2, 1, 20);
  EXPECT_EQ(executing, state());
  EXPECT_EQ(1U, server.goals_now().executing);
  EXPECT_EQ(10, server.goals_now().accepted_ns);
  server.cancel(goal_id(1), 30);
  EXPECT_EQ(1U, server.goals_now().executing) << "the goal is canceling";
  server.decide.write(decision(canceled), 40);
  EXPECT_EQ(2U, server.goals_now().executing);
  EXPECT_EQ(20, server.goals_now().accepted_ns) << "the wait for its turn counts";
  server.decide.write(decision(succeeded), 50);
  EXPECT_EQ(0U, server.goals_now().executing);
}

TEST_F(ActionServers, KnowsThatAGoalWasAbortedUntilOneIsAcceptedOrEndsOtherwise) {
  const auto is_aborted = [&] { return server.goals_now().is_aborted; };
  EXPECT_FALSE(is_aborted()) << "before the first goal";
  carrier.ask(1, 1);
  carrier.ask(2, 1);
  EXPECT_EQ(executing, state());
  decide.write(decision(aborted));
  EXPECT_TRUE(is_aborted()) << "the next goal was accepted before";
  decide.write(decision(succeeded));
  EXPECT_FALSE(is_aborted());
  carrier.take();
  carrier.ask(3, 1, 0);
  server.poll(kAnswer);
  EXPECT_TRUE(is_aborted()) << "no answer came in time";
  carrier.take();
  carrier.ask(4, 1);
  EXPECT_TRUE(is_aborted()) << "the goal is not accepted yet";
  EXPECT_EQ(executing, state());
  EXPECT_FALSE(is_aborted());
  decide.write(decision(unknown));
  EXPECT_TRUE(is_aborted()) << "the component was stopped";
  carrier.take();
  carrier.ask(5, 1);
  state();
  decide.write(decision(canceled));
  server.cancel(goal_id(5), 0);
  decide.write(decision(canceled));
  EXPECT_FALSE(is_aborted());
  carrier.take();
  decide.disconnect();
  EXPECT_EQ(GoalReason::no_server, carrier.ask(6, 1));
  EXPECT_TRUE(is_aborted());
}

TEST_F(ActionServers, ARejectionByTheComponentOrForWantOfRoomIsNoFailure) {
  ReadPort<Walk::Goal> asked{"asked"};
  asked.connect(server.asked, "walk");
  carrier.ask(1, 1);
  decide.write(decision(rejected));
  EXPECT_FALSE(server.goals_now().is_aborted);
  carrier.ask(2, 1);
  carrier.ask(3, 1);
  EXPECT_EQ(GoalReason::full, carrier.ask(4, 1));
  EXPECT_FALSE(server.goals_now().is_aborted);
  decide.write(decision(accepted, 2));
  decide.write(decision(aborted));
  decide.write(decision(rejected, 3));
  EXPECT_TRUE(server.goals_now().is_aborted) << "a rejection ends no failure";
  asked.disconnect();
}

TEST_F(ActionServers, RejectsMoreGoalsThanAllowed) {
  EXPECT_EQ(GoalReason::none, carrier.ask(1, 1));
  EXPECT_EQ(GoalReason::none, carrier.ask(2, 1));
  for (std::uint8_t i = 3; i < 255; ++i) EXPECT_EQ(GoalReason::full, carrier.ask(i, 1));
  EXPECT_EQ(252U, server.counts().rejected);
  EXPECT_EQ(executing, state());
  EXPECT_TRUE(decide.write(decision(succeeded)));
  EXPECT_EQ(GoalReason::none, carrier.ask(255, 1))
      << "there is room again, although no client has asked for the result";
}

TEST_F(ActionServers, RejectsAGoalThatIsNoMessageOfTheType) {
  const std::vector<std::byte> nonsense(7, std::byte{1});
  EXPECT_EQ(GoalReason::malformed, server.ask(goal_id(1), nonsense, 0));
}

TEST_F(ActionServers, RejectsAGoalThatIsNotAnsweredInTime) {
  EXPECT_EQ(GoalReason::none, carrier.ask(1, 1, ms_to_ns(5)));
  EXPECT_EQ(ms_to_ns(5) + kAnswer, server.poll(ms_to_ns(104)));
  EXPECT_EQ(States{}, carrier.take());
  EXPECT_EQ(kForever, server.poll(ms_to_ns(105)));
  EXPECT_EQ((States{{1, {rejected}}}), carrier.take());
  EXPECT_EQ(GoalReason::no_answer, carrier.reasons[1]);
  EXPECT_EQ(unknown, state()) << "it is too late to accept it";
  EXPECT_EQ(1U, server.counts().rejected);
}

TEST_F(ActionServers, LetsTheComponentDecideWhereItLooksAtWhatIsAsked) {
  ReadPort<Walk::Goal> asked("asked");
  asked.connect(server.asked, "walk");
  EXPECT_EQ(GoalReason::none, carrier.ask(1, 7));
  EXPECT_EQ(GoalReason::none, carrier.ask(2, 8));
  ActionGoal found = status.read().value;
  EXPECT_EQ(unknown, found.its_state()) << "a look accepts nothing";
  EXPECT_EQ(1U, found.asked);
  EXPECT_EQ(7, asked.read().value.steps);
  EXPECT_TRUE(decide.write(decision(rejected)));
  EXPECT_EQ(8, asked.read().value.steps);
  EXPECT_TRUE(decide.write(decision(accepted, 2)));
  found = status.read().value;
  EXPECT_EQ(2U, found.number);
  EXPECT_EQ(executing, found.its_state());
  EXPECT_EQ(0U, found.asked);
  EXPECT_EQ((States{{1, {rejected}}, {2, {executing}}}), carrier.take());
  EXPECT_EQ(GoalReason::none, carrier.reasons[1]) << "it was the component's decision";
  asked.disconnect();
}

TEST_F(ActionServers, CancelsAWaitingGoalAtOnceAndAsksTheComponentForTheCurrentOne) {
  carrier.ask(1, 1);
  carrier.ask(2, 1);
  EXPECT_FALSE(server.cancel(goal_id(1), 0)) << "it is not accepted yet";
  EXPECT_EQ(executing, state());
  EXPECT_FALSE(server.cancel(goal_id(9), 0));
  EXPECT_TRUE(server.cancel(goal_id(2), 0));
  EXPECT_EQ((States{{1, {executing}}, {2, {canceled}}}), carrier.take());
  EXPECT_FALSE(decide.write(decision(canceled))) << "its client did not ask for that";
  EXPECT_TRUE(server.cancel(goal_id(1), 0));
  EXPECT_EQ(canceling, state());
  EXPECT_TRUE(decide.write(decision(canceled)));
  EXPECT_EQ((States{{1, {canceled}}}), carrier.take());
  EXPECT_FALSE(server.cancel(goal_id(1), 0));
  EXPECT_EQ(1U, server.counts().refused);
}

TEST_F(ActionServers, AGoalMaySucceedAlthoughItsClientAskedToCancelIt) {
  carrier.ask(1, 1);
  EXPECT_EQ(executing, state());
  EXPECT_TRUE(server.cancel(goal_id(1), 0));
  result.write({1});
  EXPECT_TRUE(decide.write(decision(succeeded)));
  EXPECT_EQ((States{{1, {succeeded}}}), carrier.take());
}

TEST_F(ActionServers, GiveTheNewestFeedbackOnly) {
  carrier.ask(1, 1);
  EXPECT_EQ(executing, state());
  carrier.take();
  feedback.write({1});
  feedback.write({2});
  carrier.take();
  EXPECT_EQ((std::deque<std::int64_t>{2}), carrier.feedback);
}

TEST_F(ActionServers, AnEndMayBeToldBeforeItsBeginning) {
  carrier.ask(1, 1);
  EXPECT_EQ(executing, state());
  result.write({1});
  EXPECT_TRUE(decide.write(decision(succeeded)));
  EXPECT_EQ((States{{1, {succeeded}}}), carrier.take()) << "only the last state counts";
}

TEST_F(ActionServers, AStopAbortsAllGoalsAndGivesNoFeedback) {
  carrier.ask(1, 1);
  EXPECT_EQ(executing, state());
  carrier.ask(2, 1);
  carrier.take();
  result.write({5});
  for (PortBase* port : std::initializer_list<PortBase*>{&feedback, &result, &decide})
    port->write_stopped(monotonic_now_ns());
  EXPECT_EQ((States{{1, {aborted}}, {2, {rejected}}}), carrier.take());
  EXPECT_EQ(GoalReason::stopped, carrier.reasons[1]);
  EXPECT_EQ(GoalReason::stopped, carrier.reasons[2]);
  EXPECT_EQ(5, carrier.results[1]) << "what the component wrote, not what the stop does";
  EXPECT_TRUE(carrier.feedback.empty());
}

TEST_F(ActionServers, WithoutAComponentGoalsEndAsRemoved) {
  carrier.ask(1, 1);
  EXPECT_EQ(executing, state());
  decide.disconnect();
  EXPECT_EQ(kForever, server.poll(1));
  EXPECT_EQ((States{{1, {aborted}}}), carrier.take());
  EXPECT_EQ(GoalReason::removed, carrier.reasons[1]);
  EXPECT_EQ(GoalReason::no_server, carrier.ask(2, 1));
}

TEST_F(ActionServers, IsOfOneComponent) {
  WritePort<ActionGoal> another("decide");
  try {
    another.connect(server.decide, "walk");
    ADD_FAILURE() << "two components may not decide";
  } catch (const Error& error) {
    EXPECT_EQ(ErrorCode::invalid_argument, error.code());
  }
}

TEST_F(ActionServers, EndsTheWaitOfAComponent) {
  struct Listener final : EventListener {
    int events{0};
    void on_event(time_ns_t /*time_ns*/) noexcept override { ++events; }
  } listener;
  server.listen(listener);
  carrier.ask(1, 1);
  EXPECT_EQ(1, listener.events);
  EXPECT_EQ(executing, state());
  feedback.write({1});
  EXPECT_EQ(1, listener.events) << "its own feedback is no event";
  server.cancel(goal_id(1), 0);
  EXPECT_EQ(2, listener.events);
  server.unlisten(listener);
}

TEST(ActionKinds, AreMadeOfRegisteredActions) {
  PluginRegistry registry;
  registry.action_type<Walk>();
  registry.action_type<Walk>();  // by another package
  EXPECT_THAT(registry.names("action_type"), ::testing::ElementsAre("test_interfaces/action/Walk"));
  const auto made =
      registry.make_resource("action_server", "test_interfaces/action/Walk", {{"goals", std::int64_t{3}}});
  EXPECT_EQ("action_server", made->kind());
  EXPECT_NE(nullptr, made->action_server());
  EXPECT_EQ(nullptr, made->client());
  const auto port = registry.make_port(PortKind::read, "test_interfaces/action/Walk_Goal", "goal");
  EXPECT_NE(nullptr, port);
  const auto refusal = [&](const char* kind, const char* type, const ResourceParameters& given) {
    try {
      registry.make_resource(kind, type, given);
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string("it was made");
  };
  EXPECT_THAT(refusal("action_server", "test_interfaces/action/Run", {}),
              ::testing::HasSubstr("the type of action is not registered"));
  EXPECT_THAT(refusal("action_server", "test_interfaces/action/Walk", {{"goals", std::int64_t{0}}}),
              ::testing::HasSubstr("goals"));
  EXPECT_THAT(refusal("action_client", "test_interfaces/action/Walk", {{"answer_ns", std::int64_t{0}}}),
              ::testing::HasSubstr("answer_ns"));
}

}  // namespace mauve::testing::test_action_server
