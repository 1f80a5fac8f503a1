// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/data/frames.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <set>

#include "mauve_rt/base/error.hpp"
#include "mauve_rt/base/seam/mutex.hpp"

namespace mauve {

namespace {

constexpr std::size_t kLongestFrame = 255;  // characters that a message's frame_id has room for

bool is_frame_name(std::string_view name) noexcept {
  const auto is_bad = [](char c) { return static_cast<unsigned char>(c) <= ' ' || c == '\x7F'; };
  return name.size() <= kLongestFrame && name.front() != '/' &&
         std::none_of(name.begin(), name.end(), is_bad);
}

std::string mismatch_text(const char* field, std::string_view found, std::string_view wanted) {
  return std::string(field) + " is '" + std::string(found) + "', expected '" + std::string(wanted) + "'";
}

/// The field of a message that names another frame.
struct OtherFrame {
  const char* field{""};
  std::string_view found{};
  const std::string* wanted{nullptr};  // nullptr: there is none
};

OtherFrame other_frame(const FrameIds& ids, const Frames* frames) noexcept {
  const auto differs = [](std::string_view found, const std::string& wanted) {
    return !found.empty() && !wanted.empty() && found != wanted;
  };
  if (frames == nullptr) return {};
  if (differs(ids.frame, frames->frame)) return {"header.frame_id", ids.frame, &frames->frame};
  if (differs(ids.child_frame, frames->child_frame))
    return {"child_frame_id", ids.child_frame, &frames->child_frame};
  return {};
}

}  // namespace

std::string to_string(const Frames& frames) {
  std::string text = frames.frame.empty() ? "" : "frame " + frames.frame;
  if (!frames.child_frame.empty())
    text += (text.empty() ? "child_frame " : ", child_frame ") + frames.child_frame;
  return text;
}

void check_frame_names(const Frames& frames, const std::string& element) {
  for (const auto& [key, name] : {std::pair("frame", &frames.frame), {"child_frame", &frames.child_frame}}) {
    if (name->empty() || is_frame_name(*name)) continue;
    throw Error(ErrorCode::invalid_argument, std::string("a ") + key + " has a bad name",
                {.element = element,
                 .expected = "at most 255 characters, no white space, no slash at the begin",
                 .found = "'" + *name + "'",
                 .remedy = "name the frame as tf2 does, such as map or robot_1/base"});
  }
}

const Frames* keep_frames(const Frames& frames) {
  if (frames == Frames{}) return nullptr;
  static Mutex mutex;
  static std::set<Frames>& kept =
      *new std::set<Frames>();  // never freed: writers may look at the end of the process
  const LockGuard lock(mutex);
  return &*kept.insert(frames).first;
}

std::optional<FrameDifference> frame_difference(const Frames& ours, const Frames& theirs) {
  const auto differs = [](const std::string& a, const std::string& b) {
    return !a.empty() && !b.empty() && a != b;
  };
  if (differs(ours.frame, theirs.frame))
    return FrameDifference{"frame " + ours.frame, "frame " + theirs.frame};
  if (differs(ours.child_frame, theirs.child_frame))
    return FrameDifference{"child_frame " + ours.child_frame, "child_frame " + theirs.child_frame};
  return {};
}

Frames merged_frames(const Frames& first, const Frames& second) {
  return {.frame = first.frame.empty() ? second.frame : first.frame,
          .child_frame = first.child_frame.empty() ? second.child_frame : first.child_frame};
}

FrameIds frame_ids(const std::byte* message, std::size_t size, bool has_child_frame) noexcept {
  constexpr std::size_t kHeader = 4;    // of CDR; its second byte: little-endian
  constexpr std::size_t kFrameId = 12;  // behind the stamp
  constexpr std::size_t kLength = sizeof(std::uint32_t);
  FrameIds ids;
  if (size < kHeader || message[1] != std::byte{1}) return ids;
  std::size_t at = kFrameId;
  for (std::string_view* id : std::array{&ids.frame, &ids.child_frame}) {
    std::uint32_t length = 0;  // with the zero at the end
    if (at + kLength > size) return ids;
    std::memcpy(&length, message + at, kLength);
    at += kLength;
    if (length == 0 || length > size - at) return ids;
    *id = {reinterpret_cast<const char*>(message + at), length - 1};
    at = (at + length + kLength - 1) / kLength * kLength;  // kHeader is a multiple of kLength too
    if (!has_child_frame) break;
  }
  return ids;
}

void FrameGuard::declare(Frames frames) {
  declared_ = std::move(frames);
  expect(keep_frames(declared_));
}

bool FrameGuard::admits(const FrameIds& ids) noexcept {
  const OtherFrame other = other_frame(ids, expected());
  if (other.wanted == nullptr) return true;
  refused_.fetch_add(1, std::memory_order_relaxed);
  const LockGuard lock(last_mutex_);
  found_.assign(other.found);
  wanted_ = other.wanted;
  field_ = other.field;
  return false;
}

std::string FrameGuard::refusal() const {
  BoundedString<kLongestFrame> found;
  const std::string* wanted = nullptr;
  const char* field = "";
  {
    const LockGuard lock(last_mutex_);
    found = found_;
    wanted = wanted_;
    field = field_;
  }
  return wanted == nullptr ? "" : mismatch_text(field, found.view(), *wanted);
}

std::string FrameGuard::why_refused(const FrameIds& ids) const {
  const OtherFrame other = other_frame(ids, expected());
  return other.wanted == nullptr ? "" : mismatch_text(other.field, other.found, *other.wanted);
}

}  // namespace mauve
