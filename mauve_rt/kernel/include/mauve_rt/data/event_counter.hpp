// SPDX-License-Identifier: LGPL-3.0-or-later
// EventCounter: something that happens, how often it did and when it did last.
#pragma once

#include <memory>

#include "mauve_rt/base/pi_mutex.hpp"
#include "mauve_rt/base/rt.hpp"
#include "mauve_rt/base/seam/mutex.hpp"
#include "mauve_rt/data/logged_resource.hpp"
#include "mauve_rt/data/resource_kind.hpp"

namespace mauve {

/// How often an event was raised.
struct EventCount {
  std::uint64_t data{};
};

}  // namespace mauve

MAUVE_TYPE(mauve::EventCount, "std_msgs/msg/UInt64", data)

namespace mauve {

/// What an event says on its topic.
enum class EventMessage : std::uint8_t {
  count,  // std_msgs/msg/UInt64: how often it was raised; says it once for several raises at a time
  empty,  // std_msgs/msg/Empty, for every raise
  truth,  // std_msgs/msg/Bool, true for every raise; a false one that arrives raises nothing
};

/// The type's name. [rt]
const char* type_of(EventMessage said) MAUVE_RT;

/// Services `raise` (event) and `read` (the count, with the time of the last raise), any number of each.
/// Raises between two reads are not lost: the count says how many there were.
///
/// | member            | written by    | under  | hot |
/// |-------------------|---------------|--------|-----|
/// | count_, time_ns_  | raise service | mutex_ | yes |
class EventCounter final : public LoggedResource<EventCount, Resource, PiMutex> {
 public:
  explicit EventCounter(EventMessage said = EventMessage::count);
  void set_name(const std::string& name) override;

  bool is_serializable() const noexcept override { return true; }
  /// What is said of raises not told of yet. [non-rt]
  bool next_sample(std::vector<std::byte>& message, time_ns_t& time_ns, std::uint64_t& seen) override;
  bool peek_sample(std::vector<std::byte>& message, time_ns_t& time_ns, std::uint64_t& sequence) override;
  /// A message that arrives raises the event once, whatever count it carries; false when malformed. [non-rt]
  bool write_sample(std::span<const std::byte> message, time_ns_t time_ns) override;

 private:
  class Read final : public ReadService<EventCount> {
   public:
    explicit Read(EventCounter& owner) : ReadService("read"), owner_(owner) {}
    DataStatus read(EventCount& value, time_ns_t& time_ns, ReaderState& reader) noexcept override;

   private:
    EventCounter& owner_;
  };
  class Raise final : public EventService {
   public:
    explicit Raise(EventCounter& owner) : EventService("raise"), owner_(owner) {}
    void raise(time_ns_t time_ns) noexcept override;

   private:
    EventCounter& owner_;
  };

  PiMutex& writers() noexcept override { return mutex_; }
  std::size_t values() const override { return 1; }

  EventMessage said_;
  PiMutex mutex_;
  EventCount count_ MAUVE_GUARDED_BY(mutex_);
  time_ns_t time_ns_ MAUVE_GUARDED_BY(mutex_){0};

 public:
  Read read{*this};
  Raise raise{*this};
};

/// As architectures name and make it. All functions [setup].
struct EventKind {
  static ResourceKind describe();
  static std::unique_ptr<Resource> make(const std::string& message, const ResourceParameters&);
};

}  // namespace mauve
