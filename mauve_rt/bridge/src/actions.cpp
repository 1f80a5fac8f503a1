// SPDX-License-Identifier: LGPL-3.0-or-later
#include "actions.hpp"

#include <rcl_action/wait.h>
#include <rcutils/time.h>

#include <algorithm>
#include <cstring>
#include <random>

#include "mauve_rt/base/contract.hpp"
#include "mauve_rt/base/error.hpp"
#include "mauve_rt/base/seam/guards.hpp"
#include "mauve_rt/base/time.hpp"
#include "mauve_rt/data/cdr.hpp"

#include "rcl_error.hpp"

namespace mauve::bridge {

namespace {

constexpr int kActionRequestsAtOnce = 64;    // of one kind before the others have their turn
constexpr std::size_t kGoalRequests = 100;   // that the middleware keeps until they are taken
constexpr std::size_t kResultRequests = 64;  // that wait for the result of one goal; more get no answer
constexpr time_ns_t kServerEvery =
    s_to_ns(1);                                // so often the bridge checks whether the server is still there
constexpr time_ns_t kServerGone = s_to_ns(3);  // so long it may be unseen: discovery has gaps

// How the C structs of all types begin that rosidl makes for an action.
struct IdFirst {  // SendGoal_Request, GetResult_Request, FeedbackMessage
  std::uint8_t id[16];
};
struct SendGoalResponse {
  bool accepted;
  builtin_interfaces__msg__Time stamp;
};
struct StateFirst {  // GetResult_Response
  std::int8_t state;
};

// On the wire, too, the id comes first. Its 16 bytes keep every alignment: what follows it is a message as it stands.
constexpr std::size_t kIdEnd = kCdrHeader.size() + sizeof(IdFirst);

/// A message that begins with an id, without the id.
void cut_id(std::span<const std::byte> whole, std::vector<std::byte>& part) {
  const auto header = whole.first(std::min(whole.size(), kCdrHeader.size()));
  part.assign(header.begin(), header.end());
  if (whole.size() <= kIdEnd) return;
  const auto rest = whole.subspan(kIdEnd);
  part.insert(part.end(), rest.begin(), rest.end());
}

void insert_id(const GoalId& id, std::vector<std::byte>& message) {
  const auto bytes = std::as_bytes(std::span(id));
  message.insert(message.begin() + std::ssize(kCdrHeader), bytes.begin(), bytes.end());
}

GoalId id_of(const std::uint8_t* bytes) {
  GoalId id{};
  std::copy_n(bytes, id.size(), id.begin());
  return id;
}
GoalId id_of(const TypedMessage& message) { return id_of(message.as<IdFirst>().id); }
GoalId id_of(const rcl_action_goal_info_t& goal) { return id_of(goal.goal_id.uuid); }

/// Expanded and remapped, for reports: rcl does so with the name of each topic and service of an action.
std::string full_name(const rcl_node_t& node, const std::string& name) {
  char* resolved = nullptr;
  const rcl_allocator_t allocator = rcl_get_default_allocator();
  if (!went_well(rcl_node_resolve_name(&node, name.c_str(), allocator, false, false, &resolved))) return name;
  std::string full = resolved;
  allocator.deallocate(resolved, allocator.state);
  return full;
}

builtin_interfaces__msg__Time stamp_now() {
  rcutils_time_point_value_t now_ns = 0;
  went_well(rcutils_system_time_now(&now_ns));
  return {.sec = static_cast<std::int32_t>(now_ns / s_to_ns(1)),
          .nanosec = static_cast<std::uint32_t>(now_ns % s_to_ns(1))};
}

rcl_action_goal_info_t info_of(const GoalId& id) {
  rcl_action_goal_info_t info = rcl_action_get_zero_initialized_goal_info();
  std::copy(id.begin(), id.end(), info.goal_id.uuid);
  info.stamp = stamp_now();
  return info;
}

/// A random one, as RFC 9562 marks it.
GoalId random_id() {
  static std::random_device device;
  GoalId id{};
  for (std::uint8_t& byte : id) byte = static_cast<std::uint8_t>(device());
  id[6] = static_cast<std::uint8_t>((id[6] & 0x0FU) | 0x40U);
  id[8] = static_cast<std::uint8_t>((id[8] & 0x3FU) | 0x80U);
  return id;
}

}  // namespace

SteadyClock::SteadyClock() {
  rcl_allocator_t allocator = rcl_get_default_allocator();
  check(rcl_clock_init(RCL_STEADY_TIME, &clock_, &allocator), "there is no steady clock", "action");
}
SteadyClock::~SteadyClock() { went_well(rcl_clock_fini(&clock_)); }

ResultResponse::ResultResponse(const ActionTypeSupport& type)
    : response_(type.result_response), type_(type.result), offset_(type.result_offset) {}

GoalState ResultResponse::state() const noexcept {
  return static_cast<GoalState>(response_.as<StateFirst>().state);
}
void ResultResponse::set_state(GoalState state) noexcept {
  response_.as<StateFirst>().state = static_cast<std::int8_t>(state);
}
bool ResultResponse::deserialize_result(std::vector<std::byte>& message) {
  const rcl_serialized_message_t serialized = borrowed(message);
  return went_well(rmw_deserialize(&serialized, type_, result()));
}
bool ResultResponse::serialize_result(OwnedMessage& into) const {
  return went_well(rmw_serialize(result(), type_, into.get()));
}

BoundAction::BoundAction(const rcl_node_t& node, const ActionSettings& settings)
    : Binding(settings.resource),
      settings_(settings),
      type_(action_type_support(settings.type)),
      goal_request_(type_.goal_request),
      goal_response_(type_.goal_response),
      result_request_(type_.result_request),
      result_response_(type_),
      feedback_(type_.feedback),
      name_(full_name(node, settings.name)) {}

std::string BoundAction::described() const {
  return "resource " + settings_.resource + ", action " + settings_.name;
}

void BoundAction::check_kind(const Resource& resource, bool fits, const char* kind) const {
  if (fits && resource.type() == settings_.type) return;
  throw Error(ErrorCode::type_mismatch, "the resource has no goals of that action",
              {.element = "resource " + resource.name(),
               .expected = std::string("a resource of kind ") + kind + " and type " + settings_.type,
               .found = "kind " + resource.kind() + ", type " + resource.type()});
}

ActionReport BoundAction::report_of(const ActionCounts& counts, bool is_offered) const {
  return {.resource = resource_name(), .action = name_, .is_offered = is_offered, .counts = counts};
}

// ---- a server

OfferedAction::OfferedAction(rcl_node_t& node, const ActionSettings& settings)
    : BoundAction(node, settings), entity_(node, rcl_action_get_zero_initialized_server()) {
  rcl_action_server_options_t options = rcl_action_server_get_default_options();
  options.goal_service_qos.depth = kGoalRequests;
  check(rcl_action_server_init(entity_.get(), &node, clock_.get(), type_.action, settings.name.c_str(),
                               &options),
        "the action cannot be offered", described());
  OwnedMessage unknown;
  if (result_response_.serialize_result(unknown))
    unknown_.assign(unknown.bytes().begin(), unknown.bytes().end());
}

void OfferedAction::attach(std::shared_ptr<Resource> resource) {
  check_kind(*resource, resource->action_server() != nullptr, "action_server");
  Binding::attach(std::move(resource));
  server_ = this->resource().action_server();
}

void OfferedAction::end() { server_->close(monotonic_now_ns()); }

std::vector<Arrival*> OfferedAction::arrivals(Lane lane) {
  return lane == Lane::requests ? std::vector<Arrival*>{this} : std::vector<Arrival*>{};
}

time_ns_t OfferedAction::next_look_ns() const { return server_->poll(monotonic_now_ns()); }

void OfferedAction::join(rcl_wait_set_t& set) {
  went_well(rcl_action_wait_set_add_action_server(&set, entity_.get(), nullptr));
}

bool OfferedAction::has_arrived(const rcl_wait_set_t& set) const {
  bool goal = false, cancel = false, result = false, expired = false;
  return went_well(rcl_action_server_wait_set_get_entities_ready(&set, entity_.get(), &goal, &cancel, &result,
                                                                 &expired)) &&
         (goal || cancel || result || expired);
}

void OfferedAction::take() {
  take_goals();
  take_cancels();
  take_results();
  forget_expired();
}

void OfferedAction::take_goals() {
  for (int taken = 0; taken < kActionRequestsAtOnce; ++taken) {
    const LockGuard lock(mutex_);
    rmw_request_id_t asked{};
    if (!went_well(rcl_action_take_goal_request(entity_.get(), &asked, goal_request_.get()))) return;
    const GoalId id = id_of(goal_request_);
    bool waits = false;
    if (!goals_.contains(id) && goal_request_.serialize(incoming_)) {
      cut_id(incoming_.bytes(), goal_);
      // The sender's thread may find the goal before it is noted here: that thread waits for the mutex.
      waits = server_->ask(id, goal_, monotonic_now_ns()) == GoalReason::none;
    }
    if (waits) {
      goals_[id].asked = asked;
    } else {
      answer(asked, false);
    }
  }
}

void OfferedAction::answer(const rmw_request_id_t& asked, bool is_accepted) {
  goal_response_.as<SendGoalResponse>() = {.accepted = is_accepted, .stamp = stamp_now()};
  rmw_request_id_t id = asked;
  went_well(rcl_action_send_goal_response(entity_.get(), &id, goal_response_.get()));
}

void OfferedAction::take_cancels() {
  for (int taken = 0; taken < kActionRequestsAtOnce; ++taken) {
    const LockGuard lock(mutex_);
    rmw_request_id_t asked{};
    rcl_action_cancel_request_t request = rcl_action_get_zero_initialized_cancel_request();
    if (!went_well(rcl_action_take_cancel_request(entity_.get(), &asked, &request))) return;
    rcl_action_cancel_response_t response = rcl_action_get_zero_initialized_cancel_response();
    if (!went_well(rcl_action_process_cancel_request(entity_.get(), &request, &response))) continue;
    auto& canceled = response.msg.goals_canceling;
    std::size_t kept = 0;
    for (std::size_t i = 0; i < canceled.size; ++i) {
      if (server_->cancel(id_of(canceled.data[i]), monotonic_now_ns()))
        canceled.data[kept++] = canceled.data[i];
    }
    if (kept == 0 && canceled.size != 0)
      response.msg.return_code = action_msgs__srv__CancelGoal_Response__ERROR_GOAL_TERMINATED;
    const std::size_t reserved = std::exchange(canceled.size, kept);
    went_well(rcl_action_send_cancel_response(entity_.get(), &asked, &response.msg));
    canceled.size = reserved;
    went_well(rcl_action_cancel_response_fini(&response));
  }
}

void OfferedAction::take_results() {
  for (int taken = 0; taken < kActionRequestsAtOnce; ++taken) {
    const LockGuard lock(mutex_);
    rmw_request_id_t asked{};
    if (!went_well(rcl_action_take_result_request(entity_.get(), &asked, result_request_.get()))) return;
    const auto found = goals_.find(id_of(result_request_));
    if (found == goals_.end()) {
      send_result(asked, GoalState::unknown, unknown_);
    } else if (is_final(found->second.ended)) {
      send_result(asked, found->second.ended, found->second.result);
    } else if (found->second.results.size() < kResultRequests) {
      found->second.results.push_back(asked);
    }
  }
}

void OfferedAction::send_result(const rmw_request_id_t& asked, GoalState ended,
                                std::vector<std::byte>& result) {
  rmw_request_id_t id = asked;
  result_response_.set_state(ended);
  if (result_response_.deserialize_result(result))
    went_well(rcl_action_send_result_response(entity_.get(), &id, result_response_.get()));
}

void OfferedAction::forget_expired() {
  const LockGuard lock(mutex_);
  rcl_action_goal_info_t expired = rcl_action_get_zero_initialized_goal_info();
  for (std::size_t count = 1;
       went_well(rcl_action_expire_goals(entity_.get(), &expired, 1, &count)) && count != 0;)
    goals_.erase(id_of(expired));
}

bool OfferedAction::send() {
  GoalEvent event;
  if (!server_->next_event(event, message_)) return false;
  const LockGuard lock(mutex_);
  const auto found = goals_.find(event.id);
  if (found == goals_.end()) return true;
  if (event.has_feedback) {
    insert_id(event.id, message_);
    if (feedback_.deserialize(message_))
      went_well(rcl_action_publish_feedback(entity_.get(), feedback_.get()));
  } else if (event.state == GoalState::rejected || !accept(event.id, found->second)) {
    answer(found->second.asked, false);
    goals_.erase(found);
  } else {
    follow(event, found->second);
    publish_status();
  }
  return true;
}

/// Unless it was before; false: rcl refuses.
bool OfferedAction::accept(const GoalId& id, Goal& goal) {
  if (goal.handle != nullptr) return true;
  const rcl_action_goal_info_t info = info_of(id);
  goal.handle = rcl_action_accept_new_goal(entity_.get(), &info);
  if (goal.handle == nullptr) {
    rcl_reset_error();
    return false;
  }
  answer(goal.asked, true);
  return true;
}

/// By the events of rcl that lead there: states in between may be missing.
void OfferedAction::follow(const GoalEvent& event, Goal& goal) {
  const auto update = [&](rcl_action_goal_event_t change) {
    went_well(rcl_action_update_goal_state(goal.handle, change));
  };
  rcl_action_goal_state_t state = GOAL_STATE_UNKNOWN;
  if (!went_well(rcl_action_goal_handle_get_status(goal.handle, &state))) return;
  const bool is_to_cancel = event.state == GoalState::canceling || event.state == GoalState::canceled;
  if (is_to_cancel && state != GOAL_STATE_CANCELING) update(GOAL_EVENT_CANCEL_GOAL);
  if (!is_to_cancel && event.state != GoalState::accepted && state == GOAL_STATE_ACCEPTED)
    update(GOAL_EVENT_EXECUTE);
  if (event.state == GoalState::succeeded) update(GOAL_EVENT_SUCCEED);
  if (event.state == GoalState::aborted) update(GOAL_EVENT_ABORT);
  if (event.state == GoalState::canceled) update(GOAL_EVENT_CANCELED);
  if (!event.has_result) return;
  went_well(rcl_action_notify_goal_done(entity_.get()));
  goal.ended = event.state;
  goal.result = message_;
  for (const rmw_request_id_t& asked : std::exchange(goal.results, {}))
    send_result(asked, goal.ended, goal.result);
}

void OfferedAction::publish_status() {
  rcl_action_goal_status_array_t states = rcl_action_get_zero_initialized_goal_status_array();
  if (!went_well(rcl_action_get_goal_status_array(entity_.get(), &states))) return;
  went_well(rcl_action_publish_status(entity_.get(), &states.msg));
  went_well(rcl_action_goal_status_array_fini(&states));
}

void OfferedAction::report(BridgeReport& report) const {
  report.actions.push_back(report_of(server_ != nullptr ? server_->counts() : ActionCounts{}, true));
}

// ---- a client

CalledAction::CalledAction(rcl_node_t& node, const ActionSettings& settings)
    : BoundAction(node, settings), node_(node), entity_(node, rcl_action_get_zero_initialized_client()) {
  const rcl_action_client_options_t options = rcl_action_client_get_default_options();
  check(rcl_action_client_init(entity_.get(), &node, type_.action, settings.name.c_str(), &options),
        "the action cannot be called", described());
}

CalledAction::~CalledAction() {
  if (client_ != nullptr) end();
}

void CalledAction::attach(std::shared_ptr<Resource> resource) {
  check_kind(*resource, resource->action_client() != nullptr, "action_client");
  Binding::attach(std::move(resource));
  client_ = this->resource().action_client();
}

void CalledAction::end() {
  send_cancel();
  if (const std::uint32_t number = client_->open_goal(); number != 0)
    client_->give_up(number, GoalReason::removed, monotonic_now_ns());
}

std::vector<Arrival*> CalledAction::arrivals(Lane lane) {
  return lane == Lane::messages ? std::vector<Arrival*>{this} : std::vector<Arrival*>{};
}

CalledAction::Goal CalledAction::present() const {
  const LockGuard lock(mutex_);
  return goal_;
}

bool CalledAction::has_server() const {
  bool is_there = false;
  return went_well(rcl_action_server_is_available(&node_, entity_.get(), &is_there)) && is_there;
}

time_ns_t CalledAction::next_look_ns() const {
  const time_ns_t now_ns = monotonic_now_ns();
  const time_ns_t answer_ns = client_->poll(now_ns);
  const std::uint32_t number = client_->open_goal();
  if (number == 0) return answer_ns;
  if (now_ns >= next_check_ns_) {  // the sender comes here after each message, and the graph is slow to ask
    next_check_ns_ = now_ns + kServerEvery;
    check_server(number, now_ns);
  }
  return std::min(answer_ns, next_check_ns_);
}

void CalledAction::check_server(std::uint32_t number, time_ns_t now_ns) const {
  if (has_server()) {
    unseen_since_ns_ = kForever;
  } else if (unseen_since_ns_ == kForever) {
    unseen_since_ns_ = now_ns;
  } else if (now_ns - unseen_since_ns_ >= kServerGone) {
    client_->give_up(number, GoalReason::no_server, now_ns);
  }
}

bool CalledAction::send() {
  send_cancel();
  std::uint32_t number = 0;
  if (!client_->next_goal(outgoing_, number)) return false;
  const GoalId id = random_id();
  insert_id(id, outgoing_);
  send_goal(id, number);
  return true;
}

void CalledAction::send_goal(const GoalId& id, std::uint32_t number) {
  const auto refuse = [&](GoalReason reason) { client_->give_up(number, reason, monotonic_now_ns()); };
  if (!has_server()) return refuse(GoalReason::no_server);
  if (!goal_request_.deserialize(outgoing_)) return refuse(GoalReason::malformed);
  // The answer may come before this returns: it waits for the sequence number.
  const LockGuard lock(mutex_);
  goal_ = {.id = id, .number = number};
  unseen_since_ns_ = kForever;  // has_server() has just seen it
  if (!went_well(rcl_action_send_goal_request(entity_.get(), goal_request_.get(), &goal_.asked)))
    refuse(GoalReason::no_server);
}

void CalledAction::send_cancel() {
  std::uint32_t number = 0;
  if (!client_->next_cancel(number)) return;
  const LockGuard lock(mutex_);
  if (number != goal_.number) return;
  rcl_action_cancel_request_t request = rcl_action_get_zero_initialized_cancel_request();
  std::copy(goal_.id.begin(), goal_.id.end(), request.goal_info.goal_id.uuid);
  std::int64_t sequence = 0;
  went_well(rcl_action_send_cancel_request(entity_.get(), &request, &sequence));
}

void CalledAction::join(rcl_wait_set_t& set) {
  went_well(rcl_action_wait_set_add_action_client(&set, entity_.get(), nullptr, nullptr));
}

bool CalledAction::has_arrived(const rcl_wait_set_t& set) const {
  bool feedback = false, status = false, goal = false, cancel = false, result = false;
  return went_well(rcl_action_client_wait_set_get_entities_ready(&set, entity_.get(), &feedback, &status,
                                                                 &goal, &cancel, &result)) &&
         (feedback || status || goal || cancel || result);
}

void CalledAction::take() {
  take_answers();
  take_feedback();
  take_states();
  take_results();
  rmw_request_id_t id{};
  rcl_action_cancel_response_t response = rcl_action_get_zero_initialized_cancel_response();
  // What it says is seen by the states.
  while (went_well(rcl_action_take_cancel_response(entity_.get(), &id, &response.msg))) {
  }
  action_msgs__srv__CancelGoal_Response__fini(&response.msg);
}

void CalledAction::take_answers() {
  rmw_request_id_t id{};
  while (went_well(rcl_action_take_goal_response(entity_.get(), &id, goal_response_.get()))) {
    const bool is_accepted = goal_response_.as<SendGoalResponse>().accepted;
    std::uint32_t number = 0;
    {
      const LockGuard lock(mutex_);
      if (id.sequence_number != goal_.asked) continue;  // of a goal that was given up
      number = goal_.number;
      std::copy(goal_.id.begin(), goal_.id.end(), result_request_.as<IdFirst>().id);
      if (is_accepted)
        went_well(rcl_action_send_result_request(entity_.get(), result_request_.get(), &goal_.result));
    }
    client_->answer(number, is_accepted, monotonic_now_ns());
  }
}

void CalledAction::take_feedback() {
  while (went_well(rcl_action_take_feedback(entity_.get(), feedback_.get()))) {
    const Goal goal = present();
    if (id_of(feedback_) != goal.id || !feedback_.serialize(incoming_)) continue;
    cut_id(incoming_.bytes(), part_);
    client_->feed_back(goal.number, part_, monotonic_now_ns());
  }
}

void CalledAction::take_states() {
  action_msgs__msg__GoalStatusArray states{};
  if (!action_msgs__msg__GoalStatusArray__init(&states)) return;
  while (went_well(rcl_action_take_status(entity_.get(), &states))) {
    const Goal goal = present();
    for (std::size_t i = 0; i < states.status_list.size; ++i) {
      const action_msgs__msg__GoalStatus& status = states.status_list.data[i];
      if (id_of(status.goal_info) == goal.id)
        client_->set_state(goal.number, static_cast<GoalState>(status.status), monotonic_now_ns());
    }
  }
  action_msgs__msg__GoalStatusArray__fini(&states);
}

void CalledAction::take_results() {
  rmw_request_id_t id{};
  while (went_well(rcl_action_take_result_response(entity_.get(), &id, result_response_.get()))) {
    const Goal goal = present();
    if (id.sequence_number == goal.result && result_response_.serialize_result(incoming_))
      client_->finish(goal.number, result_response_.state(), incoming_.bytes(), monotonic_now_ns());
  }
}

void CalledAction::report(BridgeReport& report) const {
  report.actions.push_back(report_of(client_ != nullptr ? client_->counts() : ActionCounts{}, false));
}

}  // namespace mauve::bridge
