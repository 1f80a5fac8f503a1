// SPDX-License-Identifier: LGPL-3.0-or-later
// A number of a resource's newest value, by its path.
#include "fixtures.hpp"

namespace mauve::testing::test_number_place {

struct Inner {
  double x{};
  bool on{};
};
struct Outer {
  std::uint8_t first{};
  Inner inner{};
  std::array<Inner, 3> list{};
  float cost_m{};
  BoundedVector<double, 4> varying{};
  BoundedVector<Inner, 2> inners{};
  BoundedString<8> text{};
};
struct Large {
  std::array<double, 512> values{};
};

}  // namespace mauve::testing::test_number_place

MAUVE_TYPE(mauve::testing::test_number_place::Inner, "test_msgs/msg/Inner", x, on)
MAUVE_TYPE(mauve::testing::test_number_place::Outer, "test_msgs/msg/Outer", first, inner, list, cost_m,
           varying, inners, text)
MAUVE_TYPE(mauve::testing::test_number_place::Large, "test_msgs/msg/Large", values)

namespace mauve::testing::test_number_place {

double read(Resource& resource, const std::string& path) {
  const std::optional<NumberPlace> place = resource.find_number(path);
  double number = -1;
  EXPECT_TRUE(place && resource.read_number(*place, number)) << path;
  return number;
}

TEST(NumberPlace, IsFoundByItsPath) {
  SharedData<Outer> resource;
  Outer value;
  value.first = 200;
  value.inner = {.x = 1.5, .on = true};
  value.list[2].x = -4;
  value.cost_m = 0.25F;
  resource.write.write(value, 1);
  EXPECT_EQ(200, read(resource, "first"));
  EXPECT_EQ(1.5, read(resource, "inner.x"));
  EXPECT_EQ(1, read(resource, "inner.on"));
  EXPECT_EQ(-4, read(resource, "list[2].x"));
  EXPECT_EQ(0.25, read(resource, "cost")) << "the message's name of it";
}

TEST(NumberPlace, IsNaNBeyondTheLengthOfABoundedList) {
  SharedData<Outer> resource;
  Outer value;
  ASSERT_TRUE(value.varying.push_back(1.5) && value.varying.push_back(-2.5));
  ASSERT_TRUE(value.inners.push_back({.x = 3.5, .on = true}));
  resource.write.write(value, 1);
  EXPECT_EQ(-2.5, read(resource, "varying[1]"));
  EXPECT_TRUE(std::isnan(read(resource, "varying[2]")));
  EXPECT_TRUE(std::isnan(read(resource, "varying[3]")));
  EXPECT_EQ(2, read(resource, "varying.length"));
  EXPECT_EQ(3.5, read(resource, "inners[0].x"));
  EXPECT_EQ(1, read(resource, "inners[0].on"));
  EXPECT_TRUE(std::isnan(read(resource, "inners[1].x")));
  EXPECT_FALSE(value.varying.resize(5));
  ASSERT_TRUE(value.varying.resize(1));
  resource.write.write(value, 2);
  EXPECT_TRUE(std::isnan(read(resource, "varying[1]"))) << "the list is shorter now";
}

TEST(NumberPlace, OfAListIsNotWritten) {
  SharedData<Outer> resource;
  for (const char* path : {"varying[0]", "varying.length", "inners[1].x", "inner.on"}) {
    const std::optional<NumberPlace> place = resource.find_number(path);
    EXPECT_TRUE(place && place->store == nullptr) << path;
  }
}

TEST(NumberPlace, IsNoneAtNoFixedPlace) {
  SharedData<Outer> resource;
  for (const char* path : {"", ".", "inner", "inner.y", "list", "list[3].x", "list[-1].x", "list[1x].x",
                           "list[0]", "varying", "varying[4]", "varying[0].x", "inners[0]", "inners.length.x",
                           "text", "text.length", "first.x", "inner.x[0]"})
    EXPECT_FALSE(resource.find_number(path)) << path;
}

TEST(NumberPlace, IsTheNewest) {
  LatestValue<Large> resource;
  const std::optional<NumberPlace> place = resource.find_number("values[511]");
  ASSERT_TRUE(place);
  double number = 7;
  EXPECT_FALSE(resource.read_number(*place, number)) << "nothing was written";
  EXPECT_EQ(7, number);
  Large value;
  for (int i = 0; i < 100; ++i) {  // each read gives back the slot it held
    value.values[511] = i;
    ASSERT_TRUE(resource.write.write(value, i + 1));
    ASSERT_TRUE(resource.read_number(*place, number));
    EXPECT_EQ(i, number);
  }
}

}  // namespace mauve::testing::test_number_place
