// SPDX-License-Identifier: LGPL-3.0-or-later
// A component whose core can be replaced on probation, on every kind of host.
#pragma once

#include <limits>

#include "hosts.hpp"

namespace mauve::testing {

using Verdict = ProbationVerdict;
using Cause = ProbationCause;

inline constexpr time_ns_t kPeriod = ms_to_ns(1);
inline constexpr time_ns_t kLong = s_to_ns(600);
inline constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

/// What a test knows of a core that may be gone.
struct Seen {
  std::atomic<int> runs{0};
  std::atomic<bool> is_configured{false};
  std::atomic<bool> is_cleaned{false};
  std::atomic<time_ns_t> last_ns{0};
};

struct TrialCore : TestCore {
  std::shared_ptr<Seen> seen = std::make_shared<Seen>();
  void act() override {
    seen->runs.fetch_add(1);
    seen->last_ns = clock_ns();
    TestCore::act();
  }
  bool configure_hook() override { return seen->is_configured = true; }
  void cleanup_hook() override { seen->is_cleaned = true; }
};

template <typename Way>
class Probations : public OnBothHosts<Way> {
 protected:
  using Base = OnBothHosts<Way>;

  /// A component whose core counts what it does, and writes 1.
  Component& add_trial(const std::string& name = "c", const TaskSettings& settings = {},
                       const std::string& written = "") {
    Component& component = this->add(name, 1, settings);
    auto first = std::make_unique<TrialCore>();
    first->set_implementation("t/Old");
    first->work = [&own = *first] { own.exposed_shell().output.write({1.0}); };
    first->instants.reserve(100'000);
    old = first.get();
    old_seen = first->seen;
    component.replace_core(std::move(first));
    out = &this->architecture.template add_resource<SharedData<Number>>("out_" + name);
    this->architecture.connect(name, "output", written.empty() ? "out_" + name : written, "write");
    return component;
  }
  /// Puts in a core on probation, which does this at each of its runs, counted from 1.
  std::shared_ptr<Seen> put_in(const std::function<void(TrialCore&, int)>& work,
                               ProbationOptions options = {}, const std::string& name = "c") {
    auto core = std::make_unique<TrialCore>();
    core->set_implementation("t/New");
    core->work = [&own = *core, work] { work(own, own.runs.load()); };
    auto seen = core->seen;
    if (options.duration_ns == 0) options.duration_ns = kLong;
    Transaction change;
    change.replace_core(name, std::move(core), std::move(options));
    this->host.commit(std::move(change), 0);
    return seen;
  }
  /// The last one there is.
  ProbationRecord record() {
    const auto all = (*this->host).probations();
    return all.empty() ? ProbationRecord{} : all.back();
  }
  void wait_verdict(Verdict verdict) {
    this->host.until([&] { return record().verdict == verdict; }, to_string(verdict));
  }
  void wait_seen(const Seen& seen, int runs) {
    this->host.until([&] { return seen.runs >= runs; }, "the core to run");
  }
  void settle() { (*this->host).settle_probations(); }
  /// An ordinary thread cleans up, at the last release of the parts: not when the change or its verdict is made.
  void wait_cleaned(const Seen& seen) {
    wait_until(
        [&] {
          settle();
          return seen.is_cleaned.load();
        },
        "the cleanup");
  }
  /// A state that lasts beyond its component's next instant.
  static void overrun(Component& component, time_ns_t by_ns = us_to_ns(100)) {
    Task& task = component.task();
    const time_ns_t until = task.context().clock_ns.load() + kPeriod + by_ns;
    if constexpr (Base::is_virtual) {
      task.clock().spend(kPeriod + by_ns);
    } else {
      while (monotonic_now_ns() < until) {
      }
    }
  }
  /// After the shutdown.
  static void expect_untouched(Component& neighbour) {
    expect_released_at_each_instant(Base::core(neighbour).instants, neighbour, kPeriod);
    if constexpr (Base::is_virtual) {
      EXPECT_EQ(0U, neighbour.task().statistics().skipped.load());
    }
  }
  double newest() const {
    Number value{-1.0};
    time_ns_t time = 0;
    ReaderState seen;
    out->read.read(value, time, seen);
    return value.value;
  }
  void expect_old_core_runs_on(Component& component) {
    const int before = old_seen->runs;
    wait_seen(*old_seen, before + 3);
    EXPECT_EQ(ComponentState::running, component.task().state());
    EXPECT_EQ("t/Old", component.core_implementation());
    EXPECT_EQ(old, &component.core());
    EXPECT_FALSE(old_seen->is_cleaned);
  }

  TrialCore* old{nullptr};
  std::shared_ptr<Seen> old_seen;
  SharedData<Number>* out{nullptr};
};

}  // namespace mauve::testing
