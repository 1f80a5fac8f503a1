// SPDX-License-Identifier: LGPL-3.0-or-later
// A kind of condition more, as somebody would add it: this file in conditions/, and a line in kinds.hpp, which the build
// of this program adds. That is all: the engine takes it.
#include <gtest/gtest.h>

#include "mauve_rt/rules/engine.hpp"

#include "conditions/kinds.hpp"

namespace mauve::rules {

ConditionKind often_kind() {
  return {.name = "often",
          .summary = "a topic has said more than a number",
          .parameters = {{.name = "topic", .type = "topic", .required = true},
                         {.name = "more_than", .type = "float", .required = true}},
          .hears =
              [](const Parameters& told) {
                return std::vector{SignalSpec{SignalKind::field, text(told, "topic"), "data"}};
              },
          .make = [](const Parameters& parameters,
                     std::span<Signal* const> signals) -> std::unique_ptr<Condition> {
            return std::make_unique<Range>(*signals[0], -kInfinity, told<double>(parameters, "more_than"));
          }};
}

namespace {

TEST(Trial, AConditionIsOneFileAndALine) {
  const ConditionKind* kind = find_condition_kind("often");
  ASSERT_NE(nullptr, kind);
  EXPECT_EQ("a topic has said more than a number", kind->summary);
  Engine engine(
      {{.name = "r", .when = {.kind = "often", .parameters = {{"topic", "a"}, {"more_than", 2.0}}}}});
  engine.arm(0);
  ASSERT_EQ(1U, engine.signals().size());
  EXPECT_EQ("a", engine.signals()[0].spec.target);
  for (const auto& [value, holds] : {std::pair(2.0, false), std::pair(3.0, true)}) {
    engine.signals()[0].signal->tell(1, value);
    engine.step(1);
    EXPECT_EQ(holds, engine.status(0).holds()) << value;
  }
}

}  // namespace
}  // namespace mauve::rules
