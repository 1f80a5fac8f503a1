// SPDX-License-Identifier: LGPL-3.0-or-later
// Sporadic task, polling server and deferrable server in virtual time: which request is served when.
#include "simulated.hpp"

namespace mauve::testing::test_elements_servers {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::Pair;
using types::Float64;

using ServedShell = ServerShell<Float64>;
struct Served : ServerCore<ServedShell> {
  std::vector<std::pair<double, time_ns_t>> all;  // each request, and when it was served
  void serve() override { all.emplace_back(request().data, clock_ns()); }
};

/// A server with a period of 10 ms at a ring.
class Servers : public Simulated {
 protected:
  template <template <typename, typename> typename FsmType>
  void deploy_server(std::int64_t budget, std::size_t places = 64, int requests_before = 0) {
    ring_ = &architecture.add_resource<RingBuffer<Float64>>("ring", places);
    server_ = &architecture.add_component<ServedShell, Served, FsmType<ServedShell, ServerCore<ServedShell>>>(
        "server");
    server_->set_property("budget", budget);
    architecture.connect("server", "requests", "ring", "read");
    server_->core_as<Served>().all.reserve(1000);
    for (int i = 1; i <= requests_before; ++i) ring_->write.write({static_cast<double>(i)}, 0);
    deploy();
  }
  /// Requests `first`, `first` + 1 ... at this time after the epoch.
  void request_at(double after_ms, int first, int count = 1) {
    const time_ns_t when = simulation.epoch_ns() + static_cast<time_ns_t>(after_ms * 1e6);
    simulation.at(when, [this, when, first, count] {
      for (int i = 0; i < count; ++i) ring_->write.write({static_cast<double>(first + i)}, when);
    });
  }
  /// Each request so far, and when it was served, in ms after the epoch.
  std::vector<std::pair<double, double>> served() const {
    std::vector<std::pair<double, double>> found;
    for (const auto& [request, instant] : server_->core_as<Served>().all)
      found.emplace_back(request, static_cast<double>(instant - simulation.epoch_ns()) / 1e6);
    return found;
  }

  RingBuffer<Float64>* ring_{nullptr};
  Component* server_{nullptr};
};

TEST_F(Servers, ASporadicTaskServesAtOnceAndKeepsRequestsApart) {
  deploy_server<SporadicFsm>(1);
  request_at(23, 1);
  request_at(25, 2, 2);
  request_at(60, 4);
  request_at(75.5, 5);
  run_to(ms_to_ns(200));
  EXPECT_THAT(served(), ElementsAre(Pair(1, 23), Pair(2, 33), Pair(3, 43), Pair(4, 60), Pair(5, 75.5)));
}

TEST_F(Servers, APollingServerServesUpToItsBudgetInEachPeriod) {
  deploy_server<PollingServerFsm>(2);
  EXPECT_EQ(ms_to_ns(10), server_->fsm().period_ns());
  request_at(12, 1, 5);
  run_to(ms_to_ns(100));
  EXPECT_THAT(served(), ElementsAre(Pair(1, 20), Pair(2, 20), Pair(3, 30), Pair(4, 30), Pair(5, 40)));
}

TEST_F(Servers, APollingServerLosesTheBudgetOfAPeriodInWhichNothingWaits) {
  deploy_server<PollingServerFsm>(2);
  run_to(ms_to_ns(50));
  EXPECT_THAT(served(), IsEmpty());
  request_at(51, 1, 3);
  run_to(ms_to_ns(100));
  EXPECT_THAT(served(), ElementsAre(Pair(1, 60), Pair(2, 60), Pair(3, 70)))
      << "at no other instant, and no more";
}

TEST_F(Servers, ADeferrableServerServesAtOnceAndKeepsItsBudget) {
  deploy_server<DeferrableServerFsm>(3);
  request_at(51.3, 1);
  request_at(55.2, 2);
  request_at(58.3, 3);
  run_to(ms_to_ns(100));
  EXPECT_THAT(served(), ElementsAre(Pair(1, 51.3), Pair(2, 55.3), Pair(3, 58.3)))
      << "the first at once, the others at the next of 10 polls in the period";
}

TEST_F(Servers, ADeferrableServerWithoutBudgetWaitsForTheNextPeriod) {
  deploy_server<DeferrableServerFsm>(2);
  request_at(50, 1, 3);
  request_at(53, 4, 2);
  run_to(ms_to_ns(100));
  EXPECT_THAT(served(), ElementsAre(Pair(1, 50), Pair(2, 50), Pair(3, 60), Pair(4, 60), Pair(5, 70)));
}

TEST_F(Servers, ADeferrableServersPeriodsMeetBackToBack) {
  deploy_server<DeferrableServerFsm>(3);
  request_at(50, 1);
  request_at(58.5, 2, 5);
  request_at(63, 7);
  run_to(ms_to_ns(100));
  EXPECT_THAT(served(), ElementsAre(Pair(1, 50), Pair(2, 59), Pair(3, 59), Pair(4, 60), Pair(5, 60),
                                    Pair(6, 60), Pair(7, 70)))
      << "5 requests within 1 ms, where the budget is 3 in 10 ms";
}

TEST_F(Servers, ADeferrableServerIsAtOnceAgainAfterAPeriodWithPolls) {
  deploy_server<DeferrableServerFsm>(3);
  request_at(50, 1);
  request_at(53.5, 2);  // its event is still there when the period ends
  request_at(60.25, 3);
  run_to(ms_to_ns(100));
  EXPECT_THAT(served(), ElementsAre(Pair(1, 50), Pair(2, 54), Pair(3, 60.25)));
}

TEST_F(Servers, AServerThatHasJustBecomeIdleServesAHundredthOfThePeriodLate) {
  deploy_server<DeferrableServerFsm>(3);
  request_at(50, 1);
  request_at(60.02, 2);
  run_to(ms_to_ns(100));
  EXPECT_THAT(served(), ElementsAre(Pair(1, 50), Pair(2, 60.1)));
}

TEST_F(Servers, ASporadicTaskServesRequestsFromBeforeTheStart) {
  deploy_server<SporadicFsm>(1, 64, 2);
  run_to(ms_to_ns(30));
  EXPECT_THAT(served(), ElementsAre(Pair(1, 10), Pair(2, 20)));
}

TEST_F(Servers, ADeferrableServerServesRequestsFromBeforeTheStart) {
  deploy_server<DeferrableServerFsm>(1, 64, 2);
  run_to(ms_to_ns(30));
  EXPECT_THAT(served(), ElementsAre(Pair(1, 1), Pair(2, 11)));
}

TEST_F(Servers, OnlyTheRingLosesRequests) {
  deploy_server<PollingServerFsm>(1, 2);
  request_at(1, 1, 4);
  run_to(ms_to_ns(50));
  EXPECT_EQ(2U, served().size());
  EXPECT_EQ(2U, ring_->lost()) << "refused where the ring is full";
}

}  // namespace mauve::testing::test_elements_servers
