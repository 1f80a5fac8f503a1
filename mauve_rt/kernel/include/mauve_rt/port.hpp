// SPDX-License-Identifier: LGPL-3.0-or-later
// Ports: a shell's way to the services of resources.
#pragma once

#include <atomic>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "mauve_rt/context.hpp"
#include "mauve_rt/service.hpp"

namespace mauve {

/// What the kernel does to an output while its component is not running.
enum class OutputPolicy : std::uint8_t {
  hold,      // leave the last value
  set_zero,  // write the type's default value
};

struct OutputOptions {
  OutputPolicy on_commit{OutputPolicy::hold};
  OutputPolicy on_stop{OutputPolicy::set_zero};
};

/// A port seen without its type. Connected while the component is not running.
///
/// | member                   | written by                  | read by        | order                                |
/// | ------------------------ | --------------------------- | -------------- | ------------------------------------ |
/// | service_, resource_name_ | connect(), component parked | component, any | parking publishes it                 |
/// | context_                 | [setup]                     | component      | -                                    |
/// | closed_                  | the watchdog                | component      | release/acquire: its zeros stay last |
class PortBase {
 public:
  PortBase(std::string name, PortKind kind, std::string type)
      : name_(std::move(name)), kind_(kind), type_(std::move(type)) {}
  virtual ~PortBase() = default;
  PortBase(const PortBase&) = delete;
  PortBase& operator=(const PortBase&) = delete;

  const std::string& name() const noexcept { return name_; }
  PortKind kind() const noexcept { return kind_; }
  const std::string& type() const noexcept { return type_; }
  bool is_connected() const noexcept { return base_ != nullptr; }
  /// The connected service, or nullptr.
  const ServiceBase* service() const noexcept { return base_; }
  const std::string& resource_name() const noexcept { return resource_name_; }

  /// Connects to a service of equal kind and type. [setup] Throws Error (type_mismatch).
  void connect(ServiceBase& service, const std::string& resource_name);
  /// [setup]
  void disconnect() noexcept;
  void set_context(const Context* context) noexcept { context_ = context; }

  /// Writes the type's default value; a port that is no write port does nothing. [rt]
  virtual void write_zero() noexcept {}
  virtual OutputOptions output() const noexcept { return {OutputPolicy::hold, OutputPolicy::hold}; }
  /// After this the port swallows writes, until reopened. [rt]
  void close() noexcept { closed_.store(true, std::memory_order_release); }
  void reopen() noexcept { closed_.store(false, std::memory_order_release); }

  /// A read as serialized message (for cores that are not C++); false when this is no read port. [non-rt]
  virtual bool read_serialized(std::vector<std::byte>& /*message*/, DataStatus& /*status*/,
                               time_ns_t& /*time*/) {
    return false;
  }
  /// A write of a serialized message; false when malformed or no write port. [non-rt]
  virtual bool write_serialized(std::span<const std::byte> /*message*/) { return false; }

 protected:
  virtual void attach(ServiceBase* service) noexcept = 0;
  /// Component's logical clock, or the real one outside of any. [rt]
  time_ns_t stamp_ns() const noexcept {
    return context_ != nullptr ? context_->clock_ns.load(std::memory_order_relaxed) : monotonic_now_ns();
  }
  bool is_closed() const noexcept { return closed_.load(std::memory_order_acquire); }

 private:
  std::string name_;
  PortKind kind_;
  std::string type_;
  ServiceBase* base_{nullptr};
  std::string resource_name_;
  const Context* context_{nullptr};
  std::atomic<bool> closed_{false};
};

/// Reads from a resource. Unconnected, it yields its default with status none.
template <Described T>
class ReadPort final : public PortBase {
 public:
  explicit ReadPort(std::string name, T initial = {})
      : PortBase(std::move(name), PortKind::read, type_name<T>()), default_(std::move(initial)) {}

  /// Value, status and writer's time. [rt]
  Sample<T> read() noexcept {
    Sample<T> sample{.value = default_};
    if (service_ != nullptr) sample.status = service_->read(sample.value, sample.time_ns, seen_);
    return sample;
  }
  /// The same into a place of the caller's, for large types; untouched when nothing is there. [rt]
  DataStatus read(T& value, time_ns_t* time_ns = nullptr) noexcept {
    time_ns_t time = 0;
    const DataStatus status = service_ != nullptr ? service_->read(value, time, seen_) : DataStatus::none;
    if (time_ns != nullptr) *time_ns = time;
    return status;
  }

  bool read_serialized(std::vector<std::byte>& message, DataStatus& status, time_ns_t& time_ns) override {
    auto value = std::make_unique<T>(default_);
    status = read(*value, &time_ns);
    CdrWriter(message).put(*value);
    return true;
  }

 protected:
  void attach(ServiceBase* service) noexcept override {
    service_ = static_cast<ReadService<T>*>(service);
    seen_ = 0;
  }

 private:
  ReadService<T>* service_{nullptr};
  std::uint64_t seen_{0};
  T default_;
};

/// Writes to a resource, stamped with the component's logical clock. Unconnected, it does nothing.
template <Described T>
class WritePort final : public PortBase {
 public:
  explicit WritePort(std::string name, OutputOptions output = {})
      : PortBase(std::move(name), PortKind::write, type_name<T>()), output_(output) {}

  /// False when the resource had no room. [rt]
  bool write(const T& value) noexcept {
    if (service_ == nullptr || is_closed()) return true;
    return service_->write(value, stamp_ns());
  }
  void write_zero() noexcept override {
    if (service_ != nullptr) service_->write(zero_, stamp_ns());
  }
  OutputOptions output() const noexcept override { return output_; }

  bool write_serialized(std::span<const std::byte> message) override {
    auto value = std::make_unique<T>();
    return CdrReader(message).get(*value) && write(*value);
  }

 protected:
  void attach(ServiceBase* service) noexcept override { service_ = static_cast<WriteService<T>*>(service); }

 private:
  WriteService<T>* service_{nullptr};
  OutputOptions output_;
  T zero_{};  // kept here: large types do not belong on a small stack
};

template <typename Signature>
class CallPort;

/// Calls a service of a resource; the type is the name the service declares.
template <typename R, typename... Args>
class CallPort<R(Args...)> final : public PortBase {
 public:
  CallPort(std::string name, std::string type) : PortBase(std::move(name), PortKind::call, std::move(type)) {}

  /// Calls, traced. [rt] if the service is. Throws std::logic_error when not connected (check
  /// is_connected()).
  R operator()(Args... args) {
    if (service_ == nullptr) throw std::logic_error("call port '" + name() + "' is not connected");
    const ServiceSpan span(trace_id_);
    return service_->call(std::forward<Args>(args)...);
  }

 protected:
  void attach(ServiceBase* service) noexcept override {
    service_ = static_cast<CallService<R(Args...)>*>(service);
    if (service != nullptr) trace_id_ = TraceNames::intern(resource_name() + "." + service->name());
  }

 private:
  /// Records begin and end of a service on the calling thread, also when it throws.
  class ServiceSpan {
   public:
    explicit ServiceSpan(std::uint32_t name) noexcept : name_(name), ring_(TraceRing::of_this_thread()) {
      if (ring_ != nullptr) ring_->push(TraceKind::service_begin, name_);
    }
    ~ServiceSpan() {
      if (ring_ != nullptr) ring_->push(TraceKind::service_end, name_);
    }
    ServiceSpan(const ServiceSpan&) = delete;
    ServiceSpan& operator=(const ServiceSpan&) = delete;

   private:
    std::uint32_t name_;
    TraceRing* ring_;
  };

  CallService<R(Args...)>* service_{nullptr};
  std::uint32_t trace_id_{0};
};

/// Raises an event of a resource. Unconnected, it does nothing.
class EventPort final : public PortBase {
 public:
  explicit EventPort(std::string name) : PortBase(std::move(name), PortKind::event, "") {}
  /// [rt]
  void raise() noexcept {
    if (service_ != nullptr && !is_closed()) service_->raise(stamp_ns());
  }

 protected:
  void attach(ServiceBase* service) noexcept override { service_ = static_cast<EventService*>(service); }

 private:
  EventService* service_{nullptr};
};

}  // namespace mauve
