// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/data/transform_tree.hpp"

#include <algorithm>
#include <functional>

#include "mauve_rt/base/seam/clocks.hpp"
#include "mauve_rt/base/time.hpp"
#include "mauve_rt/base/trace.hpp"

namespace mauve {

/// geometry_msgs/msg/TransformStamped, in the order of the wire.
struct StampedTransform {
  std::int32_t seconds{0};
  std::uint32_t nanoseconds{0};
  FrameName parent{};
  FrameName child{};
  Transform transform{};
};

}  // namespace mauve

MAUVE_TYPE(mauve::StampedTransform, "geometry_msgs/msg/TransformStamped", seconds, nanoseconds, parent, child,
           transform)

namespace mauve {

namespace {

constexpr const char* kTransformMessage = "tf2_msgs/msg/TFMessage";

/// What the real clock shows more than the monotonic one, of the shortest of three looks: the thread may lose its CPU within one.
time_ns_t realtime_ahead_ns() noexcept {
  time_ns_t ahead_ns = 0;
  time_ns_t shortest_ns = kForever;
  for (int look = 0; look < 3; ++look) {
    const time_ns_t before_ns = monotonic_now_ns();
    const time_ns_t real_ns = realtime_now_ns();
    const time_ns_t lasted_ns = monotonic_now_ns() - before_ns;
    if (lasted_ns >= shortest_ns) continue;
    shortest_ns = lasted_ns;
    ahead_ns = real_ns - before_ns - lasted_ns / 2;
  }
  return ahead_ns;
}

}  // namespace

TransformTree::TransformTree(std::uint32_t frames, std::uint32_t history)
    : Resource("transform_tree", kTransformMessage), buffer_(frames, history) {
  offer(set);
  offer(lookup);
}

void TransformTree::set_name(const std::string& name) {
  Resource::set_name(name);
  static_side_.set_name(name + ".static");
  buffer_.mutex().set_trace_id(TraceNames::intern(name));
}

void TransformTree::set_notifier(Notifier* notifier, Notifier* of_stops) noexcept {
  Resource::set_notifier(notifier, of_stops);
  static_side_.set_notifier(notifier, of_stops);
}

CallOutcome TransformTree::Set::call(const SetTransform::Request& request,
                                     SetTransform::Response& response) noexcept {
  const TransformOutcome outcome = owner_.buffer_.set(request.parent.view(), request.child.view(),
                                                      request.transform, request.time_ns, request.is_static);
  response.outcome = static_cast<std::uint8_t>(outcome);
  if (outcome == TransformOutcome::done) owner_.written(request.time_ns);
  return CallOutcome::answered;
}

CallOutcome TransformTree::Lookup::call(const LookupTransform::Request& request,
                                        LookupTransform::Response& response) noexcept {
  response = {};
  const TransformBuffer& buffer = owner_.buffer_;
  const std::optional<FrameId> target = buffer.find(request.target.view());
  const std::optional<FrameId> source = buffer.find(request.source.view());
  if (!target || !source) {
    response.outcome = static_cast<std::uint8_t>(TransformOutcome::unknown_frame);
    response.frame = target ? request.source : request.target;
    return CallOutcome::answered;
  }
  const TransformLookup found = buffer.lookup(*target, *source, request.time_ns);
  response.outcome = static_cast<std::uint8_t>(found.outcome);
  response.transform = found.transform;
  response.time_ns = found.time_ns;
  if (found.frame != kNoFrame) response.frame = buffer.name(found.frame);
  response.first_ns = found.first_ns;
  response.last_ns = found.last_ns;
  return CallOutcome::answered;
}

bool TransformTree::next_sample(std::vector<std::byte>& message, time_ns_t& time_ns, std::uint64_t& seen) {
  Changes changes = buffer_.changes_since(seen);
  std::erase_if(changes, [](const TransformBuffer::Change& change) { return change.is_static; });
  return put_transforms(changes, message, time_ns);
}

bool TransformTree::StaticSide::next_sample(std::vector<std::byte>& message, time_ns_t& time_ns,
                                            std::uint64_t& seen) {
  const auto is_static = [](const TransformBuffer::Change& change) { return change.is_static; };
  Changes changes = owner_.buffer_.changes_since(seen);
  if (std::none_of(changes.begin(), changes.end(), is_static)) return false;
  seen = 0;  // all of them: a listener that comes later gets the last message alone
  changes = owner_.buffer_.changes_since(seen);
  std::erase_if(changes, std::not_fn(is_static));
  return owner_.put_transforms(changes, message, time_ns);
}

bool TransformTree::put_transforms(const Changes& changes, std::vector<std::byte>& message,
                                   time_ns_t& time_ns) const {
  if (changes.empty()) return false;
  const time_ns_t ahead_ns = realtime_ahead_ns();
  CdrWriter writer(message);
  writer.put(static_cast<std::uint32_t>(changes.size()));
  time_ns = INT64_MIN;
  for (const TransformBuffer::Change& change : changes) {
    const time_ns_t stamp_ns = std::max(later_by(change.time_ns, ahead_ns), time_ns_t{0});
    writer.put(StampedTransform{.seconds = static_cast<std::int32_t>(stamp_ns / s_to_ns(1)),
                                .nanoseconds = static_cast<std::uint32_t>(stamp_ns % s_to_ns(1)),
                                .parent = buffer_.name(change.parent),
                                .child = buffer_.name(change.child),
                                .transform = change.transform});
    time_ns = std::max(time_ns, change.time_ns);
  }
  return true;
}

bool TransformTree::peek_sample(std::vector<std::byte>& message, time_ns_t& time_ns,
                                std::uint64_t& sequence) {
  sequence = 0;
  if (put_transforms(buffer_.changes_since(sequence), message, time_ns)) return true;
  CdrWriter(message).put(std::uint32_t{0});
  return false;
}

bool TransformTree::write_sample(std::span<const std::byte> message, time_ns_t time_ns) {
  return write_transforms(message, time_ns, false);
}

bool TransformTree::write_transforms(std::span<const std::byte> message, time_ns_t time_ns, bool is_static) {
  CdrReader reader(message);
  std::uint32_t count = 0;
  std::string refusal;
  bool is_one_set = false;
  bool is_whole = reader.get(count);
  const time_ns_t ahead_ns = realtime_ahead_ns();
  StampedTransform stamped;
  for (std::uint32_t i = 0; i < count; ++i) {
    is_whole = reader.get(stamped);
    if (!is_whole) break;
    const time_ns_t stamp_ns = s_to_ns(stamped.seconds) + stamped.nanoseconds;
    const TransformOutcome outcome = buffer_.set(stamped.parent.view(), stamped.child.view(),
                                                 stamped.transform, stamp_ns - ahead_ns, is_static);
    is_one_set = is_one_set || outcome == TransformOutcome::done;
    if (outcome != TransformOutcome::done && refusal.empty())
      refusal = "frame '" + std::string(stamped.child.view()) + "': " + std::string(to_string(outcome));
  }
  const bool is_taken = is_whole && refusal.empty();
  {
    const LockGuard lock(refusal_mutex_);
    refusal_ = refusal;
  }
  if (is_one_set) written(time_ns);
  return is_taken;
}

std::string TransformTree::why_refused(std::span<const std::byte> message) const {
  const LockGuard lock(refusal_mutex_);
  return refusal_.empty() ? Resource::why_refused(message) : refusal_;
}

ResourceKind TransformTreeKind::describe() {
  return {
      .name = "transform_tree",
      .parameters = {{.name = "frames",
                      .initial = std::int64_t{TransformTree::kDefaultFrames},
                      .description = "how many frames it has room for",
                      .minimum = 2,
                      .maximum = TransformBuffer::kMostFrames},
                     {.name = "history",
                      .initial = std::int64_t{TransformTree::kDefaultHistory},
                      .description = "how many transforms of each frame it keeps",
                      .minimum = 2,
                      .maximum = TransformBuffer::kMostHistory},
                     {.name = "static_topic",
                      .initial = std::string("/tf_static"),
                      .description =
                          "the topic of the static transforms, where it is bound to a topic; empty: none"}},
      .messages = {kTransformMessage}};
}

std::unique_ptr<Resource> TransformTreeKind::make(const std::string& /*message*/,
                                                  const ResourceParameters& given) {
  return std::make_unique<TransformTree>(static_cast<std::uint32_t>(get<std::int64_t>(given, "frames")),
                                         static_cast<std::uint32_t>(get<std::int64_t>(given, "history")));
}

}  // namespace mauve
