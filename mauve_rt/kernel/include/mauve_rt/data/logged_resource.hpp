// SPDX-License-Identifier: LGPL-3.0-or-later
// A resource whose every write can be recorded.
#pragma once

#include "mauve_rt/base/biased_mutex.hpp"
#include "mauve_rt/data/capacities.hpp"
#include "mauve_rt/data/cdr.hpp"
#include "mauve_rt/data/resource.hpp"
#include "mauve_rt/data/write_log.hpp"

namespace mauve {

/// Puts a write log into a resource of values of type T, beside what it has from `Base`. `Lock`: what its writers hold.
template <Described T, typename Base, typename Lock = BiasedMutex>
class LoggedResource : public Base {
 public:
  /// [setup]
  LoggedResource(std::string kind, std::string type, Capacities capacities = {})
      : Base(std::move(kind), std::move(type)), limits_(std::move(capacities)) {}

  void begin_log(std::size_t bytes) override {
    std::size_t place_bytes = sizeof(WrittenValue<T>);
    if constexpr (kHasSequences<T>)
      place_bytes = sizeof(time_ns_t) + value_bytes(message_shape<T>(), limits_.capacities());
    log_.open(bytes, writers(), place_bytes,
              [this](WrittenValue<T>& place) { limits_.allocate(place.value); });
  }
  void end_log() override { log_.close(writers()); }
  bool next_write(std::vector<std::byte>& message, time_ns_t& time_ns) override {
    return log_.next([&](const WrittenValue<T>& written) {
      time_ns = written.time_ns;
      CdrWriter(message).put(written.value);
    });
  }
  std::size_t memory_bytes() const override {
    return values() * value_bytes(message_shape<T>(), limits_.capacities());
  }
  std::uint64_t lost_writes() const noexcept override { return log_.lost(); }
  std::uint64_t refused_values() const noexcept override {
    return limits_.refused() + Base::refused_values();
  }
  std::string why_refused_value() const override {
    const std::string of_size = limits_.refusal();
    const std::string of_frame = Base::why_refused_value();
    return of_size + (of_size.empty() || of_frame.empty() ? "" : "; ") + of_frame;
  }
  std::string why_refused(std::span<const std::byte> message) const override {
    const auto value = limits_.make();
    TooLong found;
    CdrReader reader(message);
    reader.explain(found);
    if (reader.get(*value)) return why_refused_whole(*value, message);
    if (found.size == 0) return Base::why_refused(message);
    const auto capacity = limits_.capacities().find(found.path);
    if (capacity == limits_.capacities().end())
      return found.path + " has " + std::to_string(found.size) + " elements, more than the struct holds";
    return overflow_text(found.path, capacity->second, found.size);
  }

 protected:
  /// Of the sequences of its values. [rt]
  SequenceLimits<T>& limits() MAUVE_RT { return limits_; }
  const SequenceLimits<T>& limits() const MAUVE_RT { return limits_; }
  /// Why a message was refused that is whole. [non-rt]
  virtual std::string why_refused_whole(const T& value, std::span<const std::byte> message) const {
    const std::string of_frame = this->frame_guard().why_refused(frame_ids(value));
    return of_frame.empty() ? Base::why_refused(message) : of_frame;
  }
  /// After a write that succeeded. [rt] Under the lock of the writers.
  void log(const T& value, time_ns_t time_ns) MAUVE_RT { log_.put(value, time_ns); }

 private:
  /// The lock that every writer holds. [rt]
  virtual Lock& writers() MAUVE_RT = 0;
  /// How many values it has memory for, without the log. [non-rt]
  virtual std::size_t values() const = 0;

  SequenceLimits<T> limits_;
  WriteLog<WrittenValue<T>> log_;  // under writers()
};

}  // namespace mauve
