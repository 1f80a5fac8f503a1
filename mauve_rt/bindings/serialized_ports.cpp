// SPDX-License-Identifier: LGPL-3.0-or-later
#include "serialized.hpp"

namespace mauve::bindings {

namespace {

class SerializedReadPort final : public PortBase {
 public:
  SerializedReadPort(std::string name, std::string type, Message zero)
      : PortBase(std::move(name), PortKind::read, std::move(type)), zero_(std::move(zero)) {}

  std::string_view representation() const noexcept override { return kSerializedRepresentation; }
  bool read_serialized(Message& message, DataStatus& status, time_ns_t& time_ns) override {
    if (is_previewed()) return stand_in<SerializedReadPort>().read_serialized(message, status, time_ns);
    status = service_ != nullptr && !is_closed() ? service_->read(message, time_ns, seen_) : DataStatus::none;
    if (status == DataStatus::none || message.empty()) message = zero_;
    return true;
  }

 protected:
  bool fits(const ServiceBase& service) const noexcept override {
    return dynamic_cast<const SerializedReadService*>(&service) != nullptr;
  }
  void attach(ServiceBase* service, BiasedMutex::Seat* /*seat*/) noexcept override {
    service_ = static_cast<SerializedReadService*>(service);  // fits() was asked
    seen_ = 0;
  }
  std::unique_ptr<PortBase> make_stand_in() const override {
    return std::make_unique<SerializedReadPort>(name(), type(), zero_);
  }

 private:
  SerializedReadService* service_{nullptr};
  std::uint64_t seen_{0};
  Message zero_;
};

class SerializedWritePort final : public PortBase {
 public:
  SerializedWritePort(std::string name, std::string type, OutputOptions output, Message zero)
      : PortBase(std::move(name), PortKind::write, std::move(type)),
        output_(output),
        zero_(std::move(zero)) {}

  std::string_view representation() const noexcept override { return kSerializedRepresentation; }
  OutputOptions output() const noexcept override { return output_; }
  using PortBase::write_zero;
  void write_zero(time_ns_t time_ns) noexcept override {
    if (service_ != nullptr) service_->write(zero_, time_ns);
  }
  TryWrite try_write_zero(ServiceBase& service, time_ns_t time_ns) noexcept override {
    return static_cast<SerializedWriteService&>(service).try_write(zero_, time_ns);
  }
  void write_zero_to(ServiceBase& service, time_ns_t time_ns) noexcept override {
    static_cast<SerializedWriteService&>(service).write(zero_, time_ns);
  }
  bool write_serialized(std::span<const std::byte> message) override {
    if (service_ == nullptr || is_closed() || is_previewed()) return true;
    const bool taken = service_->write(message, stamp_ns());
    // Closed in between: the zeros stay last, whoever wrote first.
    if (keeps_zero()) write_stopped(stamp_ns());
    return taken;
  }

 protected:
  std::vector<std::byte> zero_message() const override { return zero_; }
  bool fits(const ServiceBase& service) const noexcept override {
    return dynamic_cast<const SerializedWriteService*>(&service) != nullptr;
  }
  void attach(ServiceBase* service, BiasedMutex::Seat* /*seat*/) noexcept override {
    service_ = static_cast<SerializedWriteService*>(service);
  }
  std::unique_ptr<PortBase> make_stand_in() const override {
    return std::make_unique<SerializedWritePort>(name(), type(), output_, zero_);
  }

 private:
  SerializedWriteService* service_{nullptr};
  OutputOptions output_;
  Message zero_;
};

}  // namespace

std::unique_ptr<PortBase> make_serialized_port(PortKind kind, const std::string& name,
                                               const std::string& type, OutputOptions output,
                                               std::span<const std::byte> zero) {
  Message bytes(zero.begin(), zero.end());
  if (kind == PortKind::read) return std::make_unique<SerializedReadPort>(name, type, std::move(bytes));
  return std::make_unique<SerializedWritePort>(name, type, output, std::move(bytes));
}

}  // namespace mauve::bindings
