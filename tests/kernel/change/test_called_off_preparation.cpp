// SPDX-License-Identifier: LGPL-3.0-or-later
// A change that is called off while a hook of a part that it prepares lasts: others go on at once, and what the hook uses stays until
// it returns.
#include <future>
#include <optional>
#include <random>

#include "hosts.hpp"

namespace mauve::testing::test_called_off_preparation {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr time_ns_t kLong = s_to_ns(600);

/// What was cleaned up, in this order.
class Log {
 public:
  void add(const std::string& name) {
    const std::lock_guard lock(mutex_);
    names_.push_back(name);
  }
  std::vector<std::string> names() const {
    const std::lock_guard lock(mutex_);
    return names_;
  }

 private:
  mutable std::mutex mutex_;
  std::vector<std::string> names_;
};

struct LoggedShell : TestShell {
  LoggedShell(std::string its_name, std::shared_ptr<Log> shared)
      : name(std::move(its_name)), log(std::move(shared)) {}
  void cleanup_hook() override { log->add(name); }
  std::string name;
  std::shared_ptr<Log> log;
};

/// Its hooks use the shell, as it is when they return.
struct LoggedCore : TestCore {
  LoggedCore(std::string its_name, std::shared_ptr<Log> shared, std::shared_ptr<Doors> its_doors = nullptr)
      : name(std::move(its_name)), log(std::move(shared)), doors(std::move(its_doors)) {}
  bool configure_hook() override {
    if (doors != nullptr) doors->pass();
    EXPECT_GE(exposed_shell().gain.value(), 0.0);
    use_shell();
    *has_returned = true;
    return true;
  }
  void cleanup_hook() override {
    use_shell();
    log->add(name);
  }
  void use_shell() { EXPECT_EQ("gain", exposed_shell().properties().front()->name()); }
  std::string name;
  std::shared_ptr<Log> log;
  std::shared_ptr<Doors> doors;
  std::shared_ptr<std::atomic<bool>> has_returned = std::make_shared<std::atomic<bool>>(false);
};

class CalledOffPreparation : public Hosted<OnThreads> {
 protected:
  CalledOffPreparation() {
    Component& b = architecture.add_component("b", std::make_unique<LoggedShell>("shell", log),
                                              std::make_unique<LoggedCore>("core", log),
                                              new_part<FsmBase, TestFsm>(), {});
    b.allow({"t/Core"}, true);
    b.set_property("period_ms", std::int64_t{2});
    add("p");
    architecture.add_resource<LatestValue<Number>>("r");
    architecture.connect("b", "output", "r", "write");
  }
  ~CalledOffPreparation() override { doors->open = true; }

  /// Another thread asks for it, and comes to the hook.
  void begin(Transaction transaction, TransactionOptions options = {}) {
    begin([this, options, asked = std::move(transaction)]() mutable { commit(asked, options); });
  }
  template <typename Ask>
  void begin(Ask&& ask) {
    answer = std::async(std::launch::async, [own = std::forward<Ask>(ask)]() mutable -> std::optional<Error> {
      try {
        own();
      } catch (const Error& error) {
        return error;
      }
      return std::nullopt;  // it is made
    });
    wait_until([&] { return doors->entered.load(); }, "the hook");
  }
  void begin_slow_core(const TransactionOptions& options = {}) {
    begin(std::move(Transaction().replace_core("b", std::make_unique<LoggedCore>("slow", log, doors))),
          options);
  }
  /// Who asked is answered while the hook lasts.
  void expect_answered() {
    const std::optional<Error> error = answer.get();
    ASSERT_TRUE(error.has_value());
    EXPECT_EQ(ErrorCode::wrong_revision, error->code());
    EXPECT_THAT(error->what(), HasSubstr("called off while it was prepared"));
    EXPECT_FALSE(doors->open);
  }
  void expect_called_off() {
    expect_answered();
    EXPECT_THAT(host().open_changes().front().hook, HasSubstr("(called off)"));
    doors->open = true;
    wait_until([&] { return host().open_changes().empty(); }, "the end of the hook");
    wait_until([&] { return !architecture.are_parts_held(*b); }, "the parts to be free");
    EXPECT_NO_THROW(commit(Transaction().set_property("p", "gain", 3.0)));
  }

  std::shared_ptr<Log> log = std::make_shared<Log>();
  std::shared_ptr<Doors> doors = std::make_shared<Doors>();
  std::future<std::optional<Error>> answer;
  std::shared_ptr<Component> b;

  void deploy() {
    Hosted::deploy();
    b = architecture.hold_component("b");
  }
};

TEST_F(CalledOffPreparation, IsAbandonedByTheNameOfItsComponent) {
  deploy();
  begin_slow_core();
  EXPECT_EQ(Abandoned::called_off, host().abandon("b"));
  EXPECT_EQ(ErrorCode::not_running, refusal([&] { host().abandon("b"); }).code()) << "once";
  commit(Transaction().replace_core("b", "t/Core"));
  EXPECT_EQ("t/Core", b->core_implementation());
  expect_called_off();
  EXPECT_EQ("t/Core", b->core_implementation());
}

TEST_F(CalledOffPreparation, WhatItsHookUsesIsCleanedUpAfterIt) {
  deploy();
  begin_slow_core();
  EXPECT_EQ(Abandoned::called_off, host().abandon("b"));
  commit(Transaction()
             .replace_shell("b", std::make_unique<LoggedShell>("second shell", log))
             .replace_core("b", std::make_unique<LoggedCore>("second core", log)));
  commit(Transaction().replace_core("b", std::make_unique<LoggedCore>("third core", log)));
  commit(Transaction().remove_component("b"));
  EXPECT_EQ(nullptr, architecture.find_component("b"));
  EXPECT_THAT(log->names(), IsEmpty()) << "the hook may use all of it";
  expect_called_off();
  wait_until([&] { return log->names().size() == 6; }, "the rest");
  EXPECT_THAT(log->names(),
              ElementsAre("slow", "core", "shell", "second core", "third core", "second shell"));
}

TEST_F(CalledOffPreparation, TheArchitectureCanEndBeforeTheHook) {
  deploy();
  begin_slow_core();
  EXPECT_EQ(Abandoned::called_off, host().abandon("b"));
  commit(Transaction().remove_component("b"));
  expect_answered();
  way.shutdown();
  EXPECT_THAT(log->names(), IsEmpty());
  doors->open = true;
  wait_until([&] { return log->names().size() == 3; }, "the cleanup");
  EXPECT_THAT(log->names(), ElementsAre("slow", "core", "shell"));
}

TEST_F(CalledOffPreparation, TheArchitectureIsNotCleanedUpWhileTheHookLasts) {
  deploy();
  begin_slow_core();
  EXPECT_EQ(Abandoned::called_off, host().abandon("b"));
  expect_answered();
  way.shutdown();
  EXPECT_EQ(ErrorCode::already_running, refusal([&] { architecture.cleanup(); }).code());
  doors->open = true;
  wait_until([&] { return !architecture.are_parts_held(*b); }, "the end of the hook");
  wait_until([&] { return log->names().size() == 1; }, "the cleanup");
  architecture.cleanup();
  EXPECT_THAT(log->names(), ElementsAre("slow", "core", "shell"));
}

TEST_F(CalledOffPreparation, AnArchitectureThatEndsLeavesBehindWhatTheHookUses) {
  auto own = std::make_unique<Architecture>();
  own->add_component("b", std::make_unique<LoggedShell>("shell", log),
                     std::make_unique<LoggedCore>("core", log), new_part<FsmBase, TestFsm>(), {});
  own->configure();
  auto deployer = std::make_unique<Deployer>(*own);
  deployer->deploy();
  auto core = std::make_unique<LoggedCore>("slow", log, doors);
  const auto has_returned = core->has_returned;
  begin([&, fresh = std::move(core)]() mutable {
    deployer->commit(std::move(Transaction().replace_core("b", std::move(fresh))));
  });
  EXPECT_EQ(Abandoned::called_off, deployer->abandon("b"));
  expect_answered();
  deployer.reset();
  own.reset();
  doors->open = true;
  wait_until([&] { return has_returned->load(); }, "the end of the hook");
}

/// A new epoch is about all components.
TEST_F(CalledOffPreparation, OfANewEpochHoldsNobodyAfterwards) {
  deploy();
  begin(std::move(
      Transaction().replace_core("b", std::make_unique<LoggedCore>("slow", log, doors)).resynchronise()));
  EXPECT_EQ(Abandoned::called_off, host().abandon("b"));
  commit(Transaction().set_property("p", "gain", 2.0).resynchronise());
  expect_called_off();
}

/// Once the hook has lasted for longer than the change allows, too.
TEST_F(CalledOffPreparation, OfANewEpochEndsByItself) {
  deploy();
  begin(
      std::move(
          Transaction().replace_core("b", std::make_unique<LoggedCore>("slow", log, doors)).resynchronise()),
      {.timeouts = {.prepare_ns = ms_to_ns(30)}});
  commit(Transaction().set_property("p", "gain", 2.0));
  expect_called_off();
}

/// The candidate is taken out of its shadow last.
TEST_F(CalledOffPreparation, OfAPromoteBesideItIsCalledOffToo) {
  deploy();
  commit(Transaction().shadow("p", std::make_unique<TestCore>(), {.budget_ns = ms_to_ns(1)}));
  begin(std::move(
      Transaction().promote("p").replace_core("b", std::make_unique<LoggedCore>("slow", log, doors))));
  EXPECT_EQ(Abandoned::called_off, host().abandon("b"));
  ASSERT_EQ(1U, host().shadows().size());
  EXPECT_EQ(ShadowVerdict::running, host().shadows().front().verdict);
  expect_called_off();
}

TEST_F(CalledOffPreparation, WhatIsAddedIsFreeForOthers) {
  deploy();
  begin(std::move(Transaction()
                      .add_component("new", {.shell = std::make_unique<TestShell>(),
                                             .core = std::make_unique<LoggedCore>("slow", log, doors),
                                             .fsm = std::make_unique<TestFsm>()})
                      .connect("new", "input", "r", "read")));
  EXPECT_EQ(Abandoned::called_off, host().abandon("new"));
  commit(Transaction()
             .add_component("new", {.shell = "t/Shell", .core = "t/Core", .fsm = "t/Fsm"})
             .start("new"));
  commit(Transaction().add_resource("other", std::make_unique<LatestValue<Number>>()));
  expect_called_off();
  EXPECT_EQ(ComponentState::running, state("new"));
  EXPECT_THAT(log->names(), ElementsAre("slow"));
}

TEST_F(CalledOffPreparation, AResourceIsAbandonedByItsName) {
  struct SlowResource final : Resource {
    explicit SlowResource(std::shared_ptr<Doors> its_doors)
        : Resource("test/Slow", ""), doors(std::move(its_doors)) {}
    bool configure_hook() override {
      doors->pass();
      return true;
    }
    std::shared_ptr<Doors> doors;
  };
  deploy();
  begin(std::move(Transaction().add_resource("slow", std::make_unique<SlowResource>(doors))));
  EXPECT_EQ(Abandoned::called_off, host().abandon("slow"));
  commit(Transaction().disconnect("b", "output").remove_resource("r"));
  expect_called_off();
}

TEST_F(CalledOffPreparation, ADryRunIsListedAndCalledOff) {
  deploy();
  begin_slow_core({.dry_run = true});
  ASSERT_EQ(1U, host().open_changes().size());
  EXPECT_THAT(host().open_changes().front().steps.front(), HasSubstr("(dry run)"));
  EXPECT_EQ(Abandoned::called_off, host().abandon("b"));
  commit(Transaction().remove_component("b"));
  expect_called_off();
}

TEST_F(CalledOffPreparation, APreparedOneIsRefused) {
  deploy();
  begin([this] {
    host().prepare(
        std::move(Transaction().replace_core("b", std::make_unique<LoggedCore>("slow", log, doors))));
  });
  EXPECT_EQ(Abandoned::called_off, host().abandon("b"));
  commit(Transaction().remove_component("b"));
  expect_called_off();
}

TEST_F(CalledOffPreparation, WhoWaitsForItCallsItOffOnceItIsOverdue) {
  deploy();
  begin_slow_core({.timeouts = {.prepare_ns = ms_to_ns(200)}});
  const time_ns_t began = monotonic_now_ns();
  commit(Transaction().remove_component("b"));
  EXPECT_EQ(nullptr, architecture.find_component("b"));
  EXPECT_GE(monotonic_now_ns() - began, ms_to_ns(100));
  expect_called_off();
}

TEST_F(CalledOffPreparation, WhoAskedIsAnsweredOnceAHookIsOverdue) {
  EXPECT_EQ(s_to_ns(60), CommitTimeouts{}.prepare_ns) << "where nothing is said";
  deploy();
  begin_slow_core({.timeouts = {.prepare_ns = ms_to_ns(200)}});
  expect_called_off();
}

TEST_F(CalledOffPreparation, AHookCanAskForNoChange) {
  struct Asking : TestCore {
    bool configure_hook() override {
      ask();
      return true;
    }
    std::function<void()> ask;
  };
  deploy();
  auto core = std::make_unique<Asking>();
  core->ask = [this] { commit(Transaction().set_property("p", "gain", 2.0)); };
  Transaction change;
  change.replace_core("b", std::move(core));
  EXPECT_THAT(refusal([&] { commit(change); }).what(), HasSubstr("a change cannot ask for another one"));
}

TEST_F(CalledOffPreparation, OneThatIsNotOverdueIsWaitedFor) {
  deploy();
  begin_slow_core();
  const Error error = refusal(
      [&] { commit(Transaction().remove_component("b"), {.timeouts = {.commit_ns = ms_to_ns(50)}}); });
  EXPECT_EQ(ErrorCode::timeout, error.code());
  EXPECT_THAT(error.what(), HasSubstr("abandon it"));
  doors->open = true;
  EXPECT_FALSE(answer.get().has_value()) << "it is made";
}

TEST_F(CalledOffPreparation, OneThatActsOnThePartsThatAreInIsNotCalledOff) {
  deploy();
  b->core().set_factory({});
  host().stop("b");
  b->core_as<LoggedCore>().doors = doors;
  begin(std::move(Transaction().add("configure", "b")), {.timeouts = {.prepare_ns = 1}});
  EXPECT_EQ(ErrorCode::not_running, refusal([&] { host().abandon("b"); }).code());
  EXPECT_EQ(ErrorCode::timeout, refusal([&] {
                                  commit(Transaction().remove_component("b"),
                                         {.timeouts = {.commit_ns = ms_to_ns(20)}});
                                }).code());
  doors->open = true;
  EXPECT_FALSE(answer.get().has_value()) << "it is made";
}

TEST_F(CalledOffPreparation, ItsComponentIsNotConfiguredInItsPlaceWhileTheHookLasts) {
  deploy();
  b->core().set_factory({});
  begin_slow_core();
  EXPECT_EQ(Abandoned::called_off, host().abandon("b"));
  host().stop("b");
  Transaction configure;
  configure.add("configure", "b");
  EXPECT_THAT(refusal([&] { commit(configure); }).what(), HasSubstr("still uses its parts"));
  expect_called_off();
}

/// Changes with hooks that last a little, all about the same component, which others abandon.
TEST_F(CalledOffPreparation, ManyAtOnceLeaveOneCore) {
  deploy();
  std::atomic<bool> is_over{false};
  std::atomic<int> called_off{0};
  std::atomic<int> made{0};
  std::vector<std::thread> threads;
  const auto repeat = [&](unsigned seed, const std::function<void(std::mt19937&)>& act) {
    threads.emplace_back([&, seed, act] {
      std::mt19937 random(seed);
      while (!is_over) {
        try {
          act(random);
        } catch (const Error&) {  // another one was first
        }
        std::this_thread::sleep_for(std::chrono::microseconds(random() % 1'000));
      }
    });
  };
  const auto doors_that_open = [](auto after_us) {
    auto brief = std::make_shared<Doors>();
    std::thread([brief, after_us] {
      std::this_thread::sleep_for(std::chrono::microseconds(after_us));
      brief->open = true;
    }).detach();
    return brief;
  };
  for (unsigned seed : {1U, 2U, 3U}) {
    repeat(seed, [&](std::mt19937& random) {
      Transaction change;
      if (random() % 3 == 0) change.replace_shell("b", std::make_unique<LoggedShell>("shell", log));
      change.replace_core("b", std::make_unique<LoggedCore>("core", log, doors_that_open(random() % 4'000)));
      commit(change,
             {.timeouts = {.commit_ns = s_to_ns(30), .prepare_ns = random() % 2 == 0 ? ms_to_ns(2) : kLong}});
      ++made;
    });
  }
  repeat(4, [&](std::mt19937& /*random*/) {
    if (architecture.call_off_preparation("b")) ++called_off;  // abandon() could stop the component
  });
  repeat(5, [&](std::mt19937& random) {
    Transaction change;
    change.set_property("b", "gain", static_cast<double>(random() % 10));
    commit(change, {.timeouts = {.commit_ns = s_to_ns(30)}});
  });
  wait_until([&] { return made > 10 && called_off > 5; }, "some of each");
  is_over = true;
  for (std::thread& thread : threads) thread.join();
  EXPECT_NO_THROW(commit(Transaction().set_property("b", "gain", 1.0)));
  const auto runs = [&] { return core(*b).runs.load(); };
  const int before = runs();
  way.until([&] { return runs() > before + 3; }, "the last core");
  wait_until([&] { return !architecture.are_parts_held(*b); }, "the last hook");
}

}  // namespace mauve::testing::test_called_off_preparation
