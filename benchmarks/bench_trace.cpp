// SPDX-License-Identifier: LGPL-3.0-or-later
// A trace record: of a thread that traces, of one that does not, beside clock_gettime; and a log line.
//   bench_trace [--blocks 41] [--calls 1024] [--priority 80] [--cpu 0]
// Prints {"on_ps": [...], "off_ps": [...], "clock_ps": [...], "log_ps": [...], "log_off_ps": [...]}: a user's own mark with a
// ring, without, a bare clock_gettime(CLOCK_MONOTONIC), and a log line with 2 doubles, kept and below its level, in picoseconds a
// call. Rings are emptied between blocks.
#include <ctime>

#include "mauve_rt/base/log.hpp"
#include "mauve_rt/base/trace.hpp"

#include "support/micro.hpp"

namespace {

void mark(std::int64_t calls) {
  for (std::int64_t i = 0; i < calls; ++i) {
    mauve::trace_mark(1, i);
    bench::keep(i);  // or the question whether there is a ring would be asked once for all
  }
}

void log_line(const mauve::Log& log, std::int64_t calls) {
  for (std::int64_t i = 0; i < calls; ++i) {
    const auto number = static_cast<double>(i);
    log.info("tracking error {} m of {:.3f} m", number, 0.5);
    bench::keep(i);
  }
}

void measure(const bench::Options& options) {
  const bench::Micro micro(options);
  mauve::TraceRing ring(0);
  if (micro.calls > static_cast<std::int64_t>(mauve::TraceRing::kDefaultCapacity))
    throw std::runtime_error("--calls: a block does not fit into a ring");
  std::vector<mauve::TraceRecord> records;
  records.reserve(mauve::TraceRing::kDefaultCapacity);
  const auto traced = [&](std::int64_t calls) {
    mauve::TraceRing::set_for_this_thread(&ring);
    mark(calls);
    mauve::TraceRing::set_for_this_thread(nullptr);
  };
  const auto clock = [](std::int64_t calls) {
    for (std::int64_t i = 0; i < calls; ++i) {
      timespec now;
      clock_gettime(CLOCK_MONOTONIC, &now);
      bench::keep(now);
    }
  };
  mauve::LogRing log_ring(0, mauve::TraceRing::kDefaultCapacity);
  mauve::LogSource source;
  const mauve::Log log(&source);
  std::vector<mauve::LogLine> lines;
  lines.reserve(mauve::TraceRing::kDefaultCapacity);
  const auto logged = [&](mauve::LogLevel level) {
    return [&, level](std::int64_t calls) {
      source.set_level(level);
      mauve::LogRing::set_for_this_thread(&log_ring);
      log_line(log, calls);
      mauve::LogRing::set_for_this_thread(nullptr);
    };
  };
  const auto drain_log = [&] {
    lines.clear();
    log_ring.drain(lines);
  };
  const auto drain = [&] {
    records.clear();
    ring.drain(records);
  };
  bench::JsonLine line;
  micro.compare(line, {{"on", traced, drain},
                       {"off", mark},
                       {"clock", clock},
                       {"log", logged(mauve::LogLevel::info), drain_log},
                       {"log_off", logged(mauve::LogLevel::warn)}});
  if (ring.dropped() + log_ring.dropped() != 0)
    throw std::runtime_error("trace records or log lines were lost");
  line.print();
}

}  // namespace

int main(int count, char** words) { return bench::run_program(count, words, measure); }
