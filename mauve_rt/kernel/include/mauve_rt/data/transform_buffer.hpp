// SPDX-License-Identifier: LGPL-3.0-or-later
// TransformBuffer: a tree of frames with the latest transforms of each, looked up without waiting.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "mauve_rt/base/pi_mutex.hpp"
#include "mauve_rt/base/rt.hpp"
#include "mauve_rt/base/seam/atomic.hpp"
#include "mauve_rt/base/time.hpp"
#include "mauve_rt/data/bounded.hpp"
#include "mauve_rt/data/transform.hpp"

namespace mauve {

/// A frame of one buffer; valid as long as the buffer.
using FrameId = std::uint32_t;
inline constexpr FrameId kNoFrame = UINT32_MAX;
using FrameName = BoundedString<63>;

/// Look up at the latest time that all frames of the path have.
inline constexpr time_ns_t kLatestCommon = 0;

/// The outcome of set() and lookup(); all but `done` change nothing.
enum class TransformOutcome : std::uint8_t {
  done = 0,
  // of lookups
  unknown_frame,    // no transform named the frame
  not_connected,    // the frames have no common ancestor
  before_interval,  // the frame's transforms begin later than the time
  after_interval,   // the frame's transforms end earlier than the time
  overtaken,        // writers replaced all transforms of the frame several times during one lookup
  // of sets
  bad_name,         // empty, or longer than 63 characters
  too_many_frames,  // the buffer is full
  loop,             // the parent is the child, or a descendant of the child
  second_parent,    // the child has another parent
  static_differs,   // the child is static and the transform is not, or the other way round
  not_finite,       // a number is infinite or NaN
  bad_rotation,     // the length of the quaternion is not 1
  not_newer,        // the child has a transform of this time, or of a later time
};

/// "done", "unknown frame", ... [rt]
std::string_view to_string(TransformOutcome outcome) MAUVE_RT;

struct TransformLookup {
  TransformOutcome outcome{TransformOutcome::done};
  Transform transform{};    // of a point in `source` to `target`
  time_ns_t time_ns{0};     // of the transform
  FrameId frame{kNoFrame};  // that has no transform at the time
  time_ns_t first_ns{0};    // the interval of that frame
  time_ns_t last_ns{0};
};

/// Frames and, for each, a ring of its latest transforms to its parent; all memory is allocated by the constructor.
///
/// Readers take no lock and never wait: the number of steps of a lookup has a bound, by the number of frames and the history.
/// Frames are never removed, and a frame's parent never changes: a path that a reader has found stays. A slot of a ring carries
/// its sequence number, which a reader compares before and after a copy. A slot that was replaced meanwhile is older than every
/// transform that is left, so a lookup at a time needs no second attempt: the time is before the interval. Only the newest
/// transform is read again, at most kAttempts times: each failed attempt means that writers replaced the whole ring during the
/// attempt. Then the lookup fails, as `overtaken`.
///
/// | member            | written by | read by | under / order                                                              |
/// | ----------------- | ---------- | ------- | -------------------------------------------------------------------------- |
/// | all               | writers    | writers | mutex_                                                                     |
/// | table_            | writers    | readers | release / acquire: publishes the name of the frame                         |
/// | count_            | writers    | any     | relaxed: a figure                                                          |
/// | Frame::parent     | writers    | readers | release / acquire: publishes is_static and the first transform             |
/// | Frame::is_static  | writers    | readers | relaxed: ordered by parent                                                 |
/// | Frame::written    | writers    | readers | release / acquire: publishes the slot                                      |
/// | Frame::change     | writers    | writers | mutex_                                                                     |
/// | Slot::sequence    | writers    | readers | relaxed before, release after the values; acquire before, relaxed after    |
/// | Slot::time, values | writers   | readers | release / acquire: who reads a new number sees the sequence taken away, too |
class TransformBuffer {
 public:
  static constexpr std::uint32_t kMostFrames = 1'000;
  static constexpr std::uint32_t kMostHistory = 10'000;
  static constexpr int kAttempts = 4;
  /// The square of a quaternion's length may differ from 1 by so much, as in tf2.
  static constexpr double kLengthTolerance = 0.01;

  /// At most `frames` frames, with the latest `history` (> 1) transforms of each. [setup]
  /// Throws Error (out_of_range).
  TransformBuffer(std::uint32_t frames, std::uint32_t history);

  /// Adds the child's transform to its parent at the time; the first set() of a frame gives its parent. [rt]
  /// Names are unknown until their first set(). A static transform is valid at any time, and replaces the last.
  TransformOutcome set(std::string_view parent, std::string_view child, const Transform& transform,
                       time_ns_t time_ns, bool is_static) MAUVE_RT;
  /// The frame of that name, if a transform named it. [rt]
  std::optional<FrameId> find(std::string_view name) const MAUVE_RT;
  /// The name of a frame. [rt]
  const FrameName& name(FrameId frame) const MAUVE_RT { return frames_[frame].name; }
  /// Transforms a point of `source` to `target`, at the time or at kLatestCommon. [rt] Both of this buffer.
  TransformLookup lookup(FrameId target, FrameId source, time_ns_t time_ns) const MAUVE_RT;

  /// How many frames have a name. [rt]
  std::uint32_t frames() const MAUVE_RT { return count_.load(std::memory_order_relaxed); }
  /// How many frames have room. [rt]
  std::uint32_t capacity() const MAUVE_RT { return static_cast<std::uint32_t>(frames_.size()); }
  /// All memory of frames and transforms. [rt]
  std::size_t memory_bytes() const MAUVE_RT;
  /// The lock of writers. [rt]
  PiMutex& mutex() MAUVE_RT { return mutex_; }

  /// A transform that was set, for those who send it on.
  struct Change {
    FrameId parent{kNoFrame};
    FrameId child{kNoFrame};
    Transform transform{};
    time_ns_t time_ns{0};
    bool is_static{false};
  };
  /// The newest transform of each frame that was set after the change `seen`, which becomes the last one. [non-rt]
  std::vector<Change> changes_since(std::uint64_t& seen);

 private:
  static constexpr std::size_t kNumbers = 7;

  struct Slot {
    Atomic<std::uint64_t> sequence{0};  // of the transform, from 1 on; 0: none, or being written
    Atomic<time_ns_t> time_ns{0};
    std::array<Atomic<double>, kNumbers> numbers{};
  };
  struct Stamped {
    time_ns_t time_ns{0};
    Transform transform{};
  };
  struct Frame {
    FrameName name{};
    Atomic<FrameId> parent{kNoFrame};
    Atomic<bool> is_static{false};
    Atomic<std::uint64_t> written{0};
    std::uint64_t change{0};
  };
  struct Path {
    FrameId top{kNoFrame};
    std::uint32_t length{0};
  };

  const Slot& slot(FrameId frame, std::uint64_t sequence) const noexcept {
    return slots_[frame * ring_ + sequence % ring_];
  }
  FrameId parent(FrameId frame) const noexcept {
    return frames_[frame].parent.load(std::memory_order_acquire);
  }
  Path climb(Path path, FrameId until) const noexcept;
  FrameId common_ancestor(FrameId one, FrameId other) const noexcept;
  bool read_time(FrameId frame, std::uint64_t sequence, time_ns_t& time_ns) const noexcept;
  bool read(FrameId frame, std::uint64_t sequence, Stamped& stamped) const noexcept;
  bool read_newest(FrameId frame, Stamped& newest, std::uint64_t& sequence) const noexcept;
  TransformOutcome refuse(TransformOutcome outcome, FrameId frame, TransformLookup& found) const noexcept;
  TransformOutcome latest_common(FrameId frame, FrameId top, TransformLookup& found) const noexcept;
  TransformOutcome at(FrameId frame, Transform& transform, TransformLookup& found) const noexcept;
  TransformOutcome between(FrameId frame, std::uint64_t newest, Transform& transform,
                           TransformLookup& found) const noexcept;
  TransformOutcome up_to(FrameId frame, FrameId top, Transform& transform,
                         TransformLookup& found) const noexcept;
  TransformOutcome check_place(FrameId parent, FrameId child, time_ns_t time_ns,
                               bool is_static) const noexcept;
  FrameId add(std::string_view name) noexcept;
  void write(FrameId frame, const Transform& transform, time_ns_t time_ns) noexcept;

  const std::uint32_t history_;
  const std::size_t ring_;  // one slot more: the oldest stays while the next one is written
  std::vector<Frame> frames_;
  std::vector<Slot> slots_;
  std::vector<Atomic<FrameId>> table_;  // open addressing by the hash of the name, at most half full
  Atomic<std::uint32_t> count_{0};
  PiMutex mutex_;
  std::uint64_t changes_ MAUVE_GUARDED_BY(mutex_){0};
};

}  // namespace mauve
