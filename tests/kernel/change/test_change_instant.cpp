// SPDX-License-Identifier: LGPL-3.0-or-later
// T, the logical instant of a change: what the report and the trace say of it.
#include <chrono>
#include <future>
#include <thread>

#include "hosts.hpp"

namespace mauve::testing::test_change_instant {

constexpr std::int64_t kAdoptPhase = 1;
constexpr std::int64_t kTakePhase = 2;

/// What the trace says of one change of one component.
struct TracedChange {
  std::vector<time_ns_t> instants;  // T, as each take says it
  time_ns_t last_old_ns{0};         // clock of the last release with old parts
  time_ns_t first_new_ns{0};        // clock of the first one with new parts

  TracedChange(const TraceDrain& drain, std::uint16_t component) {
    for (const TraceRecord& record : drain.records) {
      if (record.component != component) continue;
      const auto kind = static_cast<TraceKind>(record.kind);
      if (kind == TraceKind::reconfiguration && record.a == kTakePhase) instants.push_back(record.c);
      if (kind == TraceKind::reconfiguration && record.a == kAdoptPhase) {
        EXPECT_EQ(0, record.c) << "T was not known yet";
      }
      if (kind != TraceKind::release) continue;
      if (instants.empty()) {
        last_old_ns = record.a;
      } else if (first_new_ns == 0) {
        first_new_ns = record.a;
      }
    }
  }
};

template <typename Way>
class ChangeInstant : public Hosted<Way> {
 protected:
  static const StepReport& line_of(const TransactionReport& report, const std::string& component) {
    const auto found = std::find_if(report.steps.begin(), report.steps.end(),
                                    [&](const StepReport& line) { return line.component == component; });
    if (found == report.steps.end()) throw std::runtime_error("no line of " + component);
    return *found;
  }
};
TYPED_TEST_SUITE(ChangeInstant, EveryHost, HostNames);

TYPED_TEST(ChangeInstant, IsTheSameForAllComponentsAndSplitsNoneOfThem) {
  const std::vector<std::string> changed{"a", "b"};
  this->add("a", 2);
  this->add("b", 5);
  this->deploy();
  this->run_for(ms_to_ns(20));
  Transaction change;
  change.replace_core("a", "t/Counting").set_property("a", "gain", 2.0).set_property("b", "gain", 3.0);
  const auto committed = this->host().make(std::move(change), {.timeouts = {.commit_ns = s_to_ns(10)}});
  this->run_for(ms_to_ns(20));
  const TransactionReport report = committed->report(s_to_ns(10));
  const TraceDrain drain = this->host().drain_trace();

  ASSERT_NE(kNotMeasured, report.instant_ns);
  ASSERT_EQ(3U, report.steps.size());
  for (const StepReport& step : report.steps) {
    EXPECT_EQ(report.instant_ns, step.instant_ns) << step.step;
    EXPECT_GE(step.release_ns, step.instant_ns) << step.step;
    EXPECT_EQ(step.phase_actual_ns - step.phase_nominal_ns, step.released_ns - step.release_ns) << step.step;
  }
  time_ns_t frontier_ns = 0;
  for (std::uint16_t number = 0; number < changed.size(); ++number) {
    const TracedChange traced(drain, number);
    EXPECT_FALSE(traced.instants.empty());
    for (const time_ns_t instant : traced.instants) EXPECT_EQ(report.instant_ns, instant);
    EXPECT_LT(traced.last_old_ns, report.instant_ns) << changed[number];
    EXPECT_GE(traced.first_new_ns, report.instant_ns) << changed[number];
    EXPECT_EQ(this->line_of(report, changed[number]).release_ns, traced.first_new_ns);
    frontier_ns = std::max(frontier_ns, traced.last_old_ns);
  }
  EXPECT_GT(report.instant_ns, frontier_ns);
}

TYPED_TEST(ChangeInstant, IsNotToldOfAComponentThatDoesNotRun) {
  this->add("runs");
  this->add("rests");
  this->deploy();
  this->run_for(ms_to_ns(10));
  this->host().stop("rests");
  Transaction of_one;
  of_one.set_property("rests", "gain", 2.0);
  const TransactionReport parked = this->commit(of_one);
  EXPECT_EQ(kNotMeasured, parked.instant_ns);
  EXPECT_EQ(kNotMeasured, parked.steps.front().instant_ns);
  Transaction of_both;
  of_both.set_property("rests", "gain", 3.0).stop("runs");
  const TransactionReport both = this->commit(of_both);
  EXPECT_NE(kNotMeasured, both.instant_ns);
  EXPECT_EQ(kNotMeasured, this->line_of(both, "rests").instant_ns);
  EXPECT_EQ(both.instant_ns, this->line_of(both, "runs").instant_ns);
  EXPECT_EQ(kNotMeasured, this->line_of(both, "runs").release_ns) << "it is stopped";
}

/// Says when it was asked to take over.
struct AskedCore : CountingCore {
  explicit AskedCore(std::atomic<bool>& is_asked) : asked(is_asked) {}
  bool adopt(const CoreBase& /*old*/) override {
    asked = true;
    return true;
  }
  std::atomic<bool>& asked;
};

/// A component stays in its state until the test lets it go on.
struct Door {
  std::atomic<bool> shut{true};
  std::atomic<bool> has_come{false};
  void pass() {
    while (shut) {
      has_come = true;
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  }
};

using ChangeInstantOnThreads = ChangeInstant<OnThreads>;

TEST_F(ChangeInstantOnThreads, IsKnownOfALateComponentBeforeItTakesTheChange) {
  std::atomic<bool> has_agreed{false};
  std::atomic<bool> has_begun{false};
  Door late_door;
  Door other_door;
  struct End {  // the components end before the doors go, also when the test fails
    ~End() {
      late.shut = other.shut = false;
      host.shutdown();
    }
    Host& host;
    Door& late;
    Door& other;
  };
  const End end{host(), late_door, other_door};
  Component& late = add("late");
  Component& other = add("other");
  core(late).work = [&] {
    if (has_agreed) late_door.pass();
  };
  core(other).work = [&] {
    if (has_begun) other_door.pass();
  };
  deploy();
  run_for(ms_to_ns(5));
  has_begun = true;
  wait_until([&] { return other_door.has_come.load(); }, "the other component in its state");
  auto making = std::async(std::launch::async, [&] {
    Transaction change;
    change.replace_core("late", std::make_unique<AskedCore>(has_agreed)).set_property("other", "gain", 2.0);
    return host().make(std::move(change), {.timeouts = {.commit_ns = s_to_ns(2)}});
  });
  wait_until([&] { return late_door.has_come.load(); }, "the component that is late, in its old core");
  other_door.shut = false;
  const auto committed = making.get();
  const TransactionReport early = committed->report(0);
  EXPECT_FALSE(early.is_complete);
  EXPECT_NE(kNotMeasured, early.instant_ns);
  EXPECT_EQ(early.instant_ns, line_of(early, "late").instant_ns);
  EXPECT_EQ(kNotMeasured, line_of(early, "late").release_ns);
  late_door.shut = false;
  const TransactionReport report = committed->report(s_to_ns(10));
  EXPECT_TRUE(report.is_complete);
  EXPECT_EQ(early.instant_ns, line_of(report, "late").instant_ns);
  EXPECT_GE(line_of(report, "late").release_ns, report.instant_ns);
}

}  // namespace mauve::testing::test_change_instant
