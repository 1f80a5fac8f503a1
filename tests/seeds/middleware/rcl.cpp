// SPDX-License-Identifier: LGPL-3.0-or-later
// The functions of simulated_rcl.h: each finds its entity in the middleware.
#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <span>
#include <utility>

#include "mauve_rt/base/seam/sleep.hpp"

#include "middleware.hpp"
#include "simulated_rcl.h"

using mauve::ms_to_ns;
using mauve::us_to_ns;
using mauve::testing::Bytes;
using mauve::testing::Middleware;
using Kind = mauve::testing::Middleware::Kind;

namespace {

Middleware& here() { return Middleware::here(); }

void put(std::span<const std::byte> data, rcl_serialized_message_t& message) {
  if (data.size() > message.buffer_capacity) {
    std::free(message.buffer);  // NOLINT(cppcoreguidelines-no-malloc): as rcutils
    message.buffer = static_cast<std::uint8_t*>(std::malloc(data.size()));  // NOLINT
    message.buffer_capacity = data.size();
  }
  std::copy(data.begin(), data.end(), reinterpret_cast<std::byte*>(message.buffer));
  message.buffer_length = data.size();
}
Bytes bytes_of(const rcl_serialized_message_t& message) {
  const auto* const data = reinterpret_cast<const std::byte*>(message.buffer);
  return {data, data + message.buffer_length};
}
const Bytes& typed(const void* message) { return *static_cast<const Bytes*>(message); }
Bytes& typed(void* message) { return *static_cast<Bytes*>(message); }

const char* name_of(std::uint64_t number, Kind kind) {
  const auto* const entity = here().find(number, kind, "name");
  return entity != nullptr ? entity->name.c_str() : "";
}

/// The next message of an entity; false: there is none, or it is lost.
bool take(std::uint64_t number, Kind kind, mauve::testing::WaitingMessage& message) {
  auto* const entity = here().find(number, kind, "take");
  if (entity == nullptr) return false;
  ++entity->users;  // so that close() finds that it is in use
  here().pass(us_to_ns(3));
  --entity->users;
  if (entity->waiting.empty()) return false;
  message = std::move(entity->waiting.front());
  entity->waiting.pop_front();
  if (here().fails(here().failures.take)) return false;
  ++entity->uses;
  return true;
}

template <typename Set, typename Handle>
rcl_ret_t add(Set& handles, std::size_t room, std::size_t& added, Handle* handle, std::size_t* index) {
  if (added >= room) return RCL_RET_ERROR;
  handles[added] = handle;
  if (index != nullptr) *index = added;
  ++added;
  return RCL_RET_OK;
}

}  // namespace

rcl_error_string_t rcl_get_error_string() { return {"as the seed wants"}; }
void rcl_reset_error() {}
bool rcl_context_is_valid(const rcl_context_t* /*context*/) { return !here().is_shut_down(); }

rmw_ret_t rmw_serialized_message_init(rmw_serialized_message_t* message, std::size_t /*capacity*/,
                                      const rcl_allocator_t* /*allocator*/) {
  *message = {};
  return RMW_RET_OK;
}
rmw_ret_t rmw_serialized_message_fini(rmw_serialized_message_t* message) {
  std::free(message->buffer);  // NOLINT(cppcoreguidelines-no-malloc): as rcutils
  *message = {};
  return RMW_RET_OK;
}
rmw_ret_t rmw_serialize(const void* message, const rosidl_message_type_support_t* /*type*/,
                        rmw_serialized_message_t* serialized) {
  put(typed(message), *serialized);
  return RMW_RET_OK;
}
rmw_ret_t rmw_deserialize(const rmw_serialized_message_t* serialized,
                          const rosidl_message_type_support_t* /*type*/, void* message) {
  if (serialized->buffer_length == 0) return RCL_RET_ERROR;
  typed(message) = bytes_of(*serialized);
  return RMW_RET_OK;
}

rcl_ret_t rcl_guard_condition_init(rcl_guard_condition_t* guard, rcl_context_t* /*context*/,
                                   rcl_guard_condition_options_t /*options*/) {
  guard->number = here().open({.kind = Kind::guard, .name = "guard condition"});
  return RCL_RET_OK;
}
rcl_ret_t rcl_guard_condition_fini(rcl_guard_condition_t* guard) {
  here().close(guard->number, Kind::guard);
  return RCL_RET_OK;
}
rcl_ret_t rcl_trigger_guard_condition(rcl_guard_condition_t* guard) {
  auto* const entity = here().find(guard->number, Kind::guard, "trigger");
  if (entity == nullptr) return RCL_RET_ERROR;
  entity->is_triggered = true;
  here().changed();
  return RCL_RET_OK;
}

rcl_ret_t rcl_publisher_init(rcl_publisher_t* publisher, const rcl_node_t* /*node*/,
                             const rosidl_message_type_support_t* /*type*/, const char* topic,
                             const rcl_publisher_options_t* options) {
  publisher->number = here().open({.kind = Kind::publisher, .name = topic, .qos = options->qos});
  return RCL_RET_OK;
}
rcl_ret_t rcl_publisher_fini(rcl_publisher_t* publisher, rcl_node_t* /*node*/) {
  here().close(publisher->number, Kind::publisher);
  return RCL_RET_OK;
}
const char* rcl_publisher_get_topic_name(const rcl_publisher_t* publisher) {
  return name_of(publisher->number, Kind::publisher);
}
const rmw_qos_profile_t* rcl_publisher_get_actual_qos(const rcl_publisher_t* publisher) {
  auto* const entity = here().find(publisher->number, Kind::publisher, "quality of service");
  return entity == nullptr ? nullptr : &entity->qos;
}
rcl_ret_t rcl_publisher_wait_for_all_acked(const rcl_publisher_t* /*publisher*/, std::int64_t timeout_ns) {
  here().pass(std::min<std::int64_t>(timeout_ns, ms_to_ns(2)));
  return here().fails(2) ? RCL_RET_TIMEOUT : RCL_RET_OK;
}
rcl_ret_t rcl_publish_serialized_message(const rcl_publisher_t* publisher,
                                         const rcl_serialized_message_t* message, void* /*allocation*/) {
  auto* const entity = here().find(publisher->number, Kind::publisher, "publish");
  if (entity == nullptr) return RCL_RET_ERROR;
  ++entity->users;
  const std::uint64_t order = ++here().publishes;
  if (here().fails(here().failures.blocked_publish)) mauve::sleep_for(ms_to_ns(4));
  here().pass(us_to_ns(10));
  --entity->users;
  const bool is_sent = !here().fails(here().failures.publish);
  here().published[entity->name].push_back({.entity = publisher->number,
                                            .data = bytes_of(*message),
                                            .is_sent = is_sent,
                                            .order = order,
                                            .ended = here().publishes,
                                            .thread = pthread_self()});
  return is_sent ? RCL_RET_OK : RCL_RET_ERROR;
}

rcl_ret_t rcl_subscription_init(rcl_subscription_t* subscription, const rcl_node_t* /*node*/,
                                const rosidl_message_type_support_t* /*type*/, const char* topic,
                                const rcl_subscription_options_t* options) {
  subscription->number =
      here().open({.kind = Kind::subscription, .name = topic, .depth = options->qos.depth});
  return RCL_RET_OK;
}
rcl_ret_t rcl_subscription_fini(rcl_subscription_t* subscription, rcl_node_t* /*node*/) {
  here().close(subscription->number, Kind::subscription);
  return RCL_RET_OK;
}
const char* rcl_subscription_get_topic_name(const rcl_subscription_t* subscription) {
  return name_of(subscription->number, Kind::subscription);
}
rcl_ret_t rcl_take_serialized_message(const rcl_subscription_t* subscription,
                                      rcl_serialized_message_t* message, rmw_message_info_t* /*about*/,
                                      void* /*allocation*/) {
  mauve::testing::WaitingMessage taken;
  if (!take(subscription->number, Kind::subscription, taken)) return RCL_RET_TAKE_FAILED;
  put(taken.data, *message);
  auto* const entity = here().find(subscription->number, Kind::subscription, "take");
  if (entity->depth != 1)
    here().taken[entity->name].push_back({.entity = subscription->number, .data = std::move(taken.data)});
  return RCL_RET_OK;
}

rcl_ret_t rcl_client_init(rcl_client_t* client, const rcl_node_t* /*node*/,
                          const rosidl_service_type_support_t* /*type*/, const char* service,
                          const rcl_client_options_t* /*options*/) {
  client->number = here().open({.kind = Kind::client, .name = service});
  return RCL_RET_OK;
}
rcl_ret_t rcl_client_fini(rcl_client_t* client, rcl_node_t* /*node*/) {
  here().close(client->number, Kind::client);
  return RCL_RET_OK;
}
const char* rcl_client_get_service_name(const rcl_client_t* client) {
  return name_of(client->number, Kind::client);
}
rcl_ret_t rcl_service_server_is_available(const rcl_node_t* /*node*/, const rcl_client_t* client,
                                          bool* is_available) {
  if (here().find(client->number, Kind::client, "is available") == nullptr) return RCL_RET_ERROR;
  *is_available = here().has_server;
  return RCL_RET_OK;
}
rcl_ret_t rcl_send_request(const rcl_client_t* client, const void* request, std::int64_t* sequence_number) {
  auto* const entity = here().find(client->number, Kind::client, "send request");
  if (entity == nullptr || here().fails(here().failures.send_request)) return RCL_RET_ERROR;
  const std::int64_t sequence = ++entity->last_sequence;
  here().requests.push_back({.client = client->number, .sequence = sequence, .data = typed(request)});
  here().changed();
  here().pass(us_to_ns(30));  // the answer may be there before the number
  *sequence_number = sequence;
  return RCL_RET_OK;
}
rcl_ret_t rcl_take_response(const rcl_client_t* client, rmw_request_id_t* id, void* response) {
  mauve::testing::WaitingMessage taken;
  if (!take(client->number, Kind::client, taken)) return RCL_RET_TAKE_FAILED;
  id->sequence_number = taken.sequence;
  typed(response) = std::move(taken.data);
  return RCL_RET_OK;
}

rcl_ret_t rcl_service_init(rcl_service_t* service, const rcl_node_t* /*node*/,
                           const rosidl_service_type_support_t* /*type*/, const char* name,
                           const rcl_service_options_t* /*options*/) {
  service->number = here().open({.kind = Kind::service, .name = name});
  return RCL_RET_OK;
}
rcl_ret_t rcl_service_fini(rcl_service_t* service, rcl_node_t* /*node*/) {
  here().close(service->number, Kind::service);
  return RCL_RET_OK;
}
const char* rcl_service_get_service_name(const rcl_service_t* service) {
  return name_of(service->number, Kind::service);
}
rcl_ret_t rcl_take_request(const rcl_service_t* service, rmw_request_id_t* id, void* request) {
  mauve::testing::WaitingMessage taken;
  if (!take(service->number, Kind::service, taken)) return RCL_RET_TAKE_FAILED;
  id->sequence_number = taken.sequence;
  typed(request) = std::move(taken.data);
  here().taken_requests[taken.sequence] = false;
  return RCL_RET_OK;
}
rcl_ret_t rcl_send_response(const rcl_service_t* service, rmw_request_id_t* id, void* response) {
  if (here().find(service->number, Kind::service, "send response") == nullptr) return RCL_RET_ERROR;
  if (here().fails(here().failures.send_response)) {
    here().taken_requests[id->sequence_number] = true;
    return RCL_RET_ERROR;
  }
  here().responses.push_back({.sequence = id->sequence_number, .data = typed(response)});
  return RCL_RET_OK;
}

rcl_ret_t rcl_publisher_event_init(rcl_event_t* event, const rcl_publisher_t* publisher,
                                   rcl_publisher_event_type_t /*kind*/) {
  const auto* const of = here().find(publisher->number, Kind::publisher, "event");
  event->number = here().open({.kind = Kind::event, .name = of->name, .of = publisher->number});
  return RCL_RET_OK;
}
rcl_ret_t rcl_subscription_event_init(rcl_event_t* event, const rcl_subscription_t* subscription,
                                      rcl_subscription_event_type_t /*kind*/) {
  const auto* const of = here().find(subscription->number, Kind::subscription, "event");
  event->number = here().open({.kind = Kind::event, .name = of->name, .of = subscription->number});
  return RCL_RET_OK;
}
rcl_ret_t rcl_event_fini(rcl_event_t* event) {
  here().close(event->number, Kind::event);
  return RCL_RET_OK;
}
rcl_ret_t rcl_take_event(const rcl_event_t* event, void* status) {
  auto* const entity = here().find(event->number, Kind::event, "take event");
  if (entity == nullptr || entity->news == 0) return RCL_RET_ERROR;
  const rmw_qos_incompatible_event_status_t found{.total_count = static_cast<std::int32_t>(++entity->uses),
                                                  .total_count_change = std::exchange(entity->news, 0),
                                                  .last_policy_kind = 1};
  std::memcpy(status, &found, sizeof(found));
  return RCL_RET_OK;
}

rcl_ret_t rcl_wait_set_init(rcl_wait_set_t* set, std::size_t subscriptions, std::size_t guard_conditions,
                            std::size_t /*timers*/, std::size_t clients, std::size_t services,
                            std::size_t events, rcl_context_t* /*context*/, rcl_allocator_t /*allocator*/) {
  *set = {.subscriptions = new const rcl_subscription_t* [subscriptions] {},
          .size_of_subscriptions = subscriptions,
          .guard_conditions = new const rcl_guard_condition_t* [guard_conditions] {},
          .size_of_guard_conditions = guard_conditions,
          .clients = new const rcl_client_t* [clients] {},
          .size_of_clients = clients,
          .services = new const rcl_service_t* [services] {},
          .size_of_services = services,
          .events = new const rcl_event_t* [events] {},
          .size_of_events = events,
          .added = {}};
  return RCL_RET_OK;
}
rcl_ret_t rcl_wait_set_fini(rcl_wait_set_t* set) {
  delete[] set->subscriptions;
  delete[] set->guard_conditions;
  delete[] set->clients;
  delete[] set->services;
  delete[] set->events;
  *set = {};
  return RCL_RET_OK;
}
rcl_ret_t rcl_wait_set_clear(rcl_wait_set_t* set) {
  std::ranges::fill(set->added, 0U);
  std::fill_n(set->subscriptions, set->size_of_subscriptions, nullptr);
  std::fill_n(set->guard_conditions, set->size_of_guard_conditions, nullptr);
  std::fill_n(set->clients, set->size_of_clients, nullptr);
  std::fill_n(set->services, set->size_of_services, nullptr);
  std::fill_n(set->events, set->size_of_events, nullptr);
  return RCL_RET_OK;
}
rcl_ret_t rcl_wait_set_add_subscription(rcl_wait_set_t* set, const rcl_subscription_t* subscription,
                                        std::size_t* index) {
  return add(set->subscriptions, set->size_of_subscriptions, set->added[0], subscription, index);
}
rcl_ret_t rcl_wait_set_add_guard_condition(rcl_wait_set_t* set, const rcl_guard_condition_t* guard,
                                           std::size_t* index) {
  return add(set->guard_conditions, set->size_of_guard_conditions, set->added[1], guard, index);
}
rcl_ret_t rcl_wait_set_add_client(rcl_wait_set_t* set, const rcl_client_t* client, std::size_t* index) {
  return add(set->clients, set->size_of_clients, set->added[2], client, index);
}
rcl_ret_t rcl_wait_set_add_service(rcl_wait_set_t* set, const rcl_service_t* service, std::size_t* index) {
  return add(set->services, set->size_of_services, set->added[3], service, index);
}
rcl_ret_t rcl_wait_set_add_event(rcl_wait_set_t* set, const rcl_event_t* event, std::size_t* index) {
  return add(set->events, set->size_of_events, set->added[4], event, index);
}
rcl_ret_t rcl_wait(rcl_wait_set_t* set, std::int64_t timeout_ns) { return here().wait(*set, timeout_ns); }
