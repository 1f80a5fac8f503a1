// SPDX-License-Identifier: LGPL-3.0-or-later
// Frames: the frames of reference that ports and resources declare, and the check of the messages that are written.
#pragma once

#include <compare>
#include <concepts>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "mauve_rt/base/pi_mutex.hpp"
#include "mauve_rt/base/rt.hpp"
#include "mauve_rt/base/seam/atomic.hpp"
#include "mauve_rt/data/bounded.hpp"

namespace mauve {

/// The frame of a value; of a pose or a transform also the frame whose pose it is. An empty name: not declared.
struct Frames {
  std::string frame{};
  std::string child_frame{};

  auto operator<=>(const Frames&) const = default;
};

/// "frame odom", "frame odom, child_frame base"; empty: none is declared. [non-rt]
std::string to_string(const Frames& frames);
/// Checks the names: no white space, no slash at the begin, at most 255 characters. [non-rt]
/// Throws Error (invalid_argument) about `element`.
void check_frame_names(const Frames& frames, const std::string& element);
/// The one copy of these frames, which lives as long as the process; nullptr: none is declared. [non-rt]
const Frames* keep_frames(const Frames& frames);

/// A name that two declare and that differs.
struct FrameDifference {
  std::string ours;  // "frame odom" or "child_frame base"
  std::string theirs;
};
inline constexpr std::string_view kFrameRemedy =
    "connect another resource, read it by a TransformedReadPort, or correct a declaration";
/// Nothing: each name that both declare is equal. [non-rt]
std::optional<FrameDifference> frame_difference(const Frames& ours, const Frames& theirs);
/// Those of `first`; each one that it does not declare, of `second`. [non-rt]
Frames merged_frames(const Frames& first, const Frames& second);

/// The frames that a message names; empty: it names none, or its type has no such field.
struct FrameIds {
  std::string_view frame{};
  std::string_view child_frame{};
};

/// A message with `header.frame_id`.
template <typename T>
concept HasFrame = requires(T& value) {
  { value.header.frame_id.assign(std::string_view()) } -> std::same_as<bool>;
  { value.header.frame_id.view() } -> std::same_as<std::string_view>;
};
/// One with `child_frame_id` too.
template <typename T>
concept HasChildFrame = HasFrame<T> && requires(T& value) {
  { value.child_frame_id.assign(std::string_view()) } -> std::same_as<bool>;
  { value.child_frame_id.view() } -> std::same_as<std::string_view>;
};

/// [rt]
template <typename T>
FrameIds frame_ids(const T& value) MAUVE_RT {
  FrameIds ids;
  if constexpr (HasFrame<T>) ids.frame = value.header.frame_id.view();
  if constexpr (HasChildFrame<T>) ids.child_frame = value.child_frame_id.view();
  return ids;
}
/// Of a serialized message whose first fields are a header and, with `has_child_frame`, child_frame_id. [rt]
FrameIds frame_ids(const std::byte* message, std::size_t size, bool has_child_frame) MAUVE_RT;

/// Gives a message the declared frames where it names none; false: the message has no room for a name. [rt]
template <typename T>
bool fill_frames([[maybe_unused]] T& value, [[maybe_unused]] const Frames& frames) MAUVE_RT {
  bool fits = true;
  if constexpr (HasFrame<T>) {
    if (value.header.frame_id.view().empty()) fits = value.header.frame_id.assign(frames.frame);
  }
  if constexpr (HasChildFrame<T>) {
    if (value.child_frame_id.view().empty()) fits = value.child_frame_id.assign(frames.child_frame) && fits;
  }
  return fits;
}

/// The frames of a resource: what its declaration and the ports at it declare. Messages that name another frame are refused.
///
/// | member    | written by               | read by | under / order                                        |
/// | --------- | ------------------------ | ------- | ---------------------------------------------------- |
/// | declared_ | [setup]                  | any     | -                                                    |
/// | expected_ | [setup], changes         | writers | release/acquire: the names, which live for ever      |
/// | refused_  | writers                  | any     | relaxed: a figure that nothing depends on            |
/// | found_, wanted_ | writers that are refused | any | last_mutex_                                        |
class FrameGuard {
 public:
  /// [rt]
  const Frames& declared() const MAUVE_RT { return declared_; }
  /// [setup]
  void declare(Frames frames);
  /// nullptr: none. [rt]
  const Frames* expected() const MAUVE_RT { return expected_.load(std::memory_order_acquire); }
  /// From keep_frames(). [rt]
  void expect(const Frames* frames) MAUVE_RT { expected_.store(frames, std::memory_order_release); }

  /// Whether the message names no other frame than expected; counts what is refused. [rt]
  bool admits(const FrameIds& ids) MAUVE_RT;
  /// Messages that were refused. [rt]
  std::uint64_t refused() const MAUVE_RT { return refused_.load(std::memory_order_relaxed); }
  /// Why the last one was, in words; empty: none was. [non-rt]
  std::string refusal() const;
  /// Why admits() refuses this message, in words; empty: it does not. [non-rt]
  std::string why_refused(const FrameIds& ids) const;

 private:
  Frames declared_;
  Atomic<const Frames*> expected_{nullptr};
  Atomic<std::uint64_t> refused_{0};
  mutable PiMutex last_mutex_;
  BoundedString<255> found_;
  const std::string* wanted_{nullptr};
  const char* field_{""};
};

}  // namespace mauve
