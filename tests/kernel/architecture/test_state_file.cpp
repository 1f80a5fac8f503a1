// SPDX-License-Identifier: LGPL-3.0-or-later
// The file in which decisions outlast a restart.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstdint>
#include <fstream>
#include <iterator>
#include <limits>
#include <string>

#include "mauve_rt/architecture/state_file.hpp"
#include "mauve_rt/base/error.hpp"

namespace mauve::testing::test_state_file {

namespace fs = std::filesystem;

class StateFile : public ::testing::Test {
 protected:
  StateFile() { fs::remove_all(folder_); }
  ~StateFile() override { fs::remove_all(folder_); }

  const fs::path folder_ = fs::temp_directory_path() / ("mauve_state_file_" + std::to_string(::getpid()));
  const fs::path path_ = folder_ / "robot_1__executor.state";
};

Assigned set(const std::string& name, const PropertyValue& value) {
  return {.element = {.target = "arm", .name = "property " + name},
          .step = {.kind = "set_property", .target = "arm", .name = name, .value = value}};
}

Assigned stop(const std::string& component) {
  return {.element = {.target = component, .name = "state"}, .step = {.kind = "stop", .target = component}};
}

/// All kinds of values and records, and names with odd characters.
KeptState full_state() {
  std::string every_byte;
  for (int byte = 0; byte < 256; ++byte) every_byte += static_cast<char>(byte);
  KeptState state;
  state.active.push_back({.rule = "e_stop",
                          .source = "",
                          .priority = std::numeric_limits<std::int64_t>::min(),
                          .safety = true,
                          .whole = false,
                          .latch = true,
                          .assigns = {stop("base"), stop("arm")},
                          .leaves = {set("speed", 0.1)},
                          .leaves_over_persons = true});
  state.active.push_back({.rule = "\"a\\\n b\t", .source = every_byte, .whole = true});
  state.active.back().assigns.push_back({.element = {}, .step = {.kind = "resynchronise"}});
  state.rejected = {{.element = {.target = "arm", .name = "core"},
                     .step = {.kind = "replace_core", .target = "arm", .name = "package/Core"}}};
  for (const PropertyValue& value :
       {PropertyValue(true), PropertyValue(false), PropertyValue(std::int64_t{-5}), PropertyValue(INT64_MAX),
        PropertyValue(1.0 / 3), PropertyValue(-0.0), PropertyValue(std::numeric_limits<double>::infinity()),
        PropertyValue(std::numeric_limits<double>::denorm_min()), PropertyValue(std::string()),
        PropertyValue(std::string("true")), PropertyValue(every_byte)}) {
    state.bases.push_back({.assigned = set("p", value), .author = "operator", .of_file = std::nullopt});
    state.bases.push_back({.assigned = set("q", 1.0), .author = "", .of_file = set("q", value).step});
  }
  return state;
}

TEST_F(StateFile, KeepsEveryKindOfRecordAndValue) {
  const KeptState state = full_state();
  EXPECT_EQ(state, kept_state_of(text_of(state)));
  EXPECT_EQ(KeptState(), kept_state_of(text_of(KeptState())));
}

TEST_F(StateFile, KeepsWhatIsNoNumber) {
  KeptState state;
  state.bases.push_back({.assigned = set("p", std::nan("")), .author = "operator", .of_file = std::nullopt});
  const KeptState read = kept_state_of(text_of(state));
  ASSERT_EQ(1U, read.bases.size());
  EXPECT_TRUE(std::isnan(std::get<double>(*read.bases[0].assigned.step.value)));
}

TEST_F(StateFile, APersonCanReadIt) {
  KeptState state;
  state.active.push_back({.rule = "e_stop", .safety = true, .latch = true, .assigns = {stop("base")}});
  const std::string text = text_of(state);
  EXPECT_EQ(
      "mauve_rt state 1\n"
      "rule \"e_stop\" \"\" 0 true false true false\n"
      "assigns \"base\" \"state\" stop \"base\" \"\" none\n",
      text.substr(0, text.find("sum ")));
}

TEST_F(StateFile, OneThatEndsTooEarlyIsDamaged) {
  const std::string text = text_of(full_state());
  for (std::size_t bytes = 0; bytes < text.size(); ++bytes)
    EXPECT_THROW(kept_state_of(std::string_view(text).substr(0, bytes)), Error) << bytes;
  EXPECT_THROW(kept_state_of(text + "\n"), Error);
}

TEST_F(StateFile, OneWithAnotherBitIsDamaged) {
  std::string text = text_of(full_state());
  for (char& byte : text) {
    const char before = byte;
    for (unsigned bit = 0; bit < 8; ++bit) {
      byte = static_cast<char>(static_cast<unsigned char>(before) ^ (1U << bit));
      EXPECT_THROW(kept_state_of(text), Error) << "byte " << &byte - text.data() << ", bit " << bit;
    }
    byte = before;
  }
}

TEST_F(StateFile, TakesThePlaceOfTheOneBefore) {
  EXPECT_FALSE(read_state_file(path_).has_value());
  write_state_file(path_, text_of(full_state()));
  EXPECT_EQ(full_state(), read_state_file(path_));
  write_state_file(path_, text_of(KeptState()));
  EXPECT_EQ(KeptState(), read_state_file(path_));
  EXPECT_EQ(1, std::distance(fs::directory_iterator(folder_), fs::directory_iterator()));
}

TEST_F(StateFile, AWriteThatFailsLeavesTheOneBefore) {
  write_state_file(path_, text_of(full_state()));
  fs::create_directories(path_.string() + ".new");  // in the place of the file beside it
  try {
    write_state_file(path_, text_of(KeptState()));
    FAIL() << "it was written";
  } catch (const Error& error) {
    EXPECT_EQ(ErrorCode::io, error.code());
    EXPECT_EQ(path_.string(), error.detail().element);
    EXPECT_EQ("Is a directory", error.detail().found);
  }
  EXPECT_EQ(full_state(), read_state_file(path_));
}

TEST_F(StateFile, WhatCannotBeReadIsDamaged) {
  fs::create_directories(path_);
  EXPECT_THROW(read_state_file(path_), Error);
}

}  // namespace mauve::testing::test_state_file
