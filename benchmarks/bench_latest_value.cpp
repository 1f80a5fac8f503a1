// SPDX-License-Identifier: LGPL-3.0-or-later
// Reading and writing 16 bytes of a LatestValue through a port, next to a sequence lock: alone, and reading also while a
// thread on another CPU writes to the one that is being read, as fast as it can or every so many nanoseconds.
//   bench_latest_value [--blocks 41] [--calls 1024] [--priority 80] [--cpu 0] [--writer-cpu -1] [--pace-ns 0]
// Prints {"write_ps": [...], "seqlock_write_ps": [...], "alone_ps": [...], "seqlock_alone_ps": [...],
// "hammered_ps": [...], "seqlock_hammered_ps": [...],
// "reads": of either while it was hammered, "writes", "seqlock_writes": meanwhile, "failed": reads that found nothing,
// "torn": reads that found halves of two values, "seqlock_retries"}; without a writer's CPU only the first four.
#include "mauve_rt/mauve_rt.hpp"

#include "support/micro.hpp"
#include "support/seqlock.hpp"
#include "support/values.hpp"

namespace {

using bench::Small;

/// Both cells with the ways into them.
struct Cells {
  Cells() {
    latest.set_name("latest");
    output.set_context(&context);
    input.set_context(&context);
    output.connect(latest.write, "latest");
    input.connect(latest.read, "latest");
    write_latest(1);
    seqlock.write({1, 1});
  }
  void write_latest(std::int64_t number) { output.write({number, number}); }

  mauve::Context context;  // of a component: without one a port would read the clock to stamp
  mauve::LatestValue<Small> latest;
  mauve::WritePort<Small> output{"output"};
  mauve::ReadPort<Small> input{"input"};
  bench::Seqlock<Small> seqlock;
};

/// What reads found; of the reading thread.
struct Findings {
  std::int64_t reads{0};
  std::int64_t failed{0};
  std::int64_t torn{0};
  std::int64_t retries{0};
};

/// Writes to one of the cells.
///
/// | member   | written by   | order                                      |
/// |----------|--------------|--------------------------------------------|
/// | target_  | the reader   | relaxed: noticed soon enough               |
/// | writes_  | the writer   | relaxed: counts                            |
class Hammer {
 public:
  enum class Target : std::uint8_t { none, latest, seqlock, end };

  Hammer(Cells& cells, int priority, int cpu, mauve::time_ns_t pace_ns)
      : cells_(cells), pace_ns_(pace_ns), thread_(priority, cpu, [this] { run(); }) {}
  ~Hammer() { aim(Target::end); }
  Hammer(const Hammer&) = delete;
  Hammer& operator=(const Hammer&) = delete;

  /// Aims and waits until the blows fall.
  void begin(Target target) {
    const std::int64_t before = writes(target);
    aim(target);
    while (writes(target) == before) {
    }
  }
  void aim(Target target) { target_.store(target, std::memory_order_relaxed); }
  std::int64_t writes(Target to) const {
    return writes_[static_cast<std::size_t>(to)].load(std::memory_order_relaxed);
  }

 private:
  void run() {
    for (std::int64_t number = 2;; ++number) {
      const Target target = target_.load(std::memory_order_relaxed);
      switch (target) {
        case Target::none:
          break;
        case Target::latest:
          cells_.write_latest(number);
          break;
        case Target::seqlock:
          cells_.seqlock.write({number, number});
          break;
        case Target::end:
          return;
      }
      auto& writes = writes_[static_cast<std::size_t>(target)];
      writes.store(writes.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
      if (pace_ns_ > 0) bench::spin_for(pace_ns_);
    }
  }

  Cells& cells_;
  mauve::time_ns_t pace_ns_;
  std::atomic<Target> target_{Target::none};
  alignas(64) std::array<std::atomic<std::int64_t>, 3> writes_{};
  bench::RealtimeThread thread_;
};

void read_latest(Cells& cells, std::int64_t calls, Findings& found) {
  Small value;
  for (std::int64_t i = 0; i < calls; ++i) {
    found.failed += cells.input.read(value) == mauve::DataStatus::none ? 1 : 0;
    found.torn += value.first != value.second ? 1 : 0;
    bench::keep(value);
  }
  found.reads += calls;
}

void read_seqlock(const Cells& cells, std::int64_t calls, Findings& found) {
  Small value;
  for (std::int64_t i = 0; i < calls; ++i) {
    found.retries += cells.seqlock.read(value);
    found.torn += value.first != value.second ? 1 : 0;
    bench::keep(value);
  }
  found.reads += calls;
}

void write_latest(Cells& cells, std::int64_t calls) {
  for (std::int64_t i = 0; i < calls; ++i) cells.write_latest(i);
}

void write_seqlock(Cells& cells, std::int64_t calls) {
  for (std::int64_t i = 0; i < calls; ++i) cells.seqlock.write({i, i});
}

void measure(const bench::Options& options) {
  const bench::Micro micro(options);
  const auto writer_cpu = static_cast<int>(options.number("writer-cpu", -1));
  Cells cells;
  Findings ours;
  Findings theirs;
  bench::JsonLine line;
  micro.compare(line, {{"write", [&](std::int64_t calls) { write_latest(cells, calls); }},
                       {"seqlock_write", [&](std::int64_t calls) { write_seqlock(cells, calls); }}});
  micro.compare(line, {{"alone", [&](std::int64_t calls) { read_latest(cells, calls, ours); }},
                       {"seqlock_alone", [&](std::int64_t calls) { read_seqlock(cells, calls, theirs); }}});
  if (writer_cpu >= 0) {
    Hammer hammer(cells, micro.priority, writer_cpu, options.number("pace-ns", 0));
    ours = {};
    const auto read_ours = [&](std::int64_t calls) { read_latest(cells, calls, ours); };
    const auto read_theirs = [&](std::int64_t calls) { read_seqlock(cells, calls, theirs); };
    const auto rest = [&] { hammer.aim(Hammer::Target::none); };
    bench::Micro longer = micro;
    longer.calls *= 16;  // many writes fall into a block
    longer.compare(line,
                   {{"hammered", read_ours, rest, [&] { hammer.begin(Hammer::Target::latest); }},
                    {"seqlock_hammered", read_theirs, rest, [&] { hammer.begin(Hammer::Target::seqlock); }}});
    line.add("reads", ours.reads)
        .add("writes", hammer.writes(Hammer::Target::latest))
        .add("seqlock_writes", hammer.writes(Hammer::Target::seqlock));
  }
  line.add("failed", ours.failed).add("torn", ours.torn).add("seqlock_retries", theirs.retries);
  if (theirs.torn != 0) throw std::runtime_error("the sequence lock beside it tears values");
  line.print();
}

}  // namespace

int main(int count, char** words) { return bench::run_program(count, words, measure); }
