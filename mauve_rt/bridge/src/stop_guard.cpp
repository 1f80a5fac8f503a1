// SPDX-License-Identifier: LGPL-3.0-or-later
#include "stop_guard.hpp"

#include <lifecycle_msgs/srv/change_state.h>
#include <mauve_msgs/srv/stop.h>
#include <rcutils/logging_macros.h>
#include <rosidl_runtime_c/string_functions.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "mauve_rt/base/error.hpp"

#include "rcl_error.hpp"
#include "thread.hpp"

namespace mauve::bridge {

namespace {

constexpr time_ns_t kPatience = ms_to_ns(200);   // of a request, for the node to read it
constexpr time_ns_t kUnreadLook = ms_to_ns(10);  // whether it was read
constexpr time_ns_t kStopLook = ms_to_ns(2);     // whether a component has stopped
constexpr int kMostAtOnce = 64;
constexpr std::size_t kMostAnswered = 1000;  // kept for a node that does not take them
constexpr double kDefaultTimeout = 1.0;      // s
constexpr double kLongestTimeout = 10.0;     // s, as the node's own
constexpr const char* kSilent = "the executor's Python side did not take the request up";

std::string text_of(const rosidl_runtime_c__String& text) { return {text.data, text.size}; }

std::vector<std::byte> bytes_of(const OwnedMessage& message) {
  const auto bytes = message.bytes();
  return {bytes.begin(), bytes.end()};
}

/// Equal where two requests are: their serialized forms differ in what is between the fields.
std::string words_of(const mauve_msgs__srv__Stop_Request& request) {
  std::string words;
  for (const auto* text : {&request.request_id, &request.requested_by, &request.cause, &request.component})
    words += text_of(*text) + '\n';
  return words + std::to_string(request.timeout_s) + '\n' + std::to_string(request.expected_revision) + '\n' +
         std::to_string(static_cast<int>(request.force));
}

/// Why a stop is not begun; the node refuses what this refuses, but for a revision that fits.
std::optional<StopReply> refusal(const mauve_msgs__srv__Stop_Request& request) {
  if (!std::isfinite(request.timeout_s) || request.timeout_s < 0.0 || request.timeout_s > kLongestTimeout)
    return StopReply{"INVALID", "bad timeout: expected 0 (the default) to 10 s"};
  if (request.expected_revision == 0) return std::nullopt;
  return StopReply{"WRONG_REVISION",
                   std::string(kSilent) + ", and the revision is unknown; ask without expected_revision"};
}

/// Of a transition: whether it ends with safe outputs. rclpy goes by the label where there is one.
bool protects(const lifecycle_msgs__msg__Transition& transition) {
  const std::string label = text_of(transition.label);
  if (!label.empty()) return label == "deactivate" || label == "shutdown";
  return transition.id == lifecycle_msgs__msg__Transition__TRANSITION_DEACTIVATE ||
         transition.id == lifecycle_msgs__msg__Transition__TRANSITION_ACTIVE_SHUTDOWN;
}

}  // namespace

StopGuard::StopGuard(GuardedNode guarded)
    : guarded_(std::move(guarded)),
      stop_type_(call_type_support("mauve_msgs/srv/Stop")),
      change_type_(call_type_support("lifecycle_msgs/srv/ChangeState")),
      stop_request_(stop_type_.request),
      stop_response_(stop_type_.response),
      change_request_(change_type_.request),
      watched_{{.service = guarded_.stop, .take = &StopGuard::take_stops},
               {.service = guarded_.change_state, .take = &StopGuard::take_changes}} {
  check(rcl_guard_condition_init(&wake_, guarded_.node.context, rcl_guard_condition_get_default_options()),
        "requests to stop cannot be guarded", "guard condition");
  thread_ = start_thread("stop guard", [this] { run(); });
}

StopGuard::~StopGuard() {
  stop();
  if (rcl_guard_condition_fini(&wake_) != RCL_RET_OK) rcl_reset_error();
}

void StopGuard::set_architecture(Architecture* architecture) {
  const std::lock_guard lock(architecture_mutex_);
  architecture_ = architecture;
}

void StopGuard::stop() {
  if (!thread_.joinable()) return;
  ending_.store(true, std::memory_order_release);
  if (rcl_trigger_guard_condition(&wake_) != RCL_RET_OK) rcl_reset_error();
  thread_.join();
}

// ---- the node's side

std::vector<StopGuard::Answered> StopGuard::take_answered() {
  const std::lock_guard lock(mutex_);
  return std::exchange(answered_, {});
}

std::vector<StopGuard::Transition> StopGuard::take_transitions() {
  const std::lock_guard lock(mutex_);
  std::vector<Transition> all;
  for (auto& [number, waiting] : transitions_) {
    if (!std::exchange(waiting.is_taken, true))
      all.push_back({.number = number, .request = std::move(waiting.request)});
  }
  return all;
}

void StopGuard::answer(std::uint64_t number, std::vector<std::byte> response) {
  rmw_request_id_t id{};
  {
    const std::lock_guard lock(mutex_);
    const auto found = transitions_.find(number);
    if (found == transitions_.end()) return;
    id = found->second.id;
    transitions_.erase(found);
  }
  TypedMessage typed(change_type_.response);
  if (typed.deserialize(response)) went_well(rcl_send_response(&guarded_.change_state, &id, typed.get()));
}

// ---- the guard's thread

void StopGuard::run() {
  rcl_wait_set_t set = rcl_get_zero_initialized_wait_set();
  if (rcl_wait_set_init(&set, 0, 1, 0, 0, std::size(watched_), 0, guarded_.node.context,
                        rcl_get_default_allocator()) != RCL_RET_OK) {
    rcl_reset_error();
    return;
  }
  while (!ending_.load(std::memory_order_acquire)) {
    const bool is_busy = !stops_.empty() || is_unread();
    const rcl_context_t& context = *guarded_.node.context;
    // A request that is unread ends a wait for requests at once.
    Waited waited = Waited::well;
    if (is_busy) waited = after_wait(wait(set, stops_.empty() ? kUnreadLook : kStopLook, false), context);
    if (waited == Waited::well) waited = after_wait(wait(set, is_busy ? 0 : -1, true), context);
    if (waited == Waited::for_the_last_time) break;
    if (waited == Waited::well) look(set);
    carry_out_all();
  }
  carry_out_all();  // everything is stopped by now
  if (rcl_wait_set_fini(&set) != RCL_RET_OK) rcl_reset_error();
}

/// A time of -1: for ever.
rcl_ret_t StopGuard::wait(rcl_wait_set_t& set, time_ns_t timeout_ns, bool for_requests) {
  rcl_ret_t outcome = rcl_wait_set_clear(&set);
  if (outcome == RCL_RET_OK) outcome = rcl_wait_set_add_guard_condition(&set, &wake_, nullptr);
  for (Watched& watched : watched_) {
    if (for_requests && outcome == RCL_RET_OK)
      outcome = rcl_wait_set_add_service(&set, &watched.service, &watched.place);
  }
  return outcome == RCL_RET_OK ? rcl_wait(&set, timeout_ns) : outcome;
}

/// Who reads its requests has read all of them at some look.
void StopGuard::look(const rcl_wait_set_t& set) {
  const time_ns_t now = monotonic_now_ns();
  for (Watched& watched : watched_) {
    if (set.services[watched.place] == nullptr) {
      watched.unread_since_ns = 0;
    } else if (watched.unread_since_ns == 0) {
      watched.unread_since_ns = now;
    } else if (now - watched.unread_since_ns >= kPatience) {
      (this->*watched.take)();
      watched.unread_since_ns = 0;
    }
  }
}

bool StopGuard::is_unread() const noexcept {
  return std::any_of(std::begin(watched_), std::end(watched_),
                     [](const Watched& watched) { return watched.unread_since_ns != 0; });
}

// ---- stops

void StopGuard::take_stops() {
  for (int taken = 0; taken < kMostAtOnce; ++taken) {
    Stop stop;
    if (!went_well(rcl_take_request(&guarded_.stop, &stop.id, stop_request_.get()))) return;
    const auto& request = *static_cast<const mauve_msgs__srv__Stop_Request*>(stop_request_.get());
    const double timeout_s = request.timeout_s == 0.0 ? kDefaultTimeout : request.timeout_s;
    stop.request_id = text_of(request.request_id);
    stop.words = words_of(request);
    stop.component = text_of(request.component);
    stop.force = request.force;
    if (!stop_request_.serialize(message_)) continue;
    stop.request = bytes_of(message_);
    if (send_again(stop)) continue;
    if (const std::optional<StopReply> why_not = refusal(request)) {
      finish(stop, *why_not);
      continue;
    }
    stop.until_ns = later_by(monotonic_now_ns(), static_cast<time_ns_t>(timeout_s * 1e9));
    stops_.push_back(std::move(stop));
  }
}

void StopGuard::carry_out_all() {
  std::erase_if(stops_, [this](Stop& stop) {
    const std::optional<StopReply> reply = carry_out(stop);
    if (reply) finish(stop, *reply);
    return reply.has_value();
  });
}

/// Nothing: it is to be tried again, as the component still executes.
std::optional<StopReply> StopGuard::carry_out(Stop& stop) {
  const bool is_last = monotonic_now_ns() >= stop.until_ns;
  const auto stopped = [&](bool is_forced) {
    const std::string by_force =
        is_forced ? " by force: it is FAULTED, and its thread is left behind until its state ends" : "";
    return StopReply{"OK", "component '" + stop.component + "' is stopped" + by_force + "; " + kSilent};
  };
  const std::lock_guard lock(architecture_mutex_);
  try {
    return stopped(host().stop(stop.component, {.timeout_ns = 0, .force = is_last && stop.force}));
  } catch (const Error& failure) {
    if (failure.code() == ErrorCode::timeout) {
      stop.is_ordered = true;
      if (!is_last) return std::nullopt;
      return StopReply{"TIMEOUT",
                       "component '" + stop.component +
                           "': the stop stays pending, as its state did not end in time; a stop by "
                           "force does not wait for that"};
    }
    if (failure.code() == ErrorCode::not_running && stop.is_ordered) return stopped(false);
    const auto code = static_cast<std::size_t>(failure.code());
    return StopReply{std::string(kErrors[code].reply), failure.what()};
  } catch (const std::exception& failure) {
    return StopReply{"PREPARE_FAILED", failure.what()};
  }
}

/// architecture_mutex_ held. Throws Error.
Host& StopGuard::host() const {
  Runner* const runner = architecture_ == nullptr ? nullptr : architecture_->host();
  if (auto* const host = dynamic_cast<Host*>(runner)) return *host;
  throw Error(ErrorCode::not_configured, "the executor is not active",
              {.remedy = "activate it first (lifecycle)"});
}

void StopGuard::respond(Stop& stop, const StopReply& reply) {
  auto& response = *static_cast<mauve_msgs__srv__Stop_Response*>(stop_response_.get());
  response.success = reply.code == "OK";
  response.code = guarded_.codes.at(reply.code);
  response.revision = 0;
  rosidl_runtime_c__String__assign(&response.message, reply.message.c_str());
  rosidl_runtime_c__String__assign(&response.instance_id, guarded_.instance_id.c_str());
  went_well(rcl_send_response(&guarded_.stop, &stop.id, &response));
}

/// Answers, and keeps it for the node.
void StopGuard::finish(Stop& stop, const StopReply& reply) {
  respond(stop, reply);
  RCUTILS_LOG_WARN_NAMED(guarded_.logger.c_str(), "stop %s: %s", stop.component.c_str(),
                         reply.message.c_str());
  if (!stop_response_.serialize(message_)) return;
  {
    const std::lock_guard lock(mutex_);
    if (answered_.size() >= kMostAnswered) return;
    answered_.push_back({.request = std::move(stop.request),
                         .response = bytes_of(message_),
                         .request_id = std::move(stop.request_id),
                         .words = std::move(stop.words)});
  }
  tell_news();
}

/// Whether a request of this id was answered before: the same one gets the same answer.
bool StopGuard::send_again(Stop& stop) {
  if (stop.request_id.empty()) return false;
  const std::lock_guard lock(mutex_);
  const auto found = std::find_if(answered_.begin(), answered_.end(), [&](const Answered& answered) {
    return answered.request_id == stop.request_id;
  });
  if (found == answered_.end()) return false;
  if (found->words != stop.words) {
    respond(stop,
            {"REQUEST_ID_REUSED", "the request_id was used before, for another request; take a new id"});
    return true;
  }
  return stop_response_.deserialize(found->response) &&
         went_well(rcl_send_response(&guarded_.stop, &stop.id, stop_response_.get()));
}

// ---- transitions

/// All are the node's before outputs are made safe, which may last: it makes transitions in the order in which they came.
void StopGuard::take_changes() {
  bool is_to_be_safe = false;
  for (int taken = 0; taken < kMostAtOnce; ++taken) {
    rmw_request_id_t id{};
    if (!went_well(rcl_take_request(&guarded_.change_state, &id, change_request_.get()))) break;
    const auto& request =
        *static_cast<const lifecycle_msgs__srv__ChangeState_Request*>(change_request_.get());
    is_to_be_safe |= protects(request.transition);
    if (!change_request_.serialize(message_)) continue;
    const std::lock_guard lock(mutex_);
    transitions_[++last_number_] = {.id = id, .request = bytes_of(message_), .is_taken = false};
  }
  tell_news();
  if (is_to_be_safe) make_safe();
}

void StopGuard::make_safe() {
  {
    const std::lock_guard lock(architecture_mutex_);
    auto* const host = architecture_ == nullptr ? nullptr : dynamic_cast<Host*>(architecture_->host());
    if (host == nullptr) return;
    host->shutdown();
  }
  RCUTILS_LOG_WARN_NAMED(guarded_.logger.c_str(),
                         "outputs are safe, components parked; %s: the transition follows when it does",
                         kSilent);
}

void StopGuard::tell_news() {
  if (rcl_trigger_guard_condition(&guarded_.news) != RCL_RET_OK) rcl_reset_error();
}

}  // namespace mauve::bridge
