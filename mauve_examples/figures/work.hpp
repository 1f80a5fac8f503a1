// SPDX-License-Identifier: LGPL-3.0-or-later
// A task that computes for a while in every period, as those of the paper's timelines do.
#pragma once

#include <ctime>

#include <mauve_rt/mauve_rt.hpp>

namespace mauve_figures {

/// Computes until the calling thread has used so much processor time: what preempts it does not count.
inline void compute_for(mauve::time_ns_t processor_ns) noexcept {
  const auto used_ns = [] {
    timespec used{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &used);
    return mauve::s_to_ns(used.tv_sec) + used.tv_nsec;
  };
  constexpr int kStepsPerLook = 1000;
  const mauve::time_ns_t until_ns = used_ns() + processor_ns;
  volatile double x = 0.5;
  while (used_ns() < until_ns) {
    for (int step = 0; step < kStepsPerLook; ++step) x = 3.9 * x * (1.0 - x);
  }
}

struct WorkShell : mauve::Shell {
  mauve::Property<std::int64_t>& period_us =
      property("period_us", 40'000, {.unit = "us", .minimum = 1000, .structural = mauve::ReadBy::fsm});
  mauve::Property<std::int64_t>& work_us =
      property("work_us", 8000, {.unit = "us", .description = "processor time in a period", .minimum = 0});
  mauve::Property<std::int64_t>& prepare_us =
      property("prepare_us", 6000,
               {.unit = "us",
                .description = "processor time that ShortWork's configuration takes",
                .structural = mauve::ReadBy::core});
};

/// C_A of Fig. 6.
class Work : public mauve::Core<WorkShell> {
 public:
  virtual void work() { compute_for(mauve::us_to_ns(shell().work_us)); }
};

/// C_B: takes half the time, having prepared for it.
class ShortWork final : public Work {
 public:
  void work() override { compute_for(mauve::us_to_ns(shell().work_us) / 2); }

 protected:
  bool configure_hook() override {
    compute_for(mauve::us_to_ns(shell().prepare_us));
    return true;
  }
};

struct WorkFsm : mauve::Fsm<WorkShell, Work> {
  void define() override {
    mauve::State& work = execution("Work", "work", &Work::work);
    mauve::State& rest = wait("Rest", mauve::us_to_ns(shell().period_us));
    set_initial(work);
    next(work, rest);
    next(rest, work);
  }
};

}  // namespace mauve_figures
