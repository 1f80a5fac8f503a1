// SPDX-License-Identifier: LGPL-3.0-or-later
// What a shadow costs the thread of the live component: the taps of its ports, the capture of a release, and the CPU time of a
// whole release. Next to the shadow the same with a watch on the output, as of a core on probation, and with a max_slew that acts.
//   bench_shadow [--blocks 41] [--calls 1024] [--priority 80] [--cpu 0] [--turns 10] [--releases 50]
// Prints {"read_ps": [...], "tapped_read_ps": [...], "write_ps": [...], "tapped_write_ps": [...], "watched_write_ps": [...],
// "limited_write_ps": [...], "capture_ps": [...]} in picoseconds a call, of values of 16 bytes. A deployed 1 kHz component that reads and writes once a
// release follows, with {"plain_ns": [...], "shadowed_ns": [...], "awaiting_ns": [...], "waking_ns": [...], "probation_ns": [...],
// "blended_ns": [...]}: CPU time of the component's thread from one release to the next. "awaiting": a bumpless change waits for near
// outputs. "waking" has no shadow, and wakes a sleeping ordinary thread in each release. "blended" is a blend of two equal cores,
// "early" the blends that an overrun ended. "releases" and "compared": of the releases with a shadow, those that the candidate executed.
// Then the component has a neighbour of 1 kHz on its CPU, of the next lower priority. {"neighbour_plain_ns": [...],
// "neighbour_awaiting_ns": [...]}: the neighbour's wake-up latencies; {"blackout_ns": [...], "bumpless_blackout_ns": [...]}: of
// changes of the core, plain and bumpless, by turns.
#include <sys/resource.h>
#include <unistd.h>

#include <ctime>
#include <memory>
#include <thread>

#include "mauve_rt/base/seam/futex.hpp"

#include "support/components.hpp"
#include "support/micro.hpp"
#include "support/values.hpp"

namespace bench {
struct Torque {
  double first{};
  double second{};
};
}  // namespace bench
MAUVE_TYPE(bench::Torque, "bench_msgs/msg/Torque", first, second)

namespace {

using bench::Small;
using mauve::time_ns_t;

constexpr std::int64_t kPeriodUs = 1000;
constexpr double kLeast = -1e12, kMost = 1e12;  // of the output; no value is beyond

struct PipeShell : bench::WorkerShell {
  mauve::ReadPort<Small>& input = read_port<Small>("input");
  mauve::WritePort<Small>& output = write_port<Small>("output");
};

/// With numbers that go over in a blend.
struct RobotShell : PipeShell {
  mauve::WritePort<bench::Torque>& torque = write_port<bench::Torque>("torque");
};

// ---- ports alone

/// A shell whose ports lead to one SharedData, and a capture of both.
class Pipe {
 public:
  Pipe() {
    shell.set_context(&context_);
    data_.set_name("data");
    shell.input.connect(data_.read, "data");
    shell.output.connect(data_.write, "data");
    shell.output.write({1, 1});  // a tap copies nothing of a read that finds nothing
    capture = std::make_unique<mauve::ShadowCapture>(shell, "pipe");
  }
  ~Pipe() {
    for (const auto& port : shell.ports()) port->disconnect();
  }
  Pipe(const Pipe&) = delete;
  Pipe& operator=(const Pipe&) = delete;

  void read(std::int64_t calls) {
    Small value;
    for (std::int64_t i = 0; i < calls; ++i) {
      shell.input.read(value);
      bench::keep(value);
      capture->start();  // the next read is the first one of a release, which is copied
    }
  }
  void write(std::int64_t calls) {
    for (std::int64_t i = 0; i < calls; ++i) shell.output.write({i, i});
  }
  void end_releases(std::int64_t calls) {
    for (std::int64_t i = 0; i < calls; ++i) {
      if (!capture->end_release(i, 0)) throw std::runtime_error("a release found no free slot");
      capture->pop();
    }
  }

 private:
  mauve::Context context_;  // without one a port would read the clock to stamp
  mauve::SharedData<Small> data_;

 public:
  PipeShell shell;  // its ports refer to the data
  std::unique_ptr<mauve::ShadowCapture> capture;
};

/// As a probation with one limit.
class OneLimit final : public mauve::OutputWatch {
 public:
  explicit OneLimit(const mauve::PortBase& port) : place_(port.find_number("first").value()) {}
  bool admits(const void* value) noexcept override {
    const double number = place_.of(value);
    return number >= kLeast && number <= kMost;
  }

 private:
  mauve::NumberPlace place_;
};

void measure_ports(const bench::Options& options, bench::JsonLine& line) {
  const bench::Micro micro(options);
  Pipe plain;
  Pipe tapped;
  Pipe watched;
  Pipe limited;
  OneLimit limit(watched.shell.output);
  tapped.capture->attach(0);
  watched.shell.output.watch(limit);
  limited.shell.output.limit_slew(
      std::make_shared<mauve::SlewedOutput>(std::map<std::string, double>{{"first", 1.0}}));
  micro.compare(line, {{"read", [&](std::int64_t calls) { plain.read(calls); }},
                       {"tapped_read", [&](std::int64_t calls) { tapped.read(calls); }}});
  micro.compare(line, {{"write", [&](std::int64_t calls) { plain.write(calls); }},
                       {"tapped_write", [&](std::int64_t calls) { tapped.write(calls); }},
                       {"watched_write", [&](std::int64_t calls) { watched.write(calls); }},
                       {"limited_write", [&](std::int64_t calls) { limited.write(calls); }}});
  micro.compare(line, {{"capture", [&](std::int64_t calls) { tapped.end_releases(calls); }}});
  watched.shell.output.unwatch(limit);
}

// ---- releases of a deployed component

/// The CPU time of a thread at the begin of each of its executions.
///
/// | member | written by             | read by     | order                              |
/// |--------|------------------------|-------------|------------------------------------|
/// | at_ns_ | the component's thread | main thread | count_                             |
/// | count_ | the component's thread | main thread | release/acquire: the times before  |
class CpuTimes {
 public:
  explicit CpuTimes(std::size_t most) : at_ns_(most) {}

  void note() noexcept {
    const std::size_t count = count_.load(std::memory_order_relaxed);  // relaxed: this thread writes it
    if (count == at_ns_.size()) return;
    timespec used{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &used);
    at_ns_[count] = mauve::s_to_ns(used.tv_sec) + used.tv_nsec;
    count_.store(count + 1, std::memory_order_release);
  }
  /// Waits for releases that begin from now on; appends what each took.
  void collect(std::vector<std::int64_t>& into, std::int64_t releases) const {
    const std::size_t first = count_.load(std::memory_order_acquire) + kSettling;
    const std::size_t last = first + static_cast<std::size_t>(releases);
    if (last >= at_ns_.size()) throw std::runtime_error("more releases than were allowed for");
    const time_ns_t patience = mauve::monotonic_now_ns() + mauve::s_to_ns(30);
    while (count_.load(std::memory_order_acquire) <= last) {
      if (mauve::monotonic_now_ns() > patience) throw std::runtime_error("the component stands still");
      bench::sleep_until(mauve::monotonic_now_ns() + mauve::ms_to_ns(10));
    }
    for (std::size_t i = first; i < last; ++i) into.push_back(at_ns_[i + 1] - at_ns_[i]);
  }

 private:
  static constexpr std::size_t kSettling = 5;  // the first releases after a change find cold caches

  std::vector<std::int64_t> at_ns_;
  std::atomic<std::size_t> count_{0};
};

/// Reads what it has written in the release before.
struct Passing : bench::Worker {
  void work() override {
    auto& robot = static_cast<RobotShell&>(shell());
    const Small value = robot.input.read().value;
    robot.output.write({value.first + 1, value.second + 1});
    robot.torque.write({static_cast<double>(value.first), 1.0});
  }
};

/// Never near a passing one.
struct Far : Passing {
  void work() override {
    auto& robot = static_cast<RobotShell&>(shell());
    robot.output.write({robot.input.read().value.first + 2, 0});
  }
};

struct Timed : Passing {
  void work() override {
    if (CpuTimes* const noted = times.load(std::memory_order_relaxed)) noted->note();
    Passing::work();
  }
  void take(mauve::CoreBase& old) noexcept override { times = static_cast<Timed&>(old).times.load(); }

  std::atomic<CpuTimes*> times{nullptr};  // of one of both cores in a blend
};

/// An ordinary thread of the lowest priority that sleeps, as the shadow's.
///
/// | member       | written by             | read by     | order                                  |
/// |--------------|------------------------|-------------|----------------------------------------|
/// | word_ (futex)| the component's thread | the sleeper | relaxed: nothing else is handed over   |
/// | is_ending_   | main thread            | the sleeper | relaxed: the word wakes the sleeper    |
/// | has_ended_   | the sleeper            | main thread | relaxed: join() follows                |
class Sleeper {
 public:
  Sleeper() : thread_([this] { sleep(); }) {}
  ~Sleeper() {
    is_ending_.store(true, std::memory_order_relaxed);
    while (!has_ended_.load(std::memory_order_relaxed)) wake();
    thread_.join();
  }
  Sleeper(const Sleeper&) = delete;
  Sleeper& operator=(const Sleeper&) = delete;

  void wake() noexcept {
    word_.fetch_add(1, std::memory_order_relaxed);
    mauve::futex_wake_all(word_);
  }

 private:
  void sleep() {
    setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), 19);  // of this thread alone, on Linux
    std::uint32_t seen = 0;
    while (!is_ending_.load(std::memory_order_relaxed)) {
      mauve::futex_wait_until(word_, seen, mauve::kForever);
      seen = word_.load(std::memory_order_relaxed);
    }
    has_ended_.store(true, std::memory_order_relaxed);
  }

  std::atomic<std::uint32_t> word_{0};
  std::atomic<bool> is_ending_{false};
  std::atomic<bool> has_ended_{false};
  std::thread thread_;
};

struct Waking : Timed {
  explicit Waking(Sleeper& its_sleeper) : sleeper(its_sleeper) {}
  void work() override {
    Timed::work();
    sleeper.wake();
  }

  Sleeper& sleeper;
};

mauve::Transaction begin_shadow() {
  mauve::Transaction transaction;
  transaction.shadow("pipe", std::make_unique<Passing>(), {.budget_ns = mauve::ms_to_ns(1)},
                     std::make_unique<RobotShell>());
  return transaction;
}
mauve::Transaction end_shadow() {
  mauve::Transaction transaction;
  transaction.end_shadow("pipe");
  return transaction;
}
mauve::Transaction put_in(std::unique_ptr<mauve::CoreBase> core) {
  mauve::Transaction transaction;
  transaction.replace_core("pipe", std::move(core));
  return transaction;
}
mauve::Transaction put_on_probation() {
  mauve::ProbationOptions options{.duration_ns = mauve::s_to_ns(600)};
  options.outputs.push_back({.port = "output", .field = "first", .minimum = kLeast, .maximum = kMost});
  mauve::Transaction transaction;
  transaction.replace_core("pipe", std::make_unique<Timed>(), std::move(options));
  return transaction;
}

mauve::Transaction put_in_near(std::unique_ptr<mauve::CoreBase> core, double greatest) {
  mauve::Transaction transaction;
  transaction.replace_core(
      "pipe", std::move(core),
      mauve::ReplaceOptions{.bumpless = mauve::BumplessOptions{.outputs = {{"output", "first", greatest}},
                                                               .within_ns = mauve::s_to_ns(100)}});
  return transaction;
}

/// Calls the function while a bumpless change waits for outputs that never come near.
template <typename Function>
void while_waiting(mauve::Deployer& deployer, const Function& measure) {
  std::thread requester([&] {
    try {
      deployer.commit(put_in_near(std::make_unique<Far>(), 0.0), {});
    } catch (const mauve::Error&) {  // called off
    }
  });
  const auto has_begun = [&] {
    const auto shadows = deployer.shadows();
    return !shadows.empty() && shadows.back().verdict == mauve::ShadowVerdict::running &&
           shadows.back().compared > 0;
  };
  while (!has_begun()) bench::sleep_until(mauve::monotonic_now_ns() + mauve::ms_to_ns(1));
  measure();
  deployer.stop("pipe");  // a stop calls the change off
  requester.join();
  deployer.start("pipe");
}

mauve::Component& add_pipe(mauve::Architecture& architecture, const bench::Options& options) {
  architecture.add_resource<mauve::SharedData<Small>>("data");
  architecture.add_resource<mauve::SharedData<bench::Torque>>("torque");
  mauve::Component& component = architecture.add_component<RobotShell, Timed, bench::WorkerFsm>(
      "pipe", mauve::TaskSettings{.priority = options.priority(), .cpus = {options.cpu()}});
  component.set_property("period_us", kPeriodUs);
  architecture.connect("pipe", "input", "data", "read");
  architecture.connect("pipe", "output", "data", "write");
  architecture.connect("pipe", "torque", "torque", "write");
  return component;
}

/// Both cores execute until the shadow is ended.
void blend(mauve::Deployer& deployer, mauve::Component& component, CpuTimes& times) {
  auto core = std::make_unique<Timed>();
  Timed& fresh = *core;
  auto& old = component.core_as<Timed>();
  mauve::Transaction transaction;
  transaction.replace_core(
      "pipe", std::move(core),
      mauve::ReplaceOptions{.bumpless = mauve::BumplessOptions{.outputs = {{"torque", "first", 1e300}},
                                                               .within_ns = mauve::s_to_ns(30),
                                                               .blend_ns = mauve::s_to_ns(60)}});
  deployer.commit(std::move(transaction), {});
  old.times = nullptr;
  fresh.times = &times;
}

void measure_releases(const bench::Options& options, bench::JsonLine& line) {
  const std::int64_t turns = options.number("turns", 10);
  const std::int64_t count = options.number("releases", 50);
  Sleeper sleeper;  // outlives the cores
  CpuTimes times(static_cast<std::size_t>(20 * turns * (count + 100)));
  mauve::Architecture architecture;
  mauve::Component& component = add_pipe(architecture, options);
  auto first = std::make_unique<Timed>();
  first->times = &times;
  component.replace_core(std::move(first));
  architecture.configure();
  mauve::Deployer deployer(architecture);
  deployer.deploy();

  std::vector<std::int64_t> plain;
  std::vector<std::int64_t> shadowed;
  std::vector<std::int64_t> awaiting;
  std::vector<std::int64_t> waking;
  std::vector<std::int64_t> probation;
  std::vector<std::int64_t> blended;
  std::int64_t early = 0;
  std::int64_t releases = 0;
  std::int64_t compared = 0;
  for (std::int64_t turn = 0; turn < turns; ++turn) {
    times.collect(plain, count);
    deployer.commit(begin_shadow(), {});
    times.collect(shadowed, count);
    deployer.commit(end_shadow(), {});
    const mauve::ShadowRecord record = deployer.shadows().back();
    releases += record.releases;
    compared += record.compared;
    while_waiting(deployer, [&] { times.collect(awaiting, count); });
    deployer.commit(put_in(std::make_unique<Waking>(sleeper)), {});
    times.collect(waking, count);
    deployer.commit(put_on_probation(), {});
    times.collect(probation, count);
    deployer.commit(put_in(std::make_unique<Timed>()), {});
    blend(deployer, component, times);
    times.collect(blended, count);
    if (deployer.shadows().back().verdict == mauve::ShadowVerdict::running) {
      deployer.commit(end_shadow(), {});
    } else {
      ++early;
    }
  }
  deployer.shutdown();
  line.add("plain_ns", plain)
      .add("shadowed_ns", shadowed)
      .add("awaiting_ns", awaiting)
      .add("waking_ns", waking)
      .add("probation_ns", probation)
      .add("blended_ns", blended)
      .add("early", early)
      .add("releases", releases)
      .add("compared", compared);
}

void measure_changes(const bench::Options& options, bench::JsonLine& line) {
  constexpr std::uint16_t kNeighbour = 1;
  constexpr int kChanges = 5;  // in each turn
  const time_ns_t long_ns = mauve::us_to_ns(kPeriodUs) * options.number("releases", 50);
  mauve::Architecture architecture;
  add_pipe(architecture, options);
  bench::add_worker(architecture, "neighbour", options.priority() - 1, options.cpu(), kPeriodUs, 0);
  architecture.configure();
  mauve::Deployer deployer(architecture);
  deployer.deploy();
  const auto collect = [&](std::vector<std::int64_t>& latencies) {
    deployer.drain_trace();
    bench::sleep_until(mauve::monotonic_now_ns() + long_ns);
    std::vector<mauve::TraceRecord> releases;
    bench::append_records(releases, deployer.drain_trace(), mauve::TraceKind::release, kNeighbour);
    for (const mauve::TraceRecord& release : releases) latencies.push_back(release.b - release.a);
  };
  std::vector<std::int64_t> plain;
  std::vector<std::int64_t> awaiting;
  std::vector<std::int64_t> blackouts;
  std::vector<std::int64_t> bumpless;
  for (std::int64_t turn = 0; turn < options.number("turns", 10); ++turn) {
    collect(plain);
    while_waiting(deployer, [&] { collect(awaiting); });
    for (int change = 0; change < kChanges; ++change) {
      blackouts.push_back(deployer.commit(put_in(std::make_unique<Passing>()), {}).blackout_ns);
      bumpless.push_back(deployer.commit(put_in_near(std::make_unique<Passing>(), kMost), {}).blackout_ns);
    }
  }
  deployer.shutdown();
  line.add("neighbour_plain_ns", plain)
      .add("neighbour_awaiting_ns", awaiting)
      .add("blackout_ns", blackouts)
      .add("bumpless_blackout_ns", bumpless);
}

void measure(const bench::Options& options) {
  bench::JsonLine line;
  measure_ports(options, line);
  measure_releases(options, line);
  measure_changes(options, line);
  line.print();
}

}  // namespace

int main(int count, char** words) { return bench::run_program(count, words, measure); }
