// SPDX-License-Identifier: LGPL-3.0-or-later
// Rule 9: new parts are configured with the properties and the wiring that their own transaction makes, while the
// component goes on with those it has. On threads and in virtual time.
#include "fixtures.hpp"

namespace mauve::testing::test_prepared_future {

struct FutureShell : Shell {
  Property<std::int64_t>& size = property("size", 10);
  Property<std::int64_t>& room = property("room", 10, {.structural = ReadBy::core});
  Property<std::int64_t>& period_ms = property("period_ms", 2, {.structural = ReadBy::fsm});
  ReadPort<Number>& input = read_port<Number>("input", Number{-7.0}).optional();
  WritePort<Number>& output = write_port<Number>("output").optional();
};

/// What a part saw of its shell.
struct Seen {
  std::int64_t size{0};
  std::int64_t room{0};
  bool is_connected{false};
  std::string resource;
  std::string kind;
  double read{0.0};
  DataStatus status{DataStatus::none};

  void look(FutureShell& shell) {
    size = shell.size;
    room = shell.room;
    is_connected = shell.input.is_connected();
    resource = shell.input.resource_name();
    kind = is_connected ? shell.input.service()->resource()->kind() : "";
    const auto sample = shell.input.read();
    read = sample.value.value;
    status = shell.input.status();
  }
};

struct FutureCore : Core<FutureShell> {
  Seen configured;
  Seen first_run;
  std::atomic<int> runs{0};
  std::atomic<int> strangers{0};  // runs with other wiring than the first
  std::function<void(FutureShell&)> meanwhile = [](FutureShell&) {};

  bool configure_hook() override {
    configured.look(shell());
    shell().output.write({99.0});
    meanwhile(shell());
    return true;
  }
  void act() {
    Seen now;
    now.look(shell());
    if (runs.load() == 0) first_run = now;
    const bool as_before = now.resource == first_run.resource && now.size == first_run.size;
    strangers.fetch_add(as_before ? 0 : 1);
    runs.fetch_add(1);
  }
};

struct FutureFsm : Fsm<FutureShell, FutureCore> {
  Seen* seen{nullptr};

  void define() override {
    if (seen != nullptr) seen->look(shell());
    State& run = execution("Run", "act", &FutureCore::act);
    State& pause = wait("Pause", ms_to_ns(shell().period_ms.value()));
    set_initial(run);
    next(run, pause);
    next(pause, run);
  }
};

struct LookingShell : FutureShell {
  Seen configured;
  bool configure_hook() override {
    configured.look(*this);
    return true;
  }
};

/// Sets the instants of its initial state by events at its input.
struct EventFsm : Fsm<FutureShell, FutureCore> {
  void define() override {
    State& pause = wait_event("Pause", shell().input, s_to_ns(3600), 1);
    State& run = execution("Run", "act", &FutureCore::act);
    set_initial(pause);
    next(pause, run);
    next(run, pause);
  }
};

class OnThreads {
 public:
  explicit OnThreads(Architecture& architecture) : deployer_(architecture) { deployer_.deploy(); }
  TransactionReport commit(Transaction transaction) {
    return deployer_.commit(std::move(transaction),
                            {.timeouts = {.commit_ns = s_to_ns(10), .phase_ns = s_to_ns(10)}});
  }
  void run_on(FutureCore& core, int runs) {
    wait_until([&] { return core.runs.load() >= runs; }, "the component to run");
  }
  static constexpr bool kPreparesBeside = true;

 private:
  AwayFromComponents away_;
  Deployer deployer_;
};

class InVirtualTime {
 public:
  explicit InVirtualTime(Architecture& architecture) : host_(simulation_.add(architecture)) {
    host_.deploy();
  }
  TransactionReport commit(Transaction transaction) { return host_.commit(std::move(transaction)); }
  void run_on(FutureCore& core, int runs) {
    while (core.runs.load() < runs) simulation_.run_until(simulation_.now_ns() + ms_to_ns(1));
  }
  static constexpr bool kPreparesBeside = false;

 private:
  Simulation simulation_;
  SimulatedHost& host_;
};

template <typename Host>
class PreparedFuture : public ::testing::Test {
 protected:
  ~PreparedFuture() override { run_on_where_sanitized(); }
  void SetUp() override {
    architecture.add_component<FutureShell, FutureCore, FutureFsm>("c", {.cpus = {kComponentsCpu}});
    architecture.add_resource<SharedData<Number>>("old");
    architecture.add_resource<SharedData<Number>>("written");
    architecture.configure();
    host = std::make_unique<Host>(architecture);
    host->run_on(core(), 3);
  }
  FutureCore& core() { return architecture.component("c").template core_as<FutureCore>(); }
  std::unique_ptr<SharedData<Number>> written_with(double value) {
    auto made = std::make_unique<SharedData<Number>>();
    made->write.write({value}, 1);
    return made;
  }
  /// A core, and where to find it when the transaction has taken it.
  std::unique_ptr<FutureCore> make_core() {
    auto made = std::make_unique<FutureCore>();
    fresh = made.get();
    return made;
  }
  double value_of(const std::string& resource) {
    ReaderState reader;
    Number value;
    time_ns_t time_ns = 0;
    dynamic_cast<SharedData<Number>&>(architecture.resource(resource)).read.read(value, time_ns, reader);
    return value.value;
  }
  void expect_future(const Seen& seen) {
    EXPECT_TRUE(seen.is_connected);
    EXPECT_EQ("new", seen.resource);
    EXPECT_EQ("shared_data", seen.kind);
    EXPECT_EQ(42.0, seen.read);
    EXPECT_NE(DataStatus::none, seen.status);
    EXPECT_EQ(1000, seen.size);
    EXPECT_EQ(500, seen.room);
  }

  Architecture architecture;
  std::unique_ptr<Host> host;
  FutureCore* fresh{nullptr};
};

using Hosts = ::testing::Types<OnThreads, InVirtualTime>;
TYPED_TEST_SUITE(PreparedFuture, Hosts);

TYPED_TEST(PreparedFuture, ACoreSeesWhatStepsBeforeAndAfterItMake) {
  for (const bool core_first : {true, false}) {
    Transaction transaction;
    if (core_first) transaction.replace_core("c", this->make_core());
    transaction.add_resource("new", this->written_with(42.0)).connect("c", "input", "new", "read");
    transaction.set_property("c", "size", std::int64_t{1000}).set_property("c", "room", std::int64_t{500});
    if (!core_first) transaction.replace_core("c", this->make_core());
    this->host->commit(std::move(transaction));
    this->expect_future(this->fresh->configured);
    this->host->run_on(*this->fresh, 3);
    this->expect_future(this->fresh->first_run);
    EXPECT_EQ(0, this->fresh->strangers.load());
    Transaction back;
    back.disconnect("c", "input").remove_resource("new").set_property("c", "size", std::int64_t{10});
    back.replace_core("c", this->make_core());
    this->host->commit(std::move(back));
    EXPECT_FALSE(this->fresh->configured.is_connected);
    EXPECT_EQ("", this->fresh->configured.resource);
    EXPECT_EQ(-7.0, this->fresh->configured.read) << "the port's default";
    EXPECT_EQ(10, this->fresh->configured.size);
  }
}

TYPED_TEST(PreparedFuture, TheOldCoreGoesOnWithWhatItHas) {
  if (!TypeParam::kPreparesBeside) GTEST_SKIP() << "no time passes while a change is prepared";
  FutureCore& old = this->core();
  auto made = this->make_core();
  int strangers = -1;
  made->meanwhile = [&](FutureShell&) {
    const int before = old.runs;
    wait_until([&] { return old.runs.load() >= before + 5; }, "the old core to go on");
    strangers = old.strangers;
  };
  Transaction transaction;
  transaction.add_resource("new", this->written_with(42.0)).connect("c", "input", "new", "read");
  transaction.set_property("c", "size", std::int64_t{1000}).replace_core("c", std::move(made));
  this->host->commit(std::move(transaction));
  EXPECT_EQ(0, strangers);
}

TYPED_TEST(PreparedFuture, WhatIsWrittenInPreparationGoesNowhere) {
  Transaction wire;
  wire.connect("c", "output", "written", "write");
  this->host->commit(std::move(wire));
  Transaction transaction;
  transaction.replace_core("c", this->make_core());
  this->host->commit(std::move(transaction));
  EXPECT_EQ(0.0, this->value_of("written"));
  EXPECT_EQ(1U, this->architecture.resource("written").find_service("write")->ports());
}

TYPED_TEST(PreparedFuture, ARefusedPreparationLeavesThePortsAsTheyWere) {
  auto refusing = this->make_core();
  refusing->meanwhile = [](FutureShell&) { throw std::runtime_error("no"); };
  Transaction transaction;
  transaction.connect("c", "input", "old", "read").replace_core("c", std::move(refusing));
  EXPECT_THROW(this->host->commit(std::move(transaction)), Error);
  FutureShell& shell = this->architecture.component("c").template shell_as<FutureShell>();
  EXPECT_FALSE(shell.input.is_connected());
  EXPECT_EQ(0U, this->architecture.resource("old").find_service("read")->ports());
}

TYPED_TEST(PreparedFuture, AnFsmSeesThemInDefine) {
  for (const bool fsm_first : {true, false}) {
    Seen seen;
    auto fsm = std::make_unique<FutureFsm>();
    fsm->seen = &seen;
    Transaction transaction;
    if (fsm_first) transaction.replace_fsm("c", std::move(fsm));
    transaction.add_resource("new", this->written_with(42.0)).connect("c", "input", "new", "read");
    transaction.set_property("c", "period_ms", std::int64_t{fsm_first ? 5 : 3});
    if (!fsm_first) transaction.replace_fsm("c", std::move(fsm));
    this->host->commit(std::move(transaction));
    EXPECT_EQ("new", seen.resource);
    EXPECT_EQ(42.0, seen.read);
    EXPECT_EQ(ms_to_ns(fsm_first ? 5 : 3), this->architecture.component("c").task().grid().period_ns);
    Transaction back;
    back.disconnect("c", "input").remove_resource("new");
    this->host->commit(std::move(back));
  }
}

TYPED_TEST(PreparedFuture, AShellSeesItsOwnFuture) {
  auto shell = std::make_unique<LookingShell>();
  LookingShell& made = *shell;
  Transaction transaction;
  transaction.replace_shell("c", std::move(shell)).replace_fsm("c", std::make_unique<FutureFsm>());
  transaction.replace_core("c", this->make_core());
  transaction.add_resource("new", this->written_with(42.0)).connect("c", "input", "new", "read");
  transaction.set_property("c", "size", std::int64_t{1000}).set_property("c", "room", std::int64_t{500});
  this->host->commit(std::move(transaction));
  this->expect_future(made.configured);
  this->expect_future(this->fresh->configured);
  this->host->run_on(*this->fresh, 2);
}

TYPED_TEST(PreparedFuture, AnEventWaitListensWhereItsPortWillLead) {
  Transaction transaction;
  transaction.replace_fsm("c", std::make_unique<EventFsm>()).replace_core("c", this->make_core());
  transaction.add_resource("new", std::make_unique<SharedData<Number>>())
      .connect("c", "input", "new", "read");
  this->host->commit(std::move(transaction));
  auto& fresh = dynamic_cast<SharedData<Number>&>(this->architecture.resource("new"));
  for (int run = 0; run < 3; ++run) {
    fresh.write.write({1.0}, 1);
    this->host->run_on(*this->fresh, run + 1);
  }
  EXPECT_EQ(1U, fresh.find_service("read")->ports());
}

}  // namespace mauve::testing::test_prepared_future
