// SPDX-License-Identifier: LGPL-3.0-or-later
// What a shell may declare of its properties' ranges.
#include <cmath>

#include "fixtures.hpp"

namespace mauve::testing::test_property_declaration {

template <typename Initial>
Error refusal(Initial initial, const PropertyOptions& options) {
  struct Declaring : Shell {
    Declaring(Initial value, const PropertyOptions& how) { property("speed", value, how); }
  };
  try {
    Declaring shell(initial, options);
  } catch (const Error& error) {
    EXPECT_EQ("property speed", error.detail().element);
    EXPECT_FALSE(error.detail().expected.empty());
    EXPECT_FALSE(error.detail().found.empty());
    EXPECT_FALSE(error.detail().remedy.empty());
    return error;
  }
  return {ErrorCode::internal, "not refused"};
}

TEST(PropertyDeclaration, AnInitialValueOutOfItsRangeIsRefused) {
  EXPECT_EQ(ErrorCode::out_of_range, refusal(1.0, {.minimum = 5.0}).code());
  EXPECT_EQ(ErrorCode::out_of_range, refusal(1.0, {.maximum = 0.5}).code());
  EXPECT_EQ(ErrorCode::out_of_range, refusal(NAN, {.minimum = 0.0}).code());
  EXPECT_EQ(ErrorCode::out_of_range, refusal(7, {.minimum = 0.0, .maximum = 6.0}).code());
}

TEST(PropertyDeclaration, ARangeThatNoValueFitsIsRefused) {
  EXPECT_EQ(ErrorCode::invalid_argument, refusal(1.5, {.minimum = 2.0, .maximum = 1.0}).code());
  EXPECT_EQ(ErrorCode::invalid_argument, refusal(1.0, {.minimum = NAN}).code());
  EXPECT_EQ(ErrorCode::invalid_argument, refusal(1, {.maximum = NAN}).code());
}

TEST(PropertyDeclaration, AnyOtherIsTaken) {
  EXPECT_EQ(ErrorCode::internal, refusal(1.0, {}).code());
  EXPECT_EQ(ErrorCode::internal, refusal(1.0, {.minimum = 1.0, .maximum = 1.0}).code());
  EXPECT_EQ(ErrorCode::internal, refusal(1.0, {.minimum = -INFINITY, .maximum = INFINITY}).code());
  EXPECT_EQ(ErrorCode::internal, refusal(NAN, {}).code()) << "for one that has to be set";
  EXPECT_EQ(ErrorCode::internal, refusal("text", {.minimum = 1.0}).code());
}

}  // namespace mauve::testing::test_property_declaration
