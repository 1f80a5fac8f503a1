// SPDX-License-Identifier: LGPL-3.0-or-later
// Who may ask for a change, and when: on every host.
#include "hosts.hpp"

namespace mauve::testing::test_host_changes {

template <typename Way>
class HostChanges : public Hosted<Way> {};
TYPED_TEST_SUITE(HostChanges, EveryHost, HostNames);

TYPED_TEST(HostChanges, TheArchitecturesOwnCallsChangeItWhileItRuns) {
  Component& component = this->add("c");
  this->deploy();
  this->run_for(ms_to_ns(5));
  const std::uint64_t revision = this->architecture.revision();
  this->architecture.template add_resource<SharedData<Number>>("r");
  this->architecture.connect("c", "output", "r", "write");
  component.set_property("gain", 4.0);
  component.swap_core(std::make_unique<CountingCore>());
  EXPECT_GT(this->architecture.revision(), revision);
  EXPECT_EQ(4.0, component.shell_as<TestShell>().gain.value());
  EXPECT_TRUE(component.require_port("output").is_connected());
  EXPECT_EQ(ErrorCode::duplicate_name,
            this->refusal([&] { this->architecture.connect("c", "output", "r", "write"); }).code());
  const std::uint64_t before = this->releases("c");
  this->run_for(ms_to_ns(10));
  EXPECT_GT(this->releases("c"), before);
}

TYPED_TEST(HostChanges, AComponentAddedLaterArrivesStoppedAndStarts) {
  this->add("first");
  this->deploy();
  this->run_for(ms_to_ns(5));
  Component& late = this->architecture.template add_component<TestShell, TestCore, TestFsm>("late");
  EXPECT_EQ(ComponentState::stopped, this->state("late"));
  EXPECT_TRUE(late.is_configured());
  EXPECT_EQ(!TestFixture::is_virtual, late.task().has_thread());
  this->host().start("late");
  this->run_for(ms_to_ns(10));
  EXPECT_GT(this->core(late).runs, 0);
  EXPECT_EQ(ErrorCode::duplicate_name, this->refusal([this] { this->add("late"); }).code());
}

TYPED_TEST(HostChanges, ChangesBeforeDeploymentAreTransactionsToo) {
  Component& component = this->add("c");
  const std::uint64_t revision = this->architecture.revision();
  Transaction before;
  before.set_property("c", "gain", 2.0).set_property("c", "gain", 12.0);
  EXPECT_EQ(2, this->refusal([&] { this->architecture.commit(std::move(before)); }).detail().step);
  EXPECT_EQ(revision, this->architecture.revision());
  this->architecture.configure();
  Transaction configured;
  configured.set_property("c", "gain", 3.0).replace_core("c", "t/Counting");
  this->architecture.commit(std::move(configured));
  EXPECT_EQ("t/Counting", component.core_implementation());
  this->host().deploy();
  this->run_for(ms_to_ns(10));
  EXPECT_GT(this->releases("c"), 0U);
  EXPECT_EQ(3.0, component.shell_as<TestShell>().gain.value());
}

// ---- refusals of what would wait for itself

struct NestedCore : TestCore {
  std::function<void()> in_configure = [] {};
  std::function<void()> in_adopt = [] {};
  bool configure_hook() override {
    in_configure();
    return true;
  }
  bool adopt(const CoreBase& /*old*/) override {
    in_adopt();
    return true;
  }
};

TYPED_TEST(HostChanges, AChangeFromInsideAChangeIsRefused) {
  this->add("c");
  this->add("stopped");
  this->deploy();
  this->run_for(ms_to_ns(5));
  this->host().stop("stopped");
  int asked = 0;
  const auto ask = [&] {
    ++asked;
    for (const auto& call : std::vector<std::function<void()>>{
             [&] { this->host().set_property("c", "gain", 2.0); },
             [&] { this->architecture.component("c").set_property("gain", 2.0); },
             [&] { this->host().commit({}); }, [&] { this->host().deploy(); }}) {
      const Error error = this->refusal(call);
      EXPECT_EQ(ErrorCode::would_deadlock, error.code()) << error.what();
      EXPECT_FALSE(error.detail().remedy.empty());
    }
  };
  auto fresh = std::make_unique<NestedCore>();
  fresh->in_configure = ask;
  fresh->in_adopt = ask;
  this->architecture.component("c").swap_core(std::move(fresh), {.commit_ns = s_to_ns(10)});
  EXPECT_EQ(2, asked);
  auto parked = std::make_unique<NestedCore>();
  parked->in_adopt = ask;
  this->architecture.component("stopped").swap_core(std::move(parked));
  EXPECT_EQ(3, asked);
  this->host().set_property("c", "gain", 3.0);  // from outside it may
}

TYPED_TEST(HostChanges, AChangeByAComponentItselfIsRefused) {
  Component& component = this->add("c");
  std::atomic<int> refusals{0};
  this->core(component).work = [&] {
    try {
      this->host().set_property("c", "gain", 2.0);
    } catch (const Error& error) {
      if (error.code() == ErrorCode::would_deadlock) ++refusals;
    }
  };
  this->deploy();
  this->run_for(ms_to_ns(10));
  this->host().shutdown();  // before what the component uses goes
  EXPECT_GT(refusals, 1);
}

}  // namespace mauve::testing::test_host_changes
