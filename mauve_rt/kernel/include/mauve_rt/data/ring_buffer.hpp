// SPDX-License-Identifier: LGPL-3.0-or-later
// RingBuffer: a queue of bounded length; a read removes, so each element goes to one reader.
#pragma once

#include <memory>
#include <mutex>
#include <vector>

#include "mauve_rt/base/error.hpp"
#include "mauve_rt/base/pi_mutex.hpp"
#include "mauve_rt/base/trace.hpp"
#include "mauve_rt/data/logged_resource.hpp"
#include "mauve_rt/data/resource_kind.hpp"

namespace mauve {

/// What a full ring does with one more element.
enum class WhenFull : std::uint8_t { refuse, overwrite };

/// A bounded queue; services `read` (removes the oldest) and `write`. A reader that finds it empty gets status
/// old if it ever got an element, and no value.
///
/// | member                                   | written by           | under  | hot |
/// |------------------------------------------|----------------------|--------|-----|
/// | places_, first_, size_, sequence_, lost_ | read, write services | mutex_ | yes |
template <Described T>
class RingBuffer final : public LoggedResource<T, Resource> {
 public:
  /// Throws Error (invalid_argument) without a capacity. [setup]
  explicit RingBuffer(std::size_t capacity, WhenFull when_full = WhenFull::refuse)
      : LoggedResource<T, Resource>("ring_buffer", type_name<T>()), places_(capacity), when_full_(when_full) {
    if (capacity == 0) {
      throw Error(ErrorCode::invalid_argument, "a ring_buffer needs a capacity",
                  {.element = "capacity", .expected = "> 0", .found = "0", .remedy = "add capacity: N"});
    }
    this->offer(read);
    this->offer(write);
  }

  void set_name(const std::string& name) override {
    Resource::set_name(name);
    mutex_.set_trace_id(TraceNames::intern(name));
  }
  bool is_serializable() const noexcept override { return true; }
  /// [rt]
  std::size_t capacity() const MAUVE_RT { return places_.size(); }
  /// Elements refused or overwritten since the start. [rt]
  std::uint64_t lost() MAUVE_RT {
    const std::lock_guard lock(mutex_);
    return lost_;
  }

  bool next_sample(std::vector<std::byte>& message, time_ns_t& time_ns, std::uint64_t& seen) override {
    auto value = std::make_unique<T>();
    ReaderState reader{.seen = seen};
    if (pop(*value, time_ns, reader) != DataStatus::new_data) return false;
    seen = reader.seen;
    CdrWriter(message).put(*value);
    return true;
  }
  /// The element written last; a reader may have removed it.
  bool peek_sample(std::vector<std::byte>& message, time_ns_t& time_ns, std::uint64_t& sequence) override {
    auto value = std::make_unique<T>();
    {
      const std::lock_guard lock(mutex_);
      const Place& newest = places_[(first_ + size_ + places_.size() - 1) % places_.size()];
      *value = newest.value;
      time_ns = newest.time_ns;
      sequence = sequence_;
    }
    CdrWriter(message).put(*value);
    return sequence != 0;
  }
  bool write_sample(std::span<const std::byte> message, time_ns_t time_ns) override {
    auto value = std::make_unique<T>();
    return CdrReader(message).get(*value) && write.write(*value, time_ns);
  }
  std::string why_refused(std::span<const std::byte> message) const override {
    const auto value = std::make_unique<T>();
    return CdrReader(message).get(*value)
               ? "the ring_buffer was full: " + std::to_string(capacity()) + " elements"
               : Resource::why_refused(message);
  }

 private:
  struct Place {
    T value{};
    time_ns_t time_ns{0};
    std::uint64_t sequence{0};
  };
  class Read final : public ReadService<T> {
   public:
    explicit Read(RingBuffer& owner) : ReadService<T>("read"), owner_(owner) {}
    DataStatus read(T& value, time_ns_t& time_ns, ReaderState& reader) noexcept override {
      return owner_.pop(value, time_ns, reader);
    }

   private:
    RingBuffer& owner_;
  };
  class Write final : public WriteService<T> {
   public:
    explicit Write(RingBuffer& owner) : WriteService<T>("write"), owner_(owner) {}
    bool write(const T& value, time_ns_t time_ns) noexcept override { return owner_.push(value, time_ns); }
    TryWrite try_write(const T& value, time_ns_t time_ns) noexcept override {
      return owner_.try_push(value, time_ns);
    }
    void raise_floor(time_ns_t instant_ns) noexcept override {
      const std::lock_guard lock(owner_.mutex_);
      owner_.floor_.raise(instant_ns);
    }

   private:
    RingBuffer& owner_;
  };

  PiMutex& writers() noexcept override { return mutex_; }

  DataStatus pop(T& value, time_ns_t& time_ns, ReaderState& reader) noexcept {
    const std::lock_guard lock(mutex_);
    if (size_ == 0) {
      if (reader.seen == 0) return DataStatus::none;
      time_ns = reader.time_ns;
      return DataStatus::old_data;
    }
    const Place& place = places_[first_];
    value = place.value;
    time_ns = place.time_ns;
    first_ = (first_ + 1) % places_.size();
    --size_;
    reader.seen = place.sequence;
    return DataStatus::new_data;
  }
  bool push(const T& value, time_ns_t time_ns) noexcept {
    {
      const std::lock_guard lock(mutex_);
      if (!floor_.admits(time_ns)) return true;
      if (!put(value, time_ns)) return false;
    }
    this->written(time_ns);
    return true;
  }
  TryWrite try_push(const T& value, time_ns_t time_ns) noexcept {
    {
      if (!mutex_.try_lock()) return TryWrite::busy;
      const std::lock_guard lock(mutex_, std::adopt_lock);
      if (!floor_.admits(time_ns) || !put(value, time_ns)) return TryWrite::done;
    }
    this->written(time_ns);
    return TryWrite::done;
  }
  bool put(const T& value, time_ns_t time_ns) noexcept {
    if (size_ == places_.size()) {
      ++lost_;
      if (when_full_ == WhenFull::refuse) return false;
      first_ = (first_ + 1) % places_.size();
      --size_;
    }
    Place& place = places_[(first_ + size_) % places_.size()];
    place.value = value;
    place.time_ns = time_ns;
    place.sequence = ++sequence_;
    ++size_;
    this->log(value, time_ns);
    return true;
  }

  PiMutex mutex_;
  WriteFloor floor_;
  std::vector<Place> places_;
  std::size_t first_{0};
  std::size_t size_{0};
  std::uint64_t sequence_{0};
  std::uint64_t lost_{0};
  WhenFull when_full_;

 public:
  Read read{*this};
  Write write{*this};
};

/// As architectures name and make it. All functions [setup].
struct RingBufferKind {
  static ResourceKind describe() {
    return {
        .name = "ring_buffer",
        .parameters = {{.name = "capacity",
                        .initial = std::int64_t{1},
                        .description = "how many elements the ring_buffer holds",
                        .minimum = 1,
                        .maximum = 1'000'000,
                        .is_required = true,
                        .is_value_count = true},
                       {.name = "overwrite",
                        .initial = false,
                        .description = "whether a full one drops its oldest element rather than the new one"},
                       max_bytes_parameter()},
        .type = TypeNeed::data};
  }
  template <Described T>
  static std::unique_ptr<Resource> make(const ResourceParameters& given) {
    return std::make_unique<RingBuffer<T>>(
        static_cast<std::size_t>(get<std::int64_t>(given, "capacity")),
        get<bool>(given, "overwrite") ? WhenFull::overwrite : WhenFull::refuse);
  }
};

}  // namespace mauve
