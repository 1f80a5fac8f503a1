// SPDX-License-Identifier: LGPL-3.0-or-later
// RequestPort: how a shell in Python calls a service whose type is a ROS service's, of a resource in C++.
#pragma once

#include "python_call.hpp"

namespace mauve::bindings {

/// Calls with serialized request and response; without the interpreter's lock.
class RequestPort final : public PortBase {
 public:
  RequestPort(std::string name, std::string type)
      : PortBase(std::move(name), PortKind::call, std::move(type)) {}

  /// The response. Throws Error (not_configured): it is not connected, or the call was not answered.
  std::vector<std::byte> call(std::span<const std::byte> request) const {
    if (is_previewed()) return stand_in<RequestPort>().call(request);
    ServiceBase* const service = service_;  // another thread may change the connection meanwhile
    if (service == nullptr) {
      throw Error(ErrorCode::not_configured, "the call port is not connected",
                  {.element = "port " + name(), .remedy = "connect it, or ask is_connected first"});
    }
    std::vector<std::byte> response;
    const ServiceSpan span(trace_id());
    const CallOutcome outcome = service->call_serialized(request, response);
    if (outcome == CallOutcome::answered) return response;
    throw Error(ErrorCode::not_configured, "the call was not answered",
                {.element = "port " + name(),
                 .expected = "a response",
                 .found = std::string(to_string(outcome)),
                 .remedy = "catch this error, and call again later"});
  }

 protected:
  bool fits(const ServiceBase& service) const noexcept override { return service.is_call_serializable(); }
  void attach(ServiceBase* service, BiasedMutex::Seat* /*seat*/) noexcept override { service_ = service; }
  std::unique_ptr<PortBase> make_stand_in() const override {
    return std::make_unique<RequestPort>(name(), type());
  }

 private:
  ServiceBase* service_{nullptr};
};

}  // namespace mauve::bindings
