// SPDX-License-Identifier: LGPL-3.0-or-later
// TransformedReadPort: reads values of any frame as values of its own frame.
#pragma once

#include <string>
#include <string_view>
#include <utility>

#include "mauve_rt/base/rt.hpp"
#include "mauve_rt/data/frames.hpp"
#include "mauve_rt/data/port.hpp"
#include "mauve_rt/data/transform_tree.hpp"
#include "mauve_rt/data/transformed_values.hpp"

namespace mauve {

/// What a read found.
template <typename T>
struct TransformedSample {
  T value{};  // in the port's frame; the type's default unless the outcome is done
  DataStatus status{DataStatus::none};
  time_ns_t time_ns{0};  // of the writer, CLOCK_MONOTONIC
  TransformOutcome outcome{TransformOutcome::done};
  FrameName frame{};  // that is unknown, or has no transform at that time

  /// Whether the value is there, in the port's frame. [rt]
  explicit operator bool() const MAUVE_RT {
    return status != DataStatus::none && outcome == TransformOutcome::done;
  }
  bool is_new() const MAUVE_RT { return status == DataStatus::new_data; }
};

/// How values are transformed.
struct TransformOptions {
  std::string_view to;    // the frame of what it yields
  bool is_latest{false};  // by the latest transform that there is, in the place of that at the value's time
};

/// Transforms poses, points, vectors, rotations, twists and wrenches (transformed_values.hpp) to one frame: those that a
/// TransformedReadPort reads, or parts of other values, as the pose in the goal of an action.
class ToFrame {
 public:
  ToFrame(CallPort<CallOf<LookupTransform>>& lookup, const TransformOptions& options)
      : lookup_(lookup), to_(options.to), is_latest_(options.is_latest) {}

  /// By the transform at the time of the sample. What has no header, or an empty frame_id, is in the frame of `declared`.
  /// [rt] as far as the service is that the port is connected to.
  template <typename T>
  TransformedSample<T> transform(const Sample<T>& sample, const Frames* declared = nullptr) const {
    TransformedSample<T> found{.status = sample.status, .time_ns = sample.time_ns};
    if (sample.status == DataStatus::none) return found;
    const FrameName source = source_of(sample.value, declared);
    if (source == to_) {
      found.value = sample.value;
      return found;
    }
    LookupTransform::Response response;
    const LookupTransform::Request request{
        .target = to_, .source = source, .time_ns = is_latest_ ? kLatestCommon : sample.time_ns};
    const CallOutcome called = lookup_(request, response);
    found.outcome = called == CallOutcome::answered ? response.result() : TransformOutcome::not_connected;
    found.frame = response.frame;
    if (found.outcome != TransformOutcome::done) return found;
    found.value = sample.value;
    transform_value(response.transform, found.value);
    if constexpr (HasFrame<T>) found.value.header.frame_id.assign(to_.view());
    return found;
  }

 private:
  template <typename T>
  static FrameName source_of(const T& value, const Frames* declared) MAUVE_RT {
    if constexpr (HasFrame<T>) {
      if (const std::string_view given = value.header.frame_id.view(); !given.empty())
        return FrameName(given);
    }
    return declared != nullptr ? FrameName(declared->frame) : FrameName();
  }

  CallPort<CallOf<LookupTransform>>& lookup_;
  FrameName to_;
  bool is_latest_;
};

/// Reads a pose, point, vector, rotation, twist or wrench (transformed_values.hpp), and looks the transform from its frame to the
/// port's own up, at the time at which the value was written. A shell has it beside its read port and its call port:
///
///   struct FollowShell : mauve::Shell {
///     mauve::CallPort<mauve::CallOf<mauve::LookupTransform>>& lookup = call_port<mauve::LookupTransform>("lookup");
///     mauve::TransformedReadPort<PoseStamped> goal{read_port<PoseStamped>("goal"), lookup, {.to = "map"}};
///   };
template <typename T>
class TransformedReadPort {
 public:
  using Options = TransformOptions;

  /// What has no header, or an empty frame_id, is in the frame that `port` declares: in_frame(), or the architecture file. [setup]
  TransformedReadPort(ReadPort<T>& port, CallPort<CallOf<LookupTransform>>& lookup, const Options& options)
      : port_(port), to_frame_(lookup, options) {}

  /// [rt] as far as the services are that both ports are connected to.
  TransformedSample<T> read() { return to_frame_.transform(port_.read(), port_.frames()); }

 private:
  ReadPort<T>& port_;
  ToFrame to_frame_;
};

}  // namespace mauve
