// SPDX-License-Identifier: LGPL-3.0-or-later
// NewestValue: what shared_data and latest_value have in common, the newest value for readers that never wait.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "mauve_rt/base/pi_mutex.hpp"
#include "mauve_rt/base/seam/atomic.hpp"
#include "mauve_rt/base/seam/mutex.hpp"
#include "mauve_rt/base/trace.hpp"
#include "mauve_rt/data/biased_write.hpp"
#include "mauve_rt/data/latest_register.hpp"
#include "mauve_rt/data/logged_resource.hpp"

namespace mauve {

/// How many ports may connect to each service; 0: any number.
struct PortLimits {
  std::uint32_t readers{0};
  std::uint32_t writers{0};
};

/// One value; services `read` and `write`. A port that reads is wait-free: it has a place in the register, prepared when it
/// was connected. A single port that writes takes no lock either. All others use locks with priority inheritance.
///
/// | member    | used by                                                | under                                        |
/// | --------- | ------------------------------------------------------ | -------------------------------------------- |
/// | register_ | ports that read, each with a ReaderState               | wait-free                                    |
/// | register_ | the serialized face, rules, readers without a port: as one more reader | others_mutex_                |
/// | register_ | who writes                                             | write.mutex(), biased to the only port       |
/// | seats_    | ports that come and go                                 | relaxed: a count, nothing depends on its order |
/// | register_.reserve(), slots() | who prepares or describes           | room_mutex_                                  |
/// | limits_   | any                                                    | its own                                      |
template <Described T>
class NewestValue : public LoggedResource<T, NewestResource> {
 public:
  /// `readers`: places for ports that are there from the start. [setup]
  NewestValue(std::string kind, PortLimits limits, std::uint32_t readers, Capacities capacities = {})
      : LoggedResource<T, NewestResource>(std::move(kind), type_name<T>(), std::move(capacities)),
        limits_(limits),
        register_(readers + kOthers, [this](T& value) { this->limits().allocate(value); }) {
    if constexpr (kIsLarge<T>) register_.reserve(register_.room(), kOtherWriters);
    this->offer(read);
    this->offer(write);
  }

  void set_name(const std::string& name) override {
    Resource::set_name(name);
    write.mutex().set_trace_id(TraceNames::intern(name));
    others_mutex_.set_trace_id(TraceNames::intern(name));
  }
  bool write_sample(std::span<const std::byte> message, time_ns_t time_ns) override {
    return write.write_message(message, time_ns);
  }
  std::optional<NumberPlace> find_number(std::string_view path) const override {
    return mauve::find_number<T>(path);
  }
  bool read_number(const NumberPlace& place, double& number) noexcept override {
    const LockGuard lock(others_mutex_);
    std::uint32_t held = 0;
    const T* const newest = register_.look(held);
    if (newest != nullptr) number = place.of(newest);
    register_.let_go(held);
    return newest != nullptr;
  }

 private:
  static constexpr std::size_t kOthers = 1;  // one at a time, under others_mutex_
  static constexpr std::size_t kOtherWriters =
      2;  // without a port: a topic, and who writes a message by hand

  class Read final : public ReadService<T> {
   public:
    explicit Read(NewestValue& owner) : ReadService<T>("read"), owner_(owner) {}
    std::uint32_t max_ports() const noexcept override { return owner_.limits_.readers; }
    DataStatus read(T& value, time_ns_t& time_ns, ReaderState& reader) noexcept override {
      if (reader.seat != nullptr) return owner_.register_.read(value, time_ns, reader);
      const LockGuard lock(owner_.others_mutex_);
      const DataStatus status = owner_.register_.read(value, time_ns, reader);
      owner_.register_.let_go(reader.held);
      return status;
    }
    LatestRegister<T>* latest() noexcept override { return &owner_.register_; }
    bool lends(const ReaderState& reader) const noexcept override { return reader.seat != nullptr; }
    Loan<T> lend(ReaderState& reader) noexcept override { return owner_.register_.lend(reader); }
    std::unique_ptr<T> make() const override { return owner_.limits().make(); }
    bool is_whole(const T& value) noexcept override { return owner_.limits().admits(value); }
    void let_go(ReaderState& reader) noexcept override {
      owner_.register_.let_go(reader.held);
      reader = {.seat = reader.seat};
    }
    bool seat(BiasedMutex::Seat& /*seat*/) noexcept override { return owner_.take_place(); }
    void unseat(BiasedMutex::Seat& /*seat*/) noexcept override {
      owner_.seats_.fetch_sub(1, std::memory_order_relaxed);
    }
    bool is_wait_free() const noexcept override { return true; }
    void make_room(std::uint32_t ports) override { owner_.make_room(ports); }

   private:
    NewestValue& owner_;
  };
  friend class BiasedWrite<T, NewestValue>;

  BiasedMutex& writers() noexcept override { return write.mutex(); }
  std::size_t values() const override {
    const LockGuard lock(room_mutex_);
    return register_.slots();
  }

  bool take(const T& value, time_ns_t time_ns) noexcept {
    if (!register_.write(value, time_ns)) return false;
    this->log(value, time_ns);
    return true;
  }
  T* borrow() noexcept { return register_.borrow(); }
  bool publish(T& place, time_ns_t time_ns) noexcept {
    this->log(place, time_ns);  // first: then it is the readers'
    register_.give_back(place, &time_ns);
    return true;
  }
  void give_back(T& place) noexcept { register_.give_back(place, nullptr); }
  DataStatus serialize(std::vector<std::byte>& message, time_ns_t& time_ns, std::uint64_t& seen) override {
    ReaderState reader{.seen = seen};
    if constexpr (kIsLarge<T>) {  // without a copy
      const LockGuard lock(others_mutex_);
      const Loan<T> loan = register_.lend(reader);
      seen = reader.seen;
      if (loan.value != nullptr) {
        time_ns = loan.time_ns;
        CdrWriter(message).put(*loan.value);
        register_.let_go(reader.held);
        return loan.status;
      }
      register_.let_go(reader.held);
    }
    const auto value = read.make();
    const DataStatus status = read.read(*value, time_ns, reader);
    seen = reader.seen;
    CdrWriter(message).put(*value);
    return status;
  }

  /// Called for a port that comes to write; `ports`: how many there will be.
  void make_room_to_write(std::uint32_t ports) {
    if constexpr (kIsLarge<T>) {
      const LockGuard lock(room_mutex_);
      std::size_t left_behind = 0;
      {
        const LockGuard no_writer(write.mutex());
        left_behind = register_.borrowed();
      }
      register_.reserve(register_.room(), ports + left_behind + kOtherWriters);
    }
  }
  /// A reader whose component was removed while a state of it hung keeps its place until that ends: it is none of the ports.
  void make_room(std::uint32_t ports) {
    const LockGuard lock(room_mutex_);
    const std::uint32_t seats = seats_.load(std::memory_order_relaxed);
    const std::uint32_t left_behind = seats > read.ports() ? seats - read.ports() : 0;
    register_.reserve(ports + left_behind + kOthers);
    room_.store(static_cast<std::uint32_t>(register_.room() - kOthers), std::memory_order_relaxed);
  }
  bool take_place() noexcept {
    std::uint32_t seats = seats_.load(std::memory_order_relaxed);
    do {
      if (seats >= room_.load(std::memory_order_relaxed)) return false;
    } while (!seats_.compare_exchange_weak(seats, seats + 1, std::memory_order_relaxed));
    return true;
  }

  PortLimits limits_;
  LatestRegister<T> register_;
  PiMutex others_mutex_;
  mutable Mutex room_mutex_;
  Atomic<std::uint32_t> room_{static_cast<std::uint32_t>(register_.room() - kOthers)};
  Atomic<std::uint32_t> seats_{0};

 public:
  Read read{*this};
  BiasedWrite<T, NewestValue> write{*this, limits_.writers};
};

}  // namespace mauve
