// SPDX-License-Identifier: LGPL-3.0-or-later
// Random transactions of every kind of step, and what each should make of an architecture.
#pragma once

#include <map>
#include <random>
#include <set>

#include "rhythm.hpp"
#include "transaction_fixtures.hpp"

namespace mauve::testing {

// ---- the parts

/// Outputs of three policies. No core writes them: what is in them is the kernel's, or the test's.
struct RandomShell : TestShell {
  WritePort<Number>& cleared =
      write_port<Number>("cleared", {.on_commit = OutputPolicy::set_zero, .on_stop = OutputPolicy::hold})
          .optional();
};
struct OtherRandomShell : RandomShell {};

/// Throws when it is told to, once.
struct RandomCore : CountingCore {
  void act() override {
    if (condition.exchange(false, std::memory_order_relaxed)) throw std::runtime_error("as it was told");
    CountingCore::act();
  }
};
/// Every other period.
struct DoubleFsm : Fsm<TestShell, TestCore> {
  void define() override {
    State& run = execution("Run", "act", &TestCore::act);
    State& pause = wait("Pause", 2 * ms_to_ns(shell().period_ms.value()));
    set_initial(run);
    next(run, pause);
    next(pause, run);
  }
};

inline void register_random_parts(PluginRegistry& registry) {
  registry.type<Number>();
  registry.shell<RandomShell>("r/Shell");
  registry.shell<OtherRandomShell>("r/OtherShell");
  registry.shell<NarrowShell>("r/Narrow");  // fits nothing
  registry.core<RandomCore>("r/Core", "r/Shell");
  registry.core<RandomCore>("r/Other", "r/Shell");
  registry.core<RandomCore>("r/Undeclared", "r/Shell");  // nobody's alternative
  registry.core<RefusingCore>("r/Refusing", "r/Shell");
  registry.core<ThrowingCore>("r/Throwing", "r/Shell");
  registry.core<UnreadyCore>("r/Unready", "r/Shell");
  registry.fsm<TestFsm>("r/Fsm", "r/Shell");
  registry.fsm<SyncopatedFsm>("r/Syncopated", "r/Shell");
  registry.fsm<DoubleFsm>("r/Double", "r/Shell");
}

// ---- the model

struct Expected {
  std::string core{"r/Core"};
  std::string fsm{"r/Fsm"};
  std::string shell{"r/Shell"};
  std::string fallback{};
  bool running{false};
  double gain{1.0};
  std::int64_t period_ms{2};
  std::string input{};  // the resource it reads
  bool operator==(const Expected&) const = default;

  Plan plan() const {
    const time_ns_t unit = ms_to_ns(period_ms);
    if (fsm == "r/Syncopated") return {{unit, 2 * unit}, {"ShortPause", "LongPause"}};
    return {{fsm == "r/Double" ? 2 * unit : unit}, {"Pause"}};
  }
};

inline void PrintTo(const Expected& of, std::ostream* out) {
  *out << of.shell << ' ' << of.core << ' ' << of.fsm << (of.running ? " running" : " stopped") << ", gain "
       << of.gain << ", period " << of.period_ms << ", reads '" << of.input << "', fallback '" << of.fallback
       << '\'';
}

struct Model {
  std::map<std::string, Expected> components;
  std::set<std::string> resources;
  bool operator==(const Model&) const = default;
};

/// What a transaction does to one component.
struct Touch {
  bool core{false}, fsm{false}, shell{false};
  bool stopped{false}, started{false}, added{false}, removed{false};
  bool replaced() const { return core || fsm || shell; }
};

struct RandomDraft {
  Transaction transaction{};
  TransactionOptions options{};
  Model after;
  std::map<std::string, Touch> touched{};
  bool valid{true};
  std::string text{};
};

inline constexpr int kRandomComponents = 6;
inline const std::array<const char*, 3> kOutputs{"output", "held", "cleared"};

/// Draws transactions; most steps without regard to whether they can succeed.
class RandomModel {
 public:
  explicit RandomModel(std::uint64_t seed) : random_(seed) {}

  int below(int bound) { return std::uniform_int_distribution<int>(0, bound - 1)(random_); }

  RandomDraft draft(const Model& now, std::uint64_t revision) {
    RandomDraft made{.after = now};
    for (int steps = 1 + below(3); steps > 0; --steps) made.valid = enter(made) && made.valid;
    if (below(30) == 0) {  // last, as no step after it would find its ports
      made.transaction.replace_shell("c" + std::to_string(below(kRandomComponents)), "r/Narrow");
      made.valid = false;
    }
    for (const auto& step : made.transaction.steps()) made.text += "\n  " + step->text();
    made.options.dry_run = below(20) == 0;
    if (below(20) == 0) {
      made.options.expected_revision = below(2) == 0 ? revision : revision + 1;
      made.valid = made.valid && made.options.expected_revision == revision;
    }
    made.text += made.options.dry_run ? "\n  (a dry run)" : "";
    made.valid = made.valid && can_become(now, made);
    return made;
  }

  static ComponentParts added_parts() {
    ComponentParts parts{.shell = "r/Shell", .core = "r/Core", .fsm = "r/Fsm"};
    parts.settings.cpus = {kComponentsCpu};
    parts.properties["period_ms"] = std::int64_t{2};
    parts.alternatives = {"r/Other", "r/Refusing", "r/Throwing", "r/Unready"};
    return parts;
  }

 private:
  using Found = std::map<std::string, Expected>::iterator;

  /// What only the whole shows.
  static bool can_become(const Model& now, const RandomDraft& made) {
    static const std::set<std::string> kNeverInTheEnd{"r/Throwing", "r/Refusing", "r/Unready"};
    for (const auto& [name, after] : made.after.components) {
      if (made.options.dry_run ? after.core == "r/Unready" : kNeverInTheEnd.contains(after.core))
        return false;
      if (after.period_ms == 0) return false;
      const auto touch = made.touched.find(name);
      if (touch == made.touched.end() || touch->second.added) continue;
      const bool reads_anew = touch->second.fsm || touch->second.shell;
      if (after.period_ms != now.components.at(name).period_ms && !reads_anew) return false;
    }
    return true;
  }

  bool enter(RandomDraft& made) {
    const std::string name = "c" + std::to_string(below(kRandomComponents));
    const Found found = made.after.components.find(name);
    const bool known = found != made.after.components.end();
    switch (below(14)) {
      case 0:
      case 1:
        return replace_core(made, name, found);
      case 2: {
        const char* fsm = std::array{"r/Fsm", "r/Syncopated", "r/Double"}[static_cast<std::size_t>(below(3))];
        made.transaction.replace_fsm(name, fsm);
        return known && enter_fsm(made, found, fsm);
      }
      case 3: {
        const char* shell = below(2) == 0 ? "r/Shell" : "r/OtherShell";
        made.transaction.replace_shell(name, shell);
        if (!known) return false;
        made.touched[name].shell = true;
        found->second.shell = shell;
        return true;
      }
      case 4: {
        const double gain = below(12);  // 11 is out of range
        made.transaction.set_property(name, "gain", gain);
        if (!known || gain > 10.0) return false;
        made.touched[name];
        found->second.gain = gain;
        return true;
      }
      case 5:
        return set_period(made, name, found);
      case 6:
        return connect(made, name, found);
      case 7: {
        made.transaction.disconnect(name, "input");
        if (!known || found->second.input.empty()) return false;
        made.touched[name];
        found->second.input.clear();
        return true;
      }
      case 8:
        return add(made, name);
      case 9:
        return remove(made, name, found);
      case 10:
        return change_resource(made);
      case 11:
      case 12: {
        made.transaction.start(name);
        if (!known || found->second.running) return false;
        made.touched[name].started = true;
        return found->second.running = true;
      }
      default: {
        made.transaction.stop(name);
        if (!known || !found->second.running) return false;
        made.touched[name].stopped = true;
        found->second.running = false;
        return true;
      }
    }
  }

  bool replace_core(RandomDraft& made, const std::string& name, Found found) {
    const bool known = found != made.after.components.end();
    const bool added = known && made.touched[name].added;
    static const std::array kBad{"r/Throwing", "r/Refusing", "r/Unready", "r/Undeclared", "r/Nonsense"};
    const bool bad = !added && below(5) == 0;  // one just added may be given any core that there is
    const std::string core = bad ? kBad[static_cast<std::size_t>(below(kBad.size()))]
                                 : std::array{"r/Core", "r/Other"}[static_cast<std::size_t>(below(2))];
    made.transaction.replace_core(name, core);
    if (!known) return false;
    made.touched[name].core = true;
    found->second.core = core;
    return core != "r/Undeclared" && core != "r/Nonsense";
  }

  static bool enter_fsm(RandomDraft& made, Found found, const std::string& fsm) {
    made.touched[found->first].fsm = true;
    found->second.fsm = fsm;
    return true;
  }

  /// Structural: alone it is refused, beside a new fsm, before or after it, taken.
  bool set_period(RandomDraft& made, const std::string& name, Found found) {
    const std::int64_t period_ms = below(10) == 0 ? 0 : 1 + below(4);
    const int where = below(3);
    const char* fsm = below(2) == 0 ? "r/Fsm" : "r/Syncopated";
    if (where == 1) made.transaction.replace_fsm(name, fsm);
    made.transaction.set_property(name, "period_ms", period_ms);
    if (where == 2) made.transaction.replace_fsm(name, fsm);
    if (found == made.after.components.end()) return false;
    made.touched[name];
    found->second.period_ms = period_ms;
    return where == 0 || enter_fsm(made, found, fsm);
  }

  bool connect(RandomDraft& made, const std::string& name, Found found) {
    const std::string resource = "r" + std::to_string(below(4));
    made.transaction.connect(name, "input", resource, "read");
    if (found == made.after.components.end() || !found->second.input.empty()) return false;
    if (!made.after.resources.contains(resource)) return false;
    made.touched[name];
    found->second.input = resource;
    return true;
  }

  bool add(RandomDraft& made, const std::string& name) {
    made.transaction.add_component(name, added_parts());
    for (const std::string output : kOutputs)
      made.transaction.connect(name, output, output + "_" + name, "write");
    if (!made.after.components.emplace(name, Expected{}).second) return false;
    Touch& touch = made.touched[name];
    touch = {.added = true, .removed = touch.removed};
    return true;
  }

  static bool remove(RandomDraft& made, const std::string& name, Found found) {
    made.transaction.remove_component(name);
    if (found == made.after.components.end()) return false;
    made.after.components.erase(found);
    made.touched[name].removed = true;
    return true;
  }

  bool change_resource(RandomDraft& made) {
    const std::string resource = "r" + std::to_string(below(4));
    if (below(2) == 0) {
      made.transaction.add_resource(resource, "shared_data", kNumberType);
      return made.after.resources.insert(resource).second;
    }
    made.transaction.remove_resource(resource);
    for (const auto& [name, each] : made.after.components) {
      if (each.input == resource) return false;
    }
    return made.after.resources.erase(resource) == 1;
  }

  std::mt19937_64 random_;
};

}  // namespace mauve::testing
