// SPDX-License-Identifier: LGPL-3.0-or-later
// Kinds of steps: any by its name, and what a new one may bring.
#include "change/steps/step_kind.hpp"
#include "transaction_fixtures.hpp"

namespace mauve::testing::test_step_kind {

class StepByName : public Transacted {
 protected:
  void SetUp() override {
    add("a");
    architecture.add_resource<SharedData<Number>>("x");
    deploy();
  }
};

TEST_F(StepByName, DoesWhatTheTypedCallDoes) {
  Transaction transaction;
  transaction.add("replace_core", "a", "t/Counting")
      .add("set_property", "a", "gain", PropertyValue(2.5))
      .add("connect", "a", "output", PropertyValue("x.write"));
  Transaction typed;
  typed.replace_core("a", "t/Counting").set_property("a", "gain", 2.5).connect("a", "output", "x", "write");
  ASSERT_EQ(typed.steps().size(), transaction.steps().size());
  for (std::size_t i = 0; i < typed.steps().size(); ++i)
    EXPECT_EQ(typed.steps()[i]->text(), transaction.steps()[i]->text());
  commit(transaction);
  EXPECT_EQ("t/Counting", facts("a").parts.core);
  EXPECT_EQ(PropertyValue(2.5), property("a", "gain"));
}

TEST_F(StepByName, OfNoKindIsRefusedWithThoseThereAre) {
  Transaction transaction;
  try {
    transaction.add("replace_cores", "a", "t/Counting");
    FAIL() << "it was taken";
  } catch (const Error& error) {
    EXPECT_EQ(ErrorCode::invalid_argument, error.code());
    EXPECT_NE(std::string::npos, error.detail().expected.find("resynchronise"));
  }
  EXPECT_TRUE(transaction.steps().empty());
}

TEST_F(StepByName, WithAnotherValueThanItsKindTakesIsRefused) {
  for (const char* kind : {"set_property", "connect", "place_core", "add_component", "add_resource"}) {
    Transaction transaction;
    transaction.add(kind, kind == std::string("add_component") ? "new" : "a", "gain");
    EXPECT_EQ(ErrorCode::invalid_argument, error_of(transaction).code()) << kind;
  }
}

/// Notes who was parked while it was taken in.
class Note final : public CommitAction {
 public:
  explicit Note(std::string& told) : told_(told) {}
  void take() MAUVE_RT override { told_ = task->name(); }

 private:
  std::string& told_;
};

std::string noted;

const StepKind kNoting{.name = "note", .draft = [](Draft& draft, TransactionStep& step) {
                         draft.change(step.target).actions.push_back(std::make_unique<Note>(noted));
                       }};

TEST_F(StepByName, OfAKindOfItsOwnBringsAnActionIntoTheCommit) {
  noted.clear();
  Transaction transaction;
  transaction.add(kNoting, "a");
  EXPECT_EQ("note a", transaction.steps().front()->text());
  EXPECT_EQ("a", commit(transaction).steps.at(0).component);
  EXPECT_EQ("a", noted);
}

}  // namespace mauve::testing::test_step_kind
