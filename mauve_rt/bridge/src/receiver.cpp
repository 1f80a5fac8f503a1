// SPDX-License-Identifier: LGPL-3.0-or-later
#include "receiver.hpp"

#include <rcl/error_handling.h>

#include "mauve_rt/base/contract.hpp"

#include "rcl_error.hpp"

namespace mauve::bridge {

namespace {

constexpr time_ns_t kIdleEvery = ms_to_ns(5);  // rules tell silence from a receiver that is late by it

}  // namespace

Receiver::Receiver(const rcl_node_t& node, const char* name, time_ns_t pause_ns)
    : context_(*node.context), name_(name), pause_ns_(pause_ns) {
  check(rcl_guard_condition_init(&wake_, &context_, rcl_guard_condition_get_default_options()),
        "the bridge cannot receive", "guard condition");
}

Receiver::~Receiver() {
  stop();
  if (rcl_guard_condition_fini(&wake_) != RCL_RET_OK) rcl_reset_error();
}

void Receiver::start(std::vector<Arrival*> arrivals) {
  MAUVE_EXPECTS(!thread_.joinable());
  arrivals_ = std::move(arrivals);
  ending_.store(false, std::memory_order_release);
  if (!arrivals_.empty()) thread_ = start_thread(name_, [this] { run(); });
}

void Receiver::stop() {
  if (!thread_.joinable()) return;
  ending_.store(true, std::memory_order_release);
  if (rcl_trigger_guard_condition(&wake_) != RCL_RET_OK) rcl_reset_error();
  thread_.join();
}

void Receiver::run() {
  rcl_wait_set_t set = rcl_get_zero_initialized_wait_set();
  std::size_t count = 0;  // room for as many of each kind
  for (const Arrival* arrival : arrivals_) count += arrival->entities();
  if (rcl_wait_set_init(&set, count, 1, count, count, count, count, &context_, rcl_get_default_allocator()) !=
      RCL_RET_OK) {
    rcl_reset_error();
    return;
  }
  for (;;) {
    if (pause_ns_ > 0) pause(set);
    const time_ns_t waited_ns = monotonic_now_ns();  // before the middleware looks
    if (ending_.load(std::memory_order_acquire)) break;
    const Waited waited = after_wait(wait(set), context_);
    if (waited == Waited::for_the_last_time) break;
    if (waited == Waited::failed) continue;
    for (Arrival* arrival : arrivals_) {
      if (arrival->has_arrived(set)) {
        arrival->take();
      } else if (arrival->wants_idle()) {
        arrival->idle(waited_ns);
      }
    }
  }
  if (rcl_wait_set_fini(&set) != RCL_RET_OK) rcl_reset_error();
}

time_ns_t Receiver::longest_wait_ns() const {
  for (const Arrival* arrival : arrivals_) {
    if (arrival->wants_idle()) return kIdleEvery;
  }
  return -1;  // for ever
}

/// Until stop(), or so long.
void Receiver::pause(rcl_wait_set_t& set) {
  if (rcl_wait_set_clear(&set) != RCL_RET_OK ||
      rcl_wait_set_add_guard_condition(&set, &wake_, nullptr) != RCL_RET_OK ||
      rcl_wait(&set, pause_ns_) != RCL_RET_OK)
    rcl_reset_error();
}

rcl_ret_t Receiver::wait(rcl_wait_set_t& set) {
  rcl_ret_t outcome = rcl_wait_set_clear(&set);
  if (outcome == RCL_RET_OK) outcome = rcl_wait_set_add_guard_condition(&set, &wake_, nullptr);
  if (outcome != RCL_RET_OK) return outcome;
  for (Arrival* arrival : arrivals_) arrival->join(set);
  return rcl_wait(&set, longest_wait_ns());
}

}  // namespace mauve::bridge
