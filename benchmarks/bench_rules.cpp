// SPDX-License-Identifier: LGPL-3.0-or-later
// A rule that replaces the core of a running 1 kHz component once an input has been silent for so long, and puts the
// usual one back when it is written again. Beside it: a bare thread that watches the same deadline, and a bare 1 kHz
// loop that looks at each release whether that has passed.
//   bench_rules [--who component|bare] [--count 1000] [--priority 80] [--cpu 0] [--cpus 2] [--silence-ms 10]
//                [--work-us 100] [--hung 0] [--seed 1]
// With --hung 1 another rule, of lower priority, wants the same of a component whose state does not end.
// The input is written every 1 to 3 ms, at any phase of the component's, until it falls silent.
// Prints {"reaction_ns": from the deadline of silence to the first release that follows it with the other core, one a
// round; "stalled_ns": of it, how long CPU 0 ... cpus-1 ran nothing of ours, as witnesses noticed}.
#include <functional>
#include <stdexcept>
#include <thread>

#include "mauve_rt/base/seam/futex.hpp"
#include "mauve_rt/rules/rule_runner.hpp"

#include "support/components.hpp"
#include "support/options.hpp"
#include "support/random_pause.hpp"
#include "support/values.hpp"
#include "support/witness.hpp"

namespace {

using mauve::time_ns_t;

constexpr std::int64_t kPeriodUs = 1000;
constexpr int kFeederAbove = 10;    // the component: it must not be held up between its clock and its write
constexpr int kWatchPriority = 97;  // of the bare thread: as the rules' own
constexpr time_ns_t kSettle = mauve::ms_to_ns(100);  // after the first release: caches are cold
constexpr time_ns_t kGiveUp = mauve::s_to_ns(30);

struct Settings {
  explicit Settings(const bench::Options& options)
      : count(options.number("count", 1000)),
        priority(options.priority()),
        cpu(options.cpu()),
        cpus(static_cast<int>(options.number("cpus", 2))),
        silence_ns(mauve::ms_to_ns(options.number("silence-ms", 10))),
        work_us(options.number("work-us", 100)),
        has_hung(options.number("hung", 0) != 0),
        seed(options.seed()) {}

  std::int64_t count;
  int priority;
  int cpu;
  int cpus;
  time_ns_t silence_ns;
  std::int64_t work_us;
  bool has_hung;
  std::uint64_t seed;
};

/// Writes every 1 to 3 ms from a real-time thread, until it is told to fall silent.
///
/// | member        | written by | read by    | order                                                |
/// | ------------- | ---------- | ---------- | ---------------------------------------------------- |
/// | asked_        | the asker  | the thread | release/acquire: silent_since_ is cleared by then    |
/// | silent_since_ | both       | the asker  | release/acquire; 0: it has not fallen silent yet     |
class Feeder {
 public:
  Feeder(const Settings& settings, std::function<void()> write)
      : write_(std::move(write)),
        pause_(settings.seed, {1000, 3000}),
        thread_(settings.priority + kFeederAbove, settings.cpu, [this] { feed(); }) {}
  ~Feeder() { asked_.store(Asked::end, std::memory_order_release); }
  Feeder(const Feeder&) = delete;
  Feeder& operator=(const Feeder&) = delete;

  /// The instant just before its last write. It has written since it was told to speak.
  time_ns_t fall_silent() {
    silent_since_.store(0, std::memory_order_relaxed);
    asked_.store(Asked::silence, std::memory_order_release);
    for (;;) {
      if (const time_ns_t since = silent_since_.load(std::memory_order_acquire); since != 0) return since;
      std::this_thread::sleep_for(std::chrono::microseconds(200));
    }
  }
  void speak() { asked_.store(Asked::speech, std::memory_order_release); }

 private:
  enum class Asked : std::uint8_t { speech, silence, end };

  void feed() {
    for (time_ns_t written_ns = mauve::monotonic_now_ns();;) {
      const Asked asked = asked_.load(std::memory_order_acquire);
      if (asked == Asked::end) return;
      if (asked == Asked::speech) {
        written_ns = mauve::monotonic_now_ns();
        write_();
      } else {
        silent_since_.store(written_ns, std::memory_order_release);
      }
      pause_();
    }
  }

  std::function<void()> write_;
  bench::RandomPause pause_;
  std::atomic<Asked> asked_{Asked::speech};
  std::atomic<time_ns_t> silent_since_{0};
  bench::RealtimeThread thread_;
};

/// From a deadline to the release.
struct Reaction {
  time_ns_t deadline_ns;
  time_ns_t released_ns;
};

/// Witnesses of all CPUs: the deciding thread is bound to none.
class Witnesses {
 public:
  explicit Witnesses(int cpus) {
    for (int cpu = 0; cpu < cpus; ++cpu) witnesses_.push_back(std::make_unique<bench::Witness>(cpu));
  }
  void print(const std::vector<Reaction>& reactions) {
    std::vector<bench::Stall> stalls;
    for (const auto& witness : witnesses_)
      stalls.insert(stalls.end(), witness->end().begin(), witness->end().end());
    stalls = bench::merged(std::move(stalls));
    std::vector<std::int64_t> took;
    std::vector<std::int64_t> stalled;
    for (const Reaction& each : reactions) {
      took.push_back(each.released_ns - each.deadline_ns);
      stalled.push_back(bench::stalled_ns(stalls, each.deadline_ns, each.released_ns));
    }
    bench::JsonLine().add("reaction_ns", took).add("stalled_ns", stalled).print();
  }

 private:
  std::vector<std::unique_ptr<bench::Witness>> witnesses_;
};

struct SafeWorker : bench::Worker {};

/// Its state ends when all is over.
struct HungWorker : bench::Worker {
  void work() override {
    while (!is_over.load(std::memory_order_relaxed)) bench::sleep_until(mauve::monotonic_now_ns() + kSettle);
  }
  static inline std::atomic<bool> is_over{false};
};

constexpr const char* kUsual = "bench/Worker";
constexpr const char* kSafe = "bench/SafeWorker";
constexpr const char* kHung = "bench/HungWorker";

mauve::rules::ActionSteps core(const char* implementation, const char* target = "worker") {
  return {{.kind = "replace_core", .target = target, .name = implementation}};
}

/// The rule at work, and where a component hangs the one about that.
class Rule {
 public:
  Rule(mauve::Host& host, const Settings& settings) : runner_(host, rules(settings), actions(settings)) {
    runner_.start();
  }

  /// Until it is armed and what it does is prepared.
  void await_ready() {
    const time_ns_t until = mauve::monotonic_now_ns() + kGiveUp;
    for (;;) {
      const mauve::rules::RuleFacts facts = runner_.facts().front();
      if (facts.status.armed && !facts.status.in_effect && facts.ready) return;
      if (!facts.problem.empty()) throw std::runtime_error("the rule cannot act: " + facts.problem);
      if (mauve::monotonic_now_ns() > until) throw std::runtime_error("the rule does not become ready");
      runner_.wait_told(mauve::ms_to_ns(1));
    }
  }
  /// The release that follows what it does or undoes, decided at that instant or later.
  time_ns_t await_release(mauve::rules::Act act, time_ns_t since_ns) {
    for (const time_ns_t until = mauve::monotonic_now_ns() + kGiveUp; mauve::monotonic_now_ns() < until;) {
      for (const mauve::rules::Told& told : runner_.wait_told(mauve::ms_to_ns(100))) {
        const bool is_it = told.decision.rule == 0 && told.decision.decided == mauve::rules::Decided::done &&
                           told.decision.act == act;
        if (!is_it || told.decision.stamp_ns < since_ns) continue;
        const mauve::time_ns_t released_ns = told.action.report.value().steps.front().released_ns;
        if (released_ns == mauve::kNotMeasured) throw std::runtime_error("no release followed");
        return released_ns;
      }
    }
    throw std::runtime_error("the rule does not act");
  }

 private:
  static mauve::rules::Rule rule(const char* about, time_ns_t silence_ns, std::int64_t priority) {
    const double longer_than_s = static_cast<double>(silence_ns) / static_cast<double>(mauve::s_to_ns(1));
    mauve::rules::Rule made;
    made.name = about;
    made.when.kind = "silence";
    made.when.parameters = {{"resource", "input"}, {"longer_than_s", longer_than_s}};
    made.undoes = true;
    made.priority = priority;
    made.about = {about};
    return made;
  }
  static std::vector<mauve::rules::Rule> rules(const Settings& settings) {
    std::vector<mauve::rules::Rule> all{rule("worker", settings.silence_ns, 1)};
    if (settings.has_hung)
      all.push_back(rule("hung", settings.silence_ns / 2, 0));  // its commit is posted by then
    return all;
  }
  static std::vector<mauve::rules::RuleActions> actions(const Settings& settings) {
    std::vector<mauve::rules::RuleActions> all{{.do_steps = core(kSafe), .undo_steps = core(kUsual)}};
    if (settings.has_hung) all.push_back({.do_steps = core(kSafe, "hung")});
    return all;
  }

  mauve::rules::RuleRunner runner_;
};

void measure_component(const Settings& settings) {
  mauve::PluginRegistry registry;
  registry.type<bench::Small>();
  registry.shell<bench::WorkerShell>("bench/WorkerShell");
  registry.core<bench::Worker>(kUsual, "bench/WorkerShell");
  registry.core<SafeWorker>(kSafe, "bench/WorkerShell");
  registry.core<HungWorker>(kHung, "bench/WorkerShell");
  registry.fsm<bench::WorkerFsm>("bench/WorkerFsm", "bench/WorkerShell");
  mauve::Architecture architecture{&registry};
  auto& input = architecture.add_resource<mauve::LatestValue<bench::Small>>("input");
  mauve::Component& component =
      architecture.add_component("worker", "bench/WorkerShell", kUsual, "bench/WorkerFsm",
                                 mauve::TaskSettings{.priority = settings.priority, .cpus = {settings.cpu}});
  component.allow({kSafe}, true);
  component.set_property("period_us", kPeriodUs);
  component.set_property("work_us", settings.work_us);
  if (settings.has_hung) {
    architecture
        .add_component("hung", "bench/WorkerShell", kHung, "bench/WorkerFsm",
                       mauve::TaskSettings{.priority = settings.priority, .cpus = {settings.cpu}})
        .allow({kSafe}, true);
  }
  architecture.configure();
  mauve::Deployer deployer(architecture);
  deployer.deploy();
  Feeder feeder(settings, [&input] { input.write.write({}, mauve::monotonic_now_ns()); });
  Rule rule(deployer, settings);
  Witnesses witnesses(settings.cpus);
  bench::sleep_until(deployer.epoch_ns() + kSettle);
  std::vector<Reaction> reactions;
  for (std::int64_t i = 0; i < settings.count; ++i) {
    rule.await_ready();
    const time_ns_t deadline_ns = feeder.fall_silent() + settings.silence_ns;
    const time_ns_t released_ns = rule.await_release(mauve::rules::Act::do_, deadline_ns);
    if (component.shown().core != kSafe) throw std::runtime_error("another core is at work");
    reactions.push_back({deadline_ns, released_ns});
    feeder.speak();
    rule.await_release(mauve::rules::Act::undo, deadline_ns);
  }
  HungWorker::is_over.store(true, std::memory_order_relaxed);
  witnesses.print(reactions);
}

/// What one would write by hand: a thread that sleeps until the deadline and sets a flag, a loop that reads it.
///
/// | member     | written by | read by         | order                                  |
/// | ---------- | ---------- | --------------- | -------------------------------------- |
/// | heard_     | the feeder | the watch       | release/acquire: an instant            |
/// | is_safe_   | the watch  | the loop        | release/acquire: a flag                |
/// | released_  | the loop   | who measures    | release/acquire; 0: it is not safe     |
/// | ending_    | who measures | both threads  | relaxed: noticed at the next turn      |
class Watch {
 public:
  explicit Watch(const Settings& settings)
      : settings_(settings),
        watch_(kWatchPriority, settings.cpu, [this] { watch(); }),
        loop_(settings.priority, settings.cpu, [this] { loop(); }) {}
  ~Watch() { ending_.store(true, std::memory_order_relaxed); }
  Watch(const Watch&) = delete;
  Watch& operator=(const Watch&) = delete;

  void hear() { heard_.store(mauve::monotonic_now_ns(), std::memory_order_release); }
  /// The first release as the safe one; 0: of the usual one.
  time_ns_t await(bool is_safe) const {
    for (;;) {
      const time_ns_t released_ns = released_.load(std::memory_order_acquire);
      if ((released_ns != 0) == is_safe) return released_ns;
      std::this_thread::sleep_for(std::chrono::microseconds(200));
    }
  }

 private:
  void watch() {
    while (!ending_.load(std::memory_order_relaxed)) {
      const time_ns_t now_ns = mauve::monotonic_now_ns();
      const time_ns_t deadline_ns = heard_.load(std::memory_order_acquire) + settings_.silence_ns;
      is_safe_.store(now_ns >= deadline_ns, std::memory_order_release);
      bench::sleep_until(now_ns >= deadline_ns ? now_ns + mauve::us_to_ns(kPeriodUs) : deadline_ns);
    }
  }
  void loop() {
    bool was_safe = false;
    for (time_ns_t next = mauve::monotonic_now_ns(); !ending_.load(std::memory_order_relaxed);) {
      next += mauve::us_to_ns(kPeriodUs);
      bench::sleep_until(next);
      const time_ns_t now_ns = mauve::monotonic_now_ns();
      const bool is_safe = is_safe_.load(std::memory_order_acquire);
      if (std::exchange(was_safe, is_safe) != is_safe)
        released_.store(is_safe ? now_ns : 0, std::memory_order_release);
      bench::spin_for(mauve::us_to_ns(settings_.work_us));
    }
  }

  Settings settings_;
  std::atomic<time_ns_t> heard_{mauve::monotonic_now_ns()};
  std::atomic<bool> is_safe_{false};
  std::atomic<time_ns_t> released_{0};
  std::atomic<bool> ending_{false};
  bench::RealtimeThread watch_;
  bench::RealtimeThread loop_;
};

void measure_bare(const Settings& settings) {
  mauve::RealtimeProcess process;
  process.acquire(settings.priority, false);
  Watch watch(settings);
  Feeder feeder(settings, [&watch] { watch.hear(); });
  Witnesses witnesses(settings.cpus);
  bench::sleep_until(mauve::monotonic_now_ns() + kSettle);
  std::vector<Reaction> reactions;
  for (std::int64_t i = 0; i < settings.count; ++i) {
    watch.await(false);
    const time_ns_t deadline_ns = feeder.fall_silent() + settings.silence_ns;
    reactions.push_back({deadline_ns, watch.await(true)});
    feeder.speak();
  }
  witnesses.print(reactions);
}

}  // namespace

int main(int count, char** words) { return bench::run_sides(count, words, measure_component, measure_bare); }
