// SPDX-License-Identifier: LGPL-3.0-or-later
// Frames of ports, resources and messages: what is declared, what connects, and what is refused.
#include "fixtures.hpp"

namespace mauve::testing::test_frames {

struct Header {
  std::int32_t seconds{};
  std::uint32_t nanoseconds{};
  BoundedString<255> frame_id{};
};
/// As nav_msgs/msg/Odometry begins.
struct Odometry {
  Header header{};
  BoundedString<255> child_frame_id{};
  double x{};
};
/// Written in place.
struct Image {
  Header header{};
  std::array<std::uint8_t, 5000> data{};
};
/// With less room than a frame may need.
struct ShortHeader {
  BoundedString<4> frame_id{};
};
struct Short {
  ShortHeader header{};
};

}  // namespace mauve::testing::test_frames

MAUVE_TYPE(mauve::testing::test_frames::Header, "test_frames/msg/Header", seconds, nanoseconds, frame_id)
MAUVE_TYPE(mauve::testing::test_frames::Odometry, "test_frames/msg/Odometry", header, child_frame_id, x)
MAUVE_TYPE(mauve::testing::test_frames::Image, "test_frames/msg/Image", header, data)
MAUVE_TYPE(mauve::testing::test_frames::ShortHeader, "test_frames/msg/ShortHeader", frame_id)
MAUVE_TYPE(mauve::testing::test_frames::Short, "test_frames/msg/Short", header)

namespace mauve::testing::test_frames {

Odometry odometry(std::string_view frame, std::string_view child, double x) {
  return {.header = {.frame_id = frame}, .child_frame_id = child, .x = x};
}

std::vector<std::byte> bytes_of(const auto& value) {
  std::vector<std::byte> message;
  CdrWriter(message).put(value);
  return message;
}

Error refusal(const std::function<void()>& call) {
  try {
    call();
  } catch (const Error& error) {
    EXPECT_FALSE(error.detail().remedy.empty()) << error.what();
    return error;
  }
  ADD_FAILURE() << "nothing was refused";
  return {ErrorCode::internal, ""};
}

struct FramesShell : Shell {
  ReadPort<Odometry>& input = read_port<Odometry>("input").in_frame("odom", "base").optional();
  WritePort<Odometry>& output = write_port<Odometry>("output").in_frame("odom");
  ReadPort<Odometry>& plain = read_port<Odometry>("plain");
};

TEST(DeclaredFrames, AConnectionBetweenDifferentFramesIsRefused) {
  SharedData<Odometry> resource;
  resource.set_name("pose");
  resource.set_frames({.frame = "map"});
  FramesShell shell;
  const Error error = refusal([&] { shell.input.connect(resource.read, "pose"); });
  EXPECT_EQ(ErrorCode::frame_mismatch, error.code());
  EXPECT_EQ("port input", error.detail().element);
  EXPECT_EQ("frame odom, as the port declares", error.detail().expected);
  EXPECT_EQ("frame map of pose.read", error.detail().found);
  EXPECT_FALSE(shell.input.is_connected());
  shell.plain.connect(resource.read, "pose");  // not declared: not checked
  EXPECT_TRUE(shell.plain.is_connected());
}

TEST(DeclaredFrames, TheChildFrameIsCheckedToo) {
  SharedData<Odometry> resource;
  resource.set_name("pose");
  resource.set_frames({.frame = "odom", .child_frame = "laser"});
  FramesShell shell;
  const Error error = refusal([&] { shell.input.connect(resource.read, "pose"); });
  EXPECT_EQ("child_frame base, as the port declares", error.detail().expected);
  EXPECT_EQ("child_frame laser of pose.read", error.detail().found);
  shell.output.connect(resource.write, "pose");  // declares no child_frame
}

TEST(DeclaredFrames, ABadNameIsRefused) {
  ReadPort<Odometry> port("pose");
  for (const char* const name : {"/map", "the map", "map\n"}) {
    EXPECT_EQ(ErrorCode::invalid_argument, refusal([&] { port.in_frame(name); }).code()) << name;
    EXPECT_EQ(ErrorCode::invalid_argument, refusal([&] { port.in_frame("map", name); }).code()) << name;
  }
  EXPECT_EQ(ErrorCode::invalid_argument, refusal([&] { port.in_frame(std::string(256, 'a')); }).code());
  EXPECT_EQ(nullptr, port.frames());
  EventPort event("event");
  EXPECT_EQ(ErrorCode::invalid_argument, refusal([&] { event.declare_frames({.frame = "map"}); }).code());
}

TEST(DeclaredFrames, ASecondDeclarationAddsButDoesNotContradict) {
  ReadPort<Odometry> port("pose");
  port.in_frame("odom");
  port.declare_frames({.frame = "odom", .child_frame = "base"});
  EXPECT_EQ((Frames{.frame = "odom", .child_frame = "base"}), *port.frames());
  EXPECT_EQ(ErrorCode::frame_mismatch, refusal([&] { port.declare_frames({.frame = "map"}); }).code());
  EXPECT_EQ("odom", port.frames()->frame);
}

/// The same rules for every kind that holds values.
template <typename ResourceType>
struct FramedMessages : ::testing::Test {
  static std::unique_ptr<ResourceType> make() {
    if constexpr (std::is_same_v<ResourceType, RingBuffer<Odometry>>) {
      return std::make_unique<ResourceType>(4);
    } else {
      return std::make_unique<ResourceType>();
    }
  }
  FramedMessages() {
    resource->set_name("pose");
    resource->set_frames({.frame = "odom", .child_frame = "base"});
    output.connect(resource->write, "pose");
    input.connect(resource->read, "pose");
  }

  std::unique_ptr<ResourceType> resource = make();
  WritePort<Odometry> output{"output"};
  ReadPort<Odometry> input{"input"};
};
using Kinds = ::testing::Types<SharedData<Odometry>, LatestValue<Odometry>, RingBuffer<Odometry>>;
TYPED_TEST_SUITE(FramedMessages, Kinds);

TYPED_TEST(FramedMessages, GetTheFramesThatTheyLack) {
  ASSERT_TRUE(this->output.write(odometry("", "", 1.0)));
  const Odometry value = this->input.read().value;
  EXPECT_EQ("odom", value.header.frame_id.view());
  EXPECT_EQ("base", value.child_frame_id.view());
  EXPECT_EQ(1.0, value.x);
}

TYPED_TEST(FramedMessages, AreRefusedInAnotherFrameAndCounted) {
  EXPECT_TRUE(this->output.write(odometry("odom", "base", 1.0)));
  EXPECT_FALSE(this->output.write(odometry("map", "base", 2.0)));
  EXPECT_EQ(1U, this->resource->refused_values());
  EXPECT_EQ("header.frame_id is 'map', expected 'odom'", this->resource->why_refused_value());
  EXPECT_FALSE(this->output.write(odometry("", "laser", 3.0)));
  EXPECT_EQ(2U, this->resource->refused_values());
  EXPECT_EQ("child_frame_id is 'laser', expected 'base'", this->resource->why_refused_value());
  EXPECT_EQ(1.0, this->input.read().value.x);
}

TYPED_TEST(FramedMessages, OfATopicAreRefusedWithTheReason) {
  const std::vector<std::byte> message = bytes_of(odometry("map", "base", 2.0));
  EXPECT_FALSE(this->resource->write_sample(message, 10));
  EXPECT_EQ("header.frame_id is 'map', expected 'odom'", this->resource->why_refused(message));
  EXPECT_TRUE(this->resource->write_sample(bytes_of(odometry("odom", "base", 2.0)), 20));
}

TYPED_TEST(FramedMessages, OfAStopHaveTheFramesToo) {
  ASSERT_EQ(TryWrite::done, this->output.try_write_zero(this->resource->write, 10));
  EXPECT_EQ("odom", this->input.read().value.header.frame_id.view());
}

TEST(DeclaredFrames, ALargeMessageIsCheckedAndFilledInItsPlace) {
  SharedData<Image> resource;
  resource.set_name("image");
  resource.set_frames({.frame = "camera"});
  WritePort<Image> output("output");
  ReadPort<Image> input("input");
  output.connect(resource.write, "image");
  input.connect(resource.read, "image");
  const auto image = std::make_unique<Image>();
  ASSERT_TRUE(output.write(*image));
  EXPECT_EQ("camera", input.read().value.header.frame_id.view());
  image->header.frame_id = "map";
  EXPECT_FALSE(output.write(*image));
  EXPECT_FALSE(output.write_with([](Image& place) { place.header.frame_id = "odom"; }));
  EXPECT_EQ("header.frame_id is 'odom', expected 'camera'", resource.why_refused_value());
  EXPECT_TRUE(output.write_with([](Image& place) { place.header.frame_id.assign(""); }));
  EXPECT_EQ("camera", input.read().value.header.frame_id.view());
}

TEST(DeclaredFrames, AMessageWithoutRoomForTheFrameIsRefused) {
  SharedData<Short> resource;
  resource.set_frames({.frame = "camera"});
  WritePort<Short> output("output");
  output.connect(resource.write, "short");
  EXPECT_FALSE(output.write({}));
}

TEST(SerializedFrames, AreReadFromTheBeginOfAMessage) {
  const std::vector<std::byte> message = bytes_of(odometry("odom", "base_link", 1.0));
  EXPECT_EQ("odom", frame_ids(message.data(), message.size(), false).frame);
  EXPECT_EQ("", frame_ids(message.data(), message.size(), false).child_frame);
  EXPECT_EQ("base_link", frame_ids(message.data(), message.size(), true).child_frame);
  for (std::size_t size = 0; size < message.size(); ++size) frame_ids(message.data(), size, true);
}

}  // namespace mauve::testing::test_frames
