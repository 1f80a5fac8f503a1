// SPDX-License-Identifier: LGPL-3.0-or-later
// A goal under way: it survives a replacement of the core that executes it, and ends with a reason when its component does.
#include "mauve_rt/data/goal_sender.hpp"

#include "data/action_types.hpp"
#include "hosts.hpp"

namespace mauve::testing::test_action_goals {

using enum GoalState;

struct WalkShell : Shell {
  ActionServerPorts<Walk> walk = action_server<Walk>("walk");
};

/// One step in each release, until it has made as many as the goal asks for. Where it is, the goal's number tells the next core.
struct Walker : Core<WalkShell> {
  MAUVE_STATE(goal, step)

 public:
  std::uint32_t goal{0};
  std::int64_t step{0};

  void act() {
    auto& walk = shell().walk;
    const ActionGoal status = walk.status.read().value;
    if (status.number == 0) return;
    if (status.number != goal) {
      goal = status.number;
      step = 0;
    }
    if (status.its_state() == canceling) {
      walk.cancel({step});
      return;
    }
    walk.feedback.write({++step});
    if (step == walk.goal.read().value.steps) walk.succeed({step});
  }
};
struct ThrowingWalker : Walker {
  void act() { throw std::runtime_error("it stumbles"); }
};

template <typename CoreType>
struct WalkFsm : Fsm<WalkShell, CoreType> {
  void define() override {
    State& act = this->execution("Act", "act", &CoreType::act);
    State& pause = this->wait("Pause", ms_to_ns(1));
    this->set_initial(act);
    this->next(act, pause);
    this->next(pause, act);
  }
};

template <typename Way>
class ActionGoals : public OnBothHosts<Way> {
 protected:
  template <typename CoreType = Walker>
  void deploy_walker() {
    server =
        &this->architecture.template add_resource<ActionServer<Walk>>("walk", std::int64_t{2}, s_to_ns(100));
    this->architecture.template add_component<WalkShell, CoreType, WalkFsm<CoreType>>("walker");
    for (const char* name : {"status", "goal", "decide", "feedback", "result"})
      this->architecture.connect("walker", std::string("walk_") + name, "walk", name);
    this->deploy();
    carrier.emplace(*server);
  }
  void until_step(std::int64_t step) {
    this->host.until(
        [&] {
          look();
          return !carrier->feedback.empty() && carrier->feedback.back() >= step;
        },
        "a step of the goal");
  }
  void until_ended(int goal) {
    this->host.until(
        [&] {
          look();
          return !states[goal].empty() && is_final(states[goal].back());
        },
        "the end of the goal");
  }
  void look() {
    for (const auto& [goal, event] : carrier->take())
      states[goal].insert(states[goal].end(), event.begin(), event.end());
  }

  ActionServer<Walk>* server{nullptr};
  std::optional<GoalCarrier> carrier;
  std::map<int, std::vector<GoalState>> states;
};
TYPED_TEST_SUITE(ActionGoals, EveryHost, HostNames);

TYPED_TEST(ActionGoals, AreExecutedByAComponent) {
  this->deploy_walker();
  EXPECT_EQ(GoalReason::none, this->carrier->ask(1, 20, (*this->host).now_ns()));
  this->until_ended(1);
  EXPECT_EQ(succeeded, this->states[1].back());
  EXPECT_EQ(20, this->carrier->results[1]);
  EXPECT_TRUE(std::is_sorted(this->carrier->feedback.begin(), this->carrier->feedback.end()));
}

TYPED_TEST(ActionGoals, AreSentAndFollowedByAProgram) {
  this->deploy_walker();
  GoalSender<Walk> sender(*this->server, [this] { return (*this->host).now_ns(); });
  const std::uint64_t first = sender.ask({.steps = 1'000'000}), second = sender.ask({.steps = 3});
  const std::uint64_t third = sender.ask({.steps = 1});
  std::vector<GoalSender<Walk>::Event> event = sender.events();
  ASSERT_FALSE(event.empty());
  EXPECT_EQ(third, event.front().goal);
  EXPECT_EQ(GoalReason::full, event.front().reason);
  const auto find = [&](std::uint64_t goal, const auto& is_wanted) {
    return [&, goal] {
      for (const auto& each : sender.events()) event.push_back(each);
      return std::any_of(event.begin(), event.end(),
                         [&](const auto& each) { return each.goal == goal && is_wanted(each); });
    };
  };
  this->host.until(find(first, [](const auto& each) { return each.feedback && each.feedback->step > 2; }),
                   "a step");
  EXPECT_TRUE(sender.cancel(first));
  this->host.until(
      find(first, [](const auto& each) { return each.state == canceled && each.result->steps > 2; }),
      "the end of the first goal");
  this->host.until(
      find(second, [](const auto& each) { return each.state == succeeded && each.result->steps == 3; }),
      "the end of the second goal");
  EXPECT_FALSE(sender.cancel(second)) << "it has ended";
}

TYPED_TEST(ActionGoals, SurviveAReplacementOfTheCore) {
  this->deploy_walker();
  EXPECT_EQ(GoalReason::none, this->carrier->ask(1, 1'000'000, (*this->host).now_ns()));
  EXPECT_EQ(GoalReason::none, this->carrier->ask(2, 3, (*this->host).now_ns()));
  this->until_step(5);
  Transaction change;
  auto next = std::make_unique<Walker>();
  next->set_implementation("t/NextWalker");
  change.replace_core("walker", std::move(next));
  this->host.commit(std::move(change));
  const std::int64_t before = this->carrier->feedback.back();
  this->until_step(before + 5);
  EXPECT_TRUE(std::is_sorted(this->carrier->feedback.begin(), this->carrier->feedback.end()))
      << "the new core went on where the old one was";
  EXPECT_EQ((std::vector<GoalState>{executing}), this->states[1]) << "its client saw nothing of it";
  EXPECT_TRUE(this->server->cancel(goal_id(1), (*this->host).now_ns()));
  this->until_ended(1);
  EXPECT_EQ(canceled, this->states[1].back());
  EXPECT_GE(this->carrier->results[1], before);
  this->until_ended(2);
  EXPECT_EQ(succeeded, this->states[2].back());
}

TYPED_TEST(ActionGoals, AreAbortedWhenTheComponentStops) {
  this->deploy_walker();
  this->carrier->ask(1, 1'000'000, (*this->host).now_ns());
  this->carrier->ask(2, 1, (*this->host).now_ns());
  this->until_step(3);
  this->host.stop("walker");
  this->until_ended(1);
  this->until_ended(2);
  EXPECT_EQ(aborted, this->states[1].back());
  EXPECT_EQ(GoalReason::stopped, this->carrier->reasons[1]);
  EXPECT_EQ(GoalReason::stopped, this->carrier->reasons[2]);
  EXPECT_GE(this->carrier->results[1], 0);
  this->host.start("walker");
  this->carrier->ask(3, 2, (*this->host).now_ns());
  this->until_ended(3);
  EXPECT_EQ(succeeded, this->states[3].back()) << "it serves again";
}

TYPED_TEST(ActionGoals, AreAbortedWhenTheCoreThrows) {
  this->template deploy_walker<ThrowingWalker>();
  this->carrier->ask(1, 5, (*this->host).now_ns());
  this->host.until(
      [&] { return this->architecture.component("walker").task().state() == ComponentState::faulted; },
      "the fault");
  this->carrier->ask(2, 5, (*this->host).now_ns());
  this->look();
  EXPECT_TRUE(this->states.empty() || this->states[1].back() == rejected);
  this->server->poll((*this->host).now_ns() + s_to_ns(200));
  this->until_ended(2);
  EXPECT_EQ(rejected, this->states[2].back());
  EXPECT_EQ(GoalReason::no_answer, this->carrier->reasons[2])
      << "a component that is FAULTED answers nothing";
}

}  // namespace mauve::testing::test_action_goals
