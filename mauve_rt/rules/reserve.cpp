// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/rules/reserve.hpp"

#include <algorithm>

#include "mauve_rt/base/error.hpp"

namespace mauve::rules {

namespace {

/// Why the component still runs; empty: it does not.
std::string stop_one(Host& host, const std::string& component, const StopOptions& options) noexcept {
  try {
    host.stop(component, options);
  } catch (const Error& failure) {
    const bool is_at_rest = failure.code() == ErrorCode::not_running ||
                            failure.code() == ErrorCode::faulted ||
                            failure.code() == ErrorCode::unknown_component;
    if (!is_at_rest) return failure.what();
  } catch (const std::exception& failure) {
    return failure.what();
  }
  return {};
}

}  // namespace

std::string Reserve::carry_out(Host& host) noexcept {
  const time_ns_t until_ns =
      monotonic_now_ns() + (kind_ == ReserveKind::stop ? kStopPatience : kSafePatience);
  for (const std::string& component : components_) stop_one(host, component, {.timeout_ns = 0});
  std::string failure;
  for (const std::string& component : components_) {
    const time_ns_t rest_ns = std::max<time_ns_t>(0, until_ns - monotonic_now_ns());
    const std::string why = stop_one(host, component, {.timeout_ns = rest_ns, .force = true});
    if (!why.empty()) failure += (failure.empty() ? "" : "; ") + why;
  }
  has_failed_ = !failure.empty();
  return failure;
}

std::optional<Ended> Reserve::ended() noexcept {
  if (stage_.load(std::memory_order_acquire) != Stage::over) return std::nullopt;
  const Ended how = has_failed_ ? Ended::timed_out : Ended::done;
  stage_.store(Stage::idle, std::memory_order_relaxed);  // relaxed: begin() publishes what follows
  return how;
}

}  // namespace mauve::rules
