// SPDX-License-Identifier: LGPL-3.0-or-later
// Ports: a shell's way to the services of resources.
#pragma once

#include <memory>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>

#include "mauve_rt/base/rt.hpp"
#include "mauve_rt/data/latest_register.hpp"
#include "mauve_rt/data/port_base.hpp"

namespace mauve {

/// Reads from a resource. Unconnected (which is for optional ones), it yields its default with status none.
template <Described T>
class ReadPort final : public PortBase {
 public:
  explicit ReadPort(std::string name) : PortBase(std::move(name), PortKind::read, type_name<T>()) {}
  ReadPort(std::string name, const T& initial)
    requires(!kHasSequences<T>)
      : PortBase(std::move(name), PortKind::read, type_name<T>()), default_(initial) {}

  /// Lets it go unconnected. [setup]
  ReadPort& optional() noexcept {
    make_optional();
    return *this;
  }
  /// Its values are in this frame; of poses and transforms `child` is the frame whose pose they are. [setup]
  /// Throws Error (invalid_argument): a bad name.
  ReadPort& in_frame(const std::string& frame, const std::string& child = {}) {
    declare_frames({.frame = frame, .child_frame = child});
    return *this;
  }

  /// Value, status and writer's time. [rt]
  /// What is gone from its resource is not given twice: a ring's read with status old holds the default.
  Sample<T> read() MAUVE_RT
    requires(!kHasSequences<T>)  // a copy would allocate: use with(), or read() into a place from prototype()
  {
    return is_special() ? read_specially() : read_now();
  }
  /// The same into a place of the caller's, for large types; untouched when nothing is there. Status none as well when the place
  /// has no memory for the value's sequences. [rt]
  DataStatus read(T& value, time_ns_t* time_ns = nullptr) MAUVE_RT {
    if (is_special()) [[unlikely]]
      return read_specially(value, time_ns);
    return find(value, time_ns);
  }
  /// Calls `use` with the value where it lies, unless there is none to be had; large values are not copied. References to it end
  /// with the call. [rt] as far as `use` is; large values of a resource of your own that lends none are copied to the heap.
  template <typename Use>
  DataStatus with(Use&& use, time_ns_t* time_ns = nullptr) {
    if (is_previewed()) [[unlikely]]
      return stand_in<ReadPort>().with(std::forward<Use>(use), time_ns);
    const auto use_copy = [&](T& value) {
      const DataStatus status = read(value, time_ns);
      if (status == DataStatus::new_data || (status == DataStatus::old_data && service_->keeps_values()))
        std::forward<Use>(use)(std::as_const(value));
      return status;
    };
    if constexpr (!kIsLarge<T>) {
      T value = default_;
      return use_copy(value);
    } else {
      if (service_ != nullptr && !is_closed() && !service_->lends(reader_)) return use_copy(*make());
      const Loaned loaned(is_closed() ? nullptr : service_, reader_);
      const Loan<T>& loan = loaned.loan;
      status_ = loan.status;
      if (loan.status != DataStatus::none) reader_.time_ns = loan.time_ns;
      if (time_ns != nullptr) *time_ns = reader_.time_ns;
      if (is_special() && is_tapped()) [[unlikely]]
        tell_read(loan.value != nullptr ? loan.value : &default_, status_, reader_.time_ns);
      if (loan.value != nullptr) std::forward<Use>(use)(*loan.value);
      return status_;
    }
  }
  /// A value with memory for the sequences of whatever the connected resource gives: for members that are read into. [setup]
  T prototype() const { return std::move(*make()); }

  /// What the last read found, without reading; none before the first one. [rt]
  DataStatus status() const MAUVE_RT { return is_previewed() ? stand_in<ReadPort>().status_ : status_; }
  /// How old what the last read found is by the component's clock; 0 when there was nothing. [rt]
  time_ns_t age_ns() const MAUVE_RT {
    if (is_previewed()) [[unlikely]]
      return stand_in<ReadPort>().age_ns();
    return status_ == DataStatus::none ? 0 : stamp_ns() - reader_.time_ns;
  }

  std::vector<MessageShape> messages() const override { return message_shapes<T>(); }
  std::unique_ptr<PortCell> make_cell() const override {
    if constexpr (std::is_trivially_copyable_v<T>) {
      return std::make_unique<ReadCell<T>>();
    } else {
      return nullptr;
    }
  }
  bool read_serialized(std::vector<std::byte>& message, DataStatus& status, time_ns_t& time_ns) override {
    auto value = make();
    if constexpr (!kHasSequences<T>) *value = default_;
    status = read(*value, &time_ns);
    CdrWriter(message).put(*value);
    return true;
  }

 protected:
  void attach(ServiceBase* service, BiasedMutex::Seat* seat) noexcept override {
    if (service_ != nullptr) service_->let_go(reader_);
    service_ = static_cast<ReadService<T>*>(service);  // fits() was asked
    latest_ = seat != nullptr ? service_->latest() : nullptr;
    reader_ = {.seat = seat};
    status_ = DataStatus::none;
  }
  std::unique_ptr<PortBase> make_stand_in() const override {
    if constexpr (kHasSequences<T>) {
      return std::make_unique<ReadPort>(name());
    } else {
      return std::make_unique<ReadPort>(name(), default_);
    }
  }

 private:
  /// A value of the service's, until the end of its use.
  struct Loaned {
    Loaned(ReadService<T>* from, ReaderState& by) MAUVE_RT
        : service(from),
          reader(by),
          loan(from != nullptr ? from->lend(by) : Loan<T>{}) {}
    ~Loaned() {
      if (service != nullptr) service->end_loan(loan, reader);
    }
    Loaned(const Loaned&) = delete;
    Loaned& operator=(const Loaned&) = delete;
    ReadService<T>* service;
    ReaderState& reader;
    const Loan<T> loan;
  };

  std::unique_ptr<T> make() const {
    if (is_previewed()) return stand_in<ReadPort>().make();
    return service_ != nullptr ? service_->make() : std::make_unique<T>();
  }
  // One variable in each function that returns a large value: a compiler then makes it in the caller's place.
  Sample<T> read_now() noexcept {
    Sample<T> sample = find();
    note(sample);
    return sample;
  }
  // Out of line: the reads of a running component are to cost what they cost without previews, taps and watches.
  [[gnu::noinline, gnu::cold]] Sample<T> read_specially() noexcept {
    return is_previewed() ? read_ahead() : read_tapped();
  }
  Sample<T> read_ahead() noexcept {
    auto& other = stand_in<ReadPort>();
    Sample<T> sample = other.read();
    other.keep_nothing();
    return sample;
  }
  Sample<T> read_tapped() noexcept {
    Sample<T> sample = find_unless_closed();
    note(sample);
    if (is_tapped()) tell_read(&sample.value, sample.status, sample.time_ns);
    return sample;
  }
  [[gnu::noinline, gnu::cold]] DataStatus read_specially(T& value, time_ns_t* time_ns) noexcept {
    if (is_previewed()) {
      auto& other = stand_in<ReadPort>();
      const DataStatus status = other.read(value, time_ns);
      other.keep_nothing();
      return status;
    }
    if (is_closed()) {
      if (time_ns != nullptr) *time_ns = reader_.time_ns;
      status_ = DataStatus::none;
    } else {
      find(value, time_ns);
    }
    if (is_tapped()) tell_read(&value, status_, reader_.time_ns);
    return status_;
  }
  /// Gives back what the service keeps for a reader: a stand-in is one more than it may be made for.
  void keep_nothing() noexcept {
    if (service_ == nullptr) return;
    const ReaderState known = reader_;
    service_->let_go(reader_);
    reader_.seen = known.seen;
    reader_.time_ns = known.time_ns;
  }
  Sample<T> find_unless_closed() noexcept {
    if (is_closed()) return {.value = default_};
    return find();
  }
  Sample<T> find() noexcept {
    if (latest_ != nullptr) return latest_->sample(default_, reader_);
    if (service_ != nullptr) return service_->sample(default_, reader_);
    return {.value = default_};
  }
  void note(const Sample<T>& sample) noexcept {
    status_ = sample.status;
    reader_.time_ns = sample.time_ns;
  }
  DataStatus find(T& value, time_ns_t* time_ns) noexcept {
    time_ns_t time = reader_.time_ns;
    if (latest_ != nullptr) {
      status_ = latest_->read(value, time, reader_);
    } else {
      status_ = service_ != nullptr ? service_->read(value, time, reader_) : DataStatus::none;
    }
    if constexpr (kHasSequences<T>) {
      if (status_ != DataStatus::none && !service_->is_whole(value)) status_ = DataStatus::none;
    }
    reader_.time_ns = time;
    if (time_ns != nullptr) *time_ns = time;
    return status_;
  }

  ReadService<T>* service_{nullptr};
  LatestRegister<T>* latest_{nullptr};
  ReaderState reader_;
  DataStatus status_{DataStatus::none};
  T default_{};  // kept here, as zero_: large types do not belong on a stack
};

/// Writes to a resource, stamped with the component's logical clock. Unconnected (optional), it does nothing.
template <Described T>
class WritePort final : public PortBase {
 public:
  explicit WritePort(std::string name, OutputOptions output = {})
      : PortBase(std::move(name), PortKind::write, type_name<T>()), output_(output) {}

  /// Lets it go unconnected. [setup]
  WritePort& optional() noexcept {
    make_optional();
    return *this;
  }
  /// Its values are in this frame; of poses and transforms `child` is the frame whose pose they are. [setup]
  /// Throws Error (invalid_argument): a bad name.
  WritePort& in_frame(const std::string& frame, const std::string& child = {}) {
    declare_frames({.frame = frame, .child_frame = child});
    return *this;
  }

  /// False when the resource had no room. A value that an OutputWatch refuses is dropped. [rt]
  bool write(const T& value) MAUVE_RT {
    if (service_ == nullptr || is_special()) [[unlikely]]
      return write_specially(value);
    const bool taken = put(value, stamp_ns());
    if (is_special()) [[unlikely]]
      keep_zero();
    return taken;
  }
  /// Calls `fill` with a place of the resource's, then writes what is there; large values are not copied. The sequences come empty
  /// with their memory, other fields of large values hold what an earlier value left. False, and `fill` not called, when the
  /// resource has no place; a closed or unconnected port does nothing and says true, as write(). [rt] as far as `fill` is.
  template <typename Fill>
  bool write_with(Fill&& fill) {
    if constexpr (!kIsLarge<T>) {
      T value{};
      std::forward<Fill>(fill)(value);
      return write(value);
    } else {
      if (service_ == nullptr || is_closed() || is_previewed()) return true;
      Borrowed borrowed(*service_, seat_);
      if (borrowed.place == nullptr) return false;
      detail::clear_sequences(*borrowed.place);
      std::forward<Fill>(fill)(*borrowed.place);
      if (is_special()) [[unlikely]] {
        if (is_closed() || is_held_back(borrowed.place)) return true;
        if (is_tapped()) tell_write(borrowed.place);
        if (!admits(borrowed.place)) return true;
        if (slew_limit() != nullptr) return publish_limited(borrowed);
      }
      const bool taken = service_->publish(*std::exchange(borrowed.place, nullptr), stamp_ns(), seat_);
      if (is_special()) [[unlikely]]
        keep_zero();
      return taken;
    }
  }
  /// A value with memory for the sequences of whatever the connected resource takes: for members that are written. [setup]
  T prototype() const { return std::move(*make()); }
  void write_held(const void* value) noexcept override {
    if (!is_closed() && !is_previewed()) write_now(*static_cast<const T*>(value));
  }
  using PortBase::write_zero;
  void write_zero(time_ns_t time_ns) noexcept override {
    if (service_ == nullptr) return;
    if (slew_limit() != nullptr) {
      put_limited(zero_, time_ns);
    } else if (seat_ != nullptr && !seat_->is_mine()) {
      service_->write(zero_, time_ns);  // the component's thread may be inside
    } else {
      put(zero_, time_ns);
    }
  }
  TryWrite try_write_zero(ServiceBase& service, time_ns_t time_ns) noexcept override {
    return static_cast<WriteService<T>&>(service).try_write(zero_, time_ns);
  }
  void write_zero_to(ServiceBase& service, time_ns_t time_ns) noexcept override {
    static_cast<WriteService<T>&>(service).write(zero_, time_ns);
  }
  std::unique_ptr<PortCell> make_cell() const override {
    if constexpr (std::is_trivially_copyable_v<T>) {
      return std::make_unique<WriteCell<T>>();
    } else {
      return nullptr;
    }
  }
  OutputOptions output() const noexcept override { return output_; }
  std::optional<NumberPlace> find_number(std::string_view path) const override {
    return mauve::find_number<T>(path);
  }
  std::vector<MessageShape> messages() const override { return message_shapes<T>(); }

  bool write_serialized(std::span<const std::byte> message) override {
    const auto value = make();
    return CdrReader(message).get(*value) && write(*value);
  }

 protected:
  const void* make_room_to_limit() override {
    if constexpr (!std::is_trivially_copyable_v<T>) return nullptr;
    limited_ = std::make_unique<T>();
    return &zero_;
  }
  std::vector<std::byte> zero_message() const override {
    std::vector<std::byte> message;
    CdrWriter(message).put(zero_);
    return message;
  }
  void attach(ServiceBase* service, BiasedMutex::Seat* seat) noexcept override {
    service_ = static_cast<WriteService<T>*>(service);
    seat_ = seat;
  }
  std::unique_ptr<PortBase> make_stand_in() const override {
    return std::make_unique<WritePort>(name(), output_);
  }

 private:
  /// A place of the service's, until it is published.
  struct Borrowed {
    Borrowed(WriteService<T>& from, BiasedMutex::Seat* by) MAUVE_RT : service(from),
                                                                      seat(by),
                                                                      place(from.borrow(by)) {}
    ~Borrowed() {
      if (place != nullptr) service.give_back(*place, seat);
    }
    Borrowed(const Borrowed&) = delete;
    Borrowed& operator=(const Borrowed&) = delete;
    WriteService<T>& service;
    BiasedMutex::Seat* seat;
    T* place;
  };

  std::unique_ptr<T> make() const {
    if (is_previewed()) return stand_in<WritePort>().make();
    return service_ != nullptr ? service_->make() : std::make_unique<T>();
  }
  // Out of line, as ReadPort::read_specially().
  [[gnu::noinline, gnu::cold]] bool write_specially(const T& value) noexcept {
    if (is_closed() || is_previewed() || is_held_back(&value)) return true;
    return write_now(value);
  }
  bool write_now(const T& value) noexcept {
    if (is_tapped()) tell_write(&value);
    if (service_ == nullptr || !admits(&value)) return true;
    const bool taken = slew_limit() != nullptr ? put_limited(value, stamp_ns()) : put(value, stamp_ns());
    keep_zero();
    return taken;
  }
  /// The value is dropped where its first number ever is none.
  bool put_limited(const T& value, time_ns_t time_ns) noexcept {
    if constexpr (std::is_trivially_copyable_v<T>) {  // else make_room_to_limit() has refused
      *limited_ = value;
      if (!slew_limit()->apply(limited_.get(), time_ns)) return true;
      const bool taken = put(*limited_, time_ns);
      if (taken) slew_limit()->keep(time_ns);
      return taken;
    }
    return put(value, time_ns);
  }
  /// The same of a value that lies in the service's place already.
  bool publish_limited(Borrowed& borrowed) noexcept {
    const time_ns_t time_ns = stamp_ns();
    if (!slew_limit()->apply(borrowed.place, time_ns)) return true;
    const bool taken = service_->publish(*std::exchange(borrowed.place, nullptr), time_ns, seat_);
    if (taken) slew_limit()->keep(time_ns);
    keep_zero();
    return taken;
  }
  /// Of a port that was closed while it wrote: the zeros stay last, whoever wrote first.
  void keep_zero() noexcept {
    if (keeps_zero()) write_stopped(stamp_ns());
  }
  bool put(const T& value, time_ns_t time_ns) noexcept {
    return seat_ != nullptr ? service_->write_seated(value, time_ns, *seat_)
                            : service_->write(value, time_ns);
  }

  WriteService<T>* service_{nullptr};
  BiasedMutex::Seat* seat_{nullptr};
  OutputOptions output_;
  T zero_{};  // kept here: large types do not belong on a small stack
  /// A copy of the value that is written, with its numbers limited.
  std::unique_ptr<T> limited_;
};

template <typename Signature>
class CallPort;

/// Calls a service of a resource; the type is the name the service declares. Always required.
template <typename R, typename... Args>
class CallPort<R(Args...)> final : public PortBase {
 public:
  CallPort(std::string name, std::string type) : PortBase(std::move(name), PortKind::call, std::move(type)) {}

  std::vector<MessageShape> messages() const override { return message_shapes<Args...>(); }
  /// Calls, traced. [rt] as far as the service is. Throws std::logic_error when not connected, which only a port that
  /// belongs to no component can be.
  R operator()(Args... args) {
    if (is_previewed()) [[unlikely]]
      return stand_in<CallPort>()(std::forward<Args>(args)...);
    if (service_ == nullptr) throw std::logic_error("call port '" + name() + "' is not connected");
    const ServiceSpan span(trace_id());
    return service_->call(std::forward<Args>(args)...);
  }

 protected:
  bool fits(const ServiceBase& service) const noexcept override {
    return dynamic_cast<const CallService<R(Args...)>*>(&service) != nullptr;
  }
  void attach(ServiceBase* service, BiasedMutex::Seat* /*seat*/) noexcept override {
    service_ = static_cast<CallService<R(Args...)>*>(service);
  }
  std::unique_ptr<PortBase> make_stand_in() const override {
    return std::make_unique<CallPort>(name(), type());
  }

 private:
  CallService<R(Args...)>* service_{nullptr};
};

/// Raises an event of a resource. Unconnected (optional), it does nothing.
class EventPort final : public PortBase {
 public:
  explicit EventPort(std::string name) : PortBase(std::move(name), PortKind::event, "") {}
  /// Lets it go unconnected. [setup]
  EventPort& optional() noexcept {
    make_optional();
    return *this;
  }
  /// [rt]
  void raise() MAUVE_RT {
    if (service_ != nullptr && !is_closed() && !is_previewed()) service_->raise(stamp_ns());
  }

 protected:
  bool fits(const ServiceBase& service) const noexcept override {
    return dynamic_cast<const EventService*>(&service) != nullptr;
  }
  void attach(ServiceBase* service, BiasedMutex::Seat* /*seat*/) noexcept override {
    service_ = static_cast<EventService*>(service);
  }
  std::unique_ptr<PortBase> make_stand_in() const override { return std::make_unique<EventPort>(name()); }

 private:
  EventService* service_{nullptr};
};

}  // namespace mauve
