// SPDX-License-Identifier: LGPL-3.0-or-later
// The numbers that trace records know components by, while components of few names come and go.
#include "transaction_fixtures.hpp"

namespace mauve::testing::test_trace_numbers {

class TraceNumbers : public Transacted {
 protected:
  void add_and_remove(const std::string& name) {
    commit(Transaction().add_component(name, parts()));
    commit(Transaction().remove_component(name));
  }
};

TEST_F(TraceNumbers, OneNameAddedAgainAndAgainKeepsItsNumber) {
  add("stays");
  architecture.configure();
  for (int i = 0; i < 300; ++i) {
    add_and_remove("x");
    add_and_remove("y");
  }
  EXPECT_EQ(std::vector<std::string>({"stays", "x", "y"}), architecture.trace_components());
}

TEST_F(TraceNumbers, WhoIsHeldOrStillThereKeepsItsOwn) {
  add("stays");
  deploy();
  commit(Transaction().add_component("x", parts()));
  const auto held = architecture.hold_component("x");
  commit(Transaction().remove_component("x").add_component("x", parts()));
  const Task& second = architecture.component("x").task();
  EXPECT_NE(held->task().number(), second.number());
  EXPECT_EQ("x", architecture.trace_components()[second.number()]);
}

TEST_F(TraceNumbers, RecordsOfTheNextFollowThoseOfTheOneBefore) {
  add("stays");
  deploy();
  std::vector<TraceRecord> all;
  TraceDrain last;
  std::uint16_t number = 0;
  constexpr int kRounds = 3;
  for (int i = 0; i < kRounds; ++i) {
    commit(Transaction().add_component("x", parts()).start("x"));
    number = architecture.component("x").task().number();
    expect_running("x");
    commit(Transaction().remove_component("x"));
    last = deployer.drain_trace();
    for (const TraceRecord& record : last.records) {
      if (record.component == number) all.push_back(record);
    }
  }
  EXPECT_EQ(1U, number);
  ASSERT_EQ(2U, last.written.size());
  EXPECT_EQ(all.size(), last.written[number]);
  EXPECT_EQ(0U, last.dropped[number]);
  int starts = 0;
  int stops = 0;
  for (std::size_t i = 0; i < all.size(); ++i) {
    EXPECT_EQ(i, all[i].sequence) << "none is missing, none comes twice";
    starts += all[i].kind == static_cast<std::uint16_t>(TraceKind::start) ? 1 : 0;
    stops += all[i].kind == static_cast<std::uint16_t>(TraceKind::stop) ? 1 : 0;
    if (all[i].kind == static_cast<std::uint16_t>(TraceKind::start)) {
      EXPECT_EQ(starts, stops + 1) << "after the stop of the one before";
    }
  }
  EXPECT_EQ(kRounds, starts);
}

TEST_F(TraceNumbers, ARefusedAdditionTakesNoNumber) {
  add("stays");
  deploy();
  add_and_remove("x");
  EXPECT_THROW(commit(Transaction().add_component("x", parts()).add_component("z", parts(2, "t/Unready"))),
               Error);
  EXPECT_EQ(std::vector<std::string>({"stays", "x"}), architecture.trace_components());
  add_and_remove("x");
  EXPECT_EQ(std::vector<std::string>({"stays", "x"}), architecture.trace_components());
}

}  // namespace mauve::testing::test_trace_numbers
