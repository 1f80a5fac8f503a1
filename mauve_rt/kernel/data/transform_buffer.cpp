// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/data/transform_buffer.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <string>

#include "mauve_rt/base/error.hpp"
#include "mauve_rt/base/seam/mutex.hpp"

namespace mauve {

namespace {

std::uint32_t checked_limit(const char* what, std::uint32_t least, std::uint32_t most, std::uint32_t value) {
  if (value >= least && value <= most) return value;
  throw Error(ErrorCode::out_of_range, "a transform_tree cannot have that size",
              {.element = what,
               .expected = std::to_string(least) + " to " + std::to_string(most),
               .found = std::to_string(value)});
}

/// FNV-1a.
std::size_t hash_of(std::string_view name) noexcept {
  std::uint64_t hash = 14695981039346656037U;
  for (const char character : name) hash = (hash ^ static_cast<unsigned char>(character)) * 1099511628211U;
  return hash;
}

}  // namespace

std::string_view to_string(TransformOutcome outcome) noexcept {
  switch (outcome) {
    case TransformOutcome::done:
      return "done";
    case TransformOutcome::unknown_frame:
      return "unknown frame";
    case TransformOutcome::not_connected:
      return "not connected";
    case TransformOutcome::before_interval:
      return "before interval";
    case TransformOutcome::after_interval:
      return "after interval";
    case TransformOutcome::overtaken:
      return "overtaken";
    case TransformOutcome::bad_name:
      return "bad name";
    case TransformOutcome::too_many_frames:
      return "too many frames";
    case TransformOutcome::loop:
      return "loop";
    case TransformOutcome::second_parent:
      return "second parent";
    case TransformOutcome::static_differs:
      return "static differs";
    case TransformOutcome::not_finite:
      return "not finite";
    case TransformOutcome::bad_rotation:
      return "bad rotation";
    case TransformOutcome::not_newer:
      return "not newer";
  }
  return "";
}

TransformBuffer::TransformBuffer(std::uint32_t frames, std::uint32_t history)
    : history_(checked_limit("history", 2, kMostHistory, history)),
      ring_(std::size_t{history} + 1),
      frames_(checked_limit("frames", 2, kMostFrames, frames)),
      slots_(frames * ring_),
      table_(std::bit_ceil(std::size_t{frames} * 2)) {
  for (Atomic<FrameId>& entry : table_) entry.store(kNoFrame, std::memory_order_relaxed);
}

std::size_t TransformBuffer::memory_bytes() const noexcept {
  return frames_.size() * sizeof(Frame) + slots_.size() * sizeof(Slot) + table_.size() * sizeof(table_[0]);
}

std::optional<FrameId> TransformBuffer::find(std::string_view name) const noexcept {
  const std::size_t mask = table_.size() - 1;
  for (std::size_t place = hash_of(name) & mask;; place = (place + 1) & mask) {
    const FrameId frame = table_[place].load(std::memory_order_acquire);
    if (frame == kNoFrame) return {};
    if (frames_[frame].name == name) return frame;
  }
}

// ---- writers, under mutex_

FrameId TransformBuffer::add(std::string_view name) noexcept {
  const FrameId frame = count_.load(std::memory_order_relaxed);
  frames_[frame].name.assign(name);
  count_.store(frame + 1, std::memory_order_relaxed);
  const std::size_t mask = table_.size() - 1;
  std::size_t place = hash_of(name) & mask;
  while (table_[place].load(std::memory_order_relaxed) != kNoFrame) place = (place + 1) & mask;
  table_[place].store(frame, std::memory_order_release);
  return frame;
}

void TransformBuffer::write(FrameId frame, const Transform& transform, time_ns_t time_ns) noexcept {
  const std::uint64_t sequence = frames_[frame].written.load(std::memory_order_relaxed) + 1;
  Slot& into = slots_[frame * ring_ + sequence % ring_];
  const auto& [p, q] = transform;
  const std::array<double, kNumbers> numbers{p.x, p.y, p.z, q.x, q.y, q.z, q.w};
  into.sequence.store(0, std::memory_order_relaxed);
  into.time_ns.store(time_ns, std::memory_order_release);
  for (std::size_t i = 0; i < kNumbers; ++i) into.numbers[i].store(numbers[i], std::memory_order_release);
  into.sequence.store(sequence, std::memory_order_release);
  frames_[frame].written.store(sequence, std::memory_order_release);
}

TransformOutcome TransformBuffer::check_place(FrameId parent, FrameId child, time_ns_t time_ns,
                                              bool is_static) const noexcept {
  const Frame& frame = frames_[child];
  const FrameId present = frame.parent.load(std::memory_order_relaxed);
  if (present == kNoFrame) {
    for (FrameId above = parent; above != kNoFrame; above = this->parent(above)) {
      if (above == child) return TransformOutcome::loop;
    }
    return TransformOutcome::done;
  }
  if (present != parent) return TransformOutcome::second_parent;
  if (frame.is_static.load(std::memory_order_relaxed) != is_static) return TransformOutcome::static_differs;
  const Slot& newest = slot(child, frame.written.load(std::memory_order_relaxed));
  if (!is_static && newest.time_ns.load(std::memory_order_relaxed) >= time_ns)
    return TransformOutcome::not_newer;
  return TransformOutcome::done;
}

TransformOutcome TransformBuffer::set(std::string_view parent, std::string_view child,
                                      const Transform& transform, time_ns_t time_ns,
                                      bool is_static) noexcept {
  for (const std::string_view name : {parent, child}) {
    if (name.empty() || name.size() > FrameName::capacity()) return TransformOutcome::bad_name;
  }
  if (parent == child) return TransformOutcome::loop;
  if (!is_finite(transform)) return TransformOutcome::not_finite;
  if (!(std::abs(squared_length(transform.rotation) - 1.0) <= kLengthTolerance))
    return TransformOutcome::bad_rotation;

  const LockGuard lock(mutex_);
  std::optional<FrameId> above = find(parent);
  std::optional<FrameId> below = find(child);
  const std::uint32_t missing = (above ? 0U : 1U) + (below ? 0U : 1U);
  if (frames() + missing > capacity()) return TransformOutcome::too_many_frames;
  if (below) {
    const TransformOutcome place = check_place(above.value_or(kNoFrame), *below, time_ns, is_static);
    if (place != TransformOutcome::done) return place;
  }
  if (!above) above = add(parent);
  if (!below) below = add(child);
  Frame& frame = frames_[*below];
  write(*below, {.translation = transform.translation, .rotation = normalised(transform.rotation)}, time_ns);
  frame.change = ++changes_;
  if (frame.parent.load(std::memory_order_relaxed) == kNoFrame) {
    frame.is_static.store(is_static, std::memory_order_relaxed);
    frame.parent.store(*above, std::memory_order_release);
  }
  return TransformOutcome::done;
}

std::vector<TransformBuffer::Change> TransformBuffer::changes_since(std::uint64_t& seen) {
  std::vector<Change> found;
  found.reserve(capacity());  // not under the lock
  const LockGuard lock(mutex_);
  if (seen == changes_) return found;
  for (FrameId child = 0; child < frames(); ++child) {
    const Frame& frame = frames_[child];
    Stamped newest;
    if (frame.change > seen && read(child, frame.written.load(std::memory_order_relaxed), newest)) {
      found.push_back({.parent = parent(child),
                       .child = child,
                       .transform = newest.transform,
                       .time_ns = newest.time_ns,
                       .is_static = frame.is_static.load(std::memory_order_relaxed)});
    }
  }
  seen = changes_;
  return found;
}

// ---- readers

bool TransformBuffer::read_time(FrameId frame, std::uint64_t sequence, time_ns_t& time_ns) const noexcept {
  const Slot& from = slot(frame, sequence);
  if (from.sequence.load(std::memory_order_acquire) != sequence) return false;
  time_ns = from.time_ns.load(std::memory_order_acquire);
  return from.sequence.load(std::memory_order_relaxed) == sequence;
}

bool TransformBuffer::read(FrameId frame, std::uint64_t sequence, Stamped& stamped) const noexcept {
  const Slot& from = slot(frame, sequence);
  if (from.sequence.load(std::memory_order_acquire) != sequence) return false;
  stamped.time_ns = from.time_ns.load(std::memory_order_acquire);
  std::array<double, kNumbers> n{};
  for (std::size_t i = 0; i < kNumbers; ++i) n[i] = from.numbers[i].load(std::memory_order_acquire);
  stamped.transform = {.translation = {.x = n[0], .y = n[1], .z = n[2]},
                       .rotation = {.x = n[3], .y = n[4], .z = n[5], .w = n[6]}};
  return from.sequence.load(std::memory_order_relaxed) == sequence;
}

bool TransformBuffer::read_newest(FrameId frame, Stamped& newest, std::uint64_t& sequence) const noexcept {
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    sequence = frames_[frame].written.load(std::memory_order_acquire);
    if (read(frame, sequence, newest)) return true;
  }
  return false;
}

/// Climbs to a frame, or to the root.
TransformBuffer::Path TransformBuffer::climb(Path path, FrameId until) const noexcept {
  while (path.top != until) {
    const FrameId above = parent(path.top);
    if (above == kNoFrame) break;
    path.top = above;
    ++path.length;
  }
  return path;
}

FrameId TransformBuffer::common_ancestor(FrameId one, FrameId other) const noexcept {
  // A writer may give a parent to the root meanwhile: the shorter of both views is continued.
  Path of_one = climb({.top = one}, kNoFrame);
  Path of_other = climb({.top = other}, of_one.top);
  if (of_other.top != of_one.top) of_one = climb(of_one, of_other.top);
  if (of_other.top != of_one.top) return kNoFrame;
  for (; of_one.length > of_other.length; --of_one.length) one = parent(one);
  for (; of_other.length > of_one.length; --of_other.length) other = parent(other);
  while (one != other) {
    one = parent(one);
    other = parent(other);
  }
  return one;
}

TransformOutcome TransformBuffer::refuse(TransformOutcome outcome, FrameId frame,
                                         TransformLookup& found) const noexcept {
  found.frame = frame;
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    const std::uint64_t written = frames_[frame].written.load(std::memory_order_acquire);
    const std::uint64_t oldest = written > history_ ? written - history_ + 1 : 1;
    if (read_time(frame, written, found.last_ns) && read_time(frame, oldest, found.first_ns)) return outcome;
  }
  return TransformOutcome::overtaken;
}

TransformOutcome TransformBuffer::between(FrameId frame, std::uint64_t newest, Transform& transform,
                                          TransformLookup& found) const noexcept {
  // The first transform later than the time lies in (low, high]; a replaced one is older than all that are left.
  std::uint64_t low = newest > history_ ? newest - history_ : 0;
  const std::uint64_t none_before = low;
  std::uint64_t high = newest;
  while (high - low > 1) {
    const std::uint64_t middle = low + (high - low) / 2;
    time_ns_t time_ns = 0;
    (!read_time(frame, middle, time_ns) || time_ns <= found.time_ns ? low : high) = middle;
  }
  Stamped before;
  Stamped after;
  if (low == none_before || !read(frame, low, before) || !read(frame, high, after))
    return refuse(TransformOutcome::before_interval, frame, found);
  const double part = static_cast<double>(found.time_ns - before.time_ns) /
                      static_cast<double>(after.time_ns - before.time_ns);
  transform = part == 0.0 ? before.transform : interpolate(before.transform, after.transform, part);
  return TransformOutcome::done;
}

TransformOutcome TransformBuffer::at(FrameId frame, Transform& transform,
                                     TransformLookup& found) const noexcept {
  Stamped newest;
  std::uint64_t sequence = 0;
  if (!read_newest(frame, newest, sequence)) {
    found.frame = frame;
    return TransformOutcome::overtaken;
  }
  if (newest.time_ns == found.time_ns || frames_[frame].is_static.load(std::memory_order_relaxed)) {
    transform = newest.transform;
    return TransformOutcome::done;
  }
  if (newest.time_ns < found.time_ns) return refuse(TransformOutcome::after_interval, frame, found);
  return between(frame, sequence, transform, found);
}

/// Lowers the time to the newest of each frame below `top`.
TransformOutcome TransformBuffer::latest_common(FrameId frame, FrameId top,
                                                TransformLookup& found) const noexcept {
  for (; frame != top; frame = parent(frame)) {
    if (frames_[frame].is_static.load(std::memory_order_relaxed)) continue;
    Stamped newest;
    std::uint64_t sequence = 0;
    if (!read_newest(frame, newest, sequence)) {
      found.frame = frame;
      return TransformOutcome::overtaken;
    }
    found.time_ns = std::min(found.time_ns, newest.time_ns);
  }
  return TransformOutcome::done;
}

TransformOutcome TransformBuffer::up_to(FrameId frame, FrameId top, Transform& transform,
                                        TransformLookup& found) const noexcept {
  for (; frame != top; frame = parent(frame)) {
    Transform step;
    const TransformOutcome outcome = at(frame, step, found);
    if (outcome != TransformOutcome::done) return outcome;
    transform = compose(step, transform);
  }
  return TransformOutcome::done;
}

TransformLookup TransformBuffer::lookup(FrameId target, FrameId source, time_ns_t time_ns) const noexcept {
  TransformLookup found{.time_ns = time_ns};
  const FrameId top = common_ancestor(source, target);
  if (top == kNoFrame) {
    found.outcome = TransformOutcome::not_connected;
    return found;
  }
  if (time_ns == kLatestCommon) {
    found.time_ns = kForever;
    for (const FrameId frame : {source, target}) {
      found.outcome = latest_common(frame, top, found);
      if (found.outcome != TransformOutcome::done) return found;
    }
    if (found.time_ns == kForever) found.time_ns = kLatestCommon;  // all are static
  }
  Transform of_source;
  Transform of_target;
  found.outcome = up_to(source, top, of_source, found);
  if (found.outcome == TransformOutcome::done) found.outcome = up_to(target, top, of_target, found);
  if (found.outcome == TransformOutcome::done) found.transform = compose(inverse(of_target), of_source);
  return found;
}

}  // namespace mauve
