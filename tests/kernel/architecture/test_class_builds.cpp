// SPDX-License-Identifier: LGPL-3.0-or-later
// For which builds of its classes a part was compiled: noted at its registration, held against the parts that it meets.
#include "mauve_rt/architecture/plugin.hpp"
#include "mauve_rt/parts/handover.hpp"

#include "fixtures.hpp"

// Not in namespace mauve, whose classes are those of MAUVE RT.
namespace class_builds_tests {

struct Shell : mauve::Shell {};
struct Base : mauve::Core<Shell> {
  virtual void act() {}
};
struct Other {
  virtual ~Other() = default;
};
struct Derived : Base, Other {
  bool adopt(const mauve::CoreBase& old) override {
    has_seen_old = dynamic_cast<const Derived*>(&old) != nullptr;
    return true;
  }
  bool has_seen_old{false};
};
struct Runner : mauve::Fsm<Shell, Base> {
  void define() override { set_initial(execution("act", "act", &Base::act)); }
};

}  // namespace class_builds_tests

namespace mauve::testing::test_class_builds {

using class_builds_tests::Base;
using class_builds_tests::Derived;
using class_builds_tests::Runner;
using ::testing::HasSubstr;

/// Base and Runner are of one library, Derived is of another one.
class ClassBuildsOfRegistry : public ::testing::Test {
 protected:
  void SetUp() override {
    registry.shell<class_builds_tests::Shell>("t/Shell");
    add_runner();
    add_derived();
  }
  void add_runner() {
    registry.fsm<Runner>("t/Runner", "t/Shell");
    registry.core<Base>("t/Base", "t/Shell");
  }
  void add_derived() { registry.core<Derived>("t/Derived", "t/Shell"); }
  template <typename Add>
  std::shared_ptr<PluginGeneration> reload(int number, Add&& add) {
    auto kept = std::make_shared<PluginGeneration>();
    registry.begin_generation(number, kept);
    add();
    registry.end_generation();
    return kept;
  }
  bool binds(const FsmBase& fsm, CoreBase& core) { return fsm.bind_core(core).is_bound(); }
  bool binds() { return binds(*registry.make_fsm("t/Runner"), *registry.make_core("t/Derived")); }

  PluginRegistry registry;
};

TEST_F(ClassBuildsOfRegistry, NameTheClassFirstAndNoneOfTheKernel) {
  EXPECT_EQ((std::vector<std::string>{typeid(Derived).name(), typeid(Base).name(),
                                      typeid(class_builds_tests::Other).name()}),
            registry.classes_of("core", "t/Derived"));
  EXPECT_EQ(std::vector<std::string>{typeid(Base).name()}, registry.classes_of("fsm", "t/Runner"));
  EXPECT_TRUE(registry.classes_of("core", "t/None").empty());
  EXPECT_TRUE(registry.classes_of("type", "t/Derived").empty());
}

TEST_F(ClassBuildsOfRegistry, RefuseTheNewFsmToACoreOfTheOldBase) {
  EXPECT_TRUE(binds());
  const auto kept = reload(2, [&] { add_runner(); });
  try {
    binds();
    FAIL() << "the core has the old table of virtual functions";
  } catch (const Error& error) {
    EXPECT_EQ(ErrorCode::type_mismatch, error.code());
    EXPECT_EQ("core t/Derived", error.detail().element);
    EXPECT_EQ("generation 2, as fsm t/Runner", error.detail().expected);
    EXPECT_EQ("generation 1", error.detail().found);
    EXPECT_THAT(error.what(), HasSubstr("two builds of the class class_builds_tests::Base"));
    EXPECT_THAT(error.detail().remedy, HasSubstr("reload both in one request"));
  }
  registry.exchange(*kept);
  EXPECT_TRUE(binds()) << "back to the old build of both";
  registry.exchange(*kept);
  EXPECT_THROW(binds(), Error);
  reload(3, [&] { add_derived(); });
  EXPECT_TRUE(binds()) << "it was built for the base class that is in force";
}

TEST_F(ClassBuildsOfRegistry, TakeTheDerivedCoreAloneAndBothTogether) {
  const auto old_fsm = registry.make_fsm("t/Runner");
  reload(2, [&] { add_derived(); });
  EXPECT_TRUE(binds()) << "its base class is as before";
  reload(3, [&] {
    add_derived();  // before its base class
    add_runner();
  });
  EXPECT_TRUE(binds());
  const auto core = registry.make_core("t/Derived");
  EXPECT_THROW(binds(*old_fsm, *core), Error);
}

TEST_F(ClassBuildsOfRegistry, LetCoresOfTwoBuildsOfABaseClassBeStrangers) {
  const auto old = registry.make_core("t/Derived");
  registry.core<Derived>("t/Twin", "t/Shell");
  const auto twin = registry.make_core("t/Twin");
  EXPECT_TRUE(Handover(*old, *twin).adopt());
  EXPECT_TRUE(dynamic_cast<Derived&>(*twin).has_seen_old);
  reload(2, [&] { add_runner(); });
  registry.core<Derived>("t/Late",
                         "t/Shell");  // its library is loaded for the first time, after the new base class
  const auto late = registry.make_core("t/Late");
  EXPECT_EQ(old->generation(), late->generation());
  EXPECT_TRUE(Handover(*old, *late).adopt());
  EXPECT_FALSE(dynamic_cast<Derived&>(*late).has_seen_old) << "its base class has another layout";
}

}  // namespace mauve::testing::test_class_builds
