// SPDX-License-Identifier: LGPL-3.0-or-later
// LatestValue: the newest value of one writer, for readers that neither block nor fail.
#pragma once

#include <memory>
#include <mutex>
#include <string>

#include "mauve_rt/base/error.hpp"
#include "mauve_rt/base/pi_mutex.hpp"
#include "mauve_rt/base/trace.hpp"
#include "mauve_rt/data/latest_register.hpp"
#include "mauve_rt/data/logged_resource.hpp"
#include "mauve_rt/data/resource_kind.hpp"

namespace mauve {

inline constexpr std::uint32_t kDefaultMaxReaders = 14;
inline constexpr std::uint32_t kMostReaders = 1000;
/// Readers whose component was removed while a state of it hung keep their place until that ends.
inline constexpr std::uint32_t kLeftBehind = 2;

/// One value of a trivially copyable type; services `read` (at most max_readers ports, wait-free) and `write`
/// (one port, or an incoming topic).
///
/// | member      | used by                                 | under                                             |
/// |-------------|-----------------------------------------|---------------------------------------------------|
/// | register_   | readers, each with a ReaderState        | wait-free                                         |
/// | register_   | the writer; the watchdog for its zeros  | write_mutex_, free but for a writer that hangs    |
/// | floor_      | the writer; who takes its end over      | write_mutex_                                      |
/// | register_   | the serialized face, and one number for rules, as one more reader | serial_mutex_           |
template <Described T>
class LatestValue final : public LoggedResource<T, NewestResource> {
 public:
  /// Throws Error (out_of_range). [setup]
  explicit LatestValue(std::uint32_t max_readers = kDefaultMaxReaders)
      : LoggedResource<T, NewestResource>("latest_value", type_name<T>()),
        max_readers_(checked(max_readers)),
        register_(max_readers + 2 + kLeftBehind) {
    this->offer(read);
    this->offer(write);
  }

  void set_name(const std::string& name) override {
    Resource::set_name(name);
    write_mutex_.set_trace_id(TraceNames::intern(name));
    serial_mutex_.set_trace_id(TraceNames::intern(name));
  }
  /// [rt]
  std::uint32_t max_readers() const MAUVE_RT { return max_readers_; }
  bool write_sample(std::span<const std::byte> message, time_ns_t time_ns) override {
    auto value = std::make_unique<T>();
    return CdrReader(message).get(*value) && write.write(*value, time_ns);
  }
  std::optional<NumberPlace> find_number(std::string_view path) const override {
    return mauve::find_number<T>(path);
  }
  bool read_number(const NumberPlace& place, double& number) noexcept override {
    const std::lock_guard lock(serial_mutex_);
    std::uint32_t held = 0;
    const T* const newest = register_.look(held);
    if (newest != nullptr) number = place.of(newest);
    register_.let_go(held);
    return newest != nullptr;
  }

 private:
  class Read final : public ReadService<T> {
   public:
    explicit Read(LatestValue& owner) : ReadService<T>("read"), owner_(owner) {}
    std::uint32_t max_ports() const noexcept override { return owner_.max_readers_; }
    DataStatus read(T& value, time_ns_t& time_ns, ReaderState& reader) noexcept override {
      return owner_.register_.read(value, time_ns, reader);
    }
    Sample<T> sample(const T& fallback, ReaderState& reader) noexcept override {
      return owner_.register_.sample(fallback, reader);
    }
    LatestRegister<T>* latest() noexcept override { return &owner_.register_; }
    void let_go(ReaderState& reader) noexcept override {
      owner_.register_.let_go(reader.held);
      reader = {};
    }

   private:
    LatestValue& owner_;
  };
  class Write final : public WriteService<T> {
   public:
    explicit Write(LatestValue& owner) : WriteService<T>("write"), owner_(owner) {}
    std::uint32_t max_ports() const noexcept override { return 1; }
    bool write(const T& value, time_ns_t time_ns) noexcept override {
      {
        const std::lock_guard lock(owner_.write_mutex_);
        if (!owner_.floor_.admits(time_ns)) return true;
        if (!owner_.register_.write(value, time_ns)) return false;
        owner_.log(value, time_ns);
      }
      owner_.written(time_ns);
      return true;
    }
    TryWrite try_write(const T& value, time_ns_t time_ns) noexcept override {
      {
        if (!owner_.write_mutex_.try_lock()) return TryWrite::busy;
        const std::lock_guard lock(owner_.write_mutex_, std::adopt_lock);
        if (!owner_.floor_.admits(time_ns) || !owner_.register_.write(value, time_ns)) return TryWrite::done;
        owner_.log(value, time_ns);
      }
      owner_.written(time_ns);
      return TryWrite::done;
    }
    void raise_floor(time_ns_t instant_ns) noexcept override {
      const std::lock_guard lock(owner_.write_mutex_);
      owner_.floor_.raise(instant_ns);
    }

   private:
    LatestValue& owner_;
  };

  static std::uint32_t checked(std::uint32_t max_readers) {
    if (max_readers >= 1 && max_readers <= kMostReaders) return max_readers;
    throw Error(ErrorCode::out_of_range, "a latest_value cannot have that many readers",
                {.element = "max_readers",
                 .expected = "1 to " + std::to_string(kMostReaders),
                 .found = std::to_string(max_readers)});
  }
  PiMutex& writers() noexcept override { return write_mutex_; }

  DataStatus serialize(std::vector<std::byte>& message, time_ns_t& time_ns, std::uint64_t& seen) override {
    auto value = std::make_unique<T>();
    ReaderState reader{.seen = seen};
    DataStatus status = DataStatus::none;
    {
      const std::lock_guard lock(serial_mutex_);
      status = read.read(*value, time_ns, reader);
      register_.let_go(reader.held);
    }
    seen = reader.seen;
    CdrWriter(message).put(*value);
    return status;
  }

  std::uint32_t max_readers_;
  LatestRegister<T>
      register_;  // more readers: the serialized face, a port that is previewed, those left behind
  PiMutex write_mutex_;
  WriteFloor floor_;
  PiMutex serial_mutex_;

 public:
  Read read{*this};
  Write write{*this};
};

/// As architectures name and make it. All functions [setup].
struct LatestValueKind {
  static ResourceKind describe() {
    return {.name = "latest_value",
            .parameters = {{.name = "max_readers",
                            .initial = std::int64_t{kDefaultMaxReaders},
                            .description = "how many ports may read it",
                            .minimum = 1,
                            .maximum = kMostReaders,
                            .is_value_count = true,
                            .is_reader_limit = true}},
            .type = TypeNeed::data,
            .values = 3,
            .has_one_writer = true};
  }
  template <Described T>
    requires std::is_trivially_copyable_v<T>
  static std::unique_ptr<Resource> make(const ResourceParameters& given) {
    return std::make_unique<LatestValue<T>>(
        static_cast<std::uint32_t>(get<std::int64_t>(given, "max_readers")));
  }
};

}  // namespace mauve
