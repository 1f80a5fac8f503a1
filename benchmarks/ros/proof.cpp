// SPDX-License-Identifier: LGPL-3.0-or-later
// A plug-in for benchmarks: components that use exactly the CPU time that their properties say, in states, guards and under a lock.
#include <cstdint>
#include <ctime>
#include <mutex>

#include "mauve_rt/elements/types.hpp"
#include "mauve_rt/mauve_rt.hpp"

namespace bench {

using mauve::types::Point;

/// Uses the CPU for so long; what takes it from this thread meanwhile does not count.
inline void use_cpu(std::int64_t us) {
  const auto used_ns = [] {
    timespec used{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &used);
    return mauve::s_to_ns(used.tv_sec) + used.tv_nsec;
  };
  const mauve::time_ns_t until = used_ns() + mauve::us_to_ns(us);
  while (used_ns() < until) {
  }
}

struct ProofShell : mauve::Shell {
  using Microseconds = mauve::Property<std::int64_t>;

  Microseconds& period_us =
      structural("period_us", "of a wait; of a wait for events the least time between them");
  Microseconds& long_us = structural("long_us", "of the other wait");
  Microseconds& first_us = cost("first_us", "that state First uses");
  Microseconds& second_us = cost("second_us", "that state Second uses");
  Microseconds& guard_us = cost("guard_us", "that the guard of a wait uses");
  Microseconds& hold_us = cost("hold_us", "that state First uses under the lock of `store`, beside first_us");
  mauve::ReadPort<Point>& in = read_port<Point>("in").optional();
  mauve::WritePort<Point>& out = write_port<Point>("out").optional();
  mauve::CallPort<void(std::int64_t)>& store = call_port<void(std::int64_t)>("store", "bench/Hold");

 private:
  Microseconds& structural(const char* name, const char* description) {
    return property(name, std::int64_t{10'000},
                    {.unit = "us",
                     .description = description,
                     .minimum = 1,
                     .maximum = 1e9,
                     .structural = mauve::ReadBy::fsm});
  }
  Microseconds& cost(const char* name, const char* description) {
    return property(name, std::int64_t{0},
                    {.unit = "us", .description = description, .minimum = 0, .maximum = 1e9});
  }
};

class ProofCore final : public mauve::Core<ProofShell> {
 public:
  void first() {
    use_cpu(shell().first_us);
    shell().store(shell().hold_us);
    if (shell().out.is_connected()) shell().out.write({});
  }
  void second() { use_cpu(shell().second_us); }
  bool holds() {
    use_cpu(shell().guard_us);
    return true;
  }
  bool is_odd() { return (++count_ & 1U) != 0; }

 private:
  std::uint32_t count_{0};
};

struct ProofFsm : mauve::Fsm<ProofShell, ProofCore> {
 protected:
  mauve::State& first() { return execution("First", "first", &ProofCore::first); }
  mauve::State& rest() { return wait("Rest", mauve::us_to_ns(shell().period_us)); }
};

/// One state, one wait.
struct ProofLoop : ProofFsm {
  void define() override {
    mauve::State& work = first();
    mauve::State& pause = rest();
    set_initial(work);
    next(work, pause);
    next(pause, work);
  }
};

/// Two waits in turn.
struct ProofTurns : ProofFsm {
  void define() override {
    mauve::State& work = first();
    mauve::State& pause = rest();
    mauve::State& longer = wait("Longer", mauve::us_to_ns(shell().long_us));
    set_initial(work);
    transition(work, "is_odd", &ProofCore::is_odd, pause);
    next(work, longer);
    next(pause, work);
    next(longer, work);
  }
};

/// Two states in a job, and every other job only the first.
struct ProofSteps : ProofFsm {
  void define() override {
    mauve::State& work = first();
    mauve::State& more = execution("Second", "second", &ProofCore::second);
    mauve::State& pause = rest();
    set_initial(work);
    transition(work, "is_odd", &ProofCore::is_odd, pause);
    next(work, more);
    next(more, pause);
    next(pause, work);
  }
};

/// A wait with a guard that takes its time.
struct ProofGuarded : ProofFsm {
  void define() override {
    mauve::State& work = first();
    mauve::State& pause = rest();
    set_initial(work);
    next(work, pause);
    transition(pause, "holds", &ProofCore::holds, work);
    next(pause, work);
  }
};

/// Released by what is written to `in`.
struct ProofEvents : ProofFsm {
  void define() override {
    mauve::State& work = first();
    mauve::State& await =
        wait_event("Await", shell().in, mauve::kForever, mauve::us_to_ns(shell().period_us));
    set_initial(await);
    next(await, work);
    next(work, await);
  }
};

/// A lock that a call holds for as long as it is asked to.
class ProofStore final : public mauve::Resource {
 public:
  ProofStore() : Resource("bench/Store", "") { offer(hold_); }

 private:
  class Hold final : public mauve::CallService<void(std::int64_t)> {
   public:
    Hold() : CallService("hold", "bench/Hold") {}
    void call(std::int64_t us) override {
      const std::lock_guard lock(mutex_);
      use_cpu(us);
    }

   private:
    mauve::PiMutex mutex_;
  };
  Hold hold_;
};

}  // namespace bench

MAUVE_PLUGINS(registry) {
  registry.type<bench::Point>();
  registry.shell<bench::ProofShell>("bench/ProofShell");
  registry.core<bench::ProofCore>("bench/ProofCore", "bench/ProofShell");
  registry.fsm<bench::ProofLoop>("bench/ProofLoop", "bench/ProofShell");
  registry.fsm<bench::ProofTurns>("bench/ProofTurns", "bench/ProofShell");
  registry.fsm<bench::ProofSteps>("bench/ProofSteps", "bench/ProofShell");
  registry.fsm<bench::ProofGuarded>("bench/ProofGuarded", "bench/ProofShell");
  registry.fsm<bench::ProofEvents>("bench/ProofEvents", "bench/ProofShell");
  registry.resource<bench::ProofStore>("bench/ProofStore");
}
