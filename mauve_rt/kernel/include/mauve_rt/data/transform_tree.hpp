// SPDX-License-Identifier: LGPL-3.0-or-later
// TransformTree: where the frames of a robot are, as a resource with the calls `set` and `lookup`.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "mauve_rt/base/seam/mutex.hpp"
#include "mauve_rt/data/call_type.hpp"
#include "mauve_rt/data/resource.hpp"
#include "mauve_rt/data/resource_kind.hpp"
#include "mauve_rt/data/transform_buffer.hpp"

namespace mauve {

/// Adds the transform of a frame to its parent: TransformBuffer::set().
struct SetTransform {
  struct Request {
    FrameName parent{};
    FrameName child{};
    Transform transform{};
    time_ns_t time_ns{0};
    bool is_static{false};
  };
  struct Response {
    std::uint8_t outcome{0};

    /// [rt]
    TransformOutcome result() const MAUVE_RT { return static_cast<TransformOutcome>(outcome); }
  };
};

/// Transforms a point of `source` to `target`: TransformBuffer::lookup().
struct LookupTransform {
  struct Request {
    FrameName target{};
    FrameName source{};
    time_ns_t time_ns{kLatestCommon};
  };
  struct Response {
    std::uint8_t outcome{0};
    Transform transform{};
    time_ns_t time_ns{0};
    FrameName frame{};  // that is unknown, or has no transform at the time
    time_ns_t first_ns{0};
    time_ns_t last_ns{0};

    /// [rt]
    TransformOutcome result() const MAUVE_RT { return static_cast<TransformOutcome>(outcome); }
  };
};

}  // namespace mauve

MAUVE_TYPE(mauve::SetTransform::Request, "mauve_msgs/srv/SetTransform_Request", parent, child, transform,
           time_ns, is_static)
MAUVE_TYPE(mauve::SetTransform::Response, "mauve_msgs/srv/SetTransform_Response", outcome)
MAUVE_CALL_TYPE(mauve::SetTransform, "mauve_msgs/srv/SetTransform")
MAUVE_TYPE(mauve::LookupTransform::Request, "mauve_msgs/srv/LookupTransform_Request", target, source, time_ns)
MAUVE_TYPE(mauve::LookupTransform::Response, "mauve_msgs/srv/LookupTransform_Response", outcome, transform,
           time_ns, frame, first_ns, last_ns)
MAUVE_CALL_TYPE(mauve::LookupTransform, "mauve_msgs/srv/LookupTransform")

namespace mauve {

/// The calls `set` and `lookup`, any number of each. Lookups never wait; sets among themselves have a lock with priority
/// inheritance. On its topic it is a tf2_msgs/msg/TFMessage, whose stamps are of the real clock.
///
/// | member      | written by       | read by      | under          |
/// | ----------- | ---------------- | ------------ | -------------- |
/// | buffer_     | set, topics      | lookup       | as it says     |
/// | refusal_    | write_sample()   | why_refused() | refusal_mutex_ |
class TransformTree final : public Resource {
 public:
  static constexpr std::uint32_t kDefaultFrames = 64;
  static constexpr std::uint32_t kDefaultHistory = 256;

  /// As TransformBuffer. [setup] Throws Error (out_of_range).
  explicit TransformTree(std::uint32_t frames = kDefaultFrames, std::uint32_t history = kDefaultHistory);
  void set_name(const std::string& name) override;
  void set_notifier(Notifier* notifier, Notifier* of_stops) noexcept override;
  /// All static transforms, as one message whenever one of them changes; a message that arrives sets them.
  Resource* static_side() noexcept override { return &static_side_; }

  /// For lookups by FrameId, and for programs. [rt]
  const TransformBuffer& buffer() const MAUVE_RT { return buffer_; }
  std::size_t memory_bytes() const override { return buffer_.memory_bytes(); }

  bool is_serializable() const noexcept override { return true; }
  /// The newest transform of each frame that was set since, without the static ones: one message.
  bool next_sample(std::vector<std::byte>& message, time_ns_t& time_ns, std::uint64_t& seen) override;
  /// The newest transform of each frame.
  bool peek_sample(std::vector<std::byte>& message, time_ns_t& time_ns, std::uint64_t& sequence) override;
  /// Sets each transform of the message, as no static one; false when one of them was refused, or the message is malformed.
  bool write_sample(std::span<const std::byte> message, time_ns_t time_ns) override;
  std::string why_refused(std::span<const std::byte> message) const override;

 private:
  class Set final : public RequestService<SetTransform> {
   public:
    explicit Set(TransformTree& owner) : RequestService("set"), owner_(owner) {}
    /// [rt]
    CallOutcome call(const SetTransform::Request& request,
                     SetTransform::Response& response) noexcept override;

   private:
    TransformTree& owner_;
  };
  class Lookup final : public RequestService<LookupTransform> {
   public:
    explicit Lookup(const TransformTree& owner) : RequestService("lookup"), owner_(owner) {}
    /// [rt]
    CallOutcome call(const LookupTransform::Request& request,
                     LookupTransform::Response& response) noexcept override;

   private:
    const TransformTree& owner_;
  };

  class StaticSide final : public Resource {
   public:
    explicit StaticSide(TransformTree& owner) : Resource(owner.kind(), owner.type()), owner_(owner) {}
    bool is_serializable() const noexcept override { return true; }
    bool next_sample(std::vector<std::byte>& message, time_ns_t& time_ns, std::uint64_t& seen) override;
    bool write_sample(std::span<const std::byte> message, time_ns_t time_ns) override {
      return owner_.write_transforms(message, time_ns, true);
    }
    std::string why_refused(std::span<const std::byte> message) const override {
      return owner_.why_refused(message);
    }

   private:
    TransformTree& owner_;
  };

  using Changes = std::vector<TransformBuffer::Change>;
  bool put_transforms(const Changes& changes, std::vector<std::byte>& message, time_ns_t& time_ns) const;
  bool write_transforms(std::span<const std::byte> message, time_ns_t time_ns, bool is_static);

  TransformBuffer buffer_;
  StaticSide static_side_{*this};
  mutable Mutex refusal_mutex_;
  std::string refusal_ MAUVE_GUARDED_BY(refusal_mutex_);

 public:
  Set set{*this};
  Lookup lookup{*this};
};

/// As architectures name and make it. All functions [setup].
struct TransformTreeKind {
  static ResourceKind describe();
  static std::unique_ptr<Resource> make(const std::string& message, const ResourceParameters& given);
};

}  // namespace mauve
