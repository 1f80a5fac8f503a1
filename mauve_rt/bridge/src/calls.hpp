// SPDX-License-Identifier: LGPL-3.0-or-later
// Calls between resources and ROS services, both ways.
#pragma once

#include <rcl/client.h>
#include <rcl/service.h>

#include <memory>
#include <string>

#include "mauve_rt/base/pi_mutex.hpp"
#include "mauve_rt/base/seam/atomic.hpp"

#include "binding.hpp"
#include "owned.hpp"
#include "type_support.hpp"
#include "typed_message.hpp"

namespace mauve::bridge {

/// What both directions are made from.
struct CallSettings {
  std::string resource;
  std::string name;  // as given; rcl expands and remaps it
  std::string type;  // package/srv/Type
};

/// Carries a client's calls to a ROS service and the answers back.
///
/// | member                | written by         | read by              | under  |
/// | --------------------- | ------------------ | -------------------- | ------ |
/// | sequence_, number_    | the sending thread | the receiving thread | mutex_ |
/// | request_              | the sending thread | -                    | -      |
/// | response_, message_   | the receiving one  | -                    | -      |
class CalledService final : public Binding, private Arrival {
 public:
  /// Throws Error when the type is not installed or rcl refuses. [non-rt]
  CalledService(rcl_node_t& node, const CallSettings& settings);
  ~CalledService() override;

  /// Throws Error (invalid_argument) when the resource is no client. [non-rt]
  void attach(std::shared_ptr<Resource> resource) override;
  bool send() override;
  std::vector<Arrival*> arrivals(Lane lane) override;
  void report(BridgeReport& report) const override;

 private:
  void send_request(std::uint32_t number);
  void join(rcl_wait_set_t& set) override;
  bool has_arrived(const rcl_wait_set_t& set) const override;
  void take() override;

  rcl_node_t& node_;
  CallTypeSupport type_;
  Owned<rcl_client_t, rcl_client_fini> entity_;
  ClientBase* client_{nullptr};
  TypedMessage request_;
  TypedMessage response_;
  std::vector<std::byte> serialized_;
  OwnedMessage message_;
  std::size_t place_{0};  // in the wait set
  PiMutex mutex_;
  std::int64_t sequence_{-1};  // rcl's number of the last request
  std::uint32_t number_{0};    // the client's
};

/// Offers a resource's call as a ROS service. A request that the call refuses gets no answer: ROS has none for that.
///
/// | member      | written by           | read by | order                                 |
/// | ----------- | -------------------- | ------- | ------------------------------------- |
/// | longest_ns_ | the receiving thread | anyone  | relaxed: a figure, nothing depends on |
class OfferedService final : public Binding, private Arrival {
 public:
  /// `offered`: the resource's service. Throws Error when the type is not installed or rcl refuses. [non-rt]
  OfferedService(rcl_node_t& node, const CallSettings& settings, std::string offered);

  /// Throws Error (type_mismatch) when the resource has no such service that takes messages of the type. [non-rt]
  void attach(std::shared_ptr<Resource> resource) override;
  std::vector<Arrival*> arrivals(Lane lane) override;
  void report(BridgeReport& report) const override;

 private:
  void join(rcl_wait_set_t& set) override;
  bool has_arrived(const rcl_wait_set_t& set) const override;
  void take() override;
  bool answer(rmw_request_id_t& id);

  CallSettings settings_;
  std::string offered_;
  CallTypeSupport type_;
  Owned<rcl_service_t, rcl_service_fini> entity_;
  ServiceBase* service_{nullptr};
  TypedMessage request_;
  TypedMessage response_;
  OwnedMessage message_;
  std::vector<std::byte> reply_;
  std::size_t place_{0};    // in the wait set
  TrafficCounter counter_;  // of requests
  Atomic<time_ns_t> longest_ns_{0};
};

}  // namespace mauve::bridge
