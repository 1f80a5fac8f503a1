// SPDX-License-Identifier: LGPL-3.0-or-later
// The collector of trace records: what it was given comes out once and in order, and rings do not fill up meanwhile.
#include "mauve_rt/deploy/trace_collector.hpp"

#include "fixtures.hpp"

namespace mauve::testing::test_trace_collector {

using TraceCollectorTest = Deployed;

/// Records of one component, which must follow each other without a gap from `first` on; returns the next number.
std::uint64_t follow(const TraceDrain& drain, std::uint64_t first) {
  for (const TraceRecord& record : drain.records) EXPECT_EQ(record.sequence, first++);
  return first;
}

TEST_F(TraceCollectorTest, NothingIsLostWhileNobodyTakes) {
  constexpr int kRecordsPerRelease = 4;
  Component& component = add("fast", 1, {.trace_records = 8192});
  TraceCollector collector(architecture, ms_to_ns(5));
  deploy();
  wait_runs(component,
            2100);  // which is more than the ring holds; it lasts two seconds without the collector
  deployer.stop("fast");
  const TraceDrain drain = collector.take();
  EXPECT_EQ(drain.dropped.at(0), 0U);
  EXPECT_GT(drain.records.size(), 2100U * kRecordsPerRelease);
  EXPECT_EQ(follow(drain, 0), drain.written.at(0));
}

TEST_F(TraceCollectorTest, WhatIsTakenAtAnyTimeIsInOrder) {
  Component& component = add("fast");
  TraceCollector collector(architecture, us_to_ns(300));
  deploy();
  std::uint64_t next = 0;
  while (core(component).runs.load() < 300) {
    next = follow(collector.take(), next);
    std::this_thread::yield();
  }
  deployer.stop("fast");
  const TraceDrain last = collector.take();
  EXPECT_EQ(follow(last, next), last.written.at(0));
}

TEST_F(TraceCollectorTest, ItEndsAtAnyTime) {
  add("fast");
  deploy();
  for (int i = 0; i < 200; ++i) {
    // Not less: a real-time thread that hardly sleeps keeps this one from its CPU for most of a second.
    TraceCollector collector(architecture, us_to_ns(50 + 50 * (i % 4)));
    if (i % 3 == 0) collector.take();
    if (i % 5 == 0) std::this_thread::sleep_for(std::chrono::microseconds(100));
  }
}

}  // namespace mauve::testing::test_trace_collector
