// SPDX-License-Identifier: LGPL-3.0-or-later
// SharedData: the newest value, guarded by a priority-inheritance mutex.
#pragma once

#include <memory>
#include <mutex>

#include "mauve_rt/base/pi_mutex.hpp"
#include "mauve_rt/base/trace.hpp"
#include "mauve_rt/data/logged_resource.hpp"
#include "mauve_rt/data/resource_kind.hpp"

namespace mauve {

/// One value; services `read` and `write`, any number of each.
///
/// | member                      | written by     | under  | hot |
/// |-----------------------------|----------------|--------|-----|
/// | value_, time_ns_, sequence_ | write service  | mutex_ | yes |
/// | floor_                      | who takes an end over | mutex_ | yes |
template <Described T>
class SharedData final : public LoggedResource<T, NewestResource> {
 public:
  SharedData() : LoggedResource<T, NewestResource>("shared_data", type_name<T>()) {
    this->offer(read);
    this->offer(write);
  }

  void set_name(const std::string& name) override {
    Resource::set_name(name);
    mutex_.set_trace_id(TraceNames::intern(name));
  }
  bool write_sample(std::span<const std::byte> message, time_ns_t time_ns) override {
    auto value = std::make_unique<T>();
    return CdrReader(message).get(*value) && write.write(*value, time_ns);
  }
  std::optional<NumberPlace> find_number(std::string_view path) const override {
    return mauve::find_number<T>(path);
  }
  bool read_number(const NumberPlace& place, double& number) noexcept override {
    const std::lock_guard lock(mutex_);
    if (sequence_ == 0) return false;
    number = place.of(&value_);
    return true;
  }

 private:
  class Read final : public ReadService<T> {
   public:
    explicit Read(SharedData& owner) : ReadService<T>("read"), owner_(owner) {}
    DataStatus read(T& value, time_ns_t& time_ns, ReaderState& reader) noexcept override {
      const std::lock_guard lock(owner_.mutex_);
      if (owner_.sequence_ == 0) return DataStatus::none;
      value = owner_.value_;
      time_ns = owner_.time_ns_;
      return reader.look(owner_.sequence_);
    }
    Sample<T> sample(const T& fallback, ReaderState& reader) noexcept override {
      const std::lock_guard lock(owner_.mutex_);
      if (owner_.sequence_ == 0) return {.value = fallback};
      return {.value = owner_.value_, .status = reader.look(owner_.sequence_), .time_ns = owner_.time_ns_};
    }

   private:
    SharedData& owner_;
  };
  class Write final : public WriteService<T> {
   public:
    explicit Write(SharedData& owner) : WriteService<T>("write"), owner_(owner) {}
    bool write(const T& value, time_ns_t time_ns) noexcept override {
      {
        const std::lock_guard lock(owner_.mutex_);
        if (!owner_.put(value, time_ns)) return true;
      }
      owner_.written(time_ns);
      return true;
    }
    TryWrite try_write(const T& value, time_ns_t time_ns) noexcept override {
      {
        if (!owner_.mutex_.try_lock()) return TryWrite::busy;
        const std::lock_guard lock(owner_.mutex_, std::adopt_lock);
        if (!owner_.put(value, time_ns)) return TryWrite::done;
      }
      owner_.written(time_ns);
      return TryWrite::done;
    }
    void raise_floor(time_ns_t instant_ns) noexcept override {
      const std::lock_guard lock(owner_.mutex_);
      owner_.floor_.raise(instant_ns);
    }

   private:
    SharedData& owner_;
  };

  PiMutex& writers() noexcept override { return mutex_; }

  DataStatus serialize(std::vector<std::byte>& message, time_ns_t& time_ns, std::uint64_t& seen) override {
    auto value = std::make_unique<T>();
    ReaderState reader{.seen = seen};
    const DataStatus status = read.read(*value, time_ns, reader);
    seen = reader.seen;
    CdrWriter(message).put(*value);
    return status;
  }

  bool put(const T& value, time_ns_t time_ns) noexcept {
    if (!floor_.admits(time_ns)) return false;
    value_ = value;
    time_ns_ = time_ns;
    ++sequence_;
    this->log(value, time_ns);
    return true;
  }

  PiMutex mutex_;
  WriteFloor floor_;
  T value_{};
  time_ns_t time_ns_{0};
  std::uint64_t sequence_{0};

 public:
  Read read{*this};
  Write write{*this};
};

/// As architectures name and make it. All functions [setup].
struct SharedDataKind {
  static ResourceKind describe() {
    return {.name = "shared_data",
            .parameters = {max_bytes_parameter()},
            .type = TypeNeed::data,
            .values = 3};  // its own, and one on its way in and one out
  }
  template <Described T>
  static std::unique_ptr<Resource> make(const ResourceParameters&) {
    return std::make_unique<SharedData<T>>();
  }
};

}  // namespace mauve
