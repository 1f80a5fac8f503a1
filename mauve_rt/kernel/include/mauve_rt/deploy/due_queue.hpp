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
/// Two heaps: tasks whose instant is in the future, by instant; and those whose instant has passed while others ran, which
/// could all begin now: by priority alone. A task whose instant changes gets another entry, and its earlier one is passed over
/// when it comes to the front: so a change touches the heap alone, and no task but its own.
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
    std::uint32_t number;
  };
  struct ByInstant {
    static bool is_before(const Entry& a, const Entry& b) noexcept {
      return a.due_ns != b.due_ns ? a.due_ns < b.due_ns : a.rank < b.rank;
    }
  };
  struct ByRank {
    static bool is_before(const Entry& a, const Entry& b) noexcept { return a.rank < b.rank; }
  };
  /// Of four children each: half as deep as of two, and the four lie side by side.
  template <typename Order>
  class Heap {
   public:
    bool is_empty() const noexcept { return entries_.empty(); }
    std::size_t size() const noexcept { return entries_.size(); }
    const Entry& front() const noexcept { return entries_.front(); }
    void push(const Entry& entry);
    void pop() noexcept;
    void replace_front(const Entry& entry) noexcept { sink(0, entry); }
    /// Takes out all entries of which the function says so.
    template <typename Function>
    void erase_if(Function&& is_out);

   private:
    void sink(std::size_t index, const Entry& entry) noexcept;

    std::vector<Entry> entries_;
  };

  static bool counts(const Entry& entry) noexcept;
  template <typename Order>
  static void drop_passed_over(Heap<Order>& heap) noexcept;

  Heap<ByInstant> coming_;
  Heap<ByRank> late_;
  std::size_t queued_{0};
};

}  // namespace mauve
