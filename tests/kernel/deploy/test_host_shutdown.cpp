// SPDX-License-Identifier: LGPL-3.0-or-later
// A host of threads that ends while others prepare changes: it waits for nobody, and nobody uses what it released.
#include "hosts.hpp"

namespace mauve::testing::test_host_shutdown {

/// A core whose configure hook lasts until the test lets it go.
struct SlowCore : TestCore {
  struct Latch {
    std::atomic<bool> entered{false};
    std::atomic<bool> open{false};
  };
  explicit SlowCore(Latch& whose) : latch(whose) {}
  bool configure_hook() override {
    latch.entered = true;
    Backoff back_off;
    while (!latch.open) back_off();
    return true;
  }
  Latch& latch;
};

/// The same of its adopt.
struct SlowToAdopt : TestCore {
  explicit SlowToAdopt(SlowCore::Latch& whose) : latch(whose) {}
  bool adopt(const CoreBase& /*old*/) override {
    latch.entered = true;
    Backoff back_off;
    while (!latch.open) back_off();
    return true;
  }
  SlowCore::Latch& latch;
};

class HostShutdown : public Deployed {
 protected:
  /// A change that is being prepared on another thread, until `latch` opens.
  std::thread prepare(Transaction change) {
    std::thread other([this, change = std::move(change)]() mutable {
      try {
        deployer.commit(std::move(change));
      } catch (const Error& error) {
        refusal = error.code();
      }
    });
    wait_until([this] { return latch.entered.load(); }, "the preparation");
    return other;
  }

  SlowCore::Latch latch;
  std::atomic<ErrorCode> refusal{ErrorCode::internal};
};

TEST_F(HostShutdown, WaitsForNobodysPreparation) {
  Component& drive = add("drive");
  add("changed");
  architecture.add_resource<SharedData<Number>>("command");
  architecture.connect("drive", "output", "command", "write");
  core(drive).work = [&] { core(drive).exposed_shell().output.write({1.0}); };
  deploy();
  wait_runs(drive, 2);
  CoreBase* const old = &architecture.component("changed").core();
  Transaction change;
  change.replace_core("changed", std::make_unique<SlowCore>(latch));
  std::thread other = prepare(std::move(change));
  deployer.shutdown();  // it returns while the hook lasts
  EXPECT_FALSE(latch.open);
  EXPECT_EQ(ComponentState::stopped, drive.task().state());
  EXPECT_FALSE(drive.task().has_thread());
  EXPECT_EQ(nullptr, architecture.host());
  Number command{};
  time_ns_t written_ns = 0;
  ReaderState reader;
  auto& resource = dynamic_cast<SharedData<Number>&>(architecture.resource("command"));
  resource.read.read(command, written_ns, reader);
  EXPECT_EQ(0.0, command.value) << "the outputs are safe";
  latch.open = true;
  other.join();
  EXPECT_EQ(ErrorCode::not_configured, refusal);
  EXPECT_EQ(old, &architecture.component("changed").core());
  deployer.deploy();  // and all is as before
  const int runs = core(drive).runs;
  wait_runs(drive, runs + 2);
  deployer.shutdown();
}

TEST_F(HostShutdown, AThreadThatHasTheOrderToEndIsGivenNoStart) {
  Task& task = add("component").task();
  deploy();
  deployer.stop("component");
  task.end_thread(0);  // as a shutdown gives the order to all before it waits for one
  try {
    task.start({}, s_to_ns(60));
    ADD_FAILURE() << "it was posted";
  } catch (const Error& error) {
    EXPECT_EQ(ErrorCode::not_configured, error.code()) << error.what();
  }
}

TEST_F(HostShutdown, WaitsForNoAdoptOfAStoppedComponent) {
  Component& drive = add("drive");
  Component& changed = add("changed");
  deploy();
  wait_runs(drive, 1);
  deployer.stop("changed");
  CoreBase* const old = &changed.core();
  Transaction change;
  change.replace_core("changed", std::make_unique<SlowToAdopt>(latch)).start("changed");
  std::thread other = prepare(std::move(change));  // the adopt runs on the stopped component's thread
  deployer.stop("drive");
  deployer.start("drive");
  wait_runs(drive, core(drive).runs + 2);
  deployer.shutdown();  // it returns while the adopt lasts
  EXPECT_FALSE(latch.open);
  EXPECT_FALSE(drive.task().has_thread());
  EXPECT_EQ(nullptr, architecture.host());
  other.join();  // nor does who asked for it
  EXPECT_EQ(ErrorCode::not_configured, refusal);
  EXPECT_EQ(old, &changed.core());
  EXPECT_EQ(ComponentState::faulted, changed.task().state()) << "its thread was given up";
  latch.open = true;
  wait_until([&] { return changed.task().has_ended(); }, "the thread to come back");
  const int runs = core(drive).runs;
  deployer.deploy();
  wait_runs(drive, runs + 2);
  EXPECT_EQ(ComponentState::faulted, changed.task().state());
  deployer.shutdown();
}

TEST_F(HostShutdown, AComponentThatWasToBeAddedIsLetGo) {
  Component& present = add("present");
  deploy();
  wait_runs(present, 1);
  Transaction change;
  change.add_component("early", Parts{.shell = std::make_unique<TestShell>(),
                                      .core = std::make_unique<TestCore>(),
                                      .fsm = std::make_unique<TestFsm>()});
  change.add_component("late", Parts{.shell = std::make_unique<TestShell>(),
                                     .core = std::make_unique<SlowCore>(latch),
                                     .fsm = std::make_unique<TestFsm>()});
  std::thread other = prepare(std::move(change));  // the first of them has its thread by now
  deployer.shutdown();
  latch.open = true;
  other.join();
  EXPECT_EQ(ErrorCode::not_configured, refusal);
  EXPECT_EQ(nullptr, architecture.find_component("early"));
  EXPECT_EQ(1U, architecture.components().size());
}

TEST_F(HostShutdown, AHostThatGoesWaitsForTheChangeThatUsesIt) {
  add("changed");
  architecture.configure();
  auto passing = std::make_unique<Deployer>(architecture);
  passing->deploy();
  std::thread other([this] {
    try {
      architecture.component("changed").swap_core(std::make_unique<SlowCore>(latch));
    } catch (const Error& error) {
      refusal = error.code();
    }
  });
  wait_until([this] { return latch.entered.load(); }, "the preparation");
  passing->shutdown();
  std::thread opener([this] {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    latch.open = true;
  });
  passing.reset();
  EXPECT_TRUE(latch.open) << "the preparation used it until then";
  other.join();
  opener.join();
  EXPECT_EQ(ErrorCode::not_configured, refusal);
}

TEST_F(HostShutdown, DeployAndShutdownAtOnceLeaveOneOfTheTwo) {
  Component& component = add("c");
  architecture.configure();
  for (int i = 0; i < 20; ++i) {
    std::thread deploying([this] {
      try {
        deployer.deploy();
      } catch (const Error& error) {
        EXPECT_EQ(ErrorCode::already_running, error.code());
      }
    });
    deployer.shutdown();
    deploying.join();
    EXPECT_EQ(deployer.is_deployed(), component.task().has_thread());
    EXPECT_EQ(deployer.is_deployed() ? &deployer : nullptr, architecture.host());
  }
  deployer.shutdown();
  EXPECT_FALSE(component.task().has_thread());
}

TEST_F(HostShutdown, FromAHookItEndsTheHostAndTheChange) {
  Component& component = add("c");
  deploy();
  wait_runs(component, 1);
  struct Ending : TestCore {
    explicit Ending(Deployer& whose) : host(whose) {}
    bool configure_hook() override {
      host.shutdown();
      return true;
    }
    Deployer& host;
  };
  try {
    component.swap_core(std::make_unique<Ending>(deployer));
    FAIL() << "should have been refused";
  } catch (const Error& error) {
    EXPECT_EQ(ErrorCode::not_configured, error.code());
  }
  EXPECT_FALSE(deployer.is_deployed());
}

}  // namespace mauve::testing::test_host_shutdown
