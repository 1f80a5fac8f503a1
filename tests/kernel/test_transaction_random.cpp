// SPDX-License-Identifier: LGPL-3.0-or-later
// Rule 10: random transactions against a model of what they should have made of the architecture.
#include <random>

#include "transaction_fixtures.hpp"

namespace mauve::testing {
namespace {

/// What the test expects of one component.
struct Expected {
  std::string core{"t/Core"};
  std::string fsm{"t/Fsm"};
  std::string shell{"t/Shell"};
  bool running{false};
  double gain{1.0};
  std::string input;  // the resource it reads
  bool operator==(const Expected&) const = default;
};
struct Model {
  std::map<std::string, Expected> components;
  std::set<std::string> resources;
  bool operator==(const Model&) const = default;
};

class Rule10Random : public Transacted {
 protected:
  using Random = std::mt19937;

  int below(int bound) { return std::uniform_int_distribution<int>(0, bound - 1)(random); }
  std::string any_component() { return "c" + std::to_string(below(6)); }
  std::string any_resource() { return "r" + std::to_string(below(4)); }

  /// Enters a random step; whether the model says that it is valid, and if so what it makes of the model.
  bool enter(Transaction& transaction, Model& model) {
    const std::string name = any_component();
    const std::string resource = any_resource();
    const auto found = model.components.find(name);
    const bool known = found != model.components.end();
    switch (below(11)) {
      case 0: {
        const std::string core = below(8) == 0 ? "t/Refusing" : below(2) == 0 ? "t/Core" : "t/Counting";
        transaction.replace_core(name, core);
        if (known) found->second.core = core;
        return known;
      }
      case 1: {
        const std::string fsm = below(2) == 0 ? "t/Fsm" : "t/Syncopated";
        transaction.replace_fsm(name, fsm);
        if (known) found->second.fsm = fsm;
        return known;
      }
      case 2: {
        const std::string shell = below(2) == 0 ? "t/Shell" : "t/WideShell";
        transaction.replace_shell(name, shell);
        if (known) found->second.shell = shell;
        return known;
      }
      case 3: {
        const double gain = below(12);  // 11 is out of range
        transaction.set_property(name, "gain", gain);
        if (known) found->second.gain = gain;
        return known && gain <= 10.0;
      }
      case 4: {
        transaction.connect(name, "input", resource, "read");
        if (!known || !found->second.input.empty() || !model.resources.contains(resource)) return false;
        found->second.input = resource;
        return true;
      }
      case 5: {
        transaction.disconnect(name, "input");
        if (!known || found->second.input.empty()) return false;
        found->second.input.clear();
        return true;
      }
      case 6: {
        transaction.add_component(name, parts(2));
        return model.components.emplace(name, Expected{}).second;
      }
      case 7: {
        transaction.remove_component(name);
        return model.components.erase(name) == 1;
      }
      case 8: {
        const bool add = below(2) == 0;
        if (add) {
          transaction.add_resource(resource, "shared_data", kNumberType);
          return model.resources.insert(resource).second;
        }
        transaction.remove_resource(resource);
        for (const auto& [each, expected] : model.components) {
          if (expected.input == resource) return false;
        }
        return model.resources.erase(resource) == 1;
      }
      case 9: {
        transaction.start(name);
        if (!known || found->second.running) return false;
        return found->second.running = true;
      }
      default: {
        transaction.stop(name);
        if (!known || !found->second.running) return false;
        found->second.running = false;
        return true;
      }
    }
  }

  Model found() const {
    Model model;
    const ArchitectureDescription description = architecture.describe();
    for (const ComponentFacts& each : description.components) {
      if (each.name == "untouched") continue;
      model.components[each.name] = {.core = each.parts.core,
                                     .fsm = each.parts.fsm,
                                     .shell = each.parts.shell,
                                     .running = each.state == ComponentState::running,
                                     .gain = std::get<double>(property(each.name, "gain")),
                                     .input = wire(each.name, "input")};
      std::string& input = model.components[each.name].input;
      input = input.substr(0, input.find('.'));
    }
    for (const ResourceFacts& each : description.resources) model.resources.insert(each.name);
    return model;
  }

  /// Whether a core in the new model refuses: the kernel asks each new core, whatever it is called.
  static bool refuses(const Model& model) {
    for (const auto& [name, expected] : model.components) {
      if (expected.core == "t/Refusing") return true;
    }
    return false;
  }

  Random random{20260};  // NOLINT: the same every time
};

TEST_F(Rule10Random, TransactionsDoWhatTheModelSaysOrNothing) {
  constexpr int kTransactions = 1500;
  Model model;
  for (const char* name : {"c0", "c1", "c2", "c3"}) {
    add(name);
    model.components[name].running = true;
  }
  for (const char* name : {"r0", "r1"}) {
    architecture.add_resource<SharedData<Number>>(name);
    model.resources.insert(name);
  }
  add("untouched", 1, {.priority = 60});
  deploy();
  wait_until([&] { return runs("untouched") > 0; }, "the deployment");
  ReleaseWitness witness(architecture.component("untouched").task(), ms_to_ns(1));
  int made = 0;
  for (int i = 0; i < kTransactions; ++i) {
    Transaction transaction;
    Model next = model;
    bool valid = true;
    std::string text;
    for (int steps = 1 + below(3); steps > 0; --steps) {
      valid = enter(transaction, next) && valid;
      text += "\n" + transaction.steps().back()->text();
    }
    try {
      commit(transaction, {.timeouts = {.phase_ns = 0}, .dry_run = false});
      ASSERT_TRUE(valid && !refuses(next)) << "transaction " << i << " should have failed:" << text;
      model = next;
      ++made;
    } catch (const Error& error) {
      ASSERT_TRUE(!valid || refuses(next)) << "transaction " << i << ": " << error.what() << text;
      ASSERT_NE(0, error.detail().step) << error.what();
    }
    ASSERT_TRUE(model == found()) << "transaction " << i << text << "\n" << described();
    witness.look(deployer.drain_trace());
  }
  EXPECT_GT(made, kTransactions / 10);
  EXPECT_LT(made, kTransactions);
  for (const auto& [name, expected] : model.components) {
    if (expected.running) expect_running(name);
  }
  witness.look(deployer.drain_trace());
  EXPECT_EQ(architecture.trace_components().size(), deployer.drain_trace().written.size());
}

}  // namespace
}  // namespace mauve::testing
