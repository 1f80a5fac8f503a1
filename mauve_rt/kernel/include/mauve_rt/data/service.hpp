// SPDX-License-Identifier: LGPL-3.0-or-later
// Services: what resources offer and ports connect to.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "mauve_rt/base/biased_mutex.hpp"
#include "mauve_rt/base/contract.hpp"
#include "mauve_rt/base/seam/atomic.hpp"
#include "mauve_rt/base/time.hpp"
#include "mauve_rt/data/capacities.hpp"
#include "mauve_rt/data/message_shape.hpp"

namespace mauve {

enum class CallOutcome : std::uint8_t;  // call_type.hpp

enum class PortKind : std::uint8_t { read = 1, write = 2, call = 3, event = 4 };

/// "read", "write", "call" or "event". [rt]
std::string_view to_string(PortKind kind) MAUVE_RT;

/// What a read found, seen from the port that reads: nothing yet, what it had read before, or something
/// newer.
enum class DataStatus : std::uint8_t { none = 0, old_data = 1, new_data = 2 };

/// What came of a write that waits for no lock.
enum class TryWrite : std::uint8_t {
  done,
  busy,       // somebody holds the lock
  must_wait,  // the service cannot do without waiting
};

/// A value with its status and its writer's time.
template <typename T>
struct Sample {
  T value{};
  DataStatus status{DataStatus::none};
  time_ns_t time_ns{0};

  /// [rt]
  bool is_new() const MAUVE_RT { return status == DataStatus::new_data; }
  /// Age against a later instant; 0 when nothing was written yet. [rt]
  time_ns_t age_ns(time_ns_t now_ns) const MAUVE_RT {
    return status == DataStatus::none ? 0 : now_ns - time_ns;
  }
};

/// A value where it lies.
template <typename T>
struct Loan {
  const T* value{nullptr};  // nullptr: there is none
  DataStatus status{DataStatus::none};
  time_ns_t time_ns{0};
};

/// The identity of a type: MAUVE_TYPE's name. [non-rt]
template <Described T>
std::string type_name() {
  return std::string(TypeTraits<T>::name);
}

/// What a read port remembers between its reads; a new connection starts with a fresh one.
struct ReaderState {
  std::uint64_t seen{0};             // sequence number of the last sample read; 0: none yet
  std::uint32_t held{0};             // what the service keeps for the reader from read to read; 0: nothing
  time_ns_t time_ns{0};              // writer's time of the last sample read; set by the port
  BiasedMutex::Seat* seat{nullptr};  // the port's, if the service has given it one: ServiceBase::seat()

  /// Whether the sample of this number is another one than the last; remembers it. [rt]
  DataStatus look(std::uint64_t sequence) MAUVE_RT {
    const bool is_new = seen != sequence;
    seen = sequence;
    return is_new ? DataStatus::new_data : DataStatus::old_data;
  }
};

/// The instant before which a resource takes no writes any more: what a component that is late writes to an end that a change
/// has moved does not replace what the new owner writes. Writers ask under the resource's lock.
///
/// | member      | written by   | read by | order                                                                           |
/// | ----------- | ------------ | ------- | ------------------------------------------------------------------------------- |
/// | instant_ns_ | commits, who deploys | writers | relaxed: the new owner writes after the commit, under the same lock as the late one |
class WriteFloor {
 public:
  /// [rt]
  bool admits(time_ns_t time_ns) const MAUVE_RT {
    return time_ns >= instant_ns_.load(std::memory_order_relaxed);
  }
  void raise(time_ns_t instant_ns) MAUVE_RT {
    time_ns_t before_ns = instant_ns_.load(std::memory_order_relaxed);
    while (before_ns < instant_ns &&
           !instant_ns_.compare_exchange_weak(before_ns, instant_ns, std::memory_order_relaxed)) {
    }
  }
  /// Admits all: another clock begins. [setup]
  void forget() noexcept { instant_ns_.store(INT64_MIN, std::memory_order_relaxed); }

 private:
  Atomic<time_ns_t> instant_ns_{INT64_MIN};
};

class Resource;
template <typename T>
class LatestRegister;

/// A service seen without its type; ports connect on equal kind, type and C++ type.
///
/// | member    | written by                             | read by         | order                          |
/// | --------- | -------------------------------------- | --------------- | ------------------------------ |
/// | resource_ | Resource::offer()                      | any             | - [setup]                      |
/// | ports_    | connecting threads, commits            | ordinary thread | relaxed: a count that lags behind a change while a component is late |
/// | inputs_   | who binds topics                       | ordinary thread | relaxed: they are serialized   |
/// | since_ns_ | changes, under the gate's mutex        | the same        | -                              |
class ServiceBase {
 public:
  ServiceBase(std::string name, PortKind kind, std::string type)
      : name_(std::move(name)), kind_(kind), type_(std::move(type)) {}
  virtual ~ServiceBase() = default;
  ServiceBase(const ServiceBase&) = delete;
  ServiceBase& operator=(const ServiceBase&) = delete;

  /// [rt]
  const std::string& name() const MAUVE_RT { return name_; }
  PortKind kind() const MAUVE_RT { return kind_; }
  const std::string& type() const MAUVE_RT { return type_; }
  /// How it holds values of the type: "C++", or what another language does. [rt]
  virtual std::string_view representation() const MAUVE_RT { return "C++"; }
  /// The messages it carries, as their C++ structs have them; none where no struct is known. [non-rt]
  virtual std::vector<MessageShape> messages() const { return {}; }
  /// The resource that offers it, or nullptr. [rt]
  Resource* resource() const MAUVE_RT { return resource_; }
  /// As that resource's. [rt]
  time_ns_t longest_hold_ns() const MAUVE_RT;

  /// Whether the next does anything: a call whose type is a ROS service's. [rt]
  virtual bool is_call_serializable() const MAUVE_RT { return false; }
  /// A call by serialized messages; the reply is written when it was answered. [non-rt]
  virtual CallOutcome call_serialized(std::span<const std::byte> request, std::vector<std::byte>& reply);

  /// A write of an earlier time is dropped from now on. [rt] Does nothing where the service takes no values.
  virtual void raise_floor(time_ns_t /*instant_ns*/) MAUVE_RT {}
  /// Another clock begins, with a deployment or a simulation: a write of any time counts again. [setup]
  virtual void forget_floor() noexcept {}

  /// A port comes: whether it has a place of its own, until unseat(). What it reads or writes by that place waits for no other
  /// port. [rt] The port is in no use; its component is parked or held.
  virtual bool seat(BiasedMutex::Seat& /*seat*/) MAUVE_RT { return false; }
  /// The port goes, after seat() gave it a place. [rt] As seat().
  virtual void unseat(BiasedMutex::Seat& /*seat*/) MAUVE_RT {}
  /// Whether a port with a place takes no lock, as things are now. [rt]
  virtual bool is_wait_free() const MAUVE_RT { return false; }
  /// Others than ports use the service often, e.g. an incoming topic. [setup]
  virtual void share() noexcept {}
  /// Prepares places for so many ports. [non-rt]
  virtual void make_room(std::uint32_t /*ports*/) {}

  /// How many ports may be connected at once; 0: any number. [rt]
  virtual std::uint32_t max_ports() const MAUVE_RT { return 0; }
  /// How many ports use it now, topics that come in among them. What a change that is made has yet to connect is not. [rt]
  std::uint32_t ports() const MAUVE_RT { return ports_.load(std::memory_order_relaxed); }
  /// How many of them are topics that come in. [rt]
  std::uint32_t inputs() const MAUVE_RT { return inputs_.load(std::memory_order_relaxed); }
  /// Refuses more ports than max_ports(). [non-rt] Throws Error (invalid_argument).
  void check_ports(std::uint32_t wanted) const;
  /// A port came or went; kept by PortBase and Resource. [rt]
  void add_port() MAUVE_RT { ports_.fetch_add(1, std::memory_order_relaxed); }
  void remove_port() MAUVE_RT {
    const std::uint32_t before = ports_.fetch_sub(1, std::memory_order_relaxed);
    MAUVE_AUDIT(before != 0);
  }
  /// Others than ports write to it. [non-rt]
  void bind_input() noexcept {
    inputs_.fetch_add(1, std::memory_order_relaxed);
    add_port();
  }

  // ---- under the mutex of the architecture's gate

  /// T of the last change that was made and that connected or disconnected a port here; a change that does so again lies later.
  /// [rt]
  time_ns_t since_ns() const MAUVE_RT { return since_ns_; }
  void set_since_ns(time_ns_t instant_ns) MAUVE_RT { since_ns_ = instant_ns; }

 private:
  friend class Resource;

  std::string name_;
  PortKind kind_;
  std::string type_;
  Resource* resource_{nullptr};
  Atomic<std::uint32_t> ports_{0};
  Atomic<std::uint32_t> inputs_{0};
  time_ns_t since_ns_{0};
};

template <Described T>
class ReadService : public ServiceBase {
 public:
  explicit ReadService(std::string name) : ServiceBase(std::move(name), PortKind::read, type_name<T>()) {}
  std::vector<MessageShape> messages() const override { return message_shapes<T>(); }
  /// Copies what is there; leaves value and time alone when there is nothing. [rt]
  virtual DataStatus read(T& value, time_ns_t& time_ns, ReaderState& reader) MAUVE_RT = 0;
  /// The same by value, `fallback` when there is nothing; override it where that saves a copy. [rt]
  virtual Sample<T> sample(const T& fallback, ReaderState& reader) MAUVE_RT {
    if constexpr (kHasSequences<T>) {
      return {};  // no port asks: a copy would allocate
    } else {
      Sample<T> found{.value = fallback};
      found.status = read(found.value, found.time_ns, reader);
      return found;
    }
  }
  /// Whether a value that was read is still there for the next read; else that finds none, with status old. [rt]
  virtual bool keeps_values() const MAUVE_RT { return true; }
  /// Whether lend() gives this reader values in place; else who reads large ones copies them. [rt]
  virtual bool lends(const ReaderState& /*reader*/) const MAUVE_RT { return false; }
  /// As read(), without a copy: nothing changes the value until end_loan(). [rt]
  virtual Loan<T> lend(ReaderState& /*reader*/) MAUVE_RT { return {}; }
  virtual void end_loan(const Loan<T>& /*loan*/, ReaderState& /*reader*/) MAUVE_RT {}
  /// A value with memory for whatever the service gives. [setup]
  virtual std::unique_ptr<T> make() const { return std::make_unique<T>(); }
  /// Whether a copy that was read is whole: had memory enough; counts those that are not. [rt]
  virtual bool is_whole(const T& /*value*/) MAUVE_RT { return true; }
  /// The register that a port with a seat may read by itself, at a third of a call's price; nullptr: there is none. [rt]
  virtual LatestRegister<T>* latest() MAUVE_RT { return nullptr; }
  /// Gives back what is held for a reader that goes; the state is fresh afterwards, but for its seat. [rt]
  virtual void let_go(ReaderState& reader) MAUVE_RT { reader = {.seat = reader.seat}; }
};

template <Described T>
class WriteService : public ServiceBase {
 public:
  explicit WriteService(std::string name) : ServiceBase(std::move(name), PortKind::write, type_name<T>()) {}
  std::vector<MessageShape> messages() const override { return message_shapes<T>(); }
  /// Takes a copy; false when there was no room. [rt]
  virtual bool write(const T& value, time_ns_t time_ns) MAUVE_RT = 0;
  /// The same, of a port with a seat. [rt]
  virtual bool write_seated(const T& value, time_ns_t time_ns, BiasedMutex::Seat& /*seat*/) MAUVE_RT {
    return write(value, time_ns);
  }
  /// The same without waiting for a lock; for the outputs of a component that hangs. [rt]
  virtual TryWrite try_write(const T& /*value*/, time_ns_t /*time_ns*/) MAUVE_RT {
    return TryWrite::must_wait;
  }
  /// A place for the writer to fill without a lock, then publish() or give_back(); nullptr: there is none. [rt]
  virtual T* borrow(BiasedMutex::Seat* /*seat*/) MAUVE_RT { return nullptr; }
  /// As write(), of what was borrowed. [rt]
  virtual bool publish(T& /*place*/, time_ns_t /*time_ns*/, BiasedMutex::Seat* /*seat*/) MAUVE_RT {
    return false;
  }
  virtual void give_back(T& /*place*/, BiasedMutex::Seat* /*seat*/) MAUVE_RT {}
  /// A value with memory for whatever the service takes. [setup]
  virtual std::unique_ptr<T> make() const { return std::make_unique<T>(); }
  /// Writes a message, a large one without a copy; false when it is no whole one, or there was no room. [non-rt]
  bool write_message(std::span<const std::byte> message, time_ns_t time_ns) {
    if constexpr (kIsLarge<T>) {
      T* const place = borrow(nullptr);
      if (place != nullptr) {
        if (CdrReader(message).get(*place)) return publish(*place, time_ns, nullptr);
        give_back(*place, nullptr);
        return false;
      }
    }
    const auto value = make();
    return CdrReader(message).get(*value) && write(*value, time_ns);
  }
};

template <typename Signature>
class CallService;

/// A call of the resource's own; its type is a name given by who declares it, e.g.
/// "mauve_examples/MapVisitor".
template <typename R, typename... Args>
class CallService<R(Args...)> : public ServiceBase {
 public:
  CallService(std::string name, std::string type)
      : ServiceBase(std::move(name), PortKind::call, std::move(type)) {}
  std::vector<MessageShape> messages() const override { return message_shapes<Args...>(); }
  /// [rt] as far as the resource says so.
  virtual R call(Args... args) = 0;
};

class EventService : public ServiceBase {
 public:
  explicit EventService(std::string name) : ServiceBase(std::move(name), PortKind::event, "") {}
  /// Says that something happened at that time. [rt]
  virtual void raise(time_ns_t time_ns) MAUVE_RT = 0;
};

}  // namespace mauve
