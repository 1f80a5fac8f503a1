// SPDX-License-Identifier: LGPL-3.0-or-later
// Who made each element what it is.
#include <gmock/gmock.h>

#include "transaction_fixtures.hpp"

namespace mauve::testing::test_authors {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

Authored by(const std::string& author, const std::string& target, const std::string& element) {
  return {.target = target, .element = element, .author = author};
}

TEST(Authors, KeepsTheLastOneOfEachElement) {
  Authors authors;
  authors.note("b", "core", "operator");
  authors.note("a", "property p", "rule r");
  authors.note("b", "core", "rule r");
  EXPECT_EQ("rule r", authors.of("b", "core"));
  EXPECT_EQ("", authors.of("b", "fsm"));
  EXPECT_THAT(authors.all(), ElementsAre(by("rule r", "a", "property p"), by("rule r", "b", "core")));
  authors.note("b", "core", "");
  EXPECT_THAT(authors.all(), ElementsAre(by("rule r", "a", "property p")));
  authors.forget("a");
  EXPECT_THAT(authors.all(), IsEmpty());
}

}  // namespace mauve::testing::test_authors
