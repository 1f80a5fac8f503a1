// SPDX-License-Identifier: LGPL-3.0-or-later
// Random transactions, and the description that each should leave behind.
#pragma once

#include <algorithm>
#include <random>
#include <set>
#include <string>

#include "mauve_rt/mauve_rt.hpp"

namespace bench {

/// A transaction with what is expected of it.
struct SoakDraft {
  mauve::Transaction transaction{};
  mauve::ArchitectureDescription expected;  // as it will be, if it is valid
  bool valid{true};
  std::set<std::string> touched{};
  std::set<std::string> added{};
  std::string text{};
};

/// Makes up transactions; every step is drawn without regard to whether it can succeed.
class SoakModel {
 public:
  /// `extra`, `resource`: what looks like it that a transaction adds; its name does not matter.
  SoakModel(std::uint64_t seed, mauve::ComponentFacts extra, mauve::ComponentParts extra_parts,
            mauve::ResourceFacts resource)
      : random_(seed),
        extra_(std::move(extra)),
        extra_parts_(std::move(extra_parts)),
        resource_(std::move(resource)) {}

  SoakDraft draft(const mauve::ArchitectureDescription& now) {
    SoakDraft made{.expected = now};
    for (int steps = 1 + below(4); steps > 0; --steps) {
      made.valid = enter(made) && made.valid;
      made.text += made.transaction.steps().back()->text() + "; ";
    }
    // The kernel asks each core that is new in the end.
    for (const mauve::ComponentFacts& each : made.expected.components)
      made.valid = made.valid && each.parts.core != "soak/Refusing";
    return made;
  }

  /// The way back to an architecture without anything that was added.
  SoakDraft draft_reset(const mauve::ArchitectureDescription& now) {
    SoakDraft made{.expected = now};
    for (const mauve::ComponentFacts& each : now.components) {
      if (each.name.starts_with("extra_")) remove_component(made, each.name);
    }
    return made;
  }

 private:
  int below(int bound) { return std::uniform_int_distribution<int>(0, bound - 1)(random_); }
  bool maybe() { return below(2) == 0; }

  static mauve::ComponentFacts* find(mauve::ArchitectureDescription& in, const std::string& name) {
    const auto found = std::ranges::find(in.components, name, &mauve::ComponentFacts::name);
    return found == in.components.end() ? nullptr : &*found;
  }
  static mauve::ShownPort& input_of(mauve::ComponentFacts& of) {
    return *std::ranges::find(of.parts.ports, "input", &mauve::ShownPort::name);
  }

  std::string any_component() {
    if (below(4) == 0) return "extra_" + std::to_string(below(3));
    return below(3) != 0 ? "fast_" + std::to_string(below(8)) : "slow_" + std::to_string(below(50));
  }
  std::string any_resource() { return "resource_" + std::to_string(below(5)); }

  /// Enters a step; whether it can succeed after the ones before it.
  bool enter(SoakDraft& made) {
    const std::string name = any_component();
    mauve::ComponentFacts* const facts = find(made.expected, name);
    made.touched.insert(name);
    switch (below(12)) {  // started more often than stopped, so that most of them run
      case 0:
        return replace_core(made, name, facts);
      case 1:
        return replace_fsm(made, name, facts);
      case 2:
        return replace_shell(made, name, facts);
      case 3:
        return set_gain(made, name, facts);
      case 4:
        return connect(made, name, facts);
      case 5:
        return disconnect(made, name, facts);
      case 6:
        return maybe() ? add_component(made, "extra_" + std::to_string(below(3)))
                       : remove_component(made, "extra_" + std::to_string(below(3)));
      case 7:
        return change_resource(made);
      case 8:
      case 9:
      case 10:
        made.transaction.start(name);
        if (facts == nullptr || facts->state != mauve::ComponentState::stopped) return false;
        facts->state = mauve::ComponentState::running;
        return true;
      default:
        made.transaction.stop(name);
        if (facts == nullptr || facts->state != mauve::ComponentState::running) return false;
        facts->state = mauve::ComponentState::stopped;
        return true;
    }
  }

  bool replace_core(SoakDraft& made, const std::string& name, mauve::ComponentFacts* facts) {
    const std::string core = below(8) == 0 ? "soak/Refusing" : maybe() ? "soak/Core" : "soak/OtherCore";
    made.transaction.replace_core(name, core);
    if (facts == nullptr) return false;
    std::vector<std::string>& named = facts->alternatives;
    // The core it is added with stays one it may be given back.
    if (made.added.contains(name) && facts->parts.core != core &&
        std::ranges::find(named, facts->parts.core) == named.end())
      named.push_back(facts->parts.core);
    facts->parts.core = core;
    return true;
  }

  bool replace_fsm(SoakDraft& made, const std::string& name, mauve::ComponentFacts* facts) {
    const bool other = maybe();
    made.transaction.replace_fsm(name, other ? "soak/OtherFsm" : "soak/Fsm");
    if (facts == nullptr) return false;
    const auto period = std::ranges::find(facts->parts.properties, "period_us", &mauve::ShownProperty::name);
    facts->period_ns = (other ? 2 : 1) * mauve::us_to_ns(std::get<std::int64_t>(period->value));
    facts->parts.fsm = other ? "soak/OtherFsm" : "soak/Fsm";
    return true;
  }

  bool replace_shell(SoakDraft& made, const std::string& name, mauve::ComponentFacts* facts) {
    const std::string shell = maybe() ? "soak/Shell" : "soak/OtherShell";
    made.transaction.replace_shell(name, shell);
    if (facts != nullptr) facts->parts.shell = shell;
    return facts != nullptr;
  }

  bool set_gain(SoakDraft& made, const std::string& name, mauve::ComponentFacts* facts) {
    const double gain = below(12);  // 11 is out of range
    made.transaction.set_property(name, "gain", gain);
    if (facts == nullptr || gain > 10.0) return false;
    std::ranges::find(facts->parts.properties, "gain", &mauve::ShownProperty::name)->value = gain;
    return true;
  }

  bool connect(SoakDraft& made, const std::string& name, mauve::ComponentFacts* facts) {
    const std::string resource = any_resource();
    made.transaction.connect(name, "input", resource, "read");
    const bool exists =
        std::ranges::count(made.expected.resources, resource, &mauve::ResourceFacts::name) != 0;
    if (facts == nullptr || !exists || !input_of(*facts).resource.empty()) return false;
    input_of(*facts).resource = resource;
    input_of(*facts).service = "read";
    return true;
  }

  bool disconnect(SoakDraft& made, const std::string& name, mauve::ComponentFacts* facts) {
    made.transaction.disconnect(name, "input");
    if (facts == nullptr || input_of(*facts).resource.empty()) return false;
    input_of(*facts).resource.clear();
    input_of(*facts).service.clear();
    return true;
  }

  bool add_component(SoakDraft& made, const std::string& name) {
    made.transaction.add_component(name, extra_parts_);
    made.touched.insert(name);
    if (find(made.expected, name) != nullptr) return false;
    made.added.insert(name);
    mauve::ComponentFacts added = extra_;
    added.name = name;
    const auto place =
        std::ranges::upper_bound(made.expected.components, name, {}, &mauve::ComponentFacts::name);
    made.expected.components.insert(place, std::move(added));
    return true;
  }

  bool remove_component(SoakDraft& made, const std::string& name) {
    made.transaction.remove_component(name);
    made.touched.insert(name);
    return std::erase_if(made.expected.components, [&](const auto& each) { return each.name == name; }) == 1;
  }

  bool change_resource(SoakDraft& made) {
    const std::string name = any_resource();
    auto& resources = made.expected.resources;
    const auto place = std::ranges::lower_bound(resources, name, {}, &mauve::ResourceFacts::name);
    const bool exists = place != resources.end() && place->name == name;
    if (maybe()) {
      made.transaction.add_resource(name, "shared_data", "bench/Small");
      if (exists) return false;
      mauve::ResourceFacts added = resource_;
      added.name = name;
      resources.insert(place, std::move(added));
      return true;
    }
    made.transaction.remove_resource(name);
    for (const mauve::ComponentFacts& each : made.expected.components) {
      for (const mauve::ShownPort& port : each.parts.ports) {
        if (port.resource == name) return false;
      }
    }
    if (!exists) return false;
    resources.erase(place);
    return true;
  }

  std::mt19937_64 random_;
  mauve::ComponentFacts extra_;
  mauve::ComponentParts extra_parts_;
  mauve::ResourceFacts resource_;
};

}  // namespace bench
