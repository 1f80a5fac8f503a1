// SPDX-License-Identifier: LGPL-3.0-or-later
// Rule 10: what transactions cost beside components in long states, stops, and other transactions; on threads, where
// these happen at once.
#include <random>

#include "rhythm.hpp"
#include "transaction_fixtures.hpp"

namespace mauve::testing::test_transaction_beside {

/// Stays in its state for as long as it is told to.
struct LatchedCore : TestCore {
  struct Latch {
    std::atomic<bool> closed{false};
    std::atomic<bool> inside{false};
  };
  explicit LatchedCore(Latch& shared) : latch(shared) {}
  void act() override {
    TestCore::act();
    latch.inside = true;
    while (latch.closed) std::this_thread::sleep_for(std::chrono::microseconds(100));
    latch.inside = false;
  }
  Latch& latch;
};

class Rule10Beside : public Transacted {
 protected:
  Rhythm rhythm_of(const std::string& name, std::int64_t period_ms) const {
    Rhythm rhythm(name, architecture.component(name).task().number(), deployer.epoch_ns(), false);
    rhythm.expect_start({{ms_to_ns(period_ms)}}, false);
    return rhythm;
  }
  void look(std::initializer_list<Rhythm*> rhythms) {
    const TraceDrain drain = deployer.drain_trace();
    for (const TraceRecord& record : drain.records) {
      for (Rhythm* rhythm : rhythms) {
        if (rhythm->number() == record.component) rhythm->take(record);
      }
    }
  }
};

TEST_F(Rule10Beside, ARefusedTransactionCostsItsParticipantsNoInstant) {
  constexpr int kRounds = 30;
  LatchedCore::Latch latch;
  const ComponentsEndFirst ends_first(deployer);
  architecture.add_component("latched", std::make_unique<TestShell>(), std::make_unique<LatchedCore>(latch),
                             std::make_unique<TestFsm>(), {.priority = 40, .cpus = {kComponentsCpu}});
  add("fast", 1);
  add("neighbour", 1, {.priority = 60});
  deploy();
  Rhythm fast = rhythm_of("fast", 1);
  Rhythm neighbour = rhythm_of("neighbour", 1);
  std::int64_t lost = 0;
  for (int i = 0; i < kRounds; ++i) {
    latch.closed = true;
    wait_until([&] { return latch.inside.load(); }, "the long state");
    look({&fast, &neighbour});
    const std::int64_t fast_before = fast.lost();
    const std::int64_t neighbour_before = neighbour.lost();
    Transaction transaction;
    transaction.set_property("fast", "gain", 2.0).set_property("latched", "gain", 2.0);
    const Error error = error_of(transaction, {.timeouts = {.commit_ns = ms_to_ns(30), .phase_ns = 0}});
    EXPECT_EQ(ErrorCode::timeout, error.code()) << error.what();
    look({&fast, &neighbour});
    // What the machine does to all of them says nothing.
    if (neighbour.lost() == neighbour_before) lost += fast.lost() - fast_before;
    latch.closed = false;
    wait_until([&] { return !latch.inside.load(); }, "its end");
  }
  EXPECT_EQ(PropertyValue(1.0), property("fast", "gain"));
  EXPECT_LT(lost, kRounds) << "fewer than one each, which a busy machine makes, where 15 each would fit";
}

/// Requests of two clients, and stops, at random phases.
class Rule10Storm : public Rule10Beside {
 protected:
  static constexpr int kComponents = 4;

  /// Everything else than these would be a fault of ours.
  static void expect_known(const Error& error) {
    static const std::set<ErrorCode> kKnown{ErrorCode::timeout, ErrorCode::adopt_refused,
                                            ErrorCode::not_running, ErrorCode::already_running,
                                            ErrorCode::wrong_revision};
    EXPECT_TRUE(kKnown.contains(error.code())) << error.what();
  }

  void request(std::uint64_t seed, int count) {
    std::mt19937_64 random(seed);
    const auto below = [&](int bound) { return std::uniform_int_distribution<int>(0, bound - 1)(random); };
    for (int i = 0; i < count; ++i) {
      Transaction transaction;
      for (int steps = 1 + below(3); steps > 0; --steps) {
        const std::string name = "c" + std::to_string(below(kComponents));
        switch (below(6)) {
          case 0:
            transaction.set_property(name, "gain", static_cast<double>(below(10)));
            break;
          case 1:
            transaction.replace_fsm(name, below(2) == 0 ? "t/Fsm" : "t/Syncopated");
            break;
          case 2:
            transaction.stop(name);
            break;
          case 3:
            transaction.start(name);
            break;
          default:
            transaction.replace_core(name, below(8) == 0 ? "t/Refusing" : "t/Counting");
        }
      }
      try {
        deployer.commit(std::move(transaction), {.timeouts = {.commit_ns = ms_to_ns(200), .phase_ns = 0}});
      } catch (const Error& error) {
        expect_known(error);
      }
    }
  }

  void stop_and_start(std::uint64_t seed, int count) {
    std::mt19937_64 random(seed);
    for (int i = 0; i < count; ++i) {
      const std::string name = "c" + std::to_string(random() % kComponents);
      try {
        deployer.stop(name, s_to_ns(30));
      } catch (const Error& error) {
        EXPECT_NE(ErrorCode::timeout, error.code()) << error.what();
        expect_known(error);
      }
      std::this_thread::sleep_for(std::chrono::microseconds(random() % 2'000));
      try {
        deployer.start(name);
      } catch (const Error& error) {
        expect_known(error);
      }
      std::this_thread::sleep_for(std::chrono::microseconds(random() % 2'000));
    }
  }
};

TEST_F(Rule10Storm, AllIsInOrderWhenItIsOver) {
  for (int i = 0; i < kComponents; ++i) add("c" + std::to_string(i), 1 + i % 2);
  add("neighbour", 1, {.priority = 60});
  deploy();
  Rhythm neighbour = rhythm_of("neighbour", 1);
  std::atomic<int> busy{3};
  const auto run = [&](auto body) {
    return std::thread([&busy, body] {
      body();
      --busy;
    });
  };
  std::vector<std::thread> clients;
  clients.push_back(run([this] { request(1, 200); }));
  clients.push_back(run([this] { request(2, 200); }));
  clients.push_back(run([this] { stop_and_start(3, 200); }));
  const Grid grid{.reference_ns = deployer.epoch_ns(), .period_ns = ms_to_ns(1)};
  const auto look_on = [&] {
    for (const TraceRecord& record : deployer.drain_trace().records) {
      if (record.component == neighbour.number()) {
        neighbour.take(record);
      } else if (record.kind == static_cast<std::uint16_t>(TraceKind::release)) {
        EXPECT_EQ(0, grid.phase_error(record.a));
      }
    }
  };
  while (busy > 0) {
    look_on();
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  for (std::thread& client : clients) client.join();
  look_on();
  for (int i = 0; i < kComponents; ++i) {
    const std::string name = "c" + std::to_string(i);
    SCOPED_TRACE(name);
    const ComponentState state = facts(name).state;
    ASSERT_THAT(state, ::testing::AnyOf(ComponentState::running, ComponentState::stopped));
    if (state == ComponentState::stopped) deployer.start(name);
    expect_running(name);
    deployer.stop(name);
  }
}

}  // namespace mauve::testing::test_transaction_beside
