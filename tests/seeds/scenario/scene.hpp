// SPDX-License-Identifier: LGPL-3.0-or-later
// Scene: the components of a scenario, and how its clients make requests.
#pragma once

#include <algorithm>
#include <array>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "mauve_rt/base/seam/sleep.hpp"

#include "history.hpp"
#include "seed_parts.hpp"

namespace mauve::testing {

/// A component, as the changes made it.
struct Part {
  std::string name;
  time_ns_t period_ns;
  bool is_sporadic;
  bool has_fallback;
  double gain{1.0};
  int core{0};
  double input{kUnconnected};
  int trial{kNone};  // the core on probation
};

/// Which client changes a component: the only one, or each of two every other.
enum class Owner : std::uint8_t { only, first, second };
inline bool owns(Owner owner, std::size_t component) {
  return owner == Owner::only || component % 2 == (owner == Owner::first ? 0U : 1U);
}

inline std::string output_of(std::size_t component) { return "out" + std::to_string(component); }

class Scene {
 protected:
  Scene(std::uint64_t seed, seeds::Findings& findings)
      : dice_(seed),
        findings_(findings),
        seed_(seed),
        shuts_down_(dice_.once_in(3)),
        two_change_(dice_.once_in(2)) {
    shared_->may_hang = !dice_.once_in(3);
  }

  static constexpr int kExtra = 1000;  // components that are added, from this number on
  static constexpr time_ns_t kExtraPeriod = ms_to_ns(3);
  static constexpr time_ns_t kSlack = ms_to_ns(150);
  static constexpr time_ns_t kShutdown = Deployer::kStopTimeout + ms_to_ns(500) + kSlack;
  static constexpr time_ns_t kPrepare = ms_to_ns(30);
  static constexpr time_ns_t kCleanup = s_to_ns(1);  // a requester waits so long for the cleanup of old parts
  static constexpr time_ns_t kPatience = Commit::kPatience;  // with an adopt that hangs
  static constexpr time_ns_t kLook =
      ms_to_ns(20);  // so often a requester looks whether a component has parked
  static constexpr time_ns_t kPrompt = ms_to_ns(15);  // of a request: where no core hangs, no timeout passes

  void expect(bool is_true, const std::string& otherwise) { findings_.expect(is_true, otherwise); }

  /// A request that starts, stops or changes components.
  class Intervention {
   public:
    explicit Intervention(Scene& scene)
        : scene_(scene), number_(++scene.shared_->interventions), is_first_(scene.open_++ == 0) {}
    ~Intervention() { --scene_.open_; }
    Intervention(const Intervention&) = delete;
    Intervention& operator=(const Intervention&) = delete;
    /// No other one was made since this one began.
    bool is_sole() const {
      return is_first_ && scene_.open_ == 1 && scene_.shared_->interventions == number_ &&
             !scene_.shared_->is_shut_down;
    }

   private:
    Scene& scene_;
    int number_;
    bool is_first_;
  };

  /// A request is answered in time, but for the stalls of the computer and for slow hooks. `prompt_ns` is for runs where no
  /// core hangs any more, and where given for a request that was alone.
  template <typename Request>
  void timed(const std::string& what, time_ns_t longest_ns, time_ns_t prompt_ns, Request&& request,
             const Intervention* alone = nullptr) {
    const time_ns_t began_ns = seeds::now_ns();
    const time_ns_t excused_ns = excuses_ns();
    findings_.note(what);
    request();
    findings_.note("end of " + what);
    const time_ns_t ended_ns = seeds::now_ns();
    time_ns_t took_ns = ended_ns - began_ns - (excuses_ns() - excused_ns);
    if (shared_->hanging == 0 && (alone == nullptr || alone->is_sole())) {
      longest_ns = prompt_ns;
      const time_ns_t excuses_since_ns = excuses_ns() - shared_->returned_excuses_ns;
      took_ns = std::min(took_ns, ended_ns - shared_->returned_ns - excuses_since_ns);
    } else if (!shared_->hung_cores.empty()) {
      longest_ns += kCleanup;
    }
    expect(took_ns <= longest_ns, what + " took " + std::to_string(took_ns / 1000) +
                                      " us, expected at most " + std::to_string(longest_ns / 1000) + " us");
  }
  time_ns_t excuses_ns() const { return seeds::outcome().stalled_ns + shared_->slow_ns; }

  /// A command is carried out, or refused with a reason. Whether it was carried out.
  template <typename Request>
  bool command(const std::string& what, time_ns_t longest_ns, Request&& request,
               const Intervention* alone = nullptr, time_ns_t prompt_ns = kPrompt) {
    bool is_done = false;
    const auto carry_out = [&] {
      try {
        request();
        is_done = true;
      } catch (const Error& error) {
        findings_.count("commands refused");
        findings_.note(what + ": refused: " + error.what());
        expect(error.code() != ErrorCode::internal, what + ": internal error: " + error.what());
      }
    };
    timed(what, longest_ns, prompt_ns, carry_out, alone);
    return is_done;
  }

  // ---- the architecture

  void declare() {
    const int count = dice_.once_in(4) ? 6 + dice_.below(7) : 1 + dice_.below(5);
    for (int i = 0; i < count; ++i)
      architecture_->add_resource<LatestValue<Number>>(output_of(static_cast<std::size_t>(i)));
    for (int i = 0; i < count; ++i) declare(i, count);
    architecture_->configure();
  }

  void declare(int number, int count) {
    const std::int64_t period_ms = dice_.once_in(8) ? 200 : (2 + dice_.below(9)) * (1 + count / 5);
    parts_.push_back({.name = "c" + std::to_string(number),
                      .period_ns = ms_to_ns(period_ms),
                      .is_sporadic = dice_.once_in(6),
                      .has_fallback = dice_.once_in(5)});
    Part& part = parts_.back();
    part.core = next_core_++;
    if (part.is_sporadic) history_.note_sporadic(number);
    const bool is_bounded = dice_.once_in(3);
    auto fsm = part.is_sporadic ? new_part<FsmBase, EventFsm>()
               : is_bounded     ? new_part<FsmBase, BoundedFsm>()
                                : new_part<FsmBase, SeedFsm>();
    Component& component = architecture_->add_component(
        part.name, new_part<Shell, TestShell>(), core(part.core, number, Manner{}), std::move(fsm),
        {.priority = 10 + 10 * dice_.below(4),
         .overrun = dice_.once_in(6) ? OverrunPolicy::catch_up : OverrunPolicy::skip,
         .max_backlog = 100,
         .hung_after_ns = dice_.once_in(2) ? ms_to_ns(40) : 0});
    component.set_property("period_ms", period_ms);
    const auto index = static_cast<std::size_t>(number);
    architecture_->connect(part.name, "output", output_of(index), "write");
    const int target = dice_.below(count);
    if (part.is_sporadic || dice_.once_in(2)) {
      architecture_->connect(part.name, "input", output_of(static_cast<std::size_t>(target)), "read");
      part.input = written_by(target);
    }
    if (part.has_fallback) component.set_fallback(fallback(number));
    for (const auto& [aspect, value] : aspects_of(part))
      history_.note(Made{.component = number, .aspect = aspect, .value = value, .instant_ns = 0});
  }

  /// A number is drawn before its core is made: the other client draws numbers, too.
  std::unique_ptr<CoreBase> core(int number, int component, Manner manner, bool is_on_probation = false) {
    auto made = std::make_unique<SeedCore>(shared_, component, number, manner,
                                           seed_ * 1000 + static_cast<std::uint64_t>(number));
    if (is_on_probation) made->set_on_probation();
    return made;
  }
  /// Each instance has a number of its own.
  std::unique_ptr<CoreBase> fallback(int component) {
    auto make = [shared = shared_, component, next = next_fallback_,
                 seed = seed_]() -> std::unique_ptr<CoreBase> {
      const int number = (*next)++;
      return std::make_unique<SeedCore>(shared, component, number, Manner{},
                                        seed * 1000 + static_cast<std::uint64_t>(number));
    };
    auto first = make();
    first->set_factory(make);
    return first;
  }

  static std::map<Aspect, double> aspects_of(const Part& part) {
    return {{Aspect::core, part.core},
            {Aspect::gain, part.gain},
            {Aspect::input, part.input},
            {Aspect::period, part.is_sporadic ? 0.0 : static_cast<double>(part.period_ns)}};
  }
  static int core_of(const std::string& implementation) {
    return std::stoi(implementation.substr(implementation.find("Core") + 4));
  }

  int any(Dice& dice) const { return dice.below(static_cast<int>(parts_.size())); }
  ComponentState state_of(std::size_t index) const {
    const auto component = architecture_->find_component(parts_[index].name);
    return component == nullptr ? ComponentState::unconfigured : component->task().state();
  }
  double output_value(std::size_t index) const {
    Resource& output = architecture_->resource(output_of(index));
    double found = 0.0;
    output.read_number(output.find_number("value").value(), found);
    return found;
  }

  Dice dice_;
  seeds::Findings& findings_;
  std::uint64_t seed_;
  bool shuts_down_;  // the second client, at any moment
  bool two_change_;  // the second client, too
  std::shared_ptr<Shared> shared_{std::make_shared<Shared>(findings_)};
  History history_{findings_};
  Architecture* architecture_{nullptr};
  Deployer* deployer_{nullptr};
  std::vector<Part> parts_;
  int next_core_{0};
  std::shared_ptr<int> next_fallback_{std::make_shared<int>(kFirstFallback)};
  std::map<int, time_ns_t> trials_;  // of each core on probation how long
  int open_{0};                      // interventions
};

}  // namespace mauve::testing
