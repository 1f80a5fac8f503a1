// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/deploy/due_queue.hpp"

#include <algorithm>
#include <climits>

#include "mauve_rt/base/contract.hpp"
#include "mauve_rt/run/task.hpp"

namespace mauve {

namespace {

constexpr std::size_t kChildren = 4;
/// More entries than this beside those that count are cleared away.
constexpr std::size_t kSpare = 64;

}  // namespace

template <typename Order>
void DueQueue::Heap<Order>::push(const Entry& entry) {
  std::size_t index = entries_.size();
  entries_.push_back(entry);
  while (index > 0) {
    const std::size_t parent = (index - 1) / kChildren;
    if (!Order::is_before(entry, entries_[parent])) break;
    entries_[index] = entries_[parent];
    index = parent;
  }
  entries_[index] = entry;
}

template <typename Order>
void DueQueue::Heap<Order>::pop() noexcept {
  MAUVE_AUDIT(!is_empty());
  const Entry last = entries_.back();
  entries_.pop_back();
  if (!entries_.empty()) sink(0, last);
}

/// Puts the entry at the index or further down.
template <typename Order>
void DueQueue::Heap<Order>::sink(std::size_t index, const Entry& entry) noexcept {
  const std::size_t size = entries_.size();
  for (;;) {
    const std::size_t first = kChildren * index + 1;
    if (first >= size) break;
    const std::size_t end = std::min(first + kChildren, size);
    std::size_t least = first;
    for (std::size_t child = first + 1; child < end; ++child)
      least = Order::is_before(entries_[child], entries_[least]) ? child : least;
    if (!Order::is_before(entries_[least], entry)) break;
    entries_[index] = entries_[least];
    index = least;
  }
  entries_[index] = entry;
}

template <typename Order>
template <typename Function>
void DueQueue::Heap<Order>::erase_if(Function&& is_out) {
  std::erase_if(entries_, is_out);
  for (std::size_t index = entries_.size(); index-- > 0;) {
    const Entry entry = entries_[index];
    sink(index, entry);
  }
}

bool DueQueue::counts(const Entry& entry) noexcept {
  const QueuePlace& place = entry.task->queue_place();
  return place.is_queued && place.entry == entry.number;
}

template <typename Order>
void DueQueue::drop_passed_over(Heap<Order>& heap) noexcept {
  while (!heap.is_empty() && !counts(heap.front())) heap.pop();
}

void DueQueue::update(Task& task, time_ns_t now_ns) {
  const time_ns_t due_ns = task.due_ns();
  QueuePlace& place = task.queue_place();
  if (place.is_queued && place.is_late && due_ns <= now_ns) return;  // as late as before
  MAUVE_EXPECTS(!place.is_queued || queued_ > 0);
  if (due_ns == kForever) {
    if (place.is_queued) --queued_;
    place.is_queued = false;
    return;
  }
  const bool is_first = !coming_.is_empty() && coming_.front().task == &task;
  if (!place.is_queued) ++queued_;
  place = {.entry = place.entry + 1, .is_queued = true, .is_late = false};
  const auto urgency = static_cast<std::uint64_t>(INT_MAX - task.settings().priority);
  const Entry entry{
      .due_ns = due_ns, .rank = urgency << 32U | task.number(), .task = &task, .number = place.entry};
  if (is_first)
    return coming_.replace_front(entry);  // it has just run: its earlier entry is passed over at once
  coming_.push(entry);
  if (coming_.size() > 2 * queued_ + kSpare)
    coming_.erase_if([](const Entry& each) { return !counts(each); });
}

void DueQueue::forget(Task& task) {
  QueuePlace& place = task.queue_place();
  MAUVE_EXPECTS(!place.is_queued || queued_ > 0);
  if (place.is_queued) --queued_;
  place.is_queued = false;
  const auto is_its = [&task](const Entry& entry) { return entry.task == &task; };
  coming_.erase_if(is_its);
  late_.erase_if(is_its);
}

Task* DueQueue::next(time_ns_t now_ns) {
  drop_passed_over(coming_);
  drop_passed_over(late_);
  // With no instant passed, those of the present one are in order already.
  if (!late_.is_empty() || (!coming_.is_empty() && coming_.front().due_ns < now_ns)) {
    while (!coming_.is_empty() && coming_.front().due_ns <= now_ns) {
      const Entry entry = coming_.front();
      coming_.pop();
      entry.task->queue_place().is_late = true;
      late_.push(entry);
      drop_passed_over(coming_);
    }
    return late_.front().task;
  }
  return coming_.is_empty() ? nullptr : coming_.front().task;
}

}  // namespace mauve
