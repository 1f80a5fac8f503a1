// SPDX-License-Identifier: LGPL-3.0-or-later
#include "calls.hpp"

#include <rcl/graph.h>

#include "mauve_rt/base/error.hpp"
#include "mauve_rt/base/seam/guards.hpp"
#include "mauve_rt/base/time.hpp"

#include "rcl_error.hpp"

namespace mauve::bridge {

namespace {

constexpr int kRequestsAtOnce = 64;  // requests of one service before the others have their turn

std::string described(const CallSettings& settings) {
  return "resource " + settings.resource + ", service " + settings.name;
}

}  // namespace

CalledService::CalledService(rcl_node_t& node, const CallSettings& settings)
    : Binding(settings.resource),
      node_(node),
      type_(call_type_support(settings.type)),
      entity_(node, rcl_get_zero_initialized_client()),
      request_(type_.request),
      response_(type_.response) {
  const rcl_client_options_t options = rcl_client_get_default_options();
  check(rcl_client_init(entity_.get(), &node, type_.service, settings.name.c_str(), &options),
        "the service cannot be called", described(settings));
}

CalledService::~CalledService() {
  if (client_ != nullptr) client_->set_connected(false);
}

void CalledService::attach(std::shared_ptr<Resource> resource) {
  if (resource->client() == nullptr) {
    throw Error(ErrorCode::invalid_argument, "only a client calls a ROS service",
                {.element = "resource " + resource->name(),
                 .expected = "a resource of kind client",
                 .found = resource->kind()});
  }
  Binding::attach(std::move(resource));
  client_ = this->resource().client();
  client_->set_connected(true);
}

bool CalledService::send() {
  std::uint32_t number = 0;
  if (!client_->next_request(serialized_, number)) return false;
  send_request(number);
  return true;
}

void CalledService::send_request(std::uint32_t number) {
  bool has_server = false;
  if (!went_well(rcl_service_server_is_available(&node_, entity_.get(), &has_server)) || !has_server)
    return client_->refuse(number, CallOutcome::no_server);
  if (!request_.deserialize(serialized_)) return client_->refuse(number, CallOutcome::malformed);
  // The answer may come before this returns: it waits for the sequence number.
  const LockGuard lock(mutex_);
  number_ = number;
  if (!went_well(rcl_send_request(entity_.get(), request_.get(), &sequence_)))
    client_->refuse(number, CallOutcome::no_server);
}

std::vector<Arrival*> CalledService::arrivals(Lane lane) {
  return lane == Lane::messages ? std::vector<Arrival*>{this} : std::vector<Arrival*>{};
}

void CalledService::join(rcl_wait_set_t& set) {
  if (!went_well(rcl_wait_set_add_client(&set, entity_.get(), &place_))) place_ = set.size_of_clients;
}

bool CalledService::has_arrived(const rcl_wait_set_t& set) const {
  return place_ < set.size_of_clients && set.clients[place_] != nullptr;
}

void CalledService::take() {
  rmw_request_id_t id{};
  while (went_well(rcl_take_response(entity_.get(), &id, response_.get()))) {
    std::uint32_t number = 0;
    {
      const LockGuard lock(mutex_);
      if (id.sequence_number != sequence_) continue;  // of a call that was given up
      number = number_;
    }
    if (response_.serialize(message_)) {
      client_->answer(number, message_.bytes());
    } else {
      client_->refuse(number, CallOutcome::malformed);
    }
  }
}

void CalledService::report(BridgeReport& report) const {
  report.calls.push_back({.resource = resource_name(),
                          .service = rcl_client_get_service_name(entity_.get()),
                          .is_offered = false,
                          .counts = client_ != nullptr ? client_->counts() : CallCounts{}});
}

OfferedService::OfferedService(rcl_node_t& node, const CallSettings& settings, std::string offered)
    : Binding(settings.resource),
      settings_(settings),
      offered_(std::move(offered)),
      type_(call_type_support(settings.type)),
      entity_(node, rcl_get_zero_initialized_service()),
      request_(type_.request),
      response_(type_.response) {
  const rcl_service_options_t options = rcl_service_get_default_options();
  check(rcl_service_init(entity_.get(), &node, type_.service, settings.name.c_str(), &options),
        "the service cannot be offered", described(settings));
}

void OfferedService::attach(std::shared_ptr<Resource> resource) {
  ServiceBase* const service = resource->find_service(offered_);
  if (service == nullptr || !service->is_call_serializable() || service->type() != settings_.type) {
    throw Error(ErrorCode::type_mismatch, "the resource's service cannot be offered to ROS",
                {.element = "service " + resource->name() + "." + offered_,
                 .expected = "a call of " + settings_.type,
                 .found = service == nullptr ? "no such service" : "a service of " + service->type(),
                 .remedy = "derive it from RequestService"});
  }
  Binding::attach(std::move(resource));
  service_ = service;
}

std::vector<Arrival*> OfferedService::arrivals(Lane lane) {
  return lane == Lane::requests ? std::vector<Arrival*>{this} : std::vector<Arrival*>{};
}

void OfferedService::join(rcl_wait_set_t& set) {
  if (!went_well(rcl_wait_set_add_service(&set, entity_.get(), &place_))) place_ = set.size_of_services;
}

bool OfferedService::has_arrived(const rcl_wait_set_t& set) const {
  return place_ < set.size_of_services && set.services[place_] != nullptr;
}

void OfferedService::take() {
  rmw_request_id_t id{};
  for (int taken = 0; taken < kRequestsAtOnce; ++taken) {
    if (!went_well(rcl_take_request(entity_.get(), &id, request_.get()))) return;
    const time_ns_t began = monotonic_now_ns();
    const bool answered = answer(id);
    counter_.count(answered);
    if (!answered) continue;
    const time_ns_t lasted = monotonic_now_ns() - began;
    if (lasted > longest_ns_.load(std::memory_order_relaxed))
      longest_ns_.store(lasted, std::memory_order_relaxed);
  }
}

bool OfferedService::answer(rmw_request_id_t& id) {
  if (!request_.serialize(message_)) return false;
  try {
    if (service_->call_serialized(message_.bytes(), reply_) != CallOutcome::answered) return false;
  } catch (...) {
    return false;  // by the resource's own code: the caller's time runs out
  }
  return response_.deserialize(reply_) && went_well(rcl_send_response(entity_.get(), &id, response_.get()));
}

void OfferedService::report(BridgeReport& report) const {
  const TrafficCounts requests = counter_.counts();
  report.calls.push_back({.resource = resource_name(),
                          .service = rcl_service_get_service_name(entity_.get()),
                          .is_offered = true,
                          .counts = {.answered = requests.passed,
                                     .other = requests.refused,
                                     .longest_ns = longest_ns_.load(std::memory_order_relaxed)}});
}

}  // namespace mauve::bridge
