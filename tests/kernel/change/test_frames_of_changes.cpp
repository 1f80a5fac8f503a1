// SPDX-License-Identifier: LGPL-3.0-or-later
// Frames in transactions: all ports of a resource are in one frame, and the resource checks its messages against that frame.
#include "transaction_fixtures.hpp"

namespace mauve::testing::test_frames_of_changes {

struct Header {
  BoundedString<255> frame_id{};
};
struct Stamped {
  Header header{};
  double value{};
};

}  // namespace mauve::testing::test_frames_of_changes

MAUVE_TYPE(mauve::testing::test_frames_of_changes::Header, "test_changes/msg/Header", frame_id)
MAUVE_TYPE(mauve::testing::test_frames_of_changes::Stamped, "test_changes/msg/Stamped", header, value)

namespace mauve::testing::test_frames_of_changes {

struct FramedShell : TestShell {
  ReadPort<Stamped>& map = read_port<Stamped>("map").optional().in_frame("map");
  WritePort<Stamped>& odom = write_port<Stamped>("odom").optional().in_frame("odom");
  WritePort<Stamped>& any = write_port<Stamped>("any").optional();
};
struct OtherShell : TestShell {
  ReadPort<Stamped>& map = read_port<Stamped>("map").optional().in_frame("odom");
};

class FramesOfChanges : public ::testing::Test {
 protected:
  FramesOfChanges() {
    architecture.add_resource<SharedData<Stamped>>("pose");
    architecture.add_resource<SharedData<Stamped>>("other");
    commit(std::move(Transaction().add_component<FramedShell, TestCore, TestFsm>("a")));
    commit(std::move(Transaction().add_component<FramedShell, TestCore, TestFsm>("b")));
  }
  void commit(Transaction transaction) { architecture.commit(std::move(transaction)); }
  ErrorDetail refused(Transaction transaction) {
    try {
      commit(std::move(transaction));
    } catch (const Error& error) {
      EXPECT_EQ(ErrorCode::frame_mismatch, error.code()) << error.what();
      return error.detail();
    }
    ADD_FAILURE() << "nothing was refused";
    return {};
  }
  const Frames* expected(const std::string& resource) {
    return architecture.find_resource(resource)->frame_guard().expected();
  }

  Architecture architecture;
};

TEST_F(FramesOfChanges, TheFirstPortThatDeclaresAFrameCountsForAllOthers) {
  architecture.connect("a", "odom", "pose", "write");
  const ErrorDetail detail = refused(std::move(Transaction().connect("b", "map", "pose", "read")));
  EXPECT_EQ("b", detail.component);
  EXPECT_EQ("port map", detail.element);
  EXPECT_EQ("frame map, as the port declares", detail.expected);
  EXPECT_EQ("frame odom of port a.odom at pose.write", detail.found);
  EXPECT_FALSE(architecture.component("b").shell().find_port("map")->is_connected());
  architecture.connect("b", "any", "pose", "write");
}

TEST_F(FramesOfChanges, TheStepThatContradictsIsNamed) {
  const ErrorDetail detail = refused(std::move(Transaction()
                                                   .connect("b", "map", "other", "read")
                                                   .connect("b", "odom", "pose", "write")
                                                   .connect("a", "map", "pose", "read")));
  EXPECT_EQ(3, detail.step);
  EXPECT_EQ("a", detail.component);
}

TEST_F(FramesOfChanges, APortThatGoesMakesRoomForAnotherFrame) {
  architecture.connect("a", "odom", "pose", "write");
  ASSERT_NE(nullptr, expected("pose"));
  EXPECT_EQ("odom", expected("pose")->frame);
  commit(std::move(Transaction().disconnect("a", "odom").connect("b", "map", "pose", "read")));
  EXPECT_EQ("map", expected("pose")->frame);
  commit(std::move(Transaction().remove_component("b")));
  EXPECT_EQ(nullptr, expected("pose"));
}

TEST_F(FramesOfChanges, AMessageInAnotherFrameThanAPortDeclaresIsRefused) {
  architecture.connect("b", "map", "pose", "read");
  const auto resource = architecture.find_resource("pose");
  WritePort<Stamped> writer("writer");
  ReadPort<Stamped> reader("reader");
  writer.connect(*resource->find_service("write"), "pose");
  reader.connect(*resource->find_service("read"), "pose");
  EXPECT_FALSE(writer.write({.header = {.frame_id = "odom"}}));
  EXPECT_TRUE(writer.write({.value = 1.0}));
  EXPECT_EQ("map", reader.read().value.header.frame_id.view());
  EXPECT_EQ(1U, resource->refused_values());
  writer.disconnect();
  reader.disconnect();
}

TEST_F(FramesOfChanges, ANewShellWithAnotherFrameIsRefused) {
  architecture.configure();
  commit(std::move(Transaction().connect("a", "map", "pose", "read").connect("b", "map", "pose", "read")));
  const ErrorDetail detail =
      refused(std::move(Transaction().replace_shell("b", std::make_unique<OtherShell>())));
  EXPECT_EQ("frame map of port a.map at pose.read", detail.found);
  EXPECT_EQ(1, detail.step);
}

TEST_F(FramesOfChanges, AComponentDeclaresFramesOfPortsBesideItsShell) {
  ComponentParts parts;
  parts.frames = {{"any", {.frame = "gps"}}};
  commit(std::move(Transaction().add_component<FramedShell, TestCore, TestFsm>("c", parts)));
  commit(std::move(Transaction().add_resource("gps", std::make_unique<SharedData<Stamped>>(),
                                              TopicBinding::none, 0, {.frame = "gps"})));
  refused(std::move(Transaction().connect("c", "odom", "gps", "write")));
  architecture.connect("c", "any", "gps", "write");
  EXPECT_NE(std::string::npos, to_string(architecture.describe()).find("-> gps.write in frame gps"));
  parts.frames = {{"map", {.frame = "odom"}}};
  const ErrorDetail detail =
      refused(std::move(Transaction().add_component<FramedShell, TestCore, TestFsm>("d", parts)));
  EXPECT_EQ("frame map, as its shell declares", detail.expected);
  parts.frames = {{"none", {.frame = "odom"}}};
  EXPECT_THROW(commit(std::move(Transaction().add_component<FramedShell, TestCore, TestFsm>("d", parts))),
               Error);
}

/// The same in a deployed architecture, on threads and in virtual time.
TEST_F(FramesOfChanges, AreCheckedWhileComponentsRun) {
  architecture.connect("a", "odom", "pose", "write");
  architecture.configure();
  Deployer deployer(architecture);
  deployer.deploy();
  EXPECT_THROW(deployer.commit(std::move(Transaction().connect("b", "map", "pose", "read")), {}), Error);
  deployer.commit(std::move(Transaction().connect("b", "map", "other", "read")), {});
  EXPECT_EQ("map", expected("other")->frame);
}

}  // namespace mauve::testing::test_frames_of_changes
