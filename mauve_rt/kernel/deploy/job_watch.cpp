// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/deploy/job_watch.hpp"

#include <algorithm>
#include <utility>

namespace mauve {

namespace {

/// Records before the instant of a job, which show what delayed its thread.
constexpr time_ns_t kBefore = ms_to_ns(20);
/// In one violation: 200 KB.
constexpr std::size_t kMostRecords = 4096;

bool is_kind(const TraceRecord& record, TraceKind kind) noexcept {
  return record.kind == static_cast<std::uint16_t>(kind);
}

/// A component votes for a change, or adopts or takes new parts. What it executes for that is in no bound.
bool is_changing(const TraceDrain& drain) {
  return std::ranges::any_of(drain.records, [](const TraceRecord& record) {
    return is_kind(record, TraceKind::parked) || is_kind(record, TraceKind::armed) ||
           is_kind(record, TraceKind::reconfiguration);
  });
}

}  // namespace

bool JobWatch::watch(const std::vector<JobBound>& bounds, std::uint64_t revision, time_ns_t since_ns) {
  const bool is_settled = architecture_.revision() == revision && architecture_.open_changes().empty();
  const LockGuard lock(mutex_);
  withdraw();
  if (!is_settled) return false;
  longest_bound_ns_ = 0;
  for (const JobBound& bound : bounds) {
    const auto component = architecture_.find_component(bound.component);
    if (component == nullptr) return false;
    followed_.push_back({.number = component->task().number(),
                         .after = TraceNames::intern(bound.after),
                         .until = TraceNames::intern(bound.until),
                         .figures = {.job = bound}});
    longest_bound_ns_ = std::max(longest_bound_ns_, bound.bound_ns);
  }
  revision_ = revision;
  since_ns_ = since_ns;
  holds_ = true;
  return true;
}

void JobWatch::end() {
  const LockGuard lock(mutex_);
  withdraw();
}

void JobWatch::take(const TraceDrain& drain) {
  const LockGuard lock(mutex_);
  if (!holds_) return;
  if (is_changing(drain) || architecture_.revision() != revision_) return withdraw();
  history_.push_back(drain.records);
  for (const Late& late : std::exchange(late_, {})) note(late);
  for (const TraceRecord& record : drain.records) follow(record);
  time_ns_t oldest_ns = drain.monotonic_ns - longest_bound_ns_;
  for (const Late& late : late_) oldest_ns = std::min(oldest_ns, late.instant_ns);
  forget_before(oldest_ns - kBefore);
}

bool JobWatch::holds() const {
  const LockGuard lock(mutex_);
  return holds_;
}

std::vector<JobFigures> JobWatch::figures() const {
  const LockGuard lock(mutex_);
  std::vector<JobFigures> all;
  all.reserve(followed_.size());
  for (const Followed& one : followed_) all.push_back(one.figures);
  return all;
}

std::vector<BoundViolation> JobWatch::take_violations() {
  const LockGuard lock(mutex_);
  return std::exchange(violations_, {});
}

void JobWatch::withdraw() {
  holds_ = false;
  followed_.clear();
  current_.clear();
  history_.clear();
  late_.clear();
}

void JobWatch::follow(const TraceRecord& record) {
  if (current_.size() <= record.component) current_.resize(record.component + std::size_t{1});
  Current& current = current_[record.component];
  if (record.sequence != std::exchange(current.next_sequence, record.sequence + 1)) current.is_known = false;
  if (is_kind(record, TraceKind::release)) {
    current.after = record.name;
    current.instant_ns = record.a;
    current.is_known = record.a >= since_ns_;
  } else if (is_kind(record, TraceKind::wait)) {
    if (current.is_known) judge(record.component, current, record.name, record.time_ns);
    current.is_known = false;
  } else if (is_kind(record, TraceKind::stop) || is_kind(record, TraceKind::fault)) {
    current.is_known = false;
  }
}

void JobWatch::judge(std::uint16_t number, const Current& job, std::uint32_t until, time_ns_t end_ns) {
  const auto found = std::ranges::find_if(followed_, [&](const Followed& one) {
    return one.number == number && one.after == job.after && one.until == until;
  });
  if (found == followed_.end()) return;
  JobFigures& figures = found->figures;
  const time_ns_t response_ns = end_ns - job.instant_ns;
  if (response_ns > figures.job.bound_ns) {
    late_.push_back({.followed = static_cast<std::size_t>(found - followed_.begin()),
                     .instant_ns = job.instant_ns,
                     .end_ns = end_ns});
    return;
  }
  ++figures.jobs;
  figures.longest_ns = std::max(figures.longest_ns, response_ns);
}

void JobWatch::note(const Late& late) {
  JobFigures& figures = followed_[late.followed].figures;
  const time_ns_t response_ns = late.end_ns - late.instant_ns;
  ++figures.jobs;
  ++figures.violations;
  figures.longest_ns = std::max(figures.longest_ns, response_ns);
  auto known = std::ranges::find_if(
      violations_, [&](const BoundViolation& one) { return one.job.component == figures.job.component; });
  if (known == violations_.end()) known = violations_.insert(known, BoundViolation{.job = figures.job});
  ++known->count;
  if (known->count > 1 && response_ns - figures.job.bound_ns <= known->excess_ns()) return;
  known->job = figures.job;
  known->instant_ns = late.instant_ns;
  known->response_ns = response_ns;
  known->records.clear();
  for (const auto& records : history_) {
    for (const TraceRecord& record : records) {
      if (record.time_ns >= late.instant_ns - kBefore && record.time_ns <= late.end_ns)
        known->records.push_back(record);
    }
  }
  if (known->records.size() > kMostRecords)
    known->records.erase(known->records.begin(), known->records.end() - kMostRecords);
}

/// Whole drains, the oldest first.
void JobWatch::forget_before(time_ns_t time_ns) {
  const auto is_old = [&](const std::vector<TraceRecord>& records) {
    return std::ranges::all_of(records, [&](const TraceRecord& record) { return record.time_ns < time_ns; });
  };
  const auto kept = std::find_if_not(history_.begin(), history_.end(), is_old);
  history_.erase(history_.begin(), kept);
}

}  // namespace mauve
