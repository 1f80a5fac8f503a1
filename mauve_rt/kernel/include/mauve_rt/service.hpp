// SPDX-License-Identifier: LGPL-3.0-or-later
// Services: what resources offer and ports connect to.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "mauve_rt/cdr.hpp"
#include "mauve_rt/time.hpp"

namespace mauve {

enum class PortKind : std::uint8_t { read = 1, write = 2, call = 3, event = 4 };

/// "read", "write", "call" or "event". [rt]
std::string_view to_string(PortKind kind) noexcept;

/// What a read found, seen from the port that reads: nothing yet, what it had read before, or something
/// newer.
enum class DataStatus : std::uint8_t { none = 0, old_data = 1, new_data = 2 };

/// A value with its status and its writer's time.
template <typename T>
struct Sample {
  T value{};
  DataStatus status{DataStatus::none};
  time_ns_t time_ns{0};

  bool is_new() const noexcept { return status == DataStatus::new_data; }
  /// Age against a later instant; 0 when nothing was written yet. [rt]
  time_ns_t age_ns(time_ns_t now_ns) const noexcept {
    return status == DataStatus::none ? 0 : now_ns - time_ns;
  }
};

/// The identity of a type: MAUVE_TYPE's name.
template <Described T>
std::string type_name() {
  return std::string(TypeTraits<T>::name);
}

/// A service seen without its type; ports connect on equal kind and type.
class ServiceBase {
 public:
  ServiceBase(std::string name, PortKind kind, std::string type)
      : name_(std::move(name)), kind_(kind), type_(std::move(type)) {}
  virtual ~ServiceBase() = default;
  ServiceBase(const ServiceBase&) = delete;
  ServiceBase& operator=(const ServiceBase&) = delete;

  const std::string& name() const noexcept { return name_; }
  PortKind kind() const noexcept { return kind_; }
  const std::string& type() const noexcept { return type_; }

 private:
  std::string name_;
  PortKind kind_;
  std::string type_;
};

template <Described T>
class ReadService : public ServiceBase {
 public:
  explicit ReadService(std::string name) : ServiceBase(std::move(name), PortKind::read, type_name<T>()) {}
  /// Copies what is there; `seen` is the reading port's last sequence number, kept by the port. [rt]
  virtual DataStatus read(T& value, time_ns_t& time_ns, std::uint64_t& seen) noexcept = 0;
};

template <Described T>
class WriteService : public ServiceBase {
 public:
  explicit WriteService(std::string name) : ServiceBase(std::move(name), PortKind::write, type_name<T>()) {}
  /// Takes a copy; false when there was no room. [rt]
  virtual bool write(const T& value, time_ns_t time_ns) noexcept = 0;
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
  /// [rt] as far as the resource says so.
  virtual R call(Args... args) = 0;
};

class EventService : public ServiceBase {
 public:
  explicit EventService(std::string name) : ServiceBase(std::move(name), PortKind::event, "") {}
  /// Says that something happened at that time. [rt]
  virtual void raise(time_ns_t time_ns) noexcept = 0;
};

}  // namespace mauve
