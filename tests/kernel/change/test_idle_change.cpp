// SPDX-License-Identifier: LGPL-3.0-or-later
// Changes with `idle`: no job of a participant is pending at T, and the change is called off when no such instant comes.
#include <array>
#include <thread>

#include "hosts.hpp"

namespace mauve::testing::test_idle_change {

using ::testing::HasSubstr;

constexpr int kChanges = 1'000;
constexpr time_ns_t kHour = s_to_ns(3600);

/// What all cores of a test share.
struct Jobs {
  std::atomic<int> taken{0};  // the newest revision that a component has taken
  std::atomic<int> old{0};    // jobs with older parts than that, or that lasted until then
  std::atomic<time_ns_t> first_new_ns{kForever};  // the earliest clock of a job with the newest parts
  std::atomic<time_ns_t> bystander_ns{0};         // clock of the job of the one that takes no part; 0: none
  std::atomic<time_ns_t> earliest_ns{kForever};   // the earliest of these at a take
};

void lower(std::atomic<time_ns_t>& least, time_ns_t value) {
  time_ns_t seen = least;
  while (value < seen && !least.compare_exchange_weak(seen, value)) {
  }
}

/// A core of a revision: says so when it executes after a newer one has been taken anywhere.
struct JobCore : TestCore {
  JobCore(std::shared_ptr<Jobs> shared, int its_revision, time_ns_t its_spin_ns, time_ns_t its_adopt_ns)
      : jobs(std::move(shared)), revision(its_revision), spin_ns(its_spin_ns), adopt_ns(its_adopt_ns) {}

  bool adopt(const CoreBase& /*old*/) override {
    if (adopt_ns != 0) sleep_for(adopt_ns);
    return true;
  }
  void take(CoreBase& /*old*/) MAUVE_RT override {
    jobs->taken = revision;
    if (const time_ns_t clock_ns = jobs->bystander_ns; clock_ns != 0) lower(jobs->earliest_ns, clock_ns);
  }
  void act() override {
    TestCore::act();
    exposed_shell().output.write({1.0});
    const time_ns_t until_ns = monotonic_now_ns() + spin_ns;
    while (monotonic_now_ns() < until_ns) {
    }
    if (jobs->taken > revision) ++jobs->old;
    if (jobs->taken == revision) lower(jobs->first_new_ns, clock_ns());
  }

  std::shared_ptr<Jobs> jobs;
  int revision;
  time_ns_t spin_ns;
  time_ns_t adopt_ns;
};

/// Executes when another component has written.
struct EventFsm : Fsm<TestShell, TestCore> {
  void define() override {
    State& event = wait_event("Event", shell().input, kHour, us_to_ns(50));
    State& run = execution("Run", "act", &TestCore::act);
    set_initial(event);
    next(event, run);
    next(run, event);
  }
};

/// Before a test keeps its own threads off one of them.
const bool kHasTwoCpus = [] {
  cpu_set_t usable;
  return sched_getaffinity(0, sizeof(usable), &usable) == 0 && CPU_ISSET(0, &usable) && CPU_ISSET(1, &usable);
}();

template <typename Way>
class Rule10Idle : public OnBothHosts<Way> {
 protected:
  static constexpr bool is_virtual = OnBothHosts<Way>::is_virtual;
  static constexpr time_ns_t kJob = us_to_ns(60);

  std::unique_ptr<JobCore> core_of(int revision, time_ns_t adopt_ns = 0) {
    return std::make_unique<JobCore>(jobs, revision, is_virtual ? 0 : kJob, is_virtual ? 0 : adopt_ns);
  }
  template <typename FsmType = TestFsm>
  Component& add_job(const std::string& name, std::int64_t period_ms, int priority, std::vector<int> cpus) {
    TaskSettings settings{.priority = priority, .cpus = std::move(cpus)};
    settings.states = {DeclaredState{.name = "Run", .simulated_execution_ns = kJob}};
    Component& component = this->architecture.add_component(name, std::make_unique<TestShell>(), core_of(0),
                                                            std::make_unique<FsmType>(), settings);
    component.set_property("period_ms", period_ms);
    return component;
  }
  /// Five, the highest of which gives the lowest its events, at clocks that lie before those of others.
  void add_five(std::vector<int> some_cpus, std::vector<int> other_cpus) {
    this->architecture.template add_resource<SharedData<Number>>("x");
    add_job("a", 1, 80, some_cpus);
    add_job("b", 2, 70, other_cpus);
    add_job("c", 3, 60, some_cpus);
    add_job("d", 5, 50, other_cpus);
    add_job<EventFsm>("e", 1, 40, some_cpus);
    this->architecture.connect("a", "output", "x", "write");
    this->architecture.connect("e", "input", "x", "read");
  }
  /// One agrees late, at any moment of the periods of the others, and not always the lowest.
  Transaction change_all(int revision) {
    constexpr std::array kNames{"a", "b", "c", "d", "e"};
    const auto last = static_cast<std::size_t>(revision) % kNames.size();
    Transaction change;
    for (std::size_t i = 0; i < kNames.size(); ++i) {
      const time_ns_t adopt_ns = i == last ? us_to_ns(100 + 41 * (revision % 47)) : 0;
      change.replace_core(kNames.at(i), core_of(revision, adopt_ns));
    }
    return change;
  }
  TransactionReport commit_idle(Transaction change, time_ns_t within_ns = s_to_ns(60)) {
    return (*this->host)
        .commit(std::move(change), {.timeouts = {.commit_ns = s_to_ns(60), .phase_ns = 0},
                                    .idle = true,
                                    .idle_within_ns = within_ns});
  }
  void pass(time_ns_t duration_ns) {
    if constexpr (is_virtual) {
      this->host.run_for(duration_ns);
    } else {
      sleep_for(duration_ns);
    }
  }
  /// At many moments of the components' periods.
  void change_often() {
    this->deploy();
    this->host.run_for(ms_to_ns(25));
    int made = 0;
    time_ns_t instant_ns = 0;
    for (int revision = 1; revision <= kChanges; ++revision) {
      pass(us_to_ns(37 * (revision % 53)));
      ASSERT_GE(jobs->first_new_ns, instant_ns) << "before change " << revision;
      try {
        const TransactionReport report = commit_idle(change_all(revision));
        EXPECT_TRUE(report.is_idle);
        instant_ns = report.instant_ns;
        ++made;
      } catch (const Error& error) {
        EXPECT_TRUE(is_virtual) << error.what();  // a job is pending, and no time passes
        EXPECT_EQ(ErrorCode::timeout, error.code());
      }
      jobs->first_new_ns = kForever;
      ASSERT_EQ(0, jobs->old) << "change " << revision;
    }
    EXPECT_GT(made, is_virtual ? kChanges / 10 : kChanges - 1);
  }
  /// b is always behind: it owes instants that lie before those which a is at.
  void deploy_one_that_is_behind() {
    this->add("a", 1, {.priority = 60, .cpus = {kComponentsCpu}});
    TaskSettings behind{.priority = 40, .cpus = {kComponentsCpu}, .overrun = OverrunPolicy::catch_up};
    behind.max_backlog = 1'000'000;
    behind.states = {DeclaredState{.name = "Run", .simulated_execution_ns = ms_to_ns(2)}};
    Component& b = this->add("b", 1, behind);
    if (!is_virtual) this->core(b).work = [] { sleep_for(ms_to_ns(2)); };
    this->deploy();
    this->host.run_for(ms_to_ns(60));
  }
  static Transaction set_both() {
    Transaction both;
    both.set_property("a", "gain", 2.0).set_property("b", "gain", 2.0);
    return both;
  }

  std::shared_ptr<Jobs> jobs = std::make_shared<Jobs>();
};
TYPED_TEST_SUITE(Rule10Idle, EveryHost, HostNames);

TYPED_TEST(Rule10Idle, LeavesNoJobPendingOnOneCpu) {
  this->add_five({kComponentsCpu}, {kComponentsCpu});
  this->change_often();
}

TYPED_TEST(Rule10Idle, LeavesNoJobPendingOnTwoCpus) {
  if (!kHasTwoCpus) GTEST_SKIP() << "needs CPUs 0 and 1";
  this->add_five({0}, {1});
  this->change_often();
}

TYPED_TEST(Rule10Idle, IsCalledOffWhereNoIdleInstantComes) {
  this->deploy_one_that_is_behind();
  try {
    this->commit_idle(this->set_both(), ms_to_ns(50));
    ADD_FAILURE() << "it was made";
  } catch (const Error& error) {
    EXPECT_EQ(ErrorCode::timeout, error.code());
    EXPECT_EQ("b", error.detail().component);
    EXPECT_THAT(error.what(), HasSubstr("no instant at which all of a, b are idle came within 50 ms"));
    EXPECT_THAT(error.what(), HasSubstr("a pending job of b at the last try"));
  }
  EXPECT_EQ(1.0, this->architecture.component("b").template shell_as<TestShell>().gain.value());
  const TransactionReport report = this->host.commit(this->set_both(), 0);
  EXPECT_FALSE(report.is_idle) << "without the option the change is made";
}

TYPED_TEST(Rule10Idle, OfStoppedComponentsIsMadeAtOnce) {
  this->add("a");
  this->add("b");
  this->deploy();
  this->host.run_for(ms_to_ns(25));
  this->host.stop("a");
  this->host.stop("b");
  EXPECT_TRUE(this->commit_idle(this->set_both()).is_idle);
  EXPECT_EQ(2.0, this->architecture.component("b").template shell_as<TestShell>().gain.value());
}

TYPED_TEST(Rule10Idle, CannotBePrepared) {
  this->add("a");
  this->add("b");
  this->deploy();
  std::string text;
  EXPECT_EQ(ErrorCode::invalid_argument,
            this->code_of([&] { (*this->host).prepare(this->set_both(), {.idle = true}); }, &text));
  EXPECT_THAT(text, HasSubstr("a prepared transaction waits for no idle instant"));
}

class Rule10IdleOnThreads : public Rule10Idle<OnThreads> {
 protected:
  ~Rule10IdleOnThreads() override {
    host.shutdown();
    if (requester.joinable()) requester.join();
  }
  /// Asks for a change that finds no idle instant, and waits until both components have agreed.
  void request() {
    deploy_one_that_is_behind();
    requester = std::thread([this] {
      std::string text;
      code = code_of([this] { commit_idle(set_both(), kHour); }, &text);
      ended = true;
    });
    const auto has_all_votes = [this] {
      const auto changes = (*host).open_changes();
      return changes.size() == 1 && changes.front().phase == OpenChangePhase::waiting &&
             changes.front().late.empty();
    };
    wait_until(has_all_votes, "the votes of both");
  }
  void expect_called_off(ErrorCode why) {
    wait_until([this] { return ended.load(); }, "the answer");
    EXPECT_EQ(why, code);
    EXPECT_EQ(1.0, architecture.component("a").shell_as<TestShell>().gain.value());
  }
  /// No job of a component that takes no part is under way at a take, but one whose clock is `since(report)` or later.
  template <typename Since>
  void expect_bystander_idle(std::vector<int> cpus, Since&& since) {
    add_job("a", 1, 80, {kComponentsCpu});
    add_job("b", 3, 30, std::move(cpus));
    Component& between = add("between", 2, {.priority = 60, .cpus = {kComponentsCpu}});
    core(between).work = [this, &between] {
      jobs->bystander_ns = between.task().context().clock_ns.load(std::memory_order_relaxed);
      const time_ns_t until_ns = monotonic_now_ns() + us_to_ns(700);
      while (monotonic_now_ns() < until_ns) {
      }
      jobs->bystander_ns = 0;
    };
    deploy();
    host.run_for(ms_to_ns(25));
    for (int revision = 1; revision <= 200; ++revision) {
      pass(us_to_ns(37 * (revision % 53)));
      jobs->earliest_ns = kForever;
      Transaction change;
      const time_ns_t adopt_ns = us_to_ns(100 + 41 * (revision % 47));  // then a is the last to agree
      change.replace_core("a", core_of(revision, adopt_ns)).replace_core("b", core_of(revision));
      const TransactionReport report = commit_idle(std::move(change));
      wait_until([&] { return (*host).open_changes().empty(); }, "both takes");
      ASSERT_GE(jobs->earliest_ns, since(report)) << "change " << revision;
    }
  }

  std::thread requester;
  std::atomic<bool> ended{false};
  ErrorCode code{};
};

TEST_F(Rule10IdleOnThreads, IsCalledOffByAStop) {
  request();
  host.stop("a");
  expect_called_off(ErrorCode::wrong_revision);
}

TEST_F(Rule10IdleOnThreads, IsCalledOffByAShutdown) {
  request();
  host.shutdown();
  expect_called_off(ErrorCode::not_configured);
}

TEST_F(Rule10IdleOnThreads, LeavesNoJobOfAnotherPendingAboveTheLowest) {
  if (!may_use_fifo())
    GTEST_SKIP() << "needs the right to SCHED_FIFO: else no component stands above another";
  // The lowest closes, in the visit in which it takes: a job that is released after that begins later.
  const auto visit_of_lowest = [this](const TransactionReport& /*report*/) {
    const auto parked =
        records_of((*host).drain_trace(), TraceKind::parked, architecture.component("b").task().number());
    return parked.empty() ? kForever : parked.back().time_ns;
  };
  expect_bystander_idle({kComponentsCpu}, visit_of_lowest);
}

TEST_F(Rule10IdleOnThreads, LeavesNoJobOfASilentParticipantPending) {
  expect_bystander_idle({}, [](const TransactionReport& report) { return report.instant_ns; });
  EXPECT_TRUE(records_of((*host).drain_trace(), TraceKind::reconfiguration,
                         architecture.component("between").task().number())
                  .empty());
}

}  // namespace mauve::testing::test_idle_change
