// SPDX-License-Identifier: LGPL-3.0-or-later
// Rule 10: random transactions against a model of what they should have made of the architecture, of its outputs and of
// the releases of every component, on threads and in virtual time.
// MAUVE_RANDOM_SEED and MAUVE_RANDOM_TRANSACTIONS ask for other runs, or longer ones.
#include <cstdlib>
#include <string_view>

#include "hosts.hpp"
#include "random_model.hpp"

namespace mauve::testing::test_transaction_random {

std::uint64_t asked(const char* variable, std::uint64_t otherwise) {
  const char* text = std::getenv(variable);  // NOLINT(concurrency-mt-unsafe): nobody sets any
  return text == nullptr ? otherwise : std::stoull(text);
}

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr std::uint64_t kInVirtualTime = 4'000;
#else
constexpr std::uint64_t kInVirtualTime = 40'000;
#endif
constexpr std::uint64_t kOnThreads = 1500;

/// An architecture of random parts, and a neighbour that nothing is ever done to.
template <typename Way>
class Rule10Random : public ::testing::Test {
 protected:
  Rule10Random() {
    register_random_parts(registry);
    for (int i = 0; i < 4; ++i) add("c" + std::to_string(i), 2);
    model.components["c0"].fallback = "r/Other";
    architecture.component("c0").set_fallback(registry.make_core("r/Other"));
    for (const char* name : {"r0", "r1"}) {
      architecture.add_resource<SharedData<Number>>(name);
      model.resources.insert(name);
    }
    for (int i = 0; i < kRandomComponents; ++i) {
      const std::string name = "c" + std::to_string(i);
      for (const std::string output : kOutputs) {
        outputs[output + "_" + name] = &architecture.add_resource<SharedData<Number>>(output + "_" + name);
        if (model.components.contains(name)) architecture.connect(name, output, output + "_" + name, "write");
      }
    }
    architecture.add_component<TestShell, TestCore, TestFsm>(
        "neighbour", {.priority = 60, .cpus = {kComponentsCpu}, .trace_records = kRecords});
    architecture.configure();
  }
  ~Rule10Random() override {
    way.host().shutdown();
    run_on_where_sanitized();
  }

  void add(const std::string& name, std::int64_t period_ms) {
    Component& component = architecture.add_component(name, "r/Shell", "r/Core", "r/Fsm",
                                                      {.cpus = {kComponentsCpu}, .trace_records = kRecords});
    component.allow({"r/Other", "r/Refusing", "r/Throwing", "r/Unready"}, true);
    component.set_property("period_ms", period_ms);
    model.components[name] = {.running = true, .period_ms = period_ms};
  }

  void deploy() {
    way.host().deploy();
    pass(way.host().epoch_ns() - way.host().now_ns());
    for (const auto& component : architecture.components()) {
      const std::string& name = component->name();
      follow(name);
      const bool random = model.components.contains(name);
      rhythms.at(name).expect_start(random ? model.components.at(name).plan() : Plan{{ms_to_ns(1)}}, false);
    }
  }
  /// Lets time pass, whoever is released in it.
  void pass(time_ns_t duration_ns) {
    if constexpr (kExact) {
      way.run_for(duration_ns);
    } else {
      std::this_thread::sleep_for(std::chrono::nanoseconds(duration_ns));
    }
  }
  void follow(const std::string& name) {
    rhythms.erase(name);
    rhythms.emplace(
        name, Rhythm(name, architecture.component(name).task().number(), way.host().epoch_ns(), kExact));
  }

  void look() {
    const TraceDrain drain = way.host().drain_trace();
    std::map<std::uint16_t, Rhythm*> by_number;
    for (auto& [name, rhythm] : rhythms) by_number[rhythm.number()] = &rhythm;
    for (const TraceRecord& record : drain.records) {
      const auto found = by_number.find(record.component);
      if (found != by_number.end()) found->second->take(record);
    }
    for (const auto& [number, rhythm] : by_number)
      EXPECT_EQ(0U, drain.dropped[number]) << "the trace has a gap: drain it more often";
  }

  /// What a transaction that was made has to have done to the releases.
  void expect_starts(const RandomDraft& draft) {
    for (const auto& [name, touch] : draft.touched) {
      if (touch.removed) rhythms.erase(name);
      const auto after = draft.after.components.find(name);
      if (after == draft.after.components.end()) continue;
      if (touch.added) follow(name);
      if (!after->second.running) continue;
      const bool ran = !touch.added && model.components.at(name).running;
      const bool stopped = touch.stopped || !ran;
      if (stopped || touch.fsm || touch.shell) rhythms.at(name).expect_start(after->second.plan(), !stopped);
    }
  }

  void mark_outputs() {
    ++mark;
    for (const auto& [name, data] : outputs) data->write.write({mark}, way.host().now_ns());
  }
  /// Written by the kernel for what was stopped, or replaced, and for nobody else; nothing by a change not made.
  void expect_outputs(const RandomDraft& draft, bool made) {
    for (const auto& [name, data] : outputs) {
      const std::string output = name.substr(0, name.find('_'));
      const std::string component = name.substr(name.find('_') + 1);
      const auto touch = draft.touched.find(component);
      const auto before = model.components.find(component);
      bool zeroed = false;
      if (made && touch != draft.touched.end() && before != model.components.end() &&
          before->second.running) {
        const Touch& what = touch->second;
        const bool ends = what.removed || what.stopped;
        if (ends && (what.replaced() || what.started || what.added))
          continue;  // no rule says what comes of both
        zeroed = output == "output" ? ends : output == "cleared" ? what.replaced() : false;
      }
      Number value;
      time_ns_t time_ns = 0;
      ReaderState reader;
      data->read.read(value, time_ns, reader);
      EXPECT_EQ(zeroed ? 0.0 : mark, value.value) << name;
    }
  }

  Model found() const {
    Model seen;
    const ArchitectureDescription description = architecture.describe();
    for (const ComponentFacts& each : description.components) {
      if (each.name == "neighbour") continue;
      Expected& facts = seen.components[each.name];
      facts = {.core = each.parts.core,
               .fsm = each.parts.fsm,
               .shell = each.parts.shell,
               .fallback = each.fallback,
               .running = each.state == ComponentState::running};
      for (const ShownProperty& property : each.parts.properties) {
        if (property.name == "gain") facts.gain = std::get<double>(property.value);
        if (property.name == "period_ms") facts.period_ms = std::get<std::int64_t>(property.value);
      }
      for (const ShownPort& port : each.parts.ports) {
        if (port.name == "input") facts.input = port.resource;
        const bool is_output = std::ranges::find(kOutputs, port.name, [](const char* text) {
                                 return std::string(text);
                               }) != kOutputs.end();
        if (is_output) {
          EXPECT_EQ(port.name + "_" + each.name, port.resource);
        }
      }
    }
    for (const ResourceFacts& each : description.resources) {
      if (!outputs.contains(each.name)) seen.resources.insert(each.name);
    }
    return seen;
  }
  void expect_model() const {
    const Model seen = found();
    EXPECT_THAT(seen.components, ::testing::ContainerEq(model.components));
    EXPECT_EQ(model.resources, seen.resources);
  }

  /// Makes the next change up and carries it out; whether it came into force.
  bool carry_out() {
    RandomDraft draft = random.draft(model, architecture.revision());
    SCOPED_TRACE(draft.text + (draft.valid ? "\n  (valid)" : "\n  (to be refused)"));
    look();
    mark_outputs();
    bool made = false;
    try {
      draft.options.timeouts = {.commit_ns = s_to_ns(10), .phase_ns = 0};
      const TransactionReport report = way.host().commit(std::move(draft.transaction), draft.options);
      EXPECT_TRUE(draft.valid) << "it should have been refused";
      for (const StepReport& step : report.steps) EXPECT_GE(step.missed_releases, 0) << step.step;
      made = !draft.options.dry_run;
    } catch (const Error& error) {
      EXPECT_FALSE(draft.valid) << error.what();
      EXPECT_TRUE(error.detail().step != 0 || error.code() == ErrorCode::wrong_revision) << error.what();
    }
    expect_outputs(draft, made);
    if (made) {
      expect_starts(draft);
      model = std::move(draft.after);
    }
    look();
    expect_model();
    return made;
  }

  /// In virtual time no release that is due is still to come.
  void expect_nobody_behind(time_ns_t now_ns) const {
    for (const auto& [name, rhythm] : rhythms) {
      if (rhythm.due_ns() != 0) {
        EXPECT_GT(rhythm.due_ns(), now_ns) << name << " was not released";
      }
    }
  }

  static constexpr bool kExact = std::is_same_v<Way, InVirtualTime>;
  static constexpr std::size_t kRecords = std::size_t{1} << 15U;

  const std::uint64_t seed = asked("MAUVE_RANDOM_SEED", 20260);
  RandomModel random{seed};
  Model model;
  PluginRegistry registry;
  Architecture architecture{&registry};
  Way way{architecture};
  std::map<std::string, SharedData<Number>*> outputs;
  std::map<std::string, Rhythm> rhythms;
  double mark{0.0};
};

TYPED_TEST_SUITE(Rule10Random, EveryHost, HostNames);

TYPED_TEST(Rule10Random, TransactionsDoWhatTheModelSaysOrNothing) {
  const std::uint64_t transactions =
      asked("MAUVE_RANDOM_TRANSACTIONS", TestFixture::kExact ? kInVirtualTime : kOnThreads);
  this->deploy();
  std::uint64_t made = 0;
  for (std::uint64_t i = 0; i < transactions && !this->HasFailure(); ++i) {
    SCOPED_TRACE("seed " + std::to_string(this->seed) + ", transaction " + std::to_string(i));
    this->pass(us_to_ns(this->random.below(TestFixture::kExact ? 9'000 : 2'000)));
    if (this->carry_out()) ++made;
    if constexpr (TestFixture::kExact) this->expect_nobody_behind(this->way.host().now_ns());
  }
  EXPECT_GT(made, transactions / 10);
  EXPECT_LT(made, transactions);
  // Who has a fallback still falls back, on that one.
  for (const auto& [name, expected] : this->model.components) {
    if (!expected.running || expected.fallback.empty() || this->HasFailure()) continue;
    Component& component = this->architecture.component(name);
    component.template core_as<TestCore>().condition = true;
    const auto has_fallen_back = [&] {
      this->pass(ms_to_ns(5));
      return component.task().has_fallen_back();
    };
    wait_until(has_fallen_back, "the fallback");
    EXPECT_EQ(expected.fallback, component.core_implementation());
  }
}

}  // namespace mauve::testing::test_transaction_random
