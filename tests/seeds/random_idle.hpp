// SPDX-License-Identifier: LGPL-3.0-or-later
// A scenario of the seeds: changes with `idle` of random components, which meet releases, events, stops and other changes.
#pragma once

#include <algorithm>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "mauve_rt/base/seam/ordinary_thread.hpp"
#include "mauve_rt/base/seam/sleep.hpp"
#include "mauve_rt/mauve_rt.hpp"

#include "fixtures.hpp"
#include "forked_run.hpp"
#include "scenario/dice.hpp"

namespace mauve::testing {

/// What the cores of a run share. One thread runs at a time: nothing needs a lock.
struct IdleShared {
  explicit IdleShared(seeds::Findings& all) : findings(all) {}
  struct Job {
    time_ns_t clock_ns{0}, ended_ns{0};  // of its last one; 0: it lasts
    int revision{0};
  };
  seeds::Findings& findings;
  std::vector<Job> jobs{};   // by component
  std::vector<int> taken{};  // by component: of the idle changes of it that are made, the newest revision
};

/// A core of a revision, which each component of an idle change gets at one T.
class IdleCore : public Core<TestShell> {
 public:
  /// `together`: the components that the change is of; empty: it is no idle one.
  IdleCore(std::shared_ptr<IdleShared> shared, std::size_t component, int revision,
           std::vector<std::size_t> together, std::uint64_t seed)
      : shared_(std::move(shared)),
        component_(component),
        revision_(revision),
        together_(std::move(together)),
        dice_(seed) {}

  void act() {
    IdleShared::Job& job = shared_->jobs[component_];
    expect_new("begins");
    job = {.clock_ns = clock_ns(), .revision = revision_};
    shell().output.write(Number{1.0});
    seeds::compute(dice_.between(0, us_to_ns(150)));
    if (dice_.once_in(4)) sleep_for(dice_.between(0, us_to_ns(300)));  // it is suspended
    expect_new("executes still");
    job.ended_ns = seeds::now_ns();
  }
  bool adopt(const CoreBase& /*old*/) override {
    if (dice_.once_in(3)) seeds::compute(dice_.between(0, us_to_ns(200)));
    if (dice_.once_in(3)) sleep_for(dice_.between(0, us_to_ns(1'500)));
    return true;
  }
  /// The first take comes after T was fixed: no participant has a job with old parts.
  void take(CoreBase& /*old*/) noexcept override {
    for (const std::size_t other : together_) {
      const IdleShared::Job& job = shared_->jobs[other];
      if (job.clock_ns != 0 && job.ended_ns == 0 && job.revision < revision_)
        shared_->findings.expect(false, "c" + std::to_string(component_) + " takes revision " +
                                            std::to_string(revision_) + " while c" + std::to_string(other) +
                                            " has a job of clock " + std::to_string(job.clock_ns));
      shared_->taken[other] = std::max(shared_->taken[other], revision_);
    }
    shared_->findings.count("idle takes", together_.empty() ? 0 : 1);
  }

 private:
  void expect_new(const std::string& what) const {
    shared_->findings.expect(revision_ >= shared_->taken[component_],
                             "c" + std::to_string(component_) + " " + what + " with revision " +
                                 std::to_string(revision_) + ", and an idle change has made it " +
                                 std::to_string(shared_->taken[component_]));
  }

  std::shared_ptr<IdleShared> shared_;
  std::size_t component_;
  int revision_;
  std::vector<std::size_t> together_;
  Dice dice_;
};

struct IdleFsm : Fsm<TestShell, IdleCore> {
  void define() override {
    State& run = execution("Run", "act", &IdleCore::act);
    State& pause = wait("Pause", us_to_ns(500) * shell().period_ms.value());
    set_initial(run);
    next(run, pause);
    next(pause, run);
  }
};
struct IdleEventFsm : Fsm<TestShell, IdleCore> {
  void define() override {
    State& event = wait_event("Event", shell().input, s_to_ns(10), us_to_ns(20));
    State& run = execution("Run", "act", &IdleCore::act);
    set_initial(event);
    next(event, run);
    next(run, event);
  }
};

class RandomIdle {
 public:
  RandomIdle(std::uint64_t seed, seeds::Findings& findings) : dice_(seed), findings_(findings), seed_(seed) {}

  void run() {
    seeds::switch_often();
    {
      Architecture architecture;
      declare(architecture);
      Deployer deployer(architecture);
      architecture_ = &architecture;
      deployer_ = &deployer;
      deployer.deploy();
      sleep_for(dice_.between(ms_to_ns(19), ms_to_ns(23)));  // the epoch is 20 ms ahead
      OrdinaryThread commands([this] { command(); });
      OrdinaryThread writes([this] { write(); });
      Dice dice(seed_ + 3);
      for (int changes = 4 + dice.below(8); changes > 0; --changes) {
        sleep_for(dice.between(0, ms_to_ns(1)));
        change(dice);
      }
      is_over_ = true;
      writes.join();
      commands.join();
      deployer.shutdown();
    }
    seeds::expect_threads_end(findings_, ms_to_ns(100));
  }

 private:
  static std::string name(std::size_t component) { return "c" + std::to_string(component); }

  void declare(Architecture& architecture) {
    architecture.add_resource<SharedData<Number>>("x");
    const auto count = static_cast<std::size_t>(2 + dice_.below(4));
    const bool is_one_cpu = dice_.once_in(2);
    shared_->jobs.resize(count);
    shared_->taken.resize(count);
    for (std::size_t i = 0; i < count; ++i) {
      const bool is_event = i != 0 && dice_.once_in(3);
      TaskSettings settings{.priority = 20 + 10 * dice_.below(5)};
      if (is_one_cpu || dice_.once_in(2)) settings.cpus = {0};
      std::unique_ptr<FsmBase> fsm =
          is_event ? new_part<FsmBase, IdleEventFsm>() : new_part<FsmBase, IdleFsm>();
      architecture.add_component(name(i), new_part<Shell, TestShell>(), core(i, {}), std::move(fsm), settings)
          .set_property("period_ms", std::int64_t{1 + dice_.below(5)});
      if (is_event) architecture.connect(name(i), "input", "x", "read");
    }
    architecture.connect("c0", "output", "x", "write");
    architecture.configure();
  }
  std::unique_ptr<IdleCore> core(std::size_t component, std::vector<std::size_t> together) {
    return std::make_unique<IdleCore>(shared_, component, revision_, std::move(together),
                                      seed_ * 1000 + static_cast<std::uint64_t>(++cores_));
  }

  void change(Dice& dice) {
    ++revision_;
    std::vector<std::size_t> together;
    for (std::size_t i = 0; i < shared_->jobs.size(); ++i) {
      if (!dice.once_in(4)) together.push_back(i);
    }
    if (together.empty()) return;
    const bool is_idle = !dice.once_in(5);
    Transaction transaction;
    for (const std::size_t i : together)
      transaction.replace_core(name(i), core(i, is_idle ? together : std::vector<std::size_t>{}));
    const time_ns_t within_ns = dice.once_in(3) ? dice.between(0, ms_to_ns(2)) : ms_to_ns(200);
    const std::string what = is_idle ? "idle change" : "change";
    findings_.note(what + " " + std::to_string(revision_));
    try {
      const TransactionReport report =
          deployer_->commit(std::move(transaction), {.timeouts = {.commit_ns = ms_to_ns(40), .phase_ns = 0},
                                                     .idle = is_idle,
                                                     .idle_within_ns = within_ns});
      findings_.expect(report.is_idle == is_idle, "the report does not say that it was idle");
      findings_.count(what + " made");
    } catch (const Error& error) {
      const std::string text = error.what();
      const bool had_no_instant = text.find("no instant at which all") != std::string::npos;
      findings_.note(what + " refused: " + text);
      findings_.count(what + (had_no_instant ? " without an idle instant" : " refused"));
      findings_.expect(error.code() != ErrorCode::internal, text);
    }
  }
  void command() {
    Dice dice(seed_ + 5);
    for (int commands = dice.below(8); commands > 0 && !is_over_; --commands) {
      sleep_for(dice.between(0, ms_to_ns(4)));
      const auto component = static_cast<std::size_t>(dice.below(static_cast<int>(shared_->jobs.size())));
      try {
        if (architecture_->component(name(component)).task().state() == ComponentState::running) {
          deployer_->stop(name(component));
        } else {
          deployer_->start(name(component));
        }
        findings_.count("commands");
      } catch (const Error& error) {
        findings_.expect(error.code() != ErrorCode::internal, error.what());
        findings_.count("commands refused");
      }
    }
  }
  /// Events whose stamps may lie before what others have executed.
  void write() {
    Dice dice(seed_ + 4);
    auto& written = static_cast<SharedData<Number>&>(architecture_->resource("x"));
    while (!is_over_) {
      written.write.write(Number{2.0}, monotonic_now_ns() - (dice.once_in(2) ? us_to_ns(400) : 0));
      sleep_for(dice.between(us_to_ns(10), us_to_ns(300)));
    }
  }

  Dice dice_;
  seeds::Findings& findings_;
  std::uint64_t seed_;
  std::shared_ptr<IdleShared> shared_{std::make_shared<IdleShared>(findings_)};
  Architecture* architecture_{nullptr};
  Deployer* deployer_{nullptr};
  int revision_{0};
  int cores_{0};
  bool is_over_{false};
};

inline void random_idle(std::uint64_t seed, seeds::Findings& findings) { RandomIdle(seed, findings).run(); }

}  // namespace mauve::testing
