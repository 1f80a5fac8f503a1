// SPDX-License-Identifier: LGPL-3.0-or-later
// How an architecture's lists change while others look at them, and what stays of those removed.
#include <algorithm>
#include <iterator>

#include "mauve_rt/architecture/architecture.hpp"
#include "mauve_rt/base/error.hpp"

namespace mauve {

namespace {

constexpr std::size_t kMostNumbers = UINT16_MAX;
constexpr std::size_t kMostRetiredRecords = std::size_t{64} * 1024;

/// A component and what it tells of its changes to; the architecture listens once it is listed.
struct Member {
  Member(const std::string& name, std::uint16_t number) : component(name, number, changes) {}

  ChangeSignal changes;
  Component component;
};

}  // namespace

std::shared_ptr<Component> Architecture::make_unlisted(const std::string& name) {
  std::shared_ptr<Component> made;
  {
    const LockGuard lock(list_mutex_);
    const std::optional<std::uint16_t> free = find_free_number(name);
    const auto member = std::make_shared<Member>(name, free ? *free : give_number(name));
    made = {member, &member->component};
    numbered_[made->task().number()] = made;
  }
  made->task().set_log_queue(log_queue_);
  const LockGuard lock(trace_mutex_);
  Task& task = made->task();
  if (task.number() < finals_.size()) task.set_first_record(finals_[task.number()].written);
  made->set_self(made);
  return made;
}

std::optional<std::uint16_t> Architecture::find_free_number(const std::string& name) const {
  for (const auto& [number, component] : numbered_) {
    if (names_[number] == name && component.expired()) return number;
  }
  return {};
}

std::uint16_t Architecture::give_number(const std::string& name) {
  if (names_.size() == kMostNumbers) {
    throw Error(ErrorCode::out_of_range, "the trace has no number left for another component",
                {.component = name,
                 .expected = "at most " + std::to_string(kMostNumbers) +
                             " names, those of removed components included",
                 .found = "one more",
                 .remedy = "add the component by a name that was used before, or start the executor again"});
  }
  names_.push_back(name);
  return static_cast<std::uint16_t>(names_.size() - 1);
}

std::uint16_t Architecture::trace_number(const std::string& name) {
  const auto change = change_lock_.join();  // one that fails gives numbers back
  const LockGuard lock(list_mutex_);
  const auto found = std::find(names_.begin(), names_.end(), name);
  return found == names_.end() ? give_number(name) : static_cast<std::uint16_t>(found - names_.begin());
}

std::size_t Architecture::numbers() const {
  const LockGuard lock(list_mutex_);
  return names_.size();
}

void Architecture::give_back_numbers(std::size_t numbers) {
  const LockGuard lock(list_mutex_);
  if (numbers >= names_.size()) return;
  names_.resize(numbers);
  numbered_.erase(numbered_.lower_bound(static_cast<std::uint16_t>(numbers)), numbered_.end());
}

void Architecture::keep_until_ended(std::shared_ptr<Component> component, bool was_listed) {
  const LockGuard lock(list_mutex_);
  leaving_.push_back({.component = std::move(component), .was_listed = was_listed});
}

void Architecture::retire(std::vector<std::shared_ptr<Resource>> resources) {
  if (resources.empty()) return;
  {
    const LockGuard lock(list_mutex_);
    retiring_.insert(retiring_.end(), resources.begin(), resources.end());
  }
  resources.clear();
  reap();
}

void Architecture::reap() {
  std::vector<Leaving> ended;
  std::vector<std::shared_ptr<Resource>> unused;
  const auto split = [](auto& all, auto& out, const auto& is_over) {
    const auto first = std::partition(all.begin(), all.end(), [&](const auto& one) { return !is_over(one); });
    out.assign(std::make_move_iterator(first), std::make_move_iterator(all.end()));
    all.erase(first, all.end());
  };
  {
    const LockGuard lock(list_mutex_);
    split(leaving_, ended,
          [](const Leaving& leaving) { return leaving.component->task().end_thread(monotonic_now_ns()); });
  }
  for (const Leaving& leaving : ended) {
    for (const auto& port : leaving.component->shell().ports()) port->disconnect();
    dispose(
        "cleanup of the removed " + leaving.component->description(),
        [component = leaving.component] { component->cleanup(); }, leaving.component.get());
    if (leaving.was_listed) retire_trace(leaving.component->task());
  }
  {
    const LockGuard lock(list_mutex_);
    split(retiring_, unused, [](const auto& resource) { return !resource->is_in_use(); });
  }
  for (const auto& resource : unused)
    dispose("cleanup of the removed " + resource->description(), [resource] { resource->cleanup(); });
}

std::size_t Architecture::threads_left_behind() const {
  const LockGuard lock(list_mutex_);
  return static_cast<std::size_t>(std::count_if(leaving_.begin(), leaving_.end(), [](const Leaving& leaving) {
    return !leaving.component->task().has_ended();
  }));
}

std::vector<std::string> Architecture::trace_components() const {
  const LockGuard lock(list_mutex_);
  return names_;
}

void Architecture::retire_trace(Task& task) {
  const LockGuard lock(trace_mutex_);
  const std::unique_ptr<TraceRing> ring = task.release_ring();
  if (ring == nullptr) return;
  std::vector<TraceRecord> records;
  ring->drain(records);
  if (finals_.size() <= task.number()) finals_.resize(task.number() + std::size_t{1});
  finals_[task.number()].written += ring->offered();
  finals_[task.number()].dropped += ring->dropped();
  keep_records(records);
}

void Architecture::keep_records(const std::vector<TraceRecord>& records) {
  retired_.insert(retired_.end(), records.begin(), records.end());
  for (; retired_.size() > kMostRetiredRecords; retired_.pop_front())
    ++finals_[retired_.front().component].dropped;
}

void Architecture::record(TraceRecord record) {
  const LockGuard lock(trace_mutex_);
  if (finals_.size() <= record.component) finals_.resize(record.component + std::size_t{1});
  record.sequence = finals_[record.component].written++;
  keep_records({record});
}

TraceDrain Architecture::drain_trace() {
  const LockGuard lock(trace_mutex_);
  const auto present = components();
  TraceDrain drain;
  drain.records.assign(retired_.begin(), retired_.end());
  retired_.clear();
  retired_.shrink_to_fit();
  const std::size_t count = std::max(numbers(), finals_.size());
  drain.written.resize(count);
  drain.dropped.resize(count);
  for (std::size_t number = 0; number < finals_.size(); ++number) {
    drain.written[number] = finals_[number].written;
    drain.dropped[number] = finals_[number].dropped;
  }
  for (const auto& component : present) {
    Task& task = component->task();
    task.drain_ring(drain.records, drain.written[task.number()], drain.dropped[task.number()]);
  }
  drain.monotonic_ns = monotonic_now_ns();
  drain.realtime_ns = realtime_now_ns();
  return drain;
}

}  // namespace mauve
