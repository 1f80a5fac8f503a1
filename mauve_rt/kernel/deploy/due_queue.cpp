// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/deploy/due_queue.hpp"

#include <climits>

#include "mauve_rt/run/task.hpp"

namespace mauve {

void DueQueue::update(Task& task, time_ns_t now_ns) {
  const time_ns_t due_ns = task.due_ns();
  QueuePlace& place = task.queue_place();
  if (place.index == QueuePlace::kNone) {
    if (due_ns == kForever) return;
    const auto urgency = static_cast<std::uint64_t>(INT_MAX - task.settings().priority);
    return insert(coming_, {.due_ns = due_ns, .rank = urgency << 32U | task.number(), .task = &task});
  }
  if (due_ns == kForever) return take_out(task);
  Entry entry = heap_of(place)[place.index];
  entry.due_ns = due_ns;
  if (!place.is_late) return settle(coming_, place.index, entry);
  if (due_ns <= now_ns) return;  // as late as before
  take_out(task);
  insert(coming_, entry);
}

void DueQueue::forget(Task& task) {
  if (task.queue_place().index != QueuePlace::kNone) take_out(task);
}

Task* DueQueue::next(time_ns_t now_ns) {
  // With no instant passed, those of the present one are in order already.
  if (!late_.empty() || (!coming_.empty() && coming_.front().due_ns < now_ns)) {
    while (!coming_.empty() && coming_.front().due_ns <= now_ns) {
      const Entry entry = coming_.front();
      take_out(*entry.task);
      insert(late_, entry);
    }
    return late_.front().task;
  }
  return coming_.empty() ? nullptr : coming_.front().task;
}

bool DueQueue::is_before(const Entry& a, const Entry& b, bool is_late) noexcept {
  return is_late || a.due_ns == b.due_ns ? a.rank < b.rank : a.due_ns < b.due_ns;
}

void DueQueue::put(Heap& heap, std::size_t index, const Entry& entry) noexcept {
  heap[index] = entry;
  entry.task->queue_place() = {.index = index, .is_late = &heap == &late_};
}

void DueQueue::rise(Heap& heap, std::size_t index, const Entry& entry) noexcept {
  const bool is_late = &heap == &late_;
  while (index > 0) {
    const std::size_t parent = (index - 1) / 2;
    if (!is_before(entry, heap[parent], is_late)) break;
    put(heap, index, heap[parent]);
    index = parent;
  }
  put(heap, index, entry);
}

/// Finds the place of an entry that may belong further up or further down than the index.
void DueQueue::settle(Heap& heap, std::size_t index, const Entry& entry) noexcept {
  const bool is_late = &heap == &late_;
  for (;;) {
    std::size_t child = 2 * index + 1;
    if (child >= heap.size()) break;
    if (child + 1 < heap.size() && is_before(heap[child + 1], heap[child], is_late)) ++child;
    if (!is_before(heap[child], entry, is_late)) break;
    put(heap, index, heap[child]);
    index = child;
  }
  rise(heap, index, entry);
}

void DueQueue::insert(Heap& heap, const Entry& entry) {
  heap.push_back(entry);
  rise(heap, heap.size() - 1, entry);
}

void DueQueue::take_out(Task& task) noexcept {
  const QueuePlace place = task.queue_place();
  Heap& heap = heap_of(place);
  const Entry last = heap.back();
  heap.pop_back();
  task.queue_place() = {};
  if (last.task != &task) settle(heap, place.index, last);
}

}  // namespace mauve
