// SPDX-License-Identifier: LGPL-3.0-or-later
#include "serialized.hpp"

namespace mauve::bindings {

namespace {

/// One serialized message in memory that was set aside for the longest.
struct Place {
  Message message;
  time_ns_t time_ns{0};

  void set(std::span<const std::byte> bytes, time_ns_t time) MAUVE_RT {
    MAUVE_RT_TRUSTED(
        message.assign(bytes.begin(), bytes.end()));  // within what was reserved: allocates nothing
    time_ns = time;
  }
};

/// What shared data and rings of serialized messages have in common: services and serialized face.
class SerializedResource : public Resource {
 public:
  SerializedResource(std::string kind, SerializedOptions options)
      : Resource(std::move(kind), options.type),
        options_(std::move(options)),
        max_bytes_(static_cast<std::size_t>(get<std::int64_t>(options_.parameters, "max_bytes"))) {
    offer(read_);
    offer(write_);
  }

  void set_name(const std::string& name) override {
    Resource::set_name(name);
    mutex_.set_trace_id(TraceNames::intern(name));
  }
  bool is_serializable() const noexcept override { return true; }
  bool next_sample(Message& message, time_ns_t& time_ns, std::uint64_t& seen) override {
    return read(message, time_ns, seen) == DataStatus::new_data;
  }
  bool peek_sample(Message& message, time_ns_t& time_ns, std::uint64_t& sequence) override {
    message.reserve(max_bytes_);  // not under the lock
    {
      const std::lock_guard lock(mutex_);
      sequence = look(message, time_ns);
    }
    if (sequence == 0) message = options_.zeros.front();
    return sequence != 0;
  }
  void begin_log(std::size_t bytes) override {
    log_.open(bytes, mutex_, max_bytes_, [this](Place& place) { place = touched_place(); });
  }
  void end_log() override { log_.close(mutex_); }
  bool next_write(Message& message, time_ns_t& time_ns) override {
    return log_.next([&](const Place& written) {
      message.assign(written.message.begin(), written.message.end());
      time_ns = written.time_ns;
    });
  }
  std::uint64_t lost_writes() const noexcept override { return log_.lost(); }
  bool write_sample(std::span<const std::byte> message, time_ns_t time_ns) override {
    return message.size() >= kCdrHeader.size() && write(message, time_ns);
  }
  std::string why_refused(std::span<const std::byte> message) const override {
    const std::string found = "it has " + std::to_string(message.size()) + " bytes";
    if (message.size() < kCdrHeader.size()) return found + ", which are no message";
    if (message.size() > max_bytes_)
      return found + ", more than the " + std::to_string(max_bytes_) + " declared";
    std::string of_frame = frame_guard().why_refused(ids_of(message));
    if (!of_frame.empty()) return of_frame;
    return "the " + kind() + " was full";
  }

 protected:
  virtual DataStatus take_out(Message& message, time_ns_t& time_ns, std::uint64_t& seen) noexcept = 0;
  virtual bool put_in(std::span<const std::byte> message, time_ns_t time_ns) MAUVE_RT = 0;
  /// Copies the message written last; returns how many were written.
  virtual std::uint64_t look(Message& message, time_ns_t& time_ns) const noexcept = 0;

  DataStatus read(Message& message, time_ns_t& time_ns, std::uint64_t& seen) {
    message.reserve(max_bytes_);  // not under the lock
    const std::lock_guard lock(mutex_);
    return take_out(message, time_ns, seen);
  }
  bool write(std::span<const std::byte> message, time_ns_t time_ns) noexcept {
    if (message.size() > max_bytes_ || !frame_guard().admits(ids_of(message))) return false;
    {
      const std::lock_guard lock(mutex_);
      if (!floor_.admits(time_ns)) return true;
      if (!put_in(message, time_ns)) return false;
      log_.put(message, time_ns);
    }
    written(time_ns);
    return true;
  }
  TryWrite try_write(std::span<const std::byte> message, time_ns_t time_ns) noexcept {
    if (message.size() > max_bytes_) return TryWrite::done;
    {
      if (!mutex_.try_lock()) return TryWrite::busy;
      const LockGuard lock(mutex_, std::adopt_lock);
      if (!floor_.admits(time_ns) || !put_in(message, time_ns)) return TryWrite::done;
      log_.put(message, time_ns);
    }
    written(time_ns);
    return TryWrite::done;
  }
  Place place() const {
    Place made;
    made.message.reserve(max_bytes_);
    return made;
  }
  /// A copy of it has all its memory, touched.
  Place touched_place() const {
    Place made;
    made.message.resize(max_bytes_);
    return made;
  }
  const SerializedOptions& options() const noexcept { return options_; }

 private:
  class Read final : public SerializedReadService {
   public:
    explicit Read(SerializedResource& owner) : SerializedReadService(owner.type()), owner_(owner) {}
    DataStatus read(Message& message, time_ns_t& time_ns, std::uint64_t& seen) override {
      return owner_.read(message, time_ns, seen);
    }

   private:
    SerializedResource& owner_;
  };
  class Write final : public SerializedWriteService {
   public:
    explicit Write(SerializedResource& owner) : SerializedWriteService(owner.type()), owner_(owner) {}
    bool write(std::span<const std::byte> message, time_ns_t time_ns) noexcept override {
      return owner_.write(message, time_ns);
    }
    TryWrite try_write(std::span<const std::byte> message, time_ns_t time_ns) noexcept override {
      return owner_.try_write(message, time_ns);
    }
    void raise_floor(time_ns_t instant_ns) noexcept override {
      const std::lock_guard lock(owner_.mutex_);
      owner_.floor_.raise(instant_ns);
    }
    void forget_floor() noexcept override { owner_.floor_.forget(); }

   private:
    SerializedResource& owner_;
  };

  FrameIds ids_of(std::span<const std::byte> message) const noexcept {
    return options_.frame_ids == 0 ? FrameIds{}
                                   : mauve::frame_ids(message.data(), message.size(), options_.frame_ids > 1);
  }

  const SerializedOptions options_;
  const std::size_t max_bytes_;  // of one message
  PiMutex mutex_;
  WriteFloor floor_;
  WriteLog<Place> log_;  // under mutex_
  Read read_{*this};
  Write write_{*this};
};

/// As SharedData<T>.
///
/// | member            | written by    | under   |
/// | ----------------- | ------------- | ------- |
/// | place_, sequence_ | write service | mutex_  |
class SerializedData final : public SerializedResource {
 public:
  explicit SerializedData(SerializedOptions options)
      : SerializedResource(SharedDataKind::describe().name, std::move(options)), place_(place()) {}

 protected:
  DataStatus take_out(Message& message, time_ns_t& time_ns, std::uint64_t& seen) noexcept override {
    if (sequence_ == 0) return DataStatus::none;
    message.assign(place_.message.begin(), place_.message.end());
    time_ns = place_.time_ns;
    return std::exchange(seen, sequence_) != sequence_ ? DataStatus::new_data : DataStatus::old_data;
  }
  bool put_in(std::span<const std::byte> message, time_ns_t time_ns) noexcept override {
    place_.set(message, time_ns);
    ++sequence_;
    return true;
  }
  std::uint64_t look(Message& message, time_ns_t& time_ns) const noexcept override {
    message.assign(place_.message.begin(), place_.message.end());
    time_ns = place_.time_ns;
    return sequence_;
  }

 private:
  Place place_;
  std::uint64_t sequence_{0};
};

/// As RingBuffer<T>.
///
/// | member                 | written by           | under  |
/// | ---------------------- | -------------------- | ------ |
/// | places_, first_, size_ | read, write services | mutex_ |
/// | sequence_              | write service        | mutex_ |
class SerializedRing final : public SerializedResource {
 public:
  explicit SerializedRing(SerializedOptions options)
      : SerializedResource(RingBufferKind::describe().name, std::move(options)),
        overwrites_(get<bool>(this->options().parameters, "overwrite")) {
    const auto capacity = get<std::int64_t>(this->options().parameters, "capacity");
    for (std::int64_t i = 0; i < capacity; ++i) places_.push_back(place());
  }

 protected:
  DataStatus take_out(Message& message, time_ns_t& time_ns, std::uint64_t& seen) noexcept override {
    if (size_ == 0) {
      message.clear();
      return seen == 0 ? DataStatus::none : DataStatus::old_data;
    }
    const Place& oldest = places_[first_];
    message.assign(oldest.message.begin(), oldest.message.end());
    time_ns = oldest.time_ns;
    drop_oldest();
    ++seen;
    return DataStatus::new_data;
  }
  bool put_in(std::span<const std::byte> message, time_ns_t time_ns) noexcept override {
    if (size_ == places_.size()) {
      if (!overwrites_) return false;
      drop_oldest();
    }
    places_[(first_ + size_) % places_.size()].set(message, time_ns);
    ++size_;
    ++sequence_;
    return true;
  }
  std::uint64_t look(Message& message, time_ns_t& time_ns) const noexcept override {
    const Place& newest = places_[(first_ + size_ + places_.size() - 1) % places_.size()];
    message.assign(newest.message.begin(), newest.message.end());
    time_ns = newest.time_ns;
    return sequence_;
  }

 private:
  void drop_oldest() noexcept {
    first_ = (first_ + 1) % places_.size();
    --size_;
  }

  const bool overwrites_;
  std::vector<Place> places_;
  std::size_t first_{0};
  std::size_t size_{0};
  std::uint64_t sequence_{0};
};

template <typename Made>
std::unique_ptr<Resource> make_serialized(const SerializedOptions& options) {
  return std::make_unique<Made>(options);
}

using SerializedFactory = std::unique_ptr<Resource> (*)(const SerializedOptions& options);
/// The given kinds that hold serialized messages too: those with the parameter max_bytes.
const std::map<std::string, SerializedFactory>& serialized_kinds() {
  static const std::map<std::string, SerializedFactory> kinds{
      {SharedDataKind::describe().name, make_serialized<SerializedData>},
      {RingBufferKind::describe().name, make_serialized<SerializedRing>},
      {ActionServerKind::describe().name, make_serialized_server},
      {ActionClientKind::describe().name, make_serialized_client}};
  return kinds;
}

}  // namespace

std::unique_ptr<Resource> make_serialized_resource(const std::string& kind,
                                                   const SerializedOptions& options) {
  const auto found = serialized_kinds().find(kind);
  if (found == serialized_kinds().end()) {
    std::vector<std::string> kinds;
    for (const auto& [name, factory] : serialized_kinds()) kinds.push_back(name);
    throw Error(ErrorCode::unknown_type, "the data type is not registered",
                {.element = "type " + options.type,
                 .expected = "a type that a plug-in library registers, for a resource of kind " + kind,
                 .found = "a message that is only known to Python",
                 .remedy = "load a library that registers it, or use one of " + join(kinds)});
  }
  const auto max_bytes = static_cast<std::size_t>(get<std::int64_t>(options.parameters, "max_bytes"));
  for (const Message& zero : options.zeros) {
    if (zero.size() <= max_bytes) continue;
    throw Error(ErrorCode::invalid_argument, "the resource has no room for a message of its type",
                {.element = "max_bytes",
                 .expected = "at least " + std::to_string(zero.size()),
                 .found = std::to_string(max_bytes)});
  }
  return found->second(options);
}

}  // namespace mauve::bindings
