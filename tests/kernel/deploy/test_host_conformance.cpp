// SPDX-License-Identifier: LGPL-3.0-or-later
// What every host does alike: on threads and in virtual time, one body each.
#include "hosts.hpp"

namespace mauve::testing::test_host_conformance {

template <typename Way>
class HostConformance : public Hosted<Way> {};
TYPED_TEST_SUITE(HostConformance, EveryHost, HostNames);

// ---- life

TYPED_TEST(HostConformance, DeploymentReleasesAllOnTheGridOfOneEpoch) {
  Component& fast = this->add("fast", 2);
  Component& slow = this->add("slow", 5, {.offset_ns = ms_to_ns(1)});
  EXPECT_EQ(0, this->architecture.deployment_epoch_ns());
  this->deploy();
  EXPECT_TRUE(this->host().is_deployed());
  EXPECT_EQ(&this->host(), this->architecture.host());
  this->run_for(ms_to_ns(30));
  const time_ns_t epoch = this->host().epoch_ns();
  EXPECT_GT(epoch, 0);
  EXPECT_GE(this->host().now_ns(), epoch + ms_to_ns(30));
  this->host().shutdown();  // then nobody writes there any more
  EXPECT_EQ(epoch, this->core(fast).instants.front());
  EXPECT_EQ(epoch + ms_to_ns(1), this->core(slow).instants.front());
  for (const time_ns_t instant : this->core(slow).instants)
    EXPECT_EQ(ms_to_ns(1), (instant - epoch) % ms_to_ns(5));
}

TYPED_TEST(HostConformance, ForceHarmsNobodyWhoIsWell) {
  this->add("c");
  this->add("removed");
  this->deploy();
  this->run_for(ms_to_ns(10));
  EXPECT_FALSE(this->host().stop("c", {.timeout_ns = s_to_ns(10), .force = true}));
  EXPECT_EQ(ComponentState::stopped, this->state("c"));
  this->host().start("c");
  Transaction transaction;
  transaction.stop("c").remove_component("removed");
  this->commit(transaction, {.force = true});
  EXPECT_EQ(ComponentState::stopped, this->state("c"));
  EXPECT_EQ(0U, this->architecture.threads_left_behind());
}

TYPED_TEST(HostConformance, AnUnconfiguredArchitectureIsNotDeployed) {
  this->add("c");
  EXPECT_EQ(ErrorCode::not_configured, this->refusal([this] { this->host().deploy(); }).code());
  EXPECT_EQ(nullptr, this->architecture.host());
}

TYPED_TEST(HostConformance, AnArchitectureHasOneHostAtATime) {
  this->add("c");
  this->deploy();
  Deployer other(this->architecture);
  Simulation simulation;
  EXPECT_EQ(ErrorCode::already_running, this->refusal([this] { this->host().deploy(); }).code());
  EXPECT_EQ(ErrorCode::already_running, this->refusal([&] { other.deploy(); }).code());
  EXPECT_EQ(ErrorCode::already_running, this->refusal([&] { simulation.add(this->architecture); }).code());
  EXPECT_EQ(ErrorCode::already_running, this->refusal([&] { other.set_property("c", "gain", 2.0); }).code());
  const std::uint64_t before = this->releases("c");
  this->run_for(ms_to_ns(10));
  EXPECT_GT(this->releases("c"), before) << "it goes on";
  this->host().shutdown();
  EXPECT_NO_THROW(other.deploy());
  other.shutdown();
  EXPECT_NO_THROW(simulation.add(this->architecture));
}

TYPED_TEST(HostConformance, AfterAShutdownItIsDeployedAgain) {
  Component& component = this->add("c");
  this->deploy();
  this->run_for(ms_to_ns(10));
  this->host().shutdown();
  EXPECT_FALSE(this->host().is_deployed());
  EXPECT_EQ(ComponentState::stopped, this->state("c"));
  EXPECT_EQ(ErrorCode::not_configured, this->refusal([this] { this->host().start("c"); }).code());
  EXPECT_EQ(ErrorCode::not_configured, this->refusal([this] { this->host().stop("c"); }).code());
  const std::uint64_t before = this->releases("c");
  const time_ns_t epoch = this->host().epoch_ns();
  this->host().deploy();
  EXPECT_GT(this->host().epoch_ns(), epoch);
  this->run_for(ms_to_ns(10));
  EXPECT_GT(this->releases("c"), before);
  const time_ns_t second = this->host().epoch_ns();
  this->host().shutdown();  // then nobody writes there any more
  EXPECT_EQ(0, (this->core(component).instants.back() - second) % ms_to_ns(2));
}

TYPED_TEST(HostConformance, RealtimeStatusSaysWhatIsMissingInVirtualTime) {
  this->add("c");
  this->architecture.configure();
  this->host().prepare_process();
  if constexpr (TestFixture::is_virtual) {
    EXPECT_FALSE(this->host().realtime_status().granted);
    EXPECT_FALSE(this->host().realtime_status().missing.empty());
  }
  EXPECT_EQ(TestFixture::is_virtual, this->host().is_simulated());
}

// ---- start and stop

TYPED_TEST(HostConformance, StopAndStartKeepTheGrid) {
  Component& component = this->add("c", 3);
  this->deploy();
  this->run_for(ms_to_ns(10));
  this->host().stop("c");
  EXPECT_EQ(ComponentState::stopped, this->state("c"));
  EXPECT_EQ(ErrorCode::not_running, this->refusal([this] { this->host().stop("c"); }).code());
  const std::size_t before = this->core(component).instants.size();
  this->run_for(ms_to_ns(10));
  EXPECT_EQ(before, this->core(component).instants.size());
  this->host().start("c");
  EXPECT_EQ(ErrorCode::already_running, this->refusal([this] { this->host().start("c"); }).code());
  this->run_for(ms_to_ns(10));
  this->host().stop("c");
  EXPECT_GT(this->core(component).instants.size(), before);
  for (const time_ns_t instant : this->core(component).instants)
    EXPECT_EQ(0, (instant - this->host().epoch_ns()) % ms_to_ns(3));
  EXPECT_EQ(0, (this->host().get_time("c") - this->host().epoch_ns()) % ms_to_ns(3));
  EXPECT_EQ(ErrorCode::unknown_component, this->refusal([this] { this->host().start("nobody"); }).code());
  EXPECT_EQ(ErrorCode::unknown_component, this->refusal([this] { this->host().get_time("nobody"); }).code());
}

TYPED_TEST(HostConformance, StartAndStopSteps) {
  this->add("a");
  this->add("b");
  this->deploy();
  this->run_for(ms_to_ns(5));
  Transaction stop;
  stop.stop("a").stop("b");
  this->commit(stop);
  EXPECT_EQ(ComponentState::stopped, this->state("a"));
  EXPECT_EQ(ComponentState::stopped, this->state("b"));
  Transaction again;
  again.stop("a");
  EXPECT_EQ(ErrorCode::not_running, this->refused(again).code());
  Transaction start;
  start.start("a");
  this->commit(start);
  const std::uint64_t before = this->releases("a");
  this->run_for(ms_to_ns(10));
  EXPECT_GT(this->releases("a"), before);
  EXPECT_EQ(ComponentState::stopped, this->state("b"));
}

// ---- one step of each kind

TYPED_TEST(HostConformance, ReplaceCoreByName) {
  Component& component = this->add("c");
  this->deploy();
  this->run_for(ms_to_ns(10));
  const int runs = this->core(component).runs;
  const StepReport report = this->host().replace_core("c", "t/Counting");
  EXPECT_EQ("t/Core", report.from_core);
  EXPECT_EQ("t/Counting", report.to_core);
  EXPECT_EQ(0, report.missed_releases);
  if (TestFixture::is_virtual) {
    EXPECT_EQ(0, report.prepare_ns);
    EXPECT_EQ(0, report.blackout_ns);
  }
  this->run_for(ms_to_ns(10));
  EXPECT_EQ("t/Counting", component.core_implementation());
  EXPECT_GT(this->core(component).runs, runs) << "it took the count over";
}

TYPED_TEST(HostConformance, ACoreThatIsRefusedLeavesTheOldOneRunning) {
  Component& component = this->add("c");
  this->deploy();
  this->run_for(ms_to_ns(5));
  const auto try_core = [&](const std::string& name) {
    Transaction change;
    change.replace_core("c", name);
    return this->refused(change).code();
  };
  EXPECT_EQ(ErrorCode::undeclared_core, try_core("t/Undeclared"));
  EXPECT_EQ(ErrorCode::unknown_core, try_core("t/None"));
  EXPECT_EQ(ErrorCode::prepare_failed, try_core("t/Unready"));
  EXPECT_EQ(ErrorCode::adopt_refused, try_core("t/Refusing"));
  EXPECT_EQ(ErrorCode::adopt_refused, try_core("t/Throwing"));
  const int runs = this->core(component).runs;
  this->run_for(ms_to_ns(10));
  EXPECT_GT(this->core(component).runs, runs);
}

TYPED_TEST(HostConformance, ARefusalNamesItsComponentOnceAndItsReason) {
  this->add("c");
  this->deploy();
  const auto said_of = [&](const std::string& core) {
    Transaction change;
    change.replace_core("c", core);
    return std::string(this->refused(change).what());
  };
  const std::string unready = said_of("t/Unready");
  EXPECT_NE(std::string::npos, unready.find("component 'c'")) << unready;
  EXPECT_EQ(unready.find("component 'c'"), unready.rfind("component 'c'")) << unready;
  const std::string refusing = said_of("t/Refusing");
  EXPECT_NE(std::string::npos, refusing.find("the adopt of the new core returned false")) << refusing;
  EXPECT_NE(std::string::npos, refusing.find("an adopt that throws an exception gives its reason here"))
      << refusing;
  const std::string throwing = said_of("t/Throwing");
  EXPECT_NE(std::string::npos, throwing.find("cannot read the old state")) << throwing;
}

TYPED_TEST(HostConformance, ReplaceFsmAndShell) {
  Component& component = this->add("c", 2);
  this->deploy();
  this->run_for(ms_to_ns(5));
  Transaction fsm;
  fsm.replace_fsm("c", "t/Syncopated");
  this->commit(fsm);
  EXPECT_EQ(ms_to_ns(6), component.task().grid().period_ns);
  Transaction narrow;
  narrow.replace_shell("c", "t/NarrowShell");
  EXPECT_EQ(ErrorCode::prepare_failed, this->refused(narrow).code()) << "core and fsm are for another";
  Transaction wide;
  wide.replace_shell("c", "t/WideShell");
  this->commit(wide);
  const std::uint64_t before = this->releases("c");
  this->run_for(ms_to_ns(15));
  EXPECT_GT(this->releases("c"), before);
  EXPECT_EQ("t/WideShell", component.shown().shell);
}

TYPED_TEST(HostConformance, SetProperty) {
  Component& component = this->add("c");
  this->deploy();
  this->run_for(ms_to_ns(5));
  EXPECT_EQ("set_property c.gain 2.5", this->host().set_property("c", "gain", 2.5).step);
  EXPECT_EQ(2.5, component.shell_as<TestShell>().gain.value());
  EXPECT_EQ(PropertyValue(2.5), component.shown().properties[0].value);
  const auto code = [&](const std::string& name, const PropertyValue& value) {
    const Error error = this->refusal([&] { this->host().set_property("c", name, value); });
    EXPECT_EQ(0, error.detail().step) << "who asks for one thing is told no number";
    return error.code();
  };
  EXPECT_EQ(ErrorCode::out_of_range, code("gain", 11.0));
  EXPECT_EQ(ErrorCode::type_mismatch, code("gain", std::string("much")));
  EXPECT_EQ(ErrorCode::unknown_property, code("loss", 1.0));
  EXPECT_EQ(ErrorCode::structural_property, code("period_ms", std::int64_t{5}));
  EXPECT_EQ(2.5, component.shell_as<TestShell>().gain.value());
}

TYPED_TEST(HostConformance, ConnectAndDisconnect) {
  Component& component = this->add("c");
  this->architecture.template add_resource<SharedData<Number>>("r").write.write({3.0}, 1);
  std::atomic<double> read{0};
  this->core(component).work = [&] { read = this->core(component).exposed_shell().input.read().value.value; };
  this->deploy();
  this->run_for(ms_to_ns(5));
  EXPECT_EQ(7.0, read) << "its default";
  Transaction connect;
  connect.connect("c", "input", "r", "read");
  this->commit(connect);
  this->run_for(ms_to_ns(5));
  EXPECT_EQ(3.0, read);
  Transaction twice;
  twice.connect("c", "input", "r", "read");
  EXPECT_EQ(ErrorCode::duplicate_name, this->refused(twice).code());
  Transaction unknown;
  unknown.connect("c", "output", "nothing", "write");
  EXPECT_EQ(ErrorCode::unknown_resource, this->refused(unknown).code());
  Transaction gone;
  gone.remove_resource("r");
  EXPECT_EQ(ErrorCode::invalid_argument, this->refused(gone).code()) << "it is connected";
  Transaction cut;
  cut.disconnect("c", "input").remove_resource("r");
  this->commit(cut);
  this->run_for(ms_to_ns(5));
  EXPECT_EQ(7.0, read);
  EXPECT_EQ(nullptr, this->architecture.find_resource("r"));
  this->host().shutdown();  // before `read` goes
}

TYPED_TEST(HostConformance, AddAndRemoveComponents) {
  this->add("first");
  this->deploy();
  this->run_for(ms_to_ns(5));
  ComponentParts parts{.shell = "t/Shell", .core = "t/Core", .fsm = "t/Fsm"};
  parts.properties["period_ms"] = std::int64_t{3};
  Transaction add;
  add.add_component("second", parts).add_component("third", parts).start("second");
  this->commit(add);
  this->run_for(ms_to_ns(10));
  EXPECT_EQ(ComponentState::running, this->state("second"));
  EXPECT_GT(this->releases("second"), 0U);
  EXPECT_EQ(0, (this->host().get_time("second") - this->host().epoch_ns()) % ms_to_ns(3));
  EXPECT_EQ(ComponentState::stopped, this->state("third"));
  Transaction taken;
  taken.add_component("second", parts);
  EXPECT_EQ(ErrorCode::duplicate_name, this->refused(taken).code());
  const auto held = this->architecture.hold_component("second");
  Transaction remove;
  remove.remove_component("second").remove_component("third").add_component("third", parts);
  this->commit(remove);
  EXPECT_EQ(nullptr, this->architecture.find_component("second"));
  EXPECT_EQ(ErrorCode::unknown_component, this->refusal([&] { held->set_property("gain", 2.0); }).code());
  const std::uint64_t before = this->releases("first");
  this->run_for(ms_to_ns(10));
  EXPECT_GT(this->releases("first"), before);
}

// ---- transactions as a whole

TYPED_TEST(HostConformance, ARefusedStepNamesItselfAndLeavesAllAsItIs) {
  this->add("c");
  this->deploy();
  this->run_for(ms_to_ns(5));
  Transaction change;
  change.set_property("c", "gain", 2.0).stop("c").set_property("nobody", "gain", 1.0);
  const Error error = this->refused(change);
  EXPECT_EQ(ErrorCode::unknown_component, error.code());
  EXPECT_EQ(3, error.detail().step);
  EXPECT_EQ("set_property nobody.gain 1.0", error.detail().step_name);
}

TYPED_TEST(HostConformance, DryRunExpectedRevisionAndRevision) {
  Component& component = this->add("c");
  this->deploy();
  this->run_for(ms_to_ns(5));
  const std::uint64_t seen = this->architecture.revision();
  const std::string before = this->described();
  Transaction tried;
  tried.set_property("c", "gain", 2.0).replace_core("c", "t/Counting");
  this->commit(tried, {.dry_run = true});
  EXPECT_EQ(before, this->described());
  EXPECT_EQ(seen, this->architecture.revision());
  Transaction made;
  made.set_property("c", "gain", 2.0);
  const TransactionReport report = this->commit(made, {.expected_revision = seen});
  EXPECT_GT(report.revision, seen);
  Transaction late;
  late.set_property("c", "gain", 3.0);
  EXPECT_EQ(ErrorCode::wrong_revision, this->refused(late, {.expected_revision = seen}).code());
  EXPECT_EQ(2.0, component.shell_as<TestShell>().gain.value());
}

TYPED_TEST(HostConformance, WhoWaitsForAChangeIsTold) {
  this->add("c");
  this->deploy();
  this->run_for(ms_to_ns(5));
  const std::uint32_t seen = this->host().wait_change(0, 0);
  EXPECT_EQ(seen, this->host().wait_change(seen, 0));
  this->host().set_property("c", "gain", 2.0);
  EXPECT_NE(seen, this->host().wait_change(seen, kForever));
  EXPECT_EQ(this->described(), to_string(this->host().describe()));
}

// ---- the trace

TYPED_TEST(HostConformance, TheTraceNamesRemovedComponents) {
  this->add("first");
  this->add("second");
  this->deploy();
  this->run_for(ms_to_ns(10));
  Transaction remove;
  remove.remove_component("first");
  this->commit(remove);
  this->run_for(ms_to_ns(10));
  const TraceDrain drain = this->host().drain_trace();
  const std::vector<std::string> names = this->host().trace_components();
  EXPECT_THAT(names, ::testing::ElementsAre("first", "second"));
  EXPECT_FALSE(records_of(drain, TraceKind::release, 0).empty()) << "what it did is told";
  EXPECT_FALSE(records_of(drain, TraceKind::release, 1).empty());
  EXPECT_EQ(2U, drain.written.size());
  EXPECT_THAT(this->host().trace_names(), ::testing::Contains("Run"));
  if (TestFixture::is_virtual) {
    EXPECT_EQ(this->host().now_ns(), drain.monotonic_ns);
    EXPECT_EQ(this->host().now_ns(), drain.realtime_ns);
  }
}

// ---- faults

TYPED_TEST(HostConformance, AFaultIsTheComponentsOwn) {
  Component& component = this->add("c");
  this->add("other");
  this->core(component).work = [&component] {
    if (TestFixture::core(component).runs == 3) throw std::runtime_error("worn out");
  };
  this->deploy();
  this->run_for(ms_to_ns(20));
  EXPECT_EQ(ComponentState::faulted, this->state("c"));
  EXPECT_EQ("worn out", component.task().fault().what);
  EXPECT_EQ(ErrorCode::faulted, this->refusal([this] { this->host().start("c"); }).code());
  const std::uint64_t before = this->releases("other");
  this->run_for(ms_to_ns(10));
  EXPECT_GT(this->releases("other"), before);
}

/// Throws while somebody wants it to.
struct Fragile : CountingCore {
  static inline std::atomic<bool> breaks{false};
  void act() override {
    if (breaks.exchange(false)) throw std::runtime_error("broken");
    TestCore::act();
  }
};

TYPED_TEST(HostConformance, TheFallbackStaysReadyWhateverCoreWasPutInByWhom) {
  Fragile::breaks = false;
  this->registry.template core<Fragile>("t/Fragile", "t/Shell");
  Component& component = this->architecture.add_component("c", "t/Shell", "t/Fragile", "t/Fsm", {});
  component.allow({"t/Fragile"}, true);
  component.set_fallback(this->registry.make_core("t/Core"));
  this->deploy();
  this->run_for(ms_to_ns(5));
  const auto fall = [&] {
    Fragile::breaks = true;
    this->run_for(ms_to_ns(10));
    EXPECT_EQ(ComponentState::running, this->state("c"));
    EXPECT_EQ("t/Core", component.core_implementation());
  };
  fall();
  this->host().replace_core("c", "t/Fragile");
  EXPECT_EQ("t/Fragile", component.core_implementation());
  fall();
  component.swap_core(this->registry.make_core("t/Fragile"));
  EXPECT_EQ("t/Fragile", component.core_implementation());
  fall();
  this->host().stop("c");
  component.cleanup_core();
  component.replace_core(this->registry.make_core("t/Fragile"));
  component.configure_core();
  this->host().start("c");
  fall();
}

// ---- one way to change

TYPED_TEST(HostConformance, Listing3ReplacesTheCoreOfAStoppedComponent) {
  Component& component = this->add("c");
  this->deploy();
  this->run_for(ms_to_ns(5));
  EXPECT_EQ(ErrorCode::already_running,
            this->refusal([&] { component.template replace_core<CountingCore>(); }).code());
  const time_ns_t clock = this->host().get_time("c");
  this->host().stop("c");
  component.cleanup_core();
  const CountingCore& fresh = component.template replace_core<CountingCore>();
  EXPECT_EQ(&fresh, &component.core());
  EXPECT_FALSE(component.core().is_configured()) << "it waits for configure_core";
  component.configure_core();
  EXPECT_TRUE(component.core().is_configured());
  this->host().start("c", clock);
  this->run_for(ms_to_ns(10));
  EXPECT_GT(fresh.runs, 0);
  EXPECT_EQ(0, (this->host().get_time("c") - clock) % ms_to_ns(2));
}

}  // namespace mauve::testing::test_host_conformance
