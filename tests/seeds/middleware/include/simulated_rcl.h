// SPDX-License-Identifier: LGPL-3.0-or-later
// The part of rcl, rmw and rcutils that mauve_rt/bridge uses, for the seeds: names and meanings are those of rcl, the middleware behind
// them is Middleware. The bridge itself is compiled against the real headers, too, so a difference in a name is seen there.
#pragma once

#include <cstddef>
#include <cstdint>

// Names are those of rcl.
// NOLINTBEGIN(readability-identifier-naming,cppcoreguidelines-macro-usage,modernize-use-using)

using rcl_ret_t = std::int32_t;
using rmw_ret_t = std::int32_t;
inline constexpr rcl_ret_t RCL_RET_OK = 0;
inline constexpr rcl_ret_t RCL_RET_ERROR = 1;
inline constexpr rcl_ret_t RCL_RET_TIMEOUT = 2;
inline constexpr rcl_ret_t RCL_RET_UNSUPPORTED = 3;
inline constexpr rcl_ret_t RCL_RET_TAKE_FAILED = 401;
inline constexpr rmw_ret_t RMW_RET_OK = 0;

// ---- errors, memory

struct rcl_error_string_t {
  char str[64];
};
rcl_error_string_t rcl_get_error_string();
void rcl_reset_error();

struct rcl_allocator_t {};
inline rcl_allocator_t rcl_get_default_allocator() { return {}; }

struct rcl_serialized_message_t {
  std::uint8_t* buffer;
  std::size_t buffer_length;
  std::size_t buffer_capacity;
  rcl_allocator_t allocator;
};
using rmw_serialized_message_t = rcl_serialized_message_t;
inline rmw_serialized_message_t rmw_get_zero_initialized_serialized_message() { return {}; }
rmw_ret_t rmw_serialized_message_init(rmw_serialized_message_t* message, std::size_t capacity,
                                      const rcl_allocator_t* allocator);
rmw_ret_t rmw_serialized_message_fini(rmw_serialized_message_t* message);

// ---- types

struct rosidl_message_type_support_t {};
struct rosidl_service_type_support_t {};
rmw_ret_t rmw_serialize(const void* message, const rosidl_message_type_support_t* type,
                        rmw_serialized_message_t* serialized);
rmw_ret_t rmw_deserialize(const rmw_serialized_message_t* serialized,
                          const rosidl_message_type_support_t* type, void* message);

// ---- settings

struct rmw_time_t {
  std::uint64_t sec;
  std::uint64_t nsec;
};
enum rmw_qos_reliability_policy_t {
  RMW_QOS_POLICY_RELIABILITY_RELIABLE = 1,
  RMW_QOS_POLICY_RELIABILITY_BEST_EFFORT = 2,
};
enum rmw_qos_durability_policy_t { RMW_QOS_POLICY_DURABILITY_TRANSIENT_LOCAL = 1 };
struct rmw_qos_profile_t {
  std::size_t depth;
  rmw_qos_reliability_policy_t reliability;
  rmw_qos_durability_policy_t durability;
  rmw_time_t deadline;
  rmw_time_t liveliness_lease_duration;
};
inline constexpr rmw_qos_profile_t rmw_qos_profile_sensor_data{
    .depth = 5,
    .reliability = RMW_QOS_POLICY_RELIABILITY_BEST_EFFORT,
    .durability = {},
    .deadline = {},
    .liveliness_lease_duration = {}};

// ---- entities: each is known by its number in the middleware, 0: it was not initialised

struct rcl_context_t {
  std::uint64_t number;
};
struct rcl_node_t {
  rcl_context_t* context;
};
bool rcl_context_is_valid(const rcl_context_t* context);

#define MAUVE_SIMULATED_ENTITY(name)                                     \
  struct rcl_##name##_t {                                                \
    std::uint64_t number;                                                \
  };                                                                     \
  struct rcl_##name##_options_t {                                        \
    rmw_qos_profile_t qos;                                               \
  };                                                                     \
  inline rcl_##name##_t rcl_get_zero_initialized_##name() { return {}; } \
  inline rcl_##name##_options_t rcl_##name##_get_default_options() { return {}; }

MAUVE_SIMULATED_ENTITY(guard_condition)
MAUVE_SIMULATED_ENTITY(publisher)
MAUVE_SIMULATED_ENTITY(subscription)
MAUVE_SIMULATED_ENTITY(client)
MAUVE_SIMULATED_ENTITY(service)
MAUVE_SIMULATED_ENTITY(event)
#undef MAUVE_SIMULATED_ENTITY

rcl_ret_t rcl_guard_condition_init(rcl_guard_condition_t* guard, rcl_context_t* context,
                                   rcl_guard_condition_options_t options);
rcl_ret_t rcl_guard_condition_fini(rcl_guard_condition_t* guard);
rcl_ret_t rcl_trigger_guard_condition(rcl_guard_condition_t* guard);

rcl_ret_t rcl_publisher_init(rcl_publisher_t* publisher, const rcl_node_t* node,
                             const rosidl_message_type_support_t* type, const char* topic,
                             const rcl_publisher_options_t* options);
rcl_ret_t rcl_publisher_fini(rcl_publisher_t* publisher, rcl_node_t* node);
const char* rcl_publisher_get_topic_name(const rcl_publisher_t* publisher);
const rmw_qos_profile_t* rcl_publisher_get_actual_qos(const rcl_publisher_t* publisher);
rcl_ret_t rcl_publisher_wait_for_all_acked(const rcl_publisher_t* publisher, std::int64_t timeout_ns);
rcl_ret_t rcl_publish_serialized_message(const rcl_publisher_t* publisher,
                                         const rcl_serialized_message_t* message, void* allocation);

struct rmw_message_info_t {};
inline rmw_message_info_t rmw_get_zero_initialized_message_info() { return {}; }
rcl_ret_t rcl_subscription_init(rcl_subscription_t* subscription, const rcl_node_t* node,
                                const rosidl_message_type_support_t* type, const char* topic,
                                const rcl_subscription_options_t* options);
rcl_ret_t rcl_subscription_fini(rcl_subscription_t* subscription, rcl_node_t* node);
const char* rcl_subscription_get_topic_name(const rcl_subscription_t* subscription);
rcl_ret_t rcl_take_serialized_message(const rcl_subscription_t* subscription,
                                      rcl_serialized_message_t* message, rmw_message_info_t* about,
                                      void* allocation);

struct rmw_request_id_t {
  std::int64_t sequence_number;
};
rcl_ret_t rcl_client_init(rcl_client_t* client, const rcl_node_t* node,
                          const rosidl_service_type_support_t* type, const char* service,
                          const rcl_client_options_t* options);
rcl_ret_t rcl_client_fini(rcl_client_t* client, rcl_node_t* node);
const char* rcl_client_get_service_name(const rcl_client_t* client);
rcl_ret_t rcl_service_server_is_available(const rcl_node_t* node, const rcl_client_t* client,
                                          bool* is_available);
rcl_ret_t rcl_send_request(const rcl_client_t* client, const void* request, std::int64_t* sequence_number);
rcl_ret_t rcl_take_response(const rcl_client_t* client, rmw_request_id_t* id, void* response);

rcl_ret_t rcl_service_init(rcl_service_t* service, const rcl_node_t* node,
                           const rosidl_service_type_support_t* type, const char* name,
                           const rcl_service_options_t* options);
rcl_ret_t rcl_service_fini(rcl_service_t* service, rcl_node_t* node);
const char* rcl_service_get_service_name(const rcl_service_t* service);
rcl_ret_t rcl_take_request(const rcl_service_t* service, rmw_request_id_t* id, void* request);
rcl_ret_t rcl_send_response(const rcl_service_t* service, rmw_request_id_t* id, void* response);

enum rcl_publisher_event_type_t {
  RCL_PUBLISHER_OFFERED_DEADLINE_MISSED,
  RCL_PUBLISHER_LIVELINESS_LOST,
  RCL_PUBLISHER_OFFERED_INCOMPATIBLE_QOS,
};
enum rcl_subscription_event_type_t {
  RCL_SUBSCRIPTION_REQUESTED_DEADLINE_MISSED,
  RCL_SUBSCRIPTION_LIVELINESS_CHANGED,
  RCL_SUBSCRIPTION_REQUESTED_INCOMPATIBLE_QOS,
};
/// The events of deadlines and liveliness have the first member in common; no seed has them.
struct rmw_qos_incompatible_event_status_t {
  std::int32_t total_count;
  std::int32_t total_count_change;
  int last_policy_kind;
};
struct rmw_offered_deadline_missed_status_t {
  std::int32_t total_count;
};
struct rmw_requested_deadline_missed_status_t {
  std::int32_t total_count;
};
struct rmw_liveliness_lost_status_t {
  std::int32_t total_count;
};
struct rmw_liveliness_changed_status_t {
  std::int32_t not_alive_count_change;
};
rcl_ret_t rcl_publisher_event_init(rcl_event_t* event, const rcl_publisher_t* publisher,
                                   rcl_publisher_event_type_t kind);
rcl_ret_t rcl_subscription_event_init(rcl_event_t* event, const rcl_subscription_t* subscription,
                                      rcl_subscription_event_type_t kind);
rcl_ret_t rcl_event_fini(rcl_event_t* event);
rcl_ret_t rcl_take_event(const rcl_event_t* event, void* status);

// ---- waits

struct rcl_wait_set_t {
  const rcl_subscription_t** subscriptions;
  std::size_t size_of_subscriptions;
  const rcl_guard_condition_t** guard_conditions;
  std::size_t size_of_guard_conditions;
  const rcl_client_t** clients;
  std::size_t size_of_clients;
  const rcl_service_t** services;
  std::size_t size_of_services;
  const rcl_event_t** events;
  std::size_t size_of_events;
  std::size_t added[5];
};
inline rcl_wait_set_t rcl_get_zero_initialized_wait_set() { return {}; }
rcl_ret_t rcl_wait_set_init(rcl_wait_set_t* set, std::size_t subscriptions, std::size_t guard_conditions,
                            std::size_t timers, std::size_t clients, std::size_t services, std::size_t events,
                            rcl_context_t* context, rcl_allocator_t allocator);
rcl_ret_t rcl_wait_set_fini(rcl_wait_set_t* set);
rcl_ret_t rcl_wait_set_clear(rcl_wait_set_t* set);
rcl_ret_t rcl_wait_set_add_guard_condition(rcl_wait_set_t* set, const rcl_guard_condition_t* guard,
                                           std::size_t* index);
rcl_ret_t rcl_wait_set_add_subscription(rcl_wait_set_t* set, const rcl_subscription_t* subscription,
                                        std::size_t* index);
rcl_ret_t rcl_wait_set_add_client(rcl_wait_set_t* set, const rcl_client_t* client, std::size_t* index);
rcl_ret_t rcl_wait_set_add_service(rcl_wait_set_t* set, const rcl_service_t* service, std::size_t* index);
rcl_ret_t rcl_wait_set_add_event(rcl_wait_set_t* set, const rcl_event_t* event, std::size_t* index);
rcl_ret_t rcl_wait(rcl_wait_set_t* set, std::int64_t timeout_ns);

// ---- the log of ROS is for nobody here

#define RCUTILS_LOG_ERROR_THROTTLE_NAMED(clock, every_ms, name, format, ...) \
  static_cast<void>(every_ms), static_cast<void>(__VA_ARGS__)

// NOLINTEND(readability-identifier-naming,cppcoreguidelines-macro-usage,modernize-use-using)
