// SPDX-License-Identifier: LGPL-3.0-or-later
// Eight clients that all change and look at one architecture at once, for ThreadSanitizer above all: adopts that take long,
// a thread that leaves them little of the CPU, and times at the ends of what 64 bits hold.
// MAUVE_STORM_OPERATIONS says how many operations each of them makes.
#include <array>
#include <cstdlib>
#include <random>

#include "free_fsm.hpp"

namespace mauve::testing::test_storm {

constexpr int kClients = 8;
constexpr time_ns_t kPatience = ms_to_ns(40);  // with commits: some never find their components together

int operations() {
  constexpr int kFew = 1000;
  const char* wanted =
      std::getenv("MAUVE_STORM_OPERATIONS");  // NOLINT(concurrency-mt-unsafe): nobody sets it
  return wanted != nullptr ? std::atoi(wanted) : kFew;
}

/// Writes every time, and wakes who waits for it.
struct WritingCore : TestCore {
  void act() MAUVE_RT override {
    TestCore::act();
    exposed_shell().output.write({.value = static_cast<double>(runs.load(std::memory_order_relaxed))});
  }
};

/// Its adopt and take last a third of a millisecond each.
struct SlowCore : WritingCore {
  bool adopt(const CoreBase& /*old*/) override {
    spin();
    return true;
  }
  void take(CoreBase& /*old*/) noexcept override { spin(); }

 private:
  static void spin() noexcept {
    const time_ns_t until_ns = monotonic_now_ns() + us_to_ns(300);
    while (monotonic_now_ns() < until_ns) {
    }
  }
};

/// Its adopt throws.
struct ThrowingStormCore : WritingCore {
  bool adopt(const CoreBase& /*old*/) override { throw std::runtime_error("as it was told"); }
};

/// Now and then it executes beyond several of its instants, so that it is late to a change.
struct LateCore : TestCore {
  void act() override {
    TestCore::act();
    if (runs.load(std::memory_order_relaxed) % 7 != 0) return;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
};

/// Times that sums of may not fit into 64 bits.
constexpr std::array kEdges{INT64_MIN,     INT64_MIN + 1, time_ns_t{-1}, time_ns_t{0},  time_ns_t{1},
                            us_to_ns(100), kLongest,      kLongest + 1,  INT64_MAX - 1, kForever};

/// Takes what it gets of the CPU that the components run on.
class Hog {
 public:
  Hog() : thread_([this] { run(); }) {}
  ~Hog() {
    ended_ = true;
    thread_.join();
  }
  Hog(const Hog&) = delete;
  Hog& operator=(const Hog&) = delete;

 private:
  void run() const {
    cpu_set_t all;
    CPU_ZERO(&all);
    CPU_SET(kComponentsCpu, &all);
    sched_setaffinity(0, sizeof(all), &all);  // fails where there is no such CPU
    while (!ended_.load(std::memory_order_relaxed)) {
    }
  }

  std::atomic<bool> ended_{false};
  std::thread thread_;
};

class Storm : public ::testing::Test {
 protected:
  Storm() {
    architecture_.add_resource<SharedData<Number>>("one");
    architecture_.add_resource<SharedData<Number>>("other");
    for (int i = 0; i < 4; ++i) {
      const std::string name = "c" + std::to_string(i);
      names_.push_back(name);
      architecture_
          .add_component(name, std::make_unique<TestShell>(), std::make_unique<WritingCore>(),
                         new_part<FsmBase, TestFsm>(), {})
          .set_property("period_ms", std::int64_t{1 + i});
      architecture_.connect(name, "output", i % 2 == 0 ? "one" : "other", "write");
    }
    add_free(architecture_, "listens", [](FreeFsm& fsm) {
      State& run = fsm.run("Run");
      State& rest = fsm.wait_event("Rest", fsm.ports().input, ms_to_ns(5), us_to_ns(300));
      fsm.set_initial(run);
      fsm.next(run, rest);
      fsm.next(rest, run);
    });
    names_.emplace_back("listens");
    architecture_.connect("listens", "input", "one", "read");
    architecture_.configure();
    deployer_.deploy();
  }

  using Random = std::mt19937;

  void client(unsigned seed) {
    Random random(seed);
    for (int i = 0; i < operations(); ++i) {
      try {
        if (random() % 3 == 0) {
          change(random, "own_" + std::to_string(seed));
        } else {
          look_or_command(random);
        }
        ++done_;
      } catch (const Error& error) {  // one was faster, or it is too soon
        EXPECT_NE(ErrorCode::internal, error.code()) << error.what();
        ++refused_;
      }
    }
  }

  const std::string& any(Random& random) const { return names_[random() % names_.size()]; }

  static std::unique_ptr<CoreBase> core(Random& random) {
    if (random() % 4 == 0) return std::make_unique<ThrowingStormCore>();
    if (random() % 3 == 0) return std::make_unique<LateCore>();
    return std::make_unique<SlowCore>();
  }
  static time_ns_t edge(Random& random) { return kEdges[random() % kEdges.size()]; }

  /// Waits for so long, and for an event with so long a time-out.
  static std::unique_ptr<FsmBase> edge_fsm(time_ns_t wait_ns, time_ns_t timeout_ns) {
    return std::make_unique<FreeFsm>([=](FreeFsm& fsm) {
      State& run = fsm.run("Run");
      State& event =
          fsm.wait_event("Event", fsm.ports().input, timeout_ns, std::min(timeout_ns, us_to_ns(300)));
      State& rest = fsm.wait("Rest", wait_ns);
      fsm.set_initial(run);
      fsm.next(run, event);
      fsm.next(event, rest);
      fsm.next(rest, run);
    });
  }

  void change(Random& random, const std::string& own) {
    Transaction transaction;
    switch (random() % 12) {
      case 0:
        transaction.replace_core(any(random), std::make_unique<WritingCore>());
        break;
      case 8:
        transaction.replace_core(any(random), core(random));
        transaction.set_property(any(random), "gain", 1.0);
        break;
      case 9:
        transaction.replace_fsm(any(random), edge_fsm(edge(random), edge(random)));
        break;
      case 10:
        transaction.replace_fsm(any(random), std::make_unique<TestFsm>());
        break;
      case 11:
        transaction.stop("listens").start("listens", edge(random));
        break;
      case 1:
        transaction.set_property(any(random), "gain", static_cast<double>(random() % 10));
        transaction.set_property(any(random), "gain", static_cast<double>(random() % 10));
        break;
      case 2:
        transaction.add_component<TestShell, TestCore, TestFsm>(own).start(own);
        break;
      case 3:
        transaction.remove_component(own);
        break;
      case 4:
        transaction.disconnect("listens", "input")
            .connect("listens", "input", random() % 2 == 0 ? "one" : "other", "read");
        break;
      case 5:
        transaction.resynchronise();
        break;
      case 6:
        transaction.stop(any(random));
        break;
      default:
        transaction.start(any(random));
    }
    const time_ns_t phase_ns = random() % 4 == 0 ? ms_to_ns(20) : std::min(edge(random), ms_to_ns(20));
    const time_ns_t commit_ns = random() % 4 == 0 ? std::min(edge(random), kPatience) : kPatience;
    deployer_.commit(std::move(transaction), {.timeouts = {.commit_ns = commit_ns, .phase_ns = phase_ns}});
  }

  void look_or_command(Random& random) {
    switch (random() % 8) {
      case 0:
        return deployer_.stop(any(random),
                              random() % 4 == 0 ? std::min(edge(random), s_to_ns(1)) : s_to_ns(1));
      case 1:
        if (random() % 2 == 0) return deployer_.start(any(random), edge(random));
        return deployer_.start(any(random));
      case 2:
        deployer_.set_property(any(random), "gain", 2.0, {.commit_ns = kPatience, .phase_ns = 0});
        return;
      case 3:
        EXPECT_GE(architecture_.describe().components.size(), names_.size());
        return;
      case 4:
        deployer_.drain_trace();
        return;
      case 5:
        for (const auto& component : architecture_.components()) {
          const StateAge age = component->task().state_age();
          EXPECT_GE(age.age_ns, 0);
          EXPECT_EQ("", component->task().fault().what);
        }
        return;
      case 6:
        EXPECT_GE(architecture_.hold_component(any(random))->task().grid().period_ns, 0);
        return;
      default:
        deployer_.wait_change(static_cast<std::uint32_t>(architecture_.revision() - 1),
                              monotonic_now_ns() + us_to_ns(200));
    }
  }

  AwayFromComponents away_;
  std::vector<std::string> names_;
  Architecture architecture_;
  Deployer deployer_{architecture_};
  std::atomic<int> done_{0};
  std::atomic<int> refused_{0};
};

TEST_F(Storm, LeavesAnArchitectureThatDoesAsItIsTold) {
  const Hog hog;
  std::vector<std::thread> clients;
  for (unsigned i = 0; i < kClients; ++i) clients.emplace_back([this, i] { client(i + 1); });
  for (std::thread& client : clients) client.join();
  EXPECT_EQ(kClients * operations(), done_ + refused_);
  EXPECT_GT(done_, refused_ / 10) << "much of it is possible";
  for (const std::string& name : names_) {
    Component& component = architecture_.component(name);
    wait_until([&] { return component.task().state() != ComponentState::stopping; }, "its stop");
    if (component.task().state() == ComponentState::running) deployer_.stop(name, s_to_ns(60));
    Transaction again;  // it may wait for ever
    again.replace_fsm(name, std::make_unique<TestFsm>()).start(name);
    deployer_.commit(std::move(again), {.timeouts = {.commit_ns = s_to_ns(60), .phase_ns = 0}});
    const auto released = component.task().statistics().releases.load();
    wait_until([&] { return component.task().statistics().releases > released; }, "a release");
    EXPECT_EQ("", component.task().fault().what);
    EXPECT_EQ(architecture_.deployment_epoch_ns(), component.task().grid().reference_ns);
  }
}

}  // namespace mauve::testing::test_storm
