// SPDX-License-Identifier: LGPL-3.0-or-later
// What was written to and read from the resources of random_data, and what must hold of these reads and writes.
#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "../forked_run.hpp"
#include "values.hpp"

namespace mauve::testing {

/// The order of all events of a run: one thread runs at a time.
inline std::uint64_t next_tick() {
  static std::uint64_t tick = 0;
  return ++tick;
}

/// One use of a resource: a read, a write, a call.
struct Use {
  double number{0.0};  // what is read or written; 0: nothing, or what the kernel writes at a stop
  time_ns_t stamp_ns{0};
  std::uint64_t began{0}, ended{UINT64_MAX};  // ticks
  bool has_new{false};                        // of a read: something new; of a write: accepted
  bool may_be_dropped{false};                 // of a write: no reader has to see it
  bool is_late_look{false};                   // of a read: may be one write behind other readers
};

/// The uses of one resource. Uses that have not ended are in the lists, too.
struct ResourceHistory {
  std::string name{};
  bool is_ring{false};
  bool has_one_writer{false};  // at a time
  bool gets_zeros{false};      // of stopped components
  bool is_logged{false};
  std::size_t capacity{0};         // of a ring
  bool overwrites{false};          // a ring
  std::vector<Use> writes{};       // in the order in which they began
  std::vector<Use> reads{};        // likewise
  std::vector<double> log{};       // as the write log has them, without zeros
  std::vector<time_ns_t> moved{};  // T of each change that has moved its writing end
  std::vector<std::pair<std::uint64_t, std::uint64_t>> zero{};  // between these ticks the value is zero

  std::size_t begin_write(double number, time_ns_t stamp_ns) {
    writes.push_back({.number = number, .stamp_ns = stamp_ns, .began = next_tick()});
    return writes.size() - 1;
  }
  void end_write(std::size_t index, bool accepted, bool may_be_dropped) {
    writes[index].ended = next_tick();
    writes[index].has_new = accepted;
    writes[index].may_be_dropped = may_be_dropped;
  }
  std::size_t begin_read() {
    reads.push_back({.began = next_tick()});
    return reads.size() - 1;
  }
  void end_read(std::size_t index, double number, bool has_new, time_ns_t stamp_ns) {
    reads[index].ended = next_tick();
    reads[index].number = number;
    reads[index].has_new = has_new;
    reads[index].stamp_ns = stamp_ns;
  }
};

/// Checks the history of one resource, once the run is over.
class DataCheck {
 public:
  DataCheck(ResourceHistory& history, seeds::Findings& findings) : all_(history), findings_(findings) {}

  void run() {
    for (std::size_t i = 0; i < all_.writes.size(); ++i) {
      Use& write = all_.writes[i];
      for (const time_ns_t moved_ns : all_.moved)
        write.may_be_dropped = write.may_be_dropped || write.stamp_ns < moved_ns;
      write_of_[write.number] = i;
    }
    for (std::size_t i = 0; i < all_.log.size(); ++i) {
      expect(place_.emplace(all_.log[i], i).second, "logs " + text(all_.log[i]) + " twice");
      expect(write_of_.contains(all_.log[i]), "logs " + text(all_.log[i]) + ", which no writer wrote");
    }
    check_known();
    if (all_.is_ring) {
      check_ring();
    } else {
      check_register();
    }
    check_log();
  }

  /// Accepted writes that must have been taken by the resource.
  std::size_t sure_writes() const {
    return static_cast<std::size_t>(std::ranges::count_if(
        all_.writes, [](const Use& write) { return write.has_new && !write.may_be_dropped; }));
  }

 private:
  static std::string text(double number) { return std::to_string(static_cast<long long>(number)); }
  void expect(bool is_true, const std::string& otherwise) {
    findings_.expect(is_true, all_.name + " " + otherwise);
  }
  const Use& write_of(double number) const { return all_.writes[write_of_.at(number)]; }

  /// No torn value, no value without a writer, no value before its write.
  void check_known() {
    for (const Use& read : all_.reads) {
      if (read.number == 0.0 || read.ended == UINT64_MAX) continue;
      expect(read.number != kTorn, "gives a torn value at tick " + std::to_string(read.began));
      const bool is_known = write_of_.contains(read.number);
      expect(is_known, "gives " + text(read.number) + ", which no writer wrote");
      if (!is_known) continue;
      const Use& write = write_of(read.number);
      expect(write.began < read.ended, "gives " + text(read.number) + " before it is written");
      expect(read.stamp_ns == 0 || read.stamp_ns == write.stamp_ns,
             "gives " + text(read.number) + " with the time " + std::to_string(read.stamp_ns) +
                 ", written at " + std::to_string(write.stamp_ns));
    }
    std::erase_if(all_.reads, [this](const Use& read) {
      return read.ended == UINT64_MAX || (read.number != 0.0 && !write_of_.contains(read.number));
    });
  }

  /// Whether one value was surely written before another one.
  bool is_older(double one, double other) const {
    if (one == other) return false;
    const Use& first = write_of(one);
    const Use& second = write_of(other);
    if (first.ended < second.began) return true;
    const auto place = place_.find(one);
    const auto later = place_.find(other);
    if (place != place_.end() && later != place_.end() && place->second < later->second) return true;
    return all_.has_one_writer && first.stamp_ns < second.stamp_ns;
  }

  void check_register() {
    for (std::size_t i = 0; i < all_.reads.size(); ++i) {
      const Use& read = all_.reads[i];
      check_zero(read);
      if (read.number == 0.0) {
        if (all_.gets_zeros) continue;
        for (const Use& write : all_.writes)
          expect(write.may_be_dropped || write.ended >= read.began,
                 "has nothing at tick " + std::to_string(read.began) + ", after " + text(write.number) +
                     " was written");
        continue;
      }
      for (const Use& write : all_.writes) {
        if (write.ended >= read.began || write.may_be_dropped || !write.has_new) continue;
        expect(!is_older(read.number, write.number), "gives " + text(read.number) + " at tick " +
                                                         std::to_string(read.began) + " after " +
                                                         text(write.number) + " was written");
      }
      for (std::size_t k = 0; k < i; ++k) {
        const Use& before = all_.reads[k];
        if (before.ended >= read.began || before.number == 0.0) continue;
        if (read.is_late_look && !before.is_late_look) continue;
        expect(!is_older(read.number, before.number), "goes back from " + text(before.number) + " to " +
                                                          text(read.number) + " at tick " +
                                                          std::to_string(read.began));
      }
    }
  }
  void check_zero(const Use& read) {
    for (const auto& [from, to] : all_.zero) {
      if (read.began <= from || read.ended >= to) continue;
      expect(read.number == 0.0, "is " + text(read.number) + " at tick " + std::to_string(read.began) +
                                     ", while its writer is stopped");
    }
  }

  void check_ring() {
    std::map<double, std::uint64_t> popped;  // when the pop ended
    for (const Use& read : all_.reads) {
      if (!read.has_new) {
        check_empty(read);
        continue;
      }
      expect(!popped.contains(read.number), "gives " + text(read.number) + " twice");
      popped[read.number] = read.ended;
      expect(write_of(read.number).has_new || write_of(read.number).ended == UINT64_MAX,
             "gives " + text(read.number) + ", which it has refused");
    }
    for (std::size_t i = 0; i < all_.reads.size(); ++i) {
      for (std::size_t k = 0; k < i; ++k) {
        const Use& before = all_.reads[k];
        if (!before.has_new || !all_.reads[i].has_new || before.ended >= all_.reads[i].began) continue;
        expect(!is_older(all_.reads[i].number, before.number),
               "gives " + text(all_.reads[i].number) + " after " + text(before.number));
      }
    }
    for (const Use& write : all_.writes) {
      if (!write.has_new && write.ended != UINT64_MAX) check_full(write);
    }
  }
  /// What was written before has been removed by somebody else, or is overwritten.
  void check_empty(const Use& read) {
    if (all_.overwrites) return;
    std::size_t there = 0;
    for (const Use& write : all_.writes)
      there += write.has_new && !write.may_be_dropped && write.ended < read.began ? 1 : 0;
    std::size_t gone = 0;
    for (const Use& other : all_.reads) gone += other.has_new && other.began < read.ended ? 1 : 0;
    expect(there <= gone, "is found empty at tick " + std::to_string(read.began) + ", after " +
                              std::to_string(there) + " writes and at most " + std::to_string(gone) +
                              " removals");
  }
  void check_full(const Use& refused) {
    std::size_t there = 0;
    for (const Use& write : all_.writes)
      there += (write.has_new || write.ended == UINT64_MAX) && write.began < refused.ended ? 1 : 0;
    std::size_t gone = 0;
    for (const Use& read : all_.reads) gone += read.has_new && read.ended < refused.began ? 1 : 0;
    expect(there >= gone + all_.capacity, "refuses " + text(refused.number) + " with at most " +
                                              std::to_string(there - std::min(there, gone)) + " of " +
                                              std::to_string(all_.capacity) + " places taken");
  }

  void check_log() {
    if (!all_.is_logged) return;
    for (std::size_t i = 1; i < all_.log.size(); ++i) {
      if (!write_of_.contains(all_.log[i]) || !write_of_.contains(all_.log[i - 1])) continue;
      const Use& write = write_of(all_.log[i]);
      expect(write.ended >= write_of(all_.log[i - 1]).began,
             "logs " + text(all_.log[i]) + " after " + text(all_.log[i - 1]));
    }
    for (const Use& write : all_.writes) {
      if (write.has_new && !write.may_be_dropped)
        expect(place_.contains(write.number),
               "does not log " + text(write.number) + ", written at " + std::to_string(write.stamp_ns));
    }
  }

  ResourceHistory& all_;
  seeds::Findings& findings_;
  std::map<double, std::size_t> write_of_;
  std::map<double, std::size_t> place_;  // in the log
};

}  // namespace mauve::testing
