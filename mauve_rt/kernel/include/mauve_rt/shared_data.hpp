// SPDX-License-Identifier: LGPL-3.0-or-later
// SharedData: the newest value, guarded by a priority-inheritance mutex.
#pragma once

#include <memory>
#include <mutex>

#include "mauve_rt/pi_mutex.hpp"
#include "mauve_rt/resource.hpp"

namespace mauve {

/// One value; services `read` and `write`.
///
/// | member                   | written by     | under  | hot |
/// |--------------------------|----------------|--------|-----|
/// | value_, time_, sequence_ | write service  | mutex_ | yes |
template <Described T>
class SharedData final : public Resource {
 public:
  SharedData() : Resource("shared_data", type_name<T>()) {
    offer(read);
    offer(write);
  }

  void set_name(const std::string& name) override {
    Resource::set_name(name);
    mutex_.set_trace_id(TraceNames::intern(name));
  }
  bool is_serializable() const noexcept override { return true; }

  bool next_sample(std::vector<std::byte>& message, time_ns_t& time_ns, std::uint64_t& seen) override {
    auto value = std::make_unique<T>();
    if (copy(*value, time_ns, seen) != DataStatus::new_data) return false;
    CdrWriter(message).put(*value);
    return true;
  }
  bool peek_sample(std::vector<std::byte>& message, time_ns_t& time_ns, std::uint64_t& sequence) override {
    auto value = std::make_unique<T>();
    sequence = 0;
    const DataStatus status = copy(*value, time_ns, sequence);
    CdrWriter(message).put(*value);
    return status != DataStatus::none;
  }
  bool write_sample(std::span<const std::byte> message) override {
    auto value = std::make_unique<T>();
    return CdrReader(message).get(*value) && write.write(*value, monotonic_now_ns());
  }

 private:
  class Read final : public ReadService<T> {
   public:
    explicit Read(SharedData& owner) : ReadService<T>("read"), owner_(owner) {}
    DataStatus read(T& value, time_ns_t& time_ns, std::uint64_t& seen) noexcept override {
      return owner_.copy(value, time_ns, seen);
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
        owner_.value_ = value;
        owner_.time_ns_ = time_ns;
        ++owner_.sequence_;
      }
      owner_.notify();
      return true;
    }

   private:
    SharedData& owner_;
  };

  DataStatus copy(T& value, time_ns_t& time_ns, std::uint64_t& seen) noexcept {
    const std::lock_guard lock(mutex_);
    if (sequence_ == 0) return DataStatus::none;
    value = value_;
    time_ns = time_ns_;
    const bool is_new = seen != sequence_;
    seen = sequence_;
    return is_new ? DataStatus::new_data : DataStatus::old_data;
  }

  PiMutex mutex_;
  T value_{};
  time_ns_t time_ns_{0};
  std::uint64_t sequence_{0};

 public:
  Read read{*this};
  Write write{*this};
};

}  // namespace mauve
