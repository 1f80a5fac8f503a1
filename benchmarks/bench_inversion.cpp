// SPDX-License-Identifier: LGPL-3.0-or-later
// How long one of FIFO 90 waits for one of FIFO 10 that holds a lock for 2 ms of its own time, while one of
// FIFO 50 burns 50 ms on the same CPU: components around a SharedData, beside bare threads around a std::mutex.
//   bench_inversion [--who component|bare] [--count 5] [--cpu 0] [--hold-us 2000] [--burn-us 50000]
// Prints {"blocked_ns": [...]}: the duration of the write of FIFO 90.
#include <mutex>

#include "mauve_rt/mauve_rt.hpp"

#include "support/json_line.hpp"
#include "support/options.hpp"
#include "support/realtime_thread.hpp"

namespace bench {

/// A value whose copy takes a while, so that SharedData's lock is held for as long.
struct Slow {
  Slow() = default;
  Slow(const Slow&) = default;
  Slow& operator=(const Slow& other) {
    copy_us = other.copy_us;
    if (copy_us > 0) burn(mauve::us_to_ns(copy_us));
    return *this;
  }

  std::int64_t copy_us{0};
};

}  // namespace bench

MAUVE_TYPE(bench::Slow, "bench/Slow", copy_us)

namespace {

using mauve::time_ns_t;

// On every round the holder comes first and gets the lock, then the hog, then the one that must wait.
constexpr int kHolder = 10, kHog = 50, kUrgent = 90;
constexpr time_ns_t kHogAfter = mauve::us_to_ns(200);
constexpr time_ns_t kUrgentAfter = mauve::us_to_ns(400);

struct Settings {
  explicit Settings(const bench::Options& options)
      : count(options.number("count", 5)),
        cpu(options.cpu()),
        hold_us(options.number("hold-us", 2000)),
        burn_us(options.number("burn-us", 50'000)) {}

  time_ns_t period_ns() const { return mauve::us_to_ns(2 * (hold_us + burn_us)); }

  std::int64_t count;
  int cpu;
  std::int64_t hold_us;
  std::int64_t burn_us;
};

struct PartyShell : mauve::Shell {
  mauve::WritePort<bench::Slow>& data =
      write_port<bench::Slow>("data", {.on_stop = mauve::OutputPolicy::hold});
};

struct Party : mauve::Core<PartyShell> {
  virtual void act() = 0;
  std::string description() const override { return "core bench/Party"; }
};

struct Holder final : Party {
  explicit Holder(std::int64_t hold_us) { value.copy_us = hold_us; }
  void act() override { shell().data.write(value); }
  bench::Slow value;
};

struct Hog final : Party {
  explicit Hog(std::int64_t duration_us) : burn_us(duration_us) {}
  void act() override { bench::burn(mauve::us_to_ns(burn_us)); }
  std::int64_t burn_us;
};

struct Urgent final : Party {
  Urgent() { blocked_ns.reserve(10'000); }
  void act() override {
    const time_ns_t before = mauve::monotonic_now_ns();
    shell().data.write(value);
    if (blocked_ns.size() < blocked_ns.capacity()) blocked_ns.push_back(mauve::monotonic_now_ns() - before);
  }
  bench::Slow value;
  std::vector<std::int64_t> blocked_ns;
};

struct PartyFsm final : mauve::Fsm<PartyShell, Party> {
  explicit PartyFsm(time_ns_t period) : period_ns(period) {}
  void define() override {
    mauve::State& act = execution("Act", "act", &Party::act);
    mauve::State& rest = wait("Rest", period_ns);
    set_initial(act);
    next(act, rest);
    next(rest, act);
  }
  time_ns_t period_ns;
};

void measure_component(const Settings& settings) {
  mauve::Architecture architecture;
  auto& data = architecture.add_resource<mauve::SharedData<bench::Slow>>("data");
  const auto add = [&](const char* name, std::unique_ptr<Party> core, int priority, time_ns_t offset_ns) {
    mauve::Component& component = architecture.add_component(
        name, std::make_unique<PartyShell>(), std::move(core),
        std::make_unique<PartyFsm>(settings.period_ns()),
        mauve::TaskSettings{.priority = priority, .cpus = {settings.cpu}, .offset_ns = offset_ns});
    architecture.connect(component, "data", data, "write");
  };
  auto waiting = std::make_unique<Urgent>();
  const std::vector<std::int64_t>& blocked = waiting->blocked_ns;
  add("holder", std::make_unique<Holder>(settings.hold_us), kHolder, 0);
  add("hog", std::make_unique<Hog>(settings.burn_us), kHog, kHogAfter);
  add("urgent", std::move(waiting), kUrgent, kUrgentAfter);
  architecture.configure();
  mauve::Deployer deployer(architecture);
  deployer.deploy();
  bench::sleep_until(deployer.epoch_ns() + settings.count * settings.period_ns() - mauve::ms_to_ns(1));
  deployer.shutdown();
  bench::JsonLine().add("blocked_ns", blocked).print();
}

void measure_bare(const Settings& settings) {
  mauve::RealtimeProcess process;
  process.acquire(kUrgent, false);
  std::mutex mutex;
  std::vector<std::int64_t> blocked(static_cast<std::size_t>(settings.count));
  const time_ns_t epoch = mauve::monotonic_now_ns() + mauve::ms_to_ns(20);
  const auto every_period = [&](time_ns_t offset_ns, const std::function<void(std::size_t)>& act) {
    for (std::size_t i = 0; i < blocked.size(); ++i) {
      bench::sleep_until(epoch + static_cast<time_ns_t>(i) * settings.period_ns() + offset_ns);
      act(i);
    }
  };
  {
    const bench::RealtimeThread holder(kHolder, settings.cpu, [&] {
      every_period(0, [&](std::size_t) {
        const std::lock_guard lock(mutex);
        bench::burn(mauve::us_to_ns(settings.hold_us));
      });
    });
    const bench::RealtimeThread hog(kHog, settings.cpu, [&] {
      every_period(kHogAfter, [&](std::size_t) { bench::burn(mauve::us_to_ns(settings.burn_us)); });
    });
    const bench::RealtimeThread urgent(kUrgent, settings.cpu, [&] {
      every_period(kUrgentAfter, [&](std::size_t i) {
        const time_ns_t before = mauve::monotonic_now_ns();
        const std::lock_guard lock(mutex);
        blocked[i] = mauve::monotonic_now_ns() - before;
      });
    });
  }
  bench::JsonLine().add("blocked_ns", blocked).print();
}

}  // namespace

int main(int count, char** words) { return bench::run_sides(count, words, measure_component, measure_bare); }
