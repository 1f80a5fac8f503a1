// SPDX-License-Identifier: LGPL-3.0-or-later
// DueQueue: which of many simulated tasks runs next.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "mauve_rt/base/time.hpp"
#include "mauve_rt/run/queue_place.hpp"

namespace mauve {

class Task;

/// The tasks of one virtual processor by when they can begin, then priority, then declaration. One thread.
///
/// Two heaps: tasks whose instant is to come, by instant; and those whose instant has passed while others ran, which
/// could all begin now: by priority alone. Each task knows its place, so that a change costs no search.
class DueQueue {
 public:
  /// The task's instant is another one now; kForever: it waits for nothing. [non-rt]
  void update(Task& task, time_ns_t now_ns);
  void forget(Task& task);
  /// The next to run, which stays in the queue; nullptr when none waits. [non-rt]
  Task* next(time_ns_t now_ns);

 private:
  struct Entry {
    time_ns_t due_ns;
    std::uint64_t rank;  // smaller: more urgent, declared earlier
    Task* task;
  };
  using Heap = std::vector<Entry>;

  Heap& heap_of(const QueuePlace& place) noexcept { return place.is_late ? late_ : coming_; }
  static bool is_before(const Entry& a, const Entry& b, bool is_late) noexcept;
  void put(Heap& heap, std::size_t index, const Entry& entry) noexcept;
  void rise(Heap& heap, std::size_t index, const Entry& entry) noexcept;
  void settle(Heap& heap, std::size_t index, const Entry& entry) noexcept;
  void insert(Heap& heap, const Entry& entry);
  void take_out(Task& task) noexcept;

  Heap coming_;
  Heap late_;
};

}  // namespace mauve
